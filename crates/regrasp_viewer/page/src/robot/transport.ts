// Play, scrub, speed, segments; the strip above the scrubber shows who holds the object when.

import { button, el, icon } from "../dom";
import { SPEEDS, type Player } from "../player";
import type { ReplaySegment, RobotReplay } from "../robot_file";
import type { Theme } from "../theme";

/** Index of the segment at `time`. */
export function segmentAt(replay: RobotReplay, time: number): number {
  const found = replay.segments.findIndex((segment) => time < segment.end);
  return found < 0 ? replay.segments.length - 1 : found;
}

/** What happens in a segment, in words. */
export function saidOf(segment: ReplaySegment): string {
  const holders = segment.held_by.length > 0 ? `: held by ${segment.held_by.join(", ")}` : "";
  return segment.kind[0].toUpperCase() + segment.kind.slice(1) + holders;
}

export class RobotTransport {
  readonly element: HTMLElement;
  private readonly strip = el("canvas", { class: "strip", "aria-hidden": "true" });
  private readonly scrubber: HTMLInputElement;
  private readonly clock = el("output", { class: "clock" });
  private readonly play: HTMLButtonElement;
  private readonly speed: HTMLSelectElement;

  constructor(private readonly replay: RobotReplay, private readonly player: Player, private readonly theme: Theme) {
    this.scrubber = el("input", {
      type: "range", class: "scrubber", min: player.start, max: player.end, step: "any", value: player.start, "aria-label": "Time, seconds",
    });
    this.scrubber.addEventListener("input", () => player.seek(Number(this.scrubber.value)));
    this.play = button(icon("play"), "Play", () => player.setPlaying(!player.playing), "button play");
    this.speed = el("select", { "aria-label": "Speed", class: "speed" }, ...SPEEDS.map((s) => el("option", { value: s, selected: s === 1 }, `${s}\u00d7`)));
    this.speed.addEventListener("change", () => player.setSpeed(Number(this.speed.value)));
    this.element = el(
      "div",
      { class: "transport", role: "group", "aria-label": "Playback" },
      el("div", { class: "line" }, this.strip, this.scrubber),
      el(
        "div",
        { class: "buttons" },
        button(icon("previous"), "Previous segment", () => this.step(-1), "button quiet"),
        this.play,
        button(icon("next"), "Next segment", () => this.step(1), "button quiet"),
        this.clock,
        el("span", { class: "gap" }),
        button(icon("sun"), "Light or dark", () => theme.toggle(), "button quiet"),
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

  /** To the beginning of the next segment or of the one before. */
  step(direction: 1 | -1): void {
    const starts = [...this.replay.segments.map((segment) => segment.start), this.player.end];
    const { kept } = this.player;
    const next = direction > 0 ? starts.find((start) => start > kept + 1e-6) : starts.reverse().find((start) => start < kept - 1e-6);
    this.player.setPlaying(false);
    if (next !== undefined) this.player.seek(next);
  }

  private showTime(time: number): void {
    if (document.activeElement !== this.scrubber || Math.abs(Number(this.scrubber.value) - time) > 1e-6) this.scrubber.value = String(time);
    this.scrubber.setAttribute("aria-valuetext", `${time.toFixed(2)} of ${this.player.end.toFixed(2)} seconds`);
    this.clock.textContent = `${time.toFixed(2)} / ${this.player.end.toFixed(2)} s`;
  }

  private showState(): void {
    const { playing, speed } = this.player;
    this.play.replaceChildren(icon(playing ? "pause" : "play"));
    this.play.setAttribute("aria-label", playing ? "Pause" : "Play");
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
    const { player, replay } = this;
    const thumb = 16;
    const length = Math.max(player.end - player.start, 1e-9);
    const x = (t: number) => thumb / 2 + ((t - player.start) / length) * (width - thumb);
    context.fillStyle = this.theme.colours.line;
    context.fillRect(x(player.start), 2, width - thumb, 2);
    const colours = new Map(replay.holders.map(({ name, color }) => [name, color]));
    for (const segment of replay.segments) {
      const height = 6 / Math.max(segment.held_by.length, 1);
      segment.held_by.forEach((holder, k) => {
        context.fillStyle = colours.get(holder) ?? this.theme.colours.line;
        context.fillRect(x(segment.start), k * height, x(segment.end) - x(segment.start), height);
      });
    }
  }
}
