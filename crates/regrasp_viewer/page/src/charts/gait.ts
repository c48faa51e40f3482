// Which finger holds when: solid bars hold a fixed contact, hatched bars roll, lined bars slide, a thin line moves, dots stay free.
// In tracking, under the bars: ink while the finger is the moving one, grey while the object rolls on it.

import { whoMoves, type Motion } from "../motion";
import { movingHand } from "../bodies";
import type { Story } from "../story";
import { fingerColour } from "../theme";
import { el, svg } from "../dom";
import { fitted, timeAxis, transferBands, type ChartSpec, type Drawing } from "./frame";

const ROW = 26;
const BAR = 14;
const STRIP = 3.5;
const TOP = 4;

export function gaitChart(story: Story, motion: Motion): ChartSpec {
  const fingers = movingHand(story.scene).fingers;
  const bottom = TOP + ROW * fingers.length;
  const relocations = motion.nRelocations;
  const mostMoving = motion.stretches.some((s) => s.allMoving.length > 1) ? "some move" : "one moves";
  return {
    id: "gait",
    title: "Gait",
    summary: `One row per finger, bars while it holds the object. ${fingers.length} fingers, ${motion.isTracking ? `${mostMoving} at a time` : `${relocations} relocations`}.`,
    height: bottom + 20,
    below: key(motion.isTracking),
    draw(drawing) {
      transferBands(drawing, motion, TOP, bottom);
      fingers.forEach((finger, i) => row(drawing, motion, finger.name, i, TOP + ROW * (i + 0.5)));
      timeAxis(drawing, motion, bottom);
    },
    readout(time) {
      const stretch = motion.stretches[motion.stretchAt(time)];
      if (stretch?.kind === "tracking") return `${whoMoves(stretch, fingers)}, ${fingers[stretch.rolling]?.name} rolls`;
      return stretch?.kind === "regrasp" ? "relocation" : "transfer";
    },
  };
}

function row(drawing: Drawing, motion: Motion, name: string, finger: number, y: number): void {
  const { context, colours, x, left, width } = drawing;
  const colour = fingerColour(finger);
  context.fillStyle = colour;
  context.fillRect(0, y - 4, 8, 8);
  context.fillStyle = colours.ink;
  context.textAlign = "left";
  context.fillText(fitted(context, name, left - 20), 13, y);

  context.strokeStyle = colours.faint;
  context.lineWidth = 1;
  context.setLineDash([1, 4]);
  line(context, left, left + width, y);
  context.setLineDash([]);

  context.strokeStyle = colour;
  context.lineWidth = 2.5;
  for (const stretch of motion.stretches) if (stretch.kind === "regrasp" && stretch.moving === finger) line(context, x(stretch.start), x(stretch.end), y);

  for (const hold of motion.holds[finger]) {
    for (const span of hold.spans) {
      const [from, to] = [x(span.start), x(span.end)];
      context.fillStyle = colour;
      if (span.mode === "rolling") hatched(context, from, y - BAR / 2, to - from, colour);
      else if (span.mode === "sliding") lined(context, from, y - BAR / 2, to - from, colour);
      else context.fillRect(from, y - BAR / 2, Math.max(1, to - from), BAR);
    }
    if (hold.end < motion.end - 1e-9) mark(context, x(hold.end), y - BAR / 2 - 1, -1, colours.ink);
    if (hold.start > motion.start + 1e-9) mark(context, x(hold.start), y - BAR / 2 - 1, 1, colours.ink);
  }
  roles(drawing, motion, finger, y + BAR / 2 + 1);
}

/** Strips under the bars of a finger: it moves, or the object rolls on it. */
function roles({ context, colours, x }: Drawing, motion: Motion, finger: number, y: number): void {
  motion.stretches.forEach((stretch, i) => {
    const moves = stretch.allMoving.includes(finger);
    if (stretch.kind !== "tracking" || (!moves && stretch.rolling !== finger)) return;
    context.fillStyle = moves ? colours.ink : colours.muted;
    context.globalAlpha = moves ? 1 : 0.55;
    // Up to the next stretch: everything rests in between.
    const end = motion.stretches[i + 1]?.start ?? stretch.end;
    context.fillRect(x(stretch.start), y, Math.max(0.5, x(end) - x(stretch.start)), STRIP);
    context.globalAlpha = 1;
  });
}

function line(context: CanvasRenderingContext2D, from: number, to: number, y: number): void {
  context.beginPath();
  context.moveTo(from, y);
  context.lineTo(to, y);
  context.stroke();
}

function lined(context: CanvasRenderingContext2D, x: number, y: number, width: number, colour: string): void {
  context.fillStyle = colour;
  context.globalAlpha = 0.3;
  context.fillRect(x, y, Math.max(1, width), BAR);
  context.globalAlpha = 1;
  for (let at = 0; at < BAR; at += 4) context.fillRect(x, y + at, Math.max(1, width), 1.5);
}

function hatched(context: CanvasRenderingContext2D, x: number, y: number, width: number, colour: string): void {
  context.save();
  context.beginPath();
  context.rect(x, y, Math.max(1, width), BAR);
  context.clip();
  context.globalAlpha = 0.35;
  context.fillRect(x, y, width, BAR);
  context.globalAlpha = 1;
  context.strokeStyle = colour;
  context.lineWidth = 2;
  context.beginPath();
  // Lines start at multiples of 6 pixels, so that neighbouring bars share one pattern.
  for (let at = Math.floor((x - BAR) / 6) * 6; at < x + width; at += 6) {
    context.moveTo(at, y + BAR);
    context.lineTo(at + BAR, y);
  }
  context.stroke();
  context.strokeRect(x + 1, y + 1, Math.max(0, width - 2), BAR - 2);
  context.restore();
}

/** A small triangle: up where a finger lifts off, down where it lands. */
function mark(context: CanvasRenderingContext2D, x: number, y: number, down: 1 | -1, colour: string): void {
  context.fillStyle = colour;
  context.beginPath();
  if (down > 0) {
    context.moveTo(x - 3, y - 3.5);
    context.lineTo(x + 3, y - 3.5);
    context.lineTo(x, y + 1.5);
  } else {
    context.moveTo(x - 3, y + 1);
    context.lineTo(x + 3, y + 1);
    context.lineTo(x, y - 4);
  }
  context.fill();
}

function key(isTracking: boolean): HTMLElement {
  const sample = (text: string, ...shapes: SVGElement[]) =>
    el("li", {}, svg("svg", { viewBox: "0 0 22 10", width: 22, height: 10, "aria-hidden": "true" }, ...shapes), text);
  const rect = (attributes: Record<string, string | number>) => svg("rect", { x: 0.5, y: 0.5, width: 21, height: 9, ...attributes });
  return el(
    "ul",
    { class: "key", "aria-label": "Key" },
    sample("holds", rect({ fill: "currentColor" })),
    sample(
      "rolls",
      rect({ fill: "none", stroke: "currentColor" }),
      svg("path", { d: "M2 10 10 0M8 10 16 0M14 10 22 0", stroke: "currentColor", "stroke-width": 1.5 }),
    ),
    ...(isTracking
      ? [
        sample("slides", svg("path", { d: "M0 1h22M0 5h22M0 9h22", stroke: "currentColor", "stroke-width": 1.5 })),
        sample("moving finger", rect({ y: 3, height: 3.5, class: "key-moving" })),
        sample("object rolls on it", rect({ y: 3, height: 3.5, fill: "currentColor", opacity: 0.55 })),
      ]
      : [
        sample("moves", svg("path", { d: "M0 5h22", stroke: "currentColor", "stroke-width": 2.5 })),
        sample("free", svg("path", { d: "M0 5h22", stroke: "currentColor", "stroke-dasharray": "1 4" })),
        sample("lifts off, lands", svg("path", { d: "M2 8h7l-3.5-6zM13 2h7l-3.5 6z", fill: "currentColor" })),
        sample("transfer", rect({ class: "key-shade" })),
      ]),
  );
}
