// Charts of numbers over time: closure margin, clearance, joint positions, normal forces.

import { dot, norm } from "../math";
import type { Motion } from "../motion";
import { movingHand } from "../bodies";
import type { HandStory, Story } from "../story";
import { fingerColour } from "../theme";
import { el, setText } from "../dom";
import { fitted, tickText, ticks, transferBands, type ChartSpec, type Drawing } from "./frame";

const TOP = 10;
const BOTTOM = 8;

interface Curve {
  values: (number | null)[];
  colour: string;
  dash: number[];
  width: number;
}

interface Range { low: number; high: number }

type Place = (value: number) => number;

/** Frame, ticks and transfers of a plot; gives the vertical place of a value. */
function axes(drawing: Drawing, motion: Motion, range: Range, wanted = 3): Place {
  const { context, colours, left, width, height } = drawing;
  const bottom = height - BOTTOM;
  transferBands(drawing, motion, TOP, bottom);
  const y: Place = (v) => bottom - ((v - range.low) / (range.high - range.low)) * (bottom - TOP);
  const at = ticks(range.low, range.high, wanted);
  const step = at.length > 1 ? at[1] - at[0] : 1;
  context.lineWidth = 1;
  context.strokeStyle = colours.line;
  context.fillStyle = colours.muted;
  context.textAlign = "right";
  for (const value of at) {
    const place = Math.round(y(value)) + 0.5;
    context.beginPath();
    context.moveTo(left, place);
    context.lineTo(left + width, place);
    context.stroke();
    context.fillText(tickText(value, step), left - 7, place);
  }
  return y;
}

function curve({ context, x }: Drawing, motion: Motion, y: Place, { values, colour, dash, width }: Curve): void {
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.lineJoin = "round";
  context.setLineDash(dash);
  context.beginPath();
  let drawn = false;
  values.forEach((value, i) => {
    if (value === null || !Number.isFinite(value)) drawn = false;
    else {
      const [px, py] = [x(motion.times[i]), y(value)];
      if (drawn) context.lineTo(px, py);
      else context.moveTo(px, py);
      drawn = true;
    }
  });
  context.stroke();
  context.setLineDash([]);
}

/** Level with its name, drawn so that it differs from curves without colour. */
function level(drawing: Drawing, y: Place, value: number, text: string): void {
  const { context, colours, left, width } = drawing;
  const place = Math.round(y(value)) + 0.5;
  context.strokeStyle = colours.bad;
  context.lineWidth = 1.5;
  context.setLineDash([5, 3]);
  context.beginPath();
  context.moveTo(left, place);
  context.lineTo(left + width, place);
  context.stroke();
  context.setLineDash([]);
  label(drawing, left + width - 3, place - 8, text, colours.bad, "right");
}

function label(d: Drawing, x: number, y: number, text: string, colour: string, align: "left" | "right" | "center"): void {
  const { context, colours } = d;
  context.textAlign = align;
  context.lineWidth = 3;
  context.strokeStyle = colours.panel;
  context.lineJoin = "round";
  context.strokeText(text, x, y);
  context.fillStyle = colour;
  context.fillText(text, x, y);
}

/** Marks the smallest value; the text goes to the side with more room. */
function worst(drawing: Drawing, motion: Motion, y: Place, values: (number | null)[], text: (i: number) => string): void {
  const i = indexOfLeast(values);
  if (i < 0) return;
  const { context, colours, left, width, x } = drawing;
  const [px, py] = [x(motion.times[i]), y(values[i]!)];
  context.fillStyle = colours.panel;
  context.strokeStyle = colours.ink;
  context.lineWidth = 2;
  context.beginPath();
  context.arc(px, py, 4, 0, 2 * Math.PI);
  context.fill();
  context.stroke();
  const before = px > left + width * 0.55;
  const words = fitted(context, text(i), (before ? px - left : left + width - px) - 12);
  label(drawing, before ? px - 8 : px + 8, py - 11 < TOP ? py + 11 : py - 11, words, colours.ink, before ? "right" : "left");
}

export function indexOfLeast(values: (number | null)[]): number {
  let best = -1;
  values.forEach((v, i) => {
    if (v !== null && Number.isFinite(v) && (best < 0 || v < values[best]!)) best = i;
  });
  return best;
}

function valueAt(motion: Motion, values: (number | null)[], time: number): number | null {
  const { index, u } = motion.moment(time);
  const from = values[index] ?? null;
  const to = values[index + 1] ?? null;
  if (from === null || u === 0 || to === null) return from;
  return from + (to - from) * u;
}

function span(values: (number | null)[], include: number[]): Range {
  let low = Math.min(...include);
  let high = Math.max(...include);
  for (const v of values) {
    if (v === null || !Number.isFinite(v)) continue;
    low = Math.min(low, v);
    high = Math.max(high, v);
  }
  const room = (high - low || Math.abs(high) || 1) * 0.08;
  return { low: low < 0 ? low - room : low, high: high + room };
}

export function marginChart(story: Story, motion: Motion): ChartSpec {
  const judged = story.judged!;
  const range = span(judged.margin, [0, judged.required_margin]);
  const i = indexOfLeast(judged.margin);
  const least = i < 0 ? "not judged" : `smallest ${judged.margin[i]!.toFixed(4)} at ${motion.times[i].toFixed(2)} s`;
  return {
    id: "margin",
    title: "Closure margin",
    summary: `${least}; required ${judged.required_margin}.`,
    height: 96,
    draw(drawing) {
      const y = axes(drawing, motion, range);
      level(drawing, y, judged.required_margin, `required ${judged.required_margin}`);
      curve(drawing, motion, y, { values: judged.margin, colour: drawing.colours.ink, dash: [], width: 1.75 });
      worst(drawing, motion, y, judged.margin, (k) => `${judged.margin[k]!.toFixed(4)} at ${motion.times[k].toFixed(2)} s`);
    },
    readout: (time) => valueAt(motion, judged.margin, time)?.toFixed(4) ?? "not judged",
  };
}

export function clearanceChart(story: Story, motion: Motion): ChartSpec {
  const judged = story.judged!;
  const values = judged.clearance.map((v) => (v === null ? null : v * 1000));
  const range = span(values, [0]);
  const pair = (i: number): string => judged.pairs[judged.pair[i]]?.join(" \u2013 ") ?? "";
  const i = indexOfLeast(values);
  return {
    id: "clearance",
    title: "Clearance, mm",
    summary: i < 0 ? "Not judged." : `smallest ${values[i]!.toFixed(2)} mm, ${pair(i)}, at ${motion.times[i].toFixed(2)} s.`,
    height: 96,
    draw(drawing) {
      const y = axes(drawing, motion, range);
      curve(drawing, motion, y, { values, colour: drawing.colours.ink, dash: [], width: 1.75 });
      worst(drawing, motion, y, values, (k) => `${values[k]!.toFixed(2)} mm, ${pair(k)}`);
    },
    readout(time) {
      const value = valueAt(motion, values, time);
      return value === null ? "not judged" : `${value.toFixed(2)} mm  ${pair(motion.moment(time).index)}`;
    },
  };
}

export function forceChart(story: Story, motion: Motion): ChartSpec {
  const fingers = movingHand(story.scene).fingers;
  const normalForce = (finger: number, i: number): number | null => {
    const contact = motion.waypoints[i].contacts[finger];
    if (!contact || contact.mode === "free" || !contact.force_in_object) return null;
    return -dot(contact.force_in_object, contact.normal_in_object ?? [0, 0, 1]);
  };
  const curves = fingers.map((_, finger) => motion.waypoints.map((__, i) => normalForce(finger, i)));
  const range = span(curves.flat(), [0]);
  const items = fingers.map((finger, i) => keyItem(finger.name, fingerColour(i), i));
  return {
    id: "force",
    title: "Normal forces, N",
    summary: `Normal force of each of ${fingers.length} fingers on the object, up to ${range.high.toFixed(1)} N.`,
    height: 104,
    draw(drawing) {
      const y = axes(drawing, motion, range);
      curves.forEach((values, finger) => {
        curve(drawing, motion, y, { values, colour: fingerColour(finger), dash: DASHES[finger % DASHES.length], width: 1.75 });
      });
    },
    below: el("ul", { class: "key values" }, ...items.map((item) => item.element)),
    show(time) {
      motion.contacts(time).forEach((c, i) => setText(items[i].value, c.force ? `${(-dot(c.force, c.normal)).toFixed(1)} N` : "\u2013"));
    },
  };
}

const DASHES = [[], [7, 3], [2, 2.5], [9, 3, 2, 3], [4, 2], [1, 3], [12, 3], [6, 2, 1, 2]];

/** Joint positions of one finger, each inside its limits: 0 is the lower one, 1 the upper one. */
export function jointChart(story: Story, motion: Motion, redraw: () => void): ChartSpec {
  const hand = movingHand(story.scene);
  const groups = jointGroups(hand);
  let shown = 0;
  const tabs = el("div", { class: "tabs", role: "group", "aria-label": "Finger whose joints are shown" });
  const legend = el("ul", { class: "key values" });
  let items: KeyItem[] = [];
  const bounds = (joint: number): Range => {
    const { lower, upper } = hand.joints[joint];
    if (lower !== null && upper !== null && upper > lower) return { low: lower, high: upper };
    return span(motion.waypoints.map((w) => w.joints[joint]), [motion.waypoints[0].joints[joint]]);
  };
  const share = (joint: number, q: number): number => {
    const { low, high } = bounds(joint);
    return (q - low) / (high - low || 1);
  };
  const limits = (joint: number): string | null => {
    const { lower, upper } = hand.joints[joint];
    return lower === null || upper === null ? null : `${jointText(hand, joint, lower)} to ${jointText(hand, joint, upper)}`;
  };
  const choose = (group: number): void => {
    shown = group;
    [...tabs.children].forEach((tab, i) => tab.setAttribute("aria-pressed", String(i === shown)));
    items = groups[shown].joints.map((joint, k) => {
      const bounded = limits(joint);
      const name = hand.joints[joint].name + (bounded ? "" : " (no limits: its own range)");
      return keyItem(name, fingerColour(groups[shown].finger), k, bounded);
    });
    legend.replaceChildren(...items.map((item) => item.element));
    redraw();
  };
  groups.forEach((group, i) => {
    const tab = el("button", { type: "button", class: "tab", "aria-pressed": "false", title: group.name });
    const swatch = el("span", { class: "swatch" });
    swatch.style.background = fingerColour(group.finger);
    tab.append(swatch, el("span", { class: "name" }, group.name));
    tab.addEventListener("click", () => choose(i));
    tabs.append(tab);
  });
  queueMicrotask(() => choose(0));
  return {
    id: "joints",
    title: "Joints in their limits",
    summary: "Position of every joint of one finger; 0 is its lower limit and 1 its upper limit.",
    height: 112,
    above: tabs,
    below: legend,
    draw(drawing) {
      const y = axes(drawing, motion, { low: -0.06, high: 1.06 }, 2);
      const { context, colours, left, width } = drawing;
      context.strokeStyle = colours.bad;
      context.lineWidth = 1.5;
      context.setLineDash([5, 3]);
      for (const limit of [0, 1]) {
        context.beginPath();
        context.moveTo(left, y(limit));
        context.lineTo(left + width, y(limit));
        context.stroke();
      }
      context.setLineDash([]);
      const { joints, finger } = groups[shown];
      joints.forEach((joint, k) => {
        const values = motion.waypoints.map((w) => share(joint, w.joints[joint]));
        curve(drawing, motion, y, { values, colour: fingerColour(finger), dash: DASHES[k % DASHES.length], width: 1.75 });
      });
    },
    show(time) {
      const q = motion.joints(time);
      items.forEach((item, k) => setText(item.value, jointText(hand, groups[shown].joints[k], q[groups[shown].joints[k]])));
    },
  };
}

/** Joints whose position is a length; all others are angles. */
function slides({ links }: Pick<HandStory, "links">, joint: number): boolean {
  return links.some((link) => link.joint === joint && link.kind === "prismatic");
}

/** A position of a joint of a body. */
export function jointText(body: Pick<HandStory, "links">, joint: number, q: number): string {
  return slides(body, joint) ? `${(q * 1000).toFixed(1)} mm` : `${((q * 180) / Math.PI).toFixed(0).replace("-", "\u2212")}\u00b0`;
}

interface KeyItem { element: HTMLElement; value: HTMLElement }

/** A line as the chart draws its k-th one, with its name and room for its value. */
function keyItem(name: string, colour: string, k: number, hint: string | null = null): KeyItem {
  const sample = el("canvas", { width: 44, height: 12, "aria-hidden": "true" });
  const context = sample.getContext("2d");
  if (context) {
    context.scale(2, 2);
    context.strokeStyle = colour;
    context.lineWidth = 1.75;
    context.setLineDash(DASHES[k % DASHES.length]);
    context.beginPath();
    context.moveTo(0, 3);
    context.lineTo(22, 3);
    context.stroke();
  }
  const value = el("span", { class: "value" });
  return { element: el("li", { title: hint ? `${name}: ${hint}` : name }, sample, el("span", { class: "name" }, name), value), value };
}

interface JointGroup { name: string; finger: number; joints: number[] }

/** Joints by the finger whose links they move; those of no finger come last. */
export function jointGroups(hand: HandStory): JointGroup[] {
  const fingerOf = hand.joints.map((_, joint) => hand.links.find((l) => l.joint === joint)?.finger ?? -1);
  const groups = hand.fingers.map((finger, i) => ({
    name: finger.name,
    finger: i,
    joints: fingerOf.flatMap((f, joint) => (f === i ? [joint] : [])),
  }));
  groups.push({ name: "palm", finger: -1, joints: fingerOf.flatMap((f, joint) => (f === -1 ? [joint] : [])) });
  return groups.filter((group) => group.joints.length > 0);
}

/** Largest force of the plan, newtons; 0 without forces. */
export function largestForce(motion: Motion): number {
  let largest = 0;
  for (const w of motion.waypoints) for (const c of w.contacts) if (c.force_in_object) largest = Math.max(largest, norm(c.force_in_object));
  return largest;
}
