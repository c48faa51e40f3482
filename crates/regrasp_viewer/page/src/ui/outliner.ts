// The bodies of the scene by name, with their links and joints. Each can be shown, hidden and pointed out in the 3-D view.

import { bodiesOf, type Body, type BodyKind } from "../bodies";
import { jointText } from "../charts/lines";
import { el, setText } from "../dom";
import type { Motion } from "../motion";
import type { Player } from "../player";
import type { Story } from "../story";
import type { Stage } from "../view/stage";

const KINDS: Record<BodyKind, string> = { hand: "hand", robot_part: "robot", object: "object", support: "support", obstacle: "obstacle" };

export class Outliner {
  readonly element: HTMLElement;
  private readonly entries = new Map<string, HTMLElement>();
  private chosen: string | null = null;

  constructor(story: Story, private readonly motion: Motion, player: Player, private readonly stage: Stage | null) {
    const bodies = bodiesOf(story.scene);
    const moves = story.plan !== null;
    this.element = el("section", { class: "card outliner" }, el("h2", {}, "Bodies"),
      el("ul", {}, ...bodies.map((body) => this.entry(body, player, moves))));
  }

  /** Opens the entry of a body, brings it into view and marks the body. */
  choose(key: string): void {
    this.chosen = key;
    for (const [of, entry] of this.entries) {
      entry.classList.toggle("chosen", of === key);
      const details = entry.querySelector("details");
      if (details) details.open = of === key;
    }
    this.entries.get(key)?.scrollIntoView({ block: "nearest" });
    this.stage?.mark(key);
  }

  private entry(body: Body, player: Player, moves: boolean): HTMLElement {
    const { stage } = this;
    const entry = el("li", {});
    if (stage) {
      const box = el("input", { type: "checkbox", checked: true, "aria-label": `Show ${body.name}` });
      box.addEventListener("change", () => stage.setShown(body.key, box.checked));
      entry.append(box);
      entry.addEventListener("pointerenter", () => stage.mark(body.key));
      entry.addEventListener("pointerleave", () => stage.mark(this.chosen));
    }
    const rests = body.kind === "support" || body.kind === "obstacle" ? "" : body.moves && moves ? ", moves" : ", at rest";
    const words = [el("span", { class: "name" }, body.name), el("span", { class: "kind" }, KINDS[body.kind] + rests)];
    if (body.links.length > 0) entry.append(this.parts(body, player, words));
    else {
      const name = el("button", { type: "button", class: "head" }, ...words);
      name.addEventListener("click", () => this.choose(body.key));
      entry.append(name);
    }
    this.entries.set(body.key, entry);
    return entry;
  }

  /** Links and joints; positions of the hand that moves follow the time. */
  private parts(body: Body, player: Player, words: HTMLElement[]): HTMLElement {
    const values = body.joints.map((joint, k) => el("td", {}, jointText(body, k, joint.at_rest)));
    const rows = body.joints.map((joint, k) => el("tr", {}, el("th", { scope: "row" }, joint.name), values[k]));
    const links = body.links.map((link) => link.name).join(", ");
    const details = el("details", {}, el("summary", { class: "head" }, ...words),
      el("p", {}, el("span", { class: "kind" }, "Links "), links),
      rows.length > 0 ? el("table", { class: "numbers", "aria-label": `Joints of ${body.name}` }, el("tbody", {}, ...rows)) : null);
    details.addEventListener("toggle", () => {
      if (!details.open) return;
      this.chosen = body.key;
      this.stage?.mark(body.key);
      follow(player.time);
    });
    const follow = (time: number): void => {
      if (!details.open || !body.moves) return;
      this.motion.joints(time).forEach((q, k) => setText(values[k], jointText(body, k, q)));
    };
    player.onTime(follow);
    return details;
  }
}
