// The object's orientation along the plan, in the ball of rotation vectors (radius pi) seen from the start: the centre is
// the start's orientation, opposite points of the surface are one and the same. Nodes of the roadmap where there are some.

import { el, setText } from "./dom";
import { cross, fromRotationVector, multiply, norm, rotate, rotationBetween, scale, sub, unit, type Quat, type Vec3 } from "./math";
import type { Motion } from "./motion";
import type { Player } from "./player";
import type { Story } from "./story";
import { COMPONENTS, type Theme } from "./theme";
import { cleared, keyOf, markEnd, markNow, turnable, type KeyItem } from "./turnable";

const HEIGHT = 280;

export class Ball {
  readonly element: HTMLElement;
  private readonly base = turnable("Orientation of the object as a point in the ball of rotation vectors.", (x, y) => this.rotateBy(x, y));
  private readonly over = el("canvas", { "aria-hidden": "true", class: "over" });
  private readonly readout = el("span", { class: "readout" });
  private turn: Quat = multiply(fromRotationVector([-1.1, 0, 0]), fromRotationVector([0, 0, 0.6]));
  private readonly path: { point: Vec3; broken: boolean }[] = [];
  private readonly nodes: { point: Vec3; colour: string; single: boolean }[] = [];
  private readonly rank: Map<number, number>;
  private readonly origin: Quat;
  private readonly goal: Vec3;

  constructor(private readonly story: Story, private readonly motion: Motion, private readonly player: Player, private readonly theme: Theme) {
    const start = story.plan?.start ?? story.asked[0];
    const goal = story.plan?.goal ?? story.asked[story.asked.length - 1];
    this.origin = start?.quat_xyzw ?? [0, 0, 0, 1];
    this.goal = rotationBetween(this.origin, goal?.quat_xyzw ?? this.origin);
    for (const w of motion.waypoints) {
      const point = rotationBetween(this.origin, w.world_from_object.quat_xyzw);
      const before = this.path[this.path.length - 1];
      // Two ways to write one turn of about pi: the one near the point before is drawn.
      this.path.push({ point, broken: before !== undefined && norm(sub(point, before.point)) > Math.PI });
    }
    const sizes = new Map<number, number>();
    for (const node of story.roadmap?.nodes ?? []) sizes.set(node.component, (sizes.get(node.component) ?? 0) + 1);
    this.rank = new Map([...sizes].sort((a, b) => b[1] - a[1] || a[0] - b[0]).map(([component], i) => [component, i]));
    for (const node of story.roadmap?.nodes ?? []) {
      const rank = this.rank.get(node.component)!;
      this.nodes.push({
        point: rotationBetween(this.origin, node.quat_xyzw),
        colour: COMPONENTS[rank] ?? "#9aa2a9",
        single: sizes.get(node.component) === 1,
      });
    }
    this.element = el(
      "section",
      { class: "card ball" },
      el("div", { class: "chart-head" }, el("h2", {}, "Orientation of the object"), this.readout),
      el("div", { class: "ball-plot" }, this.base, this.over),
      this.key(sizes),
    );
    player.onTime(() => this.drawNow());
    theme.onChange(() => this.draw());
    new ResizeObserver(() => this.draw()).observe(this.base);
  }

  private key(sizes: Map<number, number>): HTMLElement {
    const items: KeyItem[] = [];
    const groups = [...this.rank].filter(([component]) => sizes.get(component)! > 1);
    for (const [component, rank] of groups.slice(0, 4)) items.push([`component ${rank + 1}: ${sizes.get(component)} nodes`, COMPONENTS[rank] ?? "#9aa2a9", ""]);
    if (groups.length > 4) items.push([`${groups.length - 4} further components`, "#9aa2a9", ""]);
    const alone = this.rank.size - groups.length;
    if (this.story.roadmap?.solution.length) items.push(["node of the plan", null, "ring"]);
    if (alone > 0) items.push([`${alone} isolated node${alone === 1 ? "" : "s"}`, null, "hollow"]);
    return keyOf(items, "Distance from the centre is the angle turned since the start, direction its axis; the rim is 180\u00b0, where opposite points are the same.");
  }

  private rotateBy(x: number, y: number): void {
    this.turn = unitQuat(multiply(fromRotationVector([y, x, 0]), this.turn));
    this.draw();
  }

  private prepare(canvas: HTMLCanvasElement): { context: CanvasRenderingContext2D; place: (v: Vec3) => [number, number, number]; radius: number; centre: [number, number] } | null {
    const drawn = cleared(canvas, HEIGHT);
    if (!drawn) return null;
    const { context, width } = drawn;
    const radius = Math.min(width, HEIGHT) / 2 - 22;
    const centre: [number, number] = [width / 2, HEIGHT / 2];
    const place = (v: Vec3): [number, number, number] => {
      const [x, y, z] = rotate(this.turn, v);
      return [centre[0] + (x / Math.PI) * radius, centre[1] - (y / Math.PI) * radius, z];
    };
    return { context, place, radius, centre };
  }

  draw(): void {
    const made = this.prepare(this.base);
    if (!made) return;
    const { context, place, radius, centre } = made;
    const { colours } = this.theme;
    context.lineWidth = 1;
    context.fillStyle = colours.shade;
    context.strokeStyle = colours.line;
    context.beginPath();
    context.arc(centre[0], centre[1], radius, 0, 2 * Math.PI);
    context.fill();
    context.strokeStyle = colours.faint;
    context.stroke();
    this.circles(context, place);
    this.axes(context, place);
    this.graph(context, place);
    this.line(context, place);
    for (const [at, kind] of [[[0, 0, 0], "start"], [this.goal, "goal"]] as [Vec3, "start" | "goal"][]) {
      const [x, y] = place(at);
      markEnd(context, this.theme, [x, y], kind);
    }
    this.drawNow();
  }

  private circles(context: CanvasRenderingContext2D, place: (v: Vec3) => [number, number, number]): void {
    const { colours } = this.theme;
    for (const [radius, dash] of [[Math.PI, []], [Math.PI / 2, [2, 3]]] as [number, number[]][]) {
      for (const axis of [[1, 0, 0], [0, 1, 0], [0, 0, 1]] as Vec3[]) {
        const a = unit(cross(axis, Math.abs(axis[2]) > 0.5 ? [1, 0, 0] : [0, 0, 1]));
        const b = cross(axis, a);
        context.strokeStyle = colours.line;
        context.setLineDash(dash);
        context.beginPath();
        for (let i = 0; i <= 64; i++) {
          const t = (i / 64) * 2 * Math.PI;
          const [x, y] = place([0, 1, 2].map((k) => radius * (a[k] * Math.cos(t) + b[k] * Math.sin(t))) as Vec3);
          if (i === 0) context.moveTo(x, y);
          else context.lineTo(x, y);
        }
        context.stroke();
      }
    }
    context.setLineDash([]);
  }

  private axes(context: CanvasRenderingContext2D, place: (v: Vec3) => [number, number, number]): void {
    const { colours } = this.theme;
    context.fillStyle = colours.muted;
    context.strokeStyle = colours.faint;
    context.textAlign = "center";
    (["x", "y", "z"] as const).forEach((name, i) => {
      const axis: Vec3 = [0, 0, 0];
      axis[i] = Math.PI;
      const [x0, y0] = place(scale(axis, -1));
      const [x1, y1] = place(axis);
      context.beginPath();
      context.moveTo(x0, y0);
      context.lineTo(x1, y1);
      context.stroke();
      const [x, y] = place(scale(axis, 1.1));
      context.fillText(name, x, y);
    });
  }

  private graph(context: CanvasRenderingContext2D, place: (v: Vec3) => [number, number, number]): void {
    const roadmap = this.story.roadmap;
    if (!roadmap) return;
    context.strokeStyle = this.theme.colours.faint;
    context.lineWidth = 0.75;
    // Many motions make a veil, not a wall.
    context.globalAlpha = Math.min(1, Math.max(0.12, 300 / roadmap.edges.length));
    for (const edge of roadmap.edges) {
      const [a, b] = edge.nodes.map((i) => this.nodes[i]);
      if (!a || !b || norm(sub(a.point, b.point)) > Math.PI) continue;
      context.setLineDash(edge.kind === "transfer_regrasp" ? [3, 3] : []);
      context.beginPath();
      const [ax, ay] = place(a.point);
      const [bx, by] = place(b.point);
      context.moveTo(ax, ay);
      context.lineTo(bx, by);
      context.stroke();
    }
    context.setLineDash([]);
    const solution = new Set(roadmap.solution.map((i) => this.nodes[i]));
    const order = this.nodes.map((node) => ({ node, at: place(node.point) })).sort((a, b) => a.at[2] - b.at[2]);
    for (const { node, at } of order) {
      context.globalAlpha = at[2] < 0 ? 0.55 : 1;
      context.beginPath();
      context.arc(at[0], at[1], 3, 0, 2 * Math.PI);
      if (node.single) {
        context.strokeStyle = this.theme.colours.muted;
        context.lineWidth = 1.25;
        context.stroke();
      } else {
        context.fillStyle = node.colour;
        context.fill();
      }
      if (!solution.has(node)) continue;
      context.strokeStyle = this.theme.colours.ink;
      context.lineWidth = 1.75;
      context.beginPath();
      context.arc(at[0], at[1], 5, 0, 2 * Math.PI);
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  private line(context: CanvasRenderingContext2D, place: (v: Vec3) => [number, number, number]): void {
    const { colours } = this.theme;
    const stroke = (points: Vec3[], dash: number[], width: number) => {
      context.strokeStyle = colours.ink;
      context.lineWidth = width;
      context.setLineDash(dash);
      context.beginPath();
      points.forEach((p, i) => {
        const [x, y] = place(p);
        if (i === 0) context.moveTo(x, y);
        else context.lineTo(x, y);
      });
      context.stroke();
      context.setLineDash([]);
    };
    let run: Vec3[] = [];
    for (const { point, broken } of this.path) {
      if (broken && run.length > 0) {
        const rim = scale(unit(run[run.length - 1]), Math.PI);
        const entry = scale(unit(point), Math.PI);
        stroke([...run, rim], [], 2);
        stroke([rim, entry], [2, 4], 1);
        run = [entry];
      }
      run.push(point);
    }
    if (run.length > 1) stroke(run, [], 2);
  }

  private drawNow(): void {
    const made = this.prepare(this.over);
    const now = rotationBetween(this.origin, this.motion.object(this.player.time).quat);
    const text = `${((norm(now) * 180) / Math.PI).toFixed(1)}\u00b0 from the start, ${((this.left(now) * 180) / Math.PI).toFixed(1)}\u00b0 to go`;
    setText(this.readout, text);
    if (!made) return;
    const { context, place } = made;
    const [x, y] = place(now);
    markNow(context, this.theme, [x, y], 6);
  }

  private left(now: Vec3): number {
    return norm(rotationBetween(fromRotationVector(now), fromRotationVector(this.goal)));
  }
}

function unitQuat(q: Quat): Quat {
  const length = Math.hypot(...q);
  return q.map((x) => x / length) as Quat;
}

