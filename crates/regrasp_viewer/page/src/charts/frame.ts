// What all charts share: the time axis, a canvas in the right resolution, labels and lines.

import { el, setText } from "../dom";
import type { Colours, Theme } from "../theme";
import type { Motion } from "../motion";

/** Room left of every plot for labels, and right of it, in CSS pixels. */
export const RIGHT = 10;

export interface Drawing {
  context: CanvasRenderingContext2D;
  colours: Colours;
  left: number;
  width: number;
  height: number;
  /** Horizontal place of a time. */
  x: (time: number) => number;
}

export interface ChartSpec {
  id: string;
  title: string;
  /** Said of the chart to those who cannot see it. */
  summary: string;
  height: number;
  draw: (drawing: Drawing) => void;
  /** Text beside the title, of the time shown. */
  readout?: (time: number) => string;
  /** Brings further texts to the time shown. */
  show?: (time: number) => void;
  /** Further elements under the title and under the plot. */
  above?: HTMLElement;
  below?: HTMLElement;
}

export class Chart {
  readonly element: HTMLElement;
  private readonly canvas: HTMLCanvasElement;
  private readonly value: HTMLElement;

  constructor(readonly spec: ChartSpec, private readonly motion: Motion, private readonly theme: Theme) {
    this.canvas = el("canvas", { role: "img", "aria-label": `${spec.title}. ${spec.summary}` });
    this.canvas.style.height = `${spec.height}px`;
    this.value = el("span", { class: "readout" });
    this.element = el(
      "section",
      { class: "chart", id: `chart-${spec.id}` },
      el("div", { class: "chart-head" }, el("h3", {}, spec.title), this.value),
      spec.above,
      el("div", { class: "plot" }, this.canvas),
      spec.below,
    );
  }

  show(time: number): void {
    const text = this.spec.readout?.(time) ?? "";
    setText(this.value, text);
    this.spec.show?.(time);
  }

  draw(left: number): void {
    const width = this.canvas.clientWidth;
    if (width === 0) return;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(this.spec.height * ratio);
    const context = this.canvas.getContext("2d");
    if (!context) return;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, this.spec.height);
    context.font = `11px ${getComputedStyle(document.body).fontFamily}`;
    context.textBaseline = "middle";
    const inner = Math.max(1, width - left - RIGHT);
    const length = Math.max(this.motion.end - this.motion.start, 1e-9);
    this.spec.draw({
      context,
      colours: this.theme.colours,
      left,
      width: inner,
      height: this.spec.height,
      x: (time) => left + ((time - this.motion.start) / length) * inner,
    });
  }
}

/** Bands of the transfers, behind everything else. */
export function transferBands({ context, colours, x }: Drawing, motion: Motion, top: number, bottom: number): void {
  context.fillStyle = colours.shade;
  for (const stretch of motion.stretches) {
    if (stretch.kind !== "transfer") continue;
    context.fillRect(x(stretch.start), top, Math.max(1, x(stretch.end) - x(stretch.start)), bottom - top);
  }
}

/** Steps of 1, 2, 5 times a power of ten that make about `wanted` ticks. */
export function ticks(low: number, high: number, wanted: number): number[] {
  const raw = (high - low) / Math.max(wanted, 1);
  if (!(raw > 0) || !Number.isFinite(raw)) return [low];
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw)!;
  const first = Math.ceil(low / step - 1e-9);
  const found: number[] = [];
  for (let i = first; i * step <= high + step * 1e-9; i++) found.push(i * step);
  return found;
}

/** `value` with as many decimals as ticks `step` apart need. */
export function tickText(value: number, step: number): string {
  const decimals = Math.max(0, Math.min(6, -Math.floor(Math.log10(step) + 1e-9)));
  return value.toFixed(decimals);
}

export function timeAxis(drawing: Drawing, motion: Motion, y: number): void {
  const { context, colours, x, width } = drawing;
  const at = ticks(motion.start, motion.end, width / 70);
  const step = at.length > 1 ? at[1] - at[0] : 1;
  context.fillStyle = colours.muted;
  context.strokeStyle = colours.line;
  context.lineWidth = 1;
  at.forEach((time, i) => {
    const place = Math.round(x(time)) + 0.5;
    context.beginPath();
    context.moveTo(place, y);
    context.lineTo(place, y + 4);
    context.stroke();
    context.textAlign = i === 0 ? "left" : place > x(motion.end) - 14 ? "right" : "center";
    context.fillText(tickText(time, step) + (i === at.length - 1 ? " s" : ""), place, y + 11);
  });
}

/** `text` cut to `room` pixels. */
export function fitted(context: CanvasRenderingContext2D, text: string, room: number): string {
  const start = [...text.slice(0, 200)];
  if (start.length === text.length && context.measureText(text).width <= room) return text;
  let low = 0;
  let high = start.length;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (context.measureText(`${start.slice(0, middle).join("")}\u2026`).width <= room) low = middle;
    else high = middle - 1;
  }
  return `${start.slice(0, low).join("")}\u2026`;
}
