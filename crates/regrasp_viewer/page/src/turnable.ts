// What plots have in common that show orientations in space, to be turned by hand.

import { el } from "./dom";
import type { Theme } from "./theme";

export interface Drawn {
  context: CanvasRenderingContext2D;
  /** Width in CSS pixels. */
  width: number;
}

/** A canvas to be dragged or turned by arrow keys: `turnBy` gets radians to the right and down. */
export function turnable(label: string, turnBy: (x: number, y: number) => void): HTMLCanvasElement {
  const canvas = el("canvas", { role: "img", tabindex: 0, "aria-label": `${label} Drag or use the arrow keys to turn.` });
  let last: PointerEvent | null = null;
  canvas.addEventListener("pointerdown", (event) => {
    last = event;
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!last) return;
    turnBy((event.clientX - last.clientX) / 90, (event.clientY - last.clientY) / 90);
    last = event;
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { last = null; });
  canvas.addEventListener("keydown", (event) => {
    const steps: Record<string, [number, number]> = { ArrowLeft: [-0.15, 0], ArrowRight: [0.15, 0], ArrowUp: [0, -0.15], ArrowDown: [0, 0.15] };
    const step = steps[event.key];
    if (!step) return;
    event.preventDefault();
    event.stopPropagation();
    turnBy(...step);
  });
  return canvas;
}

/** The context of a canvas `height` CSS pixels high, cleared; null where it is not shown. */
export function cleared(canvas: HTMLCanvasElement, height: number): Drawn | null {
  const width = canvas.clientWidth;
  const context = canvas.getContext("2d");
  if (width === 0 || !context) return null;
  const ratio = Math.min(devicePixelRatio || 1, 2);
  const [pixelsWide, pixelsHigh] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== pixelsWide || canvas.height !== pixelsHigh) {
    canvas.width = pixelsWide;
    canvas.height = pixelsHigh;
  }
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = `11px ${getComputedStyle(document.body).fontFamily}`;
  context.textBaseline = "middle";
  context.lineJoin = "round";
  return { context, width };
}

export type KeyItem = [text: string, colour: string | null, kind: string];

/** A key to the marks, those of start and goal first, and a note under it. */
export function keyOf(items: KeyItem[], note: string): HTMLElement {
  const key = el("ul", { class: "key" });
  const ends: KeyItem[] = [["start", null, "start"], ["goal", null, "goal"]];
  for (const [text, colour, kind] of [...ends, ...items]) {
    const dot = el("span", { class: `dot ${kind}` });
    if (colour) dot.style.background = colour;
    key.append(el("li", {}, dot, text));
  }
  return el("div", {}, key, el("p", { class: "note" }, note));
}

/** Marks the start by a ring, the goal by a diamond. */
export function markEnd(context: CanvasRenderingContext2D, theme: Theme, [x, y]: [number, number], kind: "start" | "goal"): void {
  context.fillStyle = theme.colours.panel;
  context.strokeStyle = theme.colours.ink;
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

/** Marks where the object is now. */
export function markNow(context: CanvasRenderingContext2D, theme: Theme, [x, y]: [number, number], radius: number): void {
  context.fillStyle = theme.colours.accent;
  context.strokeStyle = theme.colours.panel;
  context.lineWidth = 2;
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fill();
  context.stroke();
}
