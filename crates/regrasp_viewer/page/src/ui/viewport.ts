// The 3-D view with what lies over it: what happens now, who holds, layers, start and goal.

import { button, el, icon, setText } from "../dom";
import { whoMoves, type Motion } from "../motion";
import type { Player } from "../player";
import { movingHand } from "../bodies";
import type { FingerStory, Story } from "../story";
import { fingerColour } from "../theme";
import type { Layer, Stage } from "../view/stage";

const LAYERS: [Layer, string][] = [
  ["visual", "Visual shapes"],
  ["seeThrough", "See through the hand"],
  ["contacts", "Contacts and normals"],
  ["cones", "Friction cones"],
  ["forces", "Forces"],
  ["trace", "Contact traces"],
  ["ghosts", "Start and goal in place"],
  ["obstacles", "Obstacles"],
];

const STATES = { fixed: "holds", rolling: "rolls", sliding: "slides", moving: "moves", free: "free" } as const;

export class Viewport {
  readonly element: HTMLElement;
  private readonly caption = el("p", { class: "caption" });
  private readonly states: HTMLElement[];
  private readonly boxes = new Map<string, HTMLInputElement>();

  private readonly fingers: FingerStory[];

  /** `choose` is told the key of a body that is clicked at. */
  constructor(private readonly story: Story, private readonly motion: Motion, player: Player, private readonly stage: Stage | null, choose: (key: string) => void) {
    this.fingers = movingHand(story.scene).fingers;
    this.states = this.fingers.map(() => el("span", { class: "state" }));
    const legend = el("ul", { class: "legend", "aria-label": "Fingers" }, ...this.fingers.map((finger, i) => {
      const swatch = el("span", { class: "swatch" });
      swatch.style.background = fingerColour(i);
      return el("li", { title: finger.name }, swatch, el("span", { class: "name" }, finger.name), this.states[i]);
    }));
    this.element = el("div", { class: "viewport" });
    if (stage) {
      stage.canvas.setAttribute("role", "img");
      stage.canvas.setAttribute("aria-label", "Hand and object in 3-D; drag to turn");
      this.element.append(stage.canvas, this.tools(stage), this.insets(stage), this.hint(stage));
      listenToClicks(stage, choose);
    } else {
      this.element.append(el("p", { class: "no-webgl" },
        "The 3-D view needs WebGL 2, which this browser does not offer. Charts and facts are complete without it."));
    }
    this.element.append(this.caption);
    if (story.plan) this.element.append(legend);
    player.onTime((time) => this.show(time));
    // Read out where one stops, not while it plays.
    player.onState(() => this.caption.setAttribute("aria-live", player.playing ? "off" : "polite"));
    this.show(player.time);
  }

  toggle(layer: string): void {
    const box = this.boxes.get(layer);
    if (!box) return;
    box.checked = !box.checked;
    this.stage?.setLayer(layer as Layer, box.checked);
  }

  private tools(stage: Stage): HTMLElement {
    const list = el("ul");
    for (const [layer, text] of LAYERS) {
      if (!stage.has(layer)) continue;
      const box = el("input", { type: "checkbox", checked: stage.layers[layer] });
      box.addEventListener("change", () => stage.setLayer(layer, box.checked));
      this.boxes.set(layer, box);
      list.append(el("li", {}, el("label", {}, box, text)));
    }
    const panel = el("div", { class: "layers", hidden: true }, list);
    const open = button(icon("layers"), "What is shown", () => {
      panel.hidden = !panel.hidden;
      open.setAttribute("aria-expanded", String(!panel.hidden));
    }, "button quiet");
    open.setAttribute("aria-expanded", "false");
    const tools = el("div", { class: "tools" }, button(icon("frame"), "Frame the hand", () => stage.frame(), "button quiet"), open, panel);
    const close = () => {
      panel.hidden = true;
      open.setAttribute("aria-expanded", "false");
    };
    tools.addEventListener("keydown", (event) => {
      if (event.key === "Escape" && !panel.hidden) {
        close();
        open.focus();
      }
    });
    stage.canvas.addEventListener("pointerdown", close);
    return tools;
  }

  /** The name of the part under the mouse. */
  private hint(stage: Stage): HTMLElement {
    const hint = el("p", { class: "hint", hidden: true });
    let waiting = false;
    stage.canvas.addEventListener("pointermove", (event) => {
      if (event.pointerType === "touch" || event.buttons !== 0 || waiting) return;
      waiting = true;
      requestAnimationFrame(() => {
        waiting = false;
        const { clientWidth } = stage.canvas;
        const name = seenAt(stage, event)?.name ?? null;
        hint.hidden = name === null;
        setText(hint, name ?? "");
        hint.style.transform = `translate(${Math.min(event.offsetX + 14, clientWidth - 180)}px, ${event.offsetY + 16}px)`;
      });
    });
    for (const leaving of ["pointerleave", "pointerdown"]) stage.canvas.addEventListener(leaving, () => { hint.hidden = true; });
    return hint;
  }

  private insets(stage: Stage): HTMLElement {
    const names = ["start", "goal"];
    const views = stage.insetCanvases.map((canvas, i) => {
      canvas.setAttribute("aria-hidden", "true");
      return el("figure", { class: `inset ${names[i]}` }, canvas, el("figcaption", {}, names[i]));
    });
    return el("div", { class: "insets" }, ...views);
  }

  private show(time: number): void {
    const { motion, story } = this;
    if (!story.plan) {
      setText(this.caption, story.failure?.nearest_miss ? "Nearest miss" : "Start");
      return;
    }
    const at = motion.stretchAt(time);
    const stretch = motion.stretches[at];
    if (!stretch) return;
    const same = motion.stretches.filter((s) => s.kind === stretch.kind);
    const number = `${same.indexOf(stretch) + 1} of ${same.length}`;
    const [name, under] = [stretch.moving, stretch.rolling].map((finger) => this.fingers[finger]?.name);
    const said = {
      transfer: `Transfer ${number}`,
      regrasp: `Relocation ${number}${name ? `: ${name} moves` : ""}`,
      tracking: `${whoMoves(stretch, this.fingers)} (dark rim), the object rolls on ${under} (grey rim)`,
    };
    setText(this.caption, said[stretch.kind]);
    motion.contacts(time).forEach((contact, i) => {
      const moves = contact.mode === "free" && stretch.moving === i;
      const role = stretch.kind !== "tracking" ? "" : stretch.allMoving.includes(i) ? ", moving finger" : stretch.rolling === i ? ", object on it" : "";
      setText(this.states[i], STATES[moves ? "moving" : contact.mode] + role);
      this.states[i].parentElement!.classList.toggle("away", contact.mode === "free");
    });
  }
}

function seenAt(stage: Stage, event: PointerEvent): { name: string; body: string } | null {
  return stage.seenAt(event.offsetX / stage.canvas.clientWidth, event.offsetY / stage.canvas.clientHeight);
}

/** A press and a release at one place: a drag turns the view. */
function listenToClicks(stage: Stage, choose: (key: string) => void): void {
  let pressed: [number, number] | null = null;
  stage.canvas.addEventListener("pointerdown", (event) => { pressed = event.button === 0 ? [event.offsetX, event.offsetY] : null; });
  stage.canvas.addEventListener("pointerup", (event) => {
    const moved = pressed ? Math.hypot(event.offsetX - pressed[0], event.offsetY - pressed[1]) : Infinity;
    pressed = null;
    const seen = moved < 4 ? seenAt(stage, event) : null;
    if (seen) choose(seen.body);
  });
}
