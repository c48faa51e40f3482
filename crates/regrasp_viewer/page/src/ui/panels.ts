// Everything in words: verdict, facts, violations, why no plan was found.

import { el, icon } from "../dom";
import { indexOfLeast } from "../charts/lines";
import type { Motion } from "../motion";
import type { Story } from "../story";
import { COMPONENTS } from "../theme";

const degrees = (radians: number): string => `${((radians * 180) / Math.PI).toFixed(1)}\u00b0`;

export function verdict(story: Story): HTMLElement {
  const [kind, text, why] = story.plan === null
    ? ["bad", "No plan found", null]
    : story.judged === null
      ? ["unknown", "Not checked", null]
      : story.judged.accepted
        ? ["good", "Accepted", `by the checker for ${story.judged.level}`]
        : ["bad", "Rejected", `by the checker for ${story.judged.level}`];
  return el(
    "p",
    { class: `verdict ${kind}`, role: "status" },
    kind === "unknown" ? null : icon(kind === "good" ? "check" : "cross"),
    el("strong", {}, text!),
    why ? el("span", {}, ` ${why}`) : null,
  );
}

/** The few numbers that one looks for first; the worst moments can be gone to. */
export function figures(story: Story, motion: Motion, seek: (time: number) => void): HTMLElement | null {
  if (!story.plan) return null;
  const list = el("dl", { class: "figures" });
  const put = (name: string, value: string, unit: string, more: string, when: HTMLElement | null = null) =>
    list.append(el("div", {}, el("dt", {}, name), el("dd", {}, value, unit ? el("span", { class: "unit" }, ` ${unit}`) : null),
      el("dd", { class: "more", title: more }, more), when ? el("dd", { class: "more" }, when) : null));
  const go = (i: number) => {
    const time = motion.times[i];
    const link = el("button", { type: "button", class: "at", title: "Show this moment" }, `at ${time.toFixed(2)} s`);
    link.addEventListener("click", () => seek(time));
    return link;
  };
  const relocations = motion.nRelocations;
  const transfers = motion.stretches.filter((s) => s.kind === "transfer").length;
  if (story.plan.promises.tracking) {
    const { transfers: onPath, samples, nodes } = story.plan.statistics;
    put("Sub-goals on the path", String(onPath), "", `${samples} tried, ${nodes} cells seen${relocations ? `, ${relocations} relocations` : ""}`);
  } else put("Relocations", String(relocations), "", `${transfers} transfers`);
  put("Duration", (motion.end - motion.start).toFixed(1), "s", `${motion.waypoints.length} waypoints`);
  if (story.judged) {
    const { margin, clearance, required_margin, pair, pairs } = story.judged;
    const i = indexOfLeast(margin);
    if (i < 0) put("Closure margin", "\u2013", "", motion.isTracking ? "not defined for sliding contacts" : "not judged");
    else put("Closure margin", margin[i]!.toFixed(4), "", `required ${required_margin}`, go(i));
    const k = indexOfLeast(clearance);
    if (k < 0) put("Clearance", "\u2013", "", "not judged");
    else put("Clearance", (clearance[k]! * 1000).toFixed(2), "mm", pairs[pair[k]]?.join(" \u2013 ") ?? "", go(k));
  }
  return list;
}

export function violations(story: Story): HTMLElement | null {
  const found = story.judged?.violations ?? [];
  if (found.length === 0) return null;
  return el("section", { class: "card wrong" }, el("h2", {}, "Violations"), el("ol", {}, ...found.map((v) => el("li", {}, v))));
}

export function facts(story: Story): HTMLElement | null {
  if (story.facts.length === 0) return null;
  const rows = story.facts.map(([name, value]) => el("tr", {}, el("th", { scope: "row" }, name), el("td", { class: /^sha256 [0-9a-f]{64}$/.test(value) ? "hash" : null }, value)));
  return el("section", { class: "card" }, el("h2", {}, story.plan ? "The plan" : "The query"), el("table", { class: "facts" }, el("tbody", {}, ...rows)));
}

export function failure(story: Story): HTMLElement | null {
  const failed = story.failure;
  if (!failed) return null;
  const card = el("section", { class: "card failure" }, el("h2", {}, "Why there is no plan"), el("p", { class: "lead" }, failed.message));
  const miss = failed.nearest_miss;
  if (miss) {
    const distance = miss.distance_left > 1e-5 ? ` and ${(miss.distance_left * 1000).toFixed(1)} mm` : "";
    card.append(el("p", { class: "miss" }, el("span", { class: "swatch-object" }), `The nearest miss, shown in 3-D, is ${degrees(miss.angle_left)}${distance} from the goal.`));
  }
  if (failed.causes.length > 0) card.append(causes(failed.causes));
  if (failed.advice) card.append(el("div", { class: "advice" }, el("h3", {}, "What to try"), el("p", {}, failed.advice)));
  return card;
}

function causes(found: { reason: string; count: number; share: number }[]): HTMLElement {
  const largest = Math.max(...found.map((c) => c.share), 1e-9);
  const rows = found.map((cause) => {
    const bar = el("span", { class: "bar" });
    bar.style.width = `${(100 * cause.share) / largest}%`;
    return el(
      "li",
      {},
      el("span", { class: "reason" }, cause.reason),
      el("span", { class: "share" }, `${(100 * cause.share).toFixed(cause.share < 0.1 ? 1 : 0)} %`, el("span", { class: "count" }, ` ${cause.count.toLocaleString("en")}`)),
      el("span", { class: "track", "aria-hidden": "true" }, bar),
    );
  });
  return el("div", {}, el("h3", {}, "What stopped the motions that were tried"), el("ol", { class: "causes" }, ...rows));
}

/** Isolated parts of the manipulation graph, in words. */
export function components(story: Story): HTMLElement | null {
  if (!story.roadmap || story.plan) return null;
  const members = new Map<number, number[]>();
  story.roadmap.nodes.forEach((node, i) => members.set(node.component, [...(members.get(node.component) ?? []), i]));
  const order = [...members.values()].sort((a, b) => b.length - a.length);
  if (order.length === 0) return null;
  const nodes = story.roadmap.nodes;
  const nearest = (list: number[]): string => degrees(Math.min(...list.map((k) => nodes[k].angle_to_goal)));
  const row = (name: string, colour: string | null, size: number, list: number[]) => {
    const dot = el("span", { class: colour ? "dot" : "dot hollow" });
    if (colour) dot.style.background = colour;
    return el("tr", {}, el("td", {}, el("span", { class: "named" }, dot, name)), el("td", {}, String(size)), el("td", {}, nearest(list)));
  };
  const groups = order.filter((list) => list.length > 1);
  const alone = order.filter((list) => list.length === 1).flat();
  const rows = groups.slice(0, 6).map((list, i) => row(`component ${i + 1}`, COMPONENTS[i], list.length, list));
  const rest = groups.slice(6).flat();
  if (rest.length > 0) rows.push(row(`${groups.length - 6} further`, "#9aa2a9", rest.length, rest));
  if (alone.length > 0) rows.push(row("isolated nodes", null, alone.length, alone));
  return el(
    "section",
    { class: "card" },
    el("h2", {}, order.length === 1 ? "One component of the roadmap" : `${order.length} components of the roadmap`),
    order.length > 1 ? el("p", { class: "note" }, "No motion was found from one component to another.") : null,
    el("table", { class: "numbers" },
      el("thead", {}, el("tr", {}, ...["", "Nodes", "Nearest to the goal"].map((t) => el("th", { scope: "col" }, t)))),
      el("tbody", {}, ...rows)),
  );
}
