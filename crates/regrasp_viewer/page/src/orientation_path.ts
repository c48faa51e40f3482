// The object's rotation vectors in the world along a tracking plan, in space and on the plane of x and y, as in figures 10 to 18 of
// paper 003; coloured by the finger that moves.

import { el, setText } from "./dom";
import { add, fromRotationVector, multiply, nearestVector, norm, rotate, rotationBetween, scale, sub, unit, type Quat, type Vec3 } from "./math";
import type { Motion } from "./motion";
import type { Player } from "./player";
import type { Plan } from "./story";
import { fingerColour, type Theme } from "./theme";
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
  private readonly base = el("canvas", {
    role: "img",
    tabindex: 0,
    "aria-label": "Path of the object's orientation in the space of rotation vectors, and its projection on the plane of x and y. Drag or use the arrow keys to turn.",
  });
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
      this.key(plan),
    );
    this.listen();
    player.onTime(() => this.drawNow());
    theme.onChange(() => this.draw());
    new ResizeObserver(() => this.draw()).observe(this.base);
  }

  private key(plan: Plan): HTMLElement {
    const key = el("ul", { class: "key" });
    const item = (text: string, colour: string | null, kind: string) => {
      const dot = el("span", { class: `dot ${kind}` });
      if (colour) dot.style.background = colour;
      key.append(el("li", {}, dot, text));
    };
    item("start", null, "start");
    item("goal", null, "goal");
    plan.fingers.forEach((name, i) => item(`${name} moves`, fingerColour(i), ""));
    return el("div", {}, key, el("p", { class: "note" },
      "Rotation vectors of the object in the world, in radians: direction is the axis of the turn, length its angle. Grey: the path on the plane of x and y."));
  }

  private listen(): void {
    let last: PointerEvent | null = null;
    this.base.addEventListener("pointerdown", (event) => {
      last = event;
      this.base.setPointerCapture(event.pointerId);
    });
    this.base.addEventListener("pointermove", (event) => {
      if (!last) return;
      this.turnBy((event.clientX - last.clientX) / 90, (event.clientY - last.clientY) / 90);
      last = event;
    });
    for (const end of ["pointerup", "pointercancel"]) this.base.addEventListener(end, () => { last = null; });
    this.base.addEventListener("keydown", (event) => {
      const steps: Record<string, [number, number]> = { ArrowLeft: [-0.15, 0], ArrowRight: [0.15, 0], ArrowUp: [0, -0.15], ArrowDown: [0, 0.15] };
      const step = steps[event.key];
      if (!step) return;
      event.preventDefault();
      event.stopPropagation();
      this.turnBy(...step);
    });
  }

  private turnBy(x: number, y: number): void {
    this.azimuth -= x;
    this.elevation = Math.max(0, Math.min(Math.PI / 2, this.elevation + y));
    this.draw();
  }

  /** The context, cleared, and where a rotation vector lies on it. */
  private prepare(canvas: HTMLCanvasElement): { context: CanvasRenderingContext2D; place: (v: Vec3) => [number, number] } | null {
    const width = canvas.clientWidth;
    const context = canvas.getContext("2d");
    if (width === 0 || !context) return null;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const [pixelsWide, pixelsHigh] = [Math.round(width * ratio), Math.round(HEIGHT * ratio)];
    if (canvas.width !== pixelsWide || canvas.height !== pixelsHigh) {
      canvas.width = pixelsWide;
      canvas.height = pixelsHigh;
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, HEIGHT);
    context.font = `11px ${getComputedStyle(document.body).fontFamily}`;
    context.textBaseline = "middle";
    context.lineJoin = "round";
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
    this.mark(context, place(this.path[0]), "start");
    this.mark(context, place(this.goal), "goal");
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

  private mark(context: CanvasRenderingContext2D, [x, y]: [number, number], kind: "start" | "goal"): void {
    const { colours } = this.theme;
    context.fillStyle = colours.panel;
    context.strokeStyle = colours.ink;
    context.lineWidth = 1.75;
    context.beginPath();
    if (kind === "start") context.arc(x, y, 4.5, 0, 2 * Math.PI);
    else {
      context.moveTo(x, y - 6);
      for (const [right, down] of [[6, 0], [0, 6], [-6, 0]]) context.lineTo(x + right, y + down);
      context.closePath();
    }
    context.fill();
    context.stroke();
  }

  private drawNow(): void {
    const { index, u } = this.motion.moment(this.player.time);
    const before = this.path[index];
    const now = nearestVector(rotationBetween(STILL, this.motion.object(this.player.time).quat), before);
    const length = this.along[index] + u * ((this.along[index + 1] ?? this.along[index]) - this.along[index]);
    const degrees = (radians: number) => ((radians * 180) / Math.PI).toFixed(1);
    setText(this.readout, `turned ${degrees(length)}\u00b0 of ${degrees(this.along[this.along.length - 1])}\u00b0 along the path`);
    const made = this.prepare(this.over);
    if (!made) return;
    const { context, place } = made;
    for (const [at, radius] of [[[now[0], now[1], 0], 3.5], [now, 6]] as [Vec3, number][]) {
      context.fillStyle = this.theme.colours.accent;
      context.strokeStyle = this.theme.colours.panel;
      context.lineWidth = 2;
      context.beginPath();
      context.arc(...place(at), radius, 0, 2 * Math.PI);
      context.fill();
      context.stroke();
    }
  }
}
