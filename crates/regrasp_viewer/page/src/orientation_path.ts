// The object's rotation vectors in the world along a tracking plan, in space and on the plane of x and y, as in figures 10 to 18 of
// Cherif 1999; coloured by the finger that moves.

import { el, setText } from "./dom";
import { add, fromRotationVector, multiply, nearestVector, norm, rotate, rotationBetween, scale, sub, unit, type Quat, type Vec3 } from "./math";
import type { Motion } from "./motion";
import type { Player } from "./player";
import type { Plan } from "./story";
import { fingerColour, type Theme } from "./theme";
import { cleared, keyOf, markEnd, markNow, turnable } from "./turnable";
import { ticks, tickText } from "./charts/frame";

const HEIGHT = 320;
const STILL: Quat = [0, 0, 0, 1];
/** Free room around the path on the plane, radians. */
const MARGIN = 0.15;

/** Rotation vectors in the world of all waypoints: the shortest at the first, then the nearest to the one before. */
export function rotationVectors(motion: Motion): Vec3[] {
  const found: Vec3[] = [];
  for (const waypoint of motion.waypoints) {
    const shortest = rotationBetween(STILL, waypoint.world_from_object.quat_xyzw);
    const before = found[found.length - 1];
    found.push(before ? nearestVector(shortest, before) : shortest);
  }
  return found;
}

/** Sum of the angles between neighbouring waypoints up to each, radians. */
export function anglesAlong(motion: Motion): number[] {
  let sum = 0;
  return motion.waypoints.map((waypoint, i) => {
    if (i > 0) sum += norm(rotationBetween(motion.waypoints[i - 1].world_from_object.quat_xyzw, waypoint.world_from_object.quat_xyzw));
    return sum;
  });
}

export class OrientationPath {
  readonly element: HTMLElement;
  private readonly base = turnable(
    "Path of the object's orientation in the space of rotation vectors, and its projection on the plane of x and y.",
    (x, y) => this.turnBy(x, y),
  );
  private readonly over = el("canvas", { "aria-hidden": "true", class: "over" });
  private readonly readout = el("span", { class: "readout" });
  private azimuth = -0.95;
  private elevation = 0.42;
  private readonly path: Vec3[];
  private readonly along: number[];
  private readonly goal: Vec3;
  private readonly low: Vec3;
  private readonly high: Vec3;

  constructor(plan: Plan, private readonly motion: Motion, private readonly player: Player, private readonly theme: Theme) {
    this.path = rotationVectors(motion);
    this.along = anglesAlong(motion);
    this.goal = nearestVector(rotationBetween(STILL, plan.goal.quat_xyzw), this.path[this.path.length - 1] ?? [0, 0, 0]);
    const all = [...this.path, this.goal];
    const bound = (k: number, pick: (...values: number[]) => number, margin: number) => all.reduce((best, v) => pick(best, v[k]), all[0][k]) + margin;
    this.low = [bound(0, Math.min, -MARGIN), bound(1, Math.min, -MARGIN), Math.min(0, bound(2, Math.min, 0))];
    this.high = [bound(0, Math.max, MARGIN), bound(1, Math.max, MARGIN), Math.max(0, bound(2, Math.max, 0))];
    this.element = el(
      "section",
      { class: "card ball orientation-path" },
      el("div", { class: "chart-head" }, el("h2", {}, "Orientation path"), this.readout),
      el("div", { class: "ball-plot path-plot" }, this.base, this.over),
      keyOf(
        plan.fingers.map((name, i) => [`${name} moves`, fingerColour(i), ""]),
        "Rotation vectors of the object in the world, in radians: direction is the axis of the turn, length its angle. Grey: the path on the plane of x and y.",
      ),
    );
    player.onTime(() => this.drawNow());
    theme.onChange(() => this.draw());
    new ResizeObserver(() => this.draw()).observe(this.base);
  }

  private turnBy(x: number, y: number): void {
    this.azimuth -= x;
    this.elevation = Math.max(0, Math.min(Math.PI / 2, this.elevation + y));
    this.draw();
  }

  /** The context, cleared, and where a rotation vector lies on it. */
  private prepare(canvas: HTMLCanvasElement): { context: CanvasRenderingContext2D; place: (v: Vec3) => [number, number] } | null {
    const drawn = cleared(canvas, HEIGHT);
    if (!drawn) return null;
    const { context, width } = drawn;
    const middle = scale(add(this.low, this.high), 0.5);
    // The box fits, whatever its azimuth.
    const [wide, deep, high] = sub(this.high, this.low);
    const across = Math.hypot(wide, deep);
    const up = Math.cos(this.elevation) * high + Math.sin(this.elevation) * across;
    const zoom = Math.min((width - 80) / across, (HEIGHT - 56) / up);
    const turn = multiply(fromRotationVector([this.elevation - Math.PI / 2, 0, 0]), fromRotationVector([0, 0, -this.azimuth - Math.PI / 2]));
    const place = (v: Vec3): [number, number] => {
      const [x, y] = rotate(turn, sub(v, middle));
      return [width / 2 + zoom * x, HEIGHT / 2 - zoom * y];
    };
    return { context, place };
  }

  draw(): void {
    const made = this.prepare(this.base);
    if (!made) return;
    const { context, place } = made;
    const { colours } = this.theme;
    const stroke = (points: Vec3[], colour: string, width: number, dash: number[] = []) => {
      context.strokeStyle = colour;
      context.lineWidth = width;
      context.setLineDash(dash);
      context.beginPath();
      points.forEach((point, i) => (i === 0 ? context.moveTo(...place(point)) : context.lineTo(...place(point))));
      context.stroke();
      context.setLineDash([]);
    };
    const onPlane = (v: Vec3): Vec3 => [v[0], v[1], 0];
    this.frame(context, place, stroke);
    stroke(this.path.map(onPlane), colours.faint, 1.5);
    for (const end of [this.path[0], this.goal]) stroke([end, onPlane(end)], colours.faint, 1, [2, 3]);
    for (const { first, last, moving } of this.motion.stretches) stroke(this.path.slice(first, last + 1), moving < 0 ? colours.ink : fingerColour(moving), 2.5);
    markEnd(context, this.theme, place(this.path[0]), "start");
    markEnd(context, this.theme, place(this.goal), "goal");
    this.drawNow();
  }

  /** The plane of x and y with a grid, numbers along two edges, and the axis of z over the third corner. */
  private frame(context: CanvasRenderingContext2D, place: (v: Vec3) => [number, number], stroke: (points: Vec3[], colour: string, width: number) => void): void {
    const { colours } = this.theme;
    const { low, high } = this;
    const corners: Vec3[] = [[low[0], low[1], 0], [high[0], low[1], 0], [high[0], high[1], 0], [low[0], high[1], 0]];
    context.fillStyle = colours.shade;
    context.beginPath();
    corners.forEach((corner, i) => (i === 0 ? context.moveTo(...place(corner)) : context.lineTo(...place(corner))));
    context.fill();
    stroke([...corners, corners[0]], colours.faint, 1);
    stroke([[low[0], high[1], low[2]], [low[0], high[1], high[2]]], colours.faint, 1);
    context.fillStyle = colours.muted;
    context.textAlign = "center";
    const middle = scale(add(low, high), 0.5);
    const write = (text: string, at: Vec3, from: Vec3, away: number) => {
      const [[x, y], [fromX, fromY]] = [place(at), place(from)];
      const out = unit([x - fromX, y - fromY, 0]);
      context.fillText(text, x + away * out[0], y + away * out[1]);
    };
    const axis = (k: 0 | 1 | 2, at: (value: number) => Vec3, opposite: (value: number) => Vec3) => {
      const values = ticks(low[k], high[k], 4);
      const step = values.length > 1 ? values[1] - values[0] : 1;
      for (const value of values) {
        if (k < 2) stroke([at(value), opposite(value)], colours.line, 1);
        write(tickText(value, step), at(value), opposite(value), 12);
      }
      if (k < 2) write("xyz"[k], at(middle[k]), opposite(middle[k]), 26);
    };
    write("z", [low[0], high[1], high[2]], [low[0], high[1], low[2] - 1], 12);
    axis(0, (x) => [x, low[1], 0], (x) => [x, high[1], 0]);
    axis(1, (y) => [high[0], y, 0], (y) => [low[0], y, 0]);
    axis(2, (z) => [low[0], high[1], z], (z) => [middle[0], middle[1], z]);
  }

  private drawNow(): void {
    const { index, u } = this.motion.moment(this.player.time);
    const before = this.path[index];
    const now = nearestVector(rotationBetween(STILL, this.motion.object(this.player.time).quat), before);
    const length = this.along[index] + this.motion.parameter(index, u) * ((this.along[index + 1] ?? this.along[index]) - this.along[index]);
    const degrees = (radians: number) => ((radians * 180) / Math.PI).toFixed(1);
    setText(this.readout, `turned ${degrees(length)}\u00b0 of ${degrees(this.along[this.along.length - 1])}\u00b0 along the path`);
    const made = this.prepare(this.over);
    if (!made) return;
    const { context, place } = made;
    markNow(context, this.theme, place([now[0], now[1], 0]), 3.5);
    markNow(context, this.theme, place(now), 6);
  }
}
