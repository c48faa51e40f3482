// Play, scrub, speed, relocations; the strip above the scrubber shows which finger relocates, or moves in tracking, when.

import { button, el, icon } from "../dom";
import type { Motion } from "../motion";
import { SPEEDS, type Player } from "../player";
import { fingerColour, type Theme } from "../theme";

export class Transport {
  readonly element: HTMLElement;
  private readonly strip = el("canvas", { class: "strip", "aria-hidden": "true" });
  private readonly scrubber: HTMLInputElement;
  private readonly clock = el("output", { class: "clock" });
  private readonly play: HTMLButtonElement;
  private readonly repeat: HTMLButtonElement;
  private readonly speed: HTMLSelectElement;

  constructor(private readonly motion: Motion, private readonly player: Player, private readonly theme: Theme) {
    this.scrubber = el("input", {
      type: "range", class: "scrubber", min: motion.start, max: motion.end, step: "any", value: motion.start, "aria-label": "Time, seconds",
    });
    this.scrubber.addEventListener("input", () => player.seek(Number(this.scrubber.value)));
    this.play = button(icon("play"), "Play", () => player.setPlaying(!player.playing), "button play");
    this.repeat = button(icon("repeat"), "Repeat", () => player.setRepeats(!player.repeats), "button quiet repeat");
    this.speed = el("select", { "aria-label": "Speed", class: "speed" }, ...SPEEDS.map((s) => el("option", { value: s, selected: s === 1 }, `${s}\u00d7`)));
    this.speed.addEventListener("change", () => player.setSpeed(Number(this.speed.value)));
    const what = motion.isTracking ? "change of the moving finger" : "relocation";
    this.element = el(
      "div",
      { class: "transport", role: "group", "aria-label": "Playback" },
      el("div", { class: "line" }, this.strip, this.scrubber),
      el(
        "div",
        { class: "buttons" },
        button(icon("previous"), `Previous ${what}`, () => step(player, motion, -1), "button quiet"),
        this.play,
        button(icon("next"), `Next ${what}`, () => step(player, motion, 1), "button quiet"),
        this.clock,
        el("span", { class: "gap" }),
        this.repeat,
        this.speed,
      ),
    );
    player.onTime((time) => this.showTime(time));
    player.onState(() => this.showState());
    theme.onChange(() => this.draw());
    new ResizeObserver(() => this.draw()).observe(this.strip);
    this.showTime(player.time);
    this.showState();
  }

  private showTime(time: number): void {
    if (document.activeElement !== this.scrubber || Math.abs(Number(this.scrubber.value) - time) > 1e-6) this.scrubber.value = String(time);
    this.scrubber.setAttribute("aria-valuetext", `${time.toFixed(2)} of ${this.motion.end.toFixed(2)} seconds`);
    this.clock.textContent = `${time.toFixed(2)} / ${this.motion.end.toFixed(2)} s`;
  }

  private showState(): void {
    const { playing, repeats, speed } = this.player;
    this.play.replaceChildren(icon(playing ? "pause" : "play"));
    this.play.setAttribute("aria-label", playing ? "Pause" : "Play");
    this.play.title = playing ? "Pause (space)" : "Play (space)";
    this.repeat.setAttribute("aria-pressed", String(repeats));
    this.speed.value = String(speed);
  }

  private draw(): void {
    const width = this.strip.clientWidth;
    const context = this.strip.getContext("2d");
    if (!width || !context) return;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    this.strip.width = Math.round(width * ratio);
    this.strip.height = Math.round(6 * ratio);
    context.scale(ratio, ratio);
    // The middle of the scrubber's thumb travels from half its width to the other end less half of it.
    const thumb = 16;
    const length = Math.max(this.motion.end - this.motion.start, 1e-9);
    const x = (t: number) => thumb / 2 + ((t - this.motion.start) / length) * (width - thumb);
    context.fillStyle = this.theme.colours.line;
    context.fillRect(x(this.motion.start), 2, width - thumb, 2);
    for (const stretch of this.motion.stretches) {
      if (stretch.kind === "transfer") continue;
      context.fillStyle = fingerColour(stretch.moving);
      context.fillRect(x(stretch.start), 0, Math.max(stretch.kind === "regrasp" ? 2 : 0.5, x(stretch.end) - x(stretch.start)), 6);
    }
  }
}

export function step(player: Player, motion: Motion, direction: 1 | -1): void {
  player.setPlaying(false);
  player.seek(motion.relocationFrom(player.kept, direction));
}
