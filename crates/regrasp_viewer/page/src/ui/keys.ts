// Keyboard, and the panel that explains it.

import { button, el, icon } from "../dom";
import type { Motion } from "../motion";
import { SPEEDS, type Player } from "../player";
import { step } from "./transport";

export interface Actions {
  frame: () => void;
  orbit: (azimuth: number, elevation: number, closer: number) => void;
  toggle: (layer: string) => void;
  theme: () => void;
}

const HELP: [string[], string][] = [
  [["Space"], "Play, pause"],
  [["\u2190", "\u2192"], "Back, forward 0.1 s (with Shift 1 s)"],
  [[",", "."], "Previous, next waypoint"],
  [["[", "]"], "Previous, next relocation (in tracking, change of the moving finger)"],
  [["Home", "End"], "Start, end"],
  [["<", ">"], "Slower, faster"],
  [["R"], "Repeat"],
  [["F"], "Frame the hand"],
  [["J", "L", "I", "K"], "Turn the view"],
  [["+", "\u2212"], "Closer, farther"],
  [["C", "G"], "Friction cones, start and goal in place"],
  [["H", "V"], "See through the hand, visual or collision shapes"],
  [["T"], "Light, dark"],
  [["?"], "This help"],
];

export function helpPanel(): { element: HTMLDialogElement; open: () => void } {
  const rows = HELP.map(([keys, what]) => el("tr", {}, el("th", { scope: "row" }, ...keys.map((k) => el("kbd", {}, k))), el("td", {}, what)));
  const element = el("dialog", { class: "help", "aria-labelledby": "help-title" });
  element.append(
    el("div", { class: "chart-head" }, el("h2", { id: "help-title" }, "Keys"), button(icon("cross"), "Close", () => element.close(), "button quiet")),
    el("table", {}, el("tbody", {}, ...rows)),
    el("p", { class: "note" }, "Drag in the 3-D view to turn, with the right button or two fingers to shift, wheel or pinch to come closer. ",
      "Move over a chart to look at a time, click to stay there. The address of the page keeps time and camera."),
  );
  element.addEventListener("click", (event) => {
    if (event.target === element) element.close();
  });
  return { element, open: () => element.showModal() };
}

export function listenToKeys(player: Player, motion: Motion, actions: Actions, help: () => void): void {
  const waypoint = (direction: 1 | -1): void => {
    const times = [...new Set(motion.times)];
    const next = direction > 0 ? times.find((t) => t > player.kept + 1e-9) : times.reverse().find((t) => t < player.kept - 1e-9);
    if (next !== undefined) player.seek(next);
  };
  const faster = (by: 1 | -1): void => player.setSpeed(SPEEDS[SPEEDS.indexOf(player.speed) + by] ?? player.speed);
  const does: Record<string, (shift: boolean) => void> = {
    " ": () => player.setPlaying(!player.playing),
    ArrowLeft: (shift) => player.seek(player.kept - (shift ? 1 : 0.1)),
    ArrowRight: (shift) => player.seek(player.kept + (shift ? 1 : 0.1)),
    ",": () => waypoint(-1),
    ".": () => waypoint(1),
    "[": () => step(player, motion, -1),
    "]": () => step(player, motion, 1),
    Home: () => player.seek(motion.start),
    End: () => player.seek(motion.end),
    "<": () => faster(-1),
    ">": () => faster(1),
    r: () => player.setRepeats(!player.repeats),
    f: () => actions.frame(),
    j: () => actions.orbit(-6, 0, 1),
    l: () => actions.orbit(6, 0, 1),
    i: () => actions.orbit(0, 6, 1),
    k: () => actions.orbit(0, -6, 1),
    "+": () => actions.orbit(0, 0, 1.15),
    "=": () => actions.orbit(0, 0, 1.15),
    "-": () => actions.orbit(0, 0, 1 / 1.15),
    c: () => actions.toggle("cones"),
    h: () => actions.toggle("seeThrough"),
    v: () => actions.toggle("visual"),
    g: () => actions.toggle("ghosts"),
    t: () => actions.theme(),
    "?": () => help(),
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    if (document.querySelector("dialog[open]")) return;
    const at = event.target instanceof HTMLElement ? event.target : null;
    const typing = at?.matches("select, input:not([type=range]):not([type=checkbox]), textarea") ?? false;
    // A button that was reached by keyboard is pressed by space; after a click, space plays.
    const presses = event.key === " " && (at?.matches("button:focus-visible, input[type=checkbox]") ?? false);
    if (typing || presses) return;
    const act = does[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    event.preventDefault();
    act(event.shiftKey);
  });
}
