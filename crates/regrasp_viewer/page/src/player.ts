// The one clock of the page: the time kept, a time looked at while hovering, and playing.

import { clamp } from "./math";

export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];

export class Player {
  kept: number;
  playing = false;
  repeats = false;
  speed = 1;
  private preview: number | null = null;
  private readonly timeListeners: ((time: number) => void)[] = [];
  private readonly stateListeners: (() => void)[] = [];

  constructor(readonly start: number, readonly end: number) {
    this.kept = start;
  }

  /** The time shown. */
  get time(): number {
    return this.preview ?? this.kept;
  }

  onTime(listener: (time: number) => void): void {
    this.timeListeners.push(listener);
  }

  onState(listener: () => void): void {
    this.stateListeners.push(listener);
  }

  seek(time: number): void {
    this.preview = null;
    this.kept = clamp(time, this.start, this.end);
    this.tellTime();
  }

  /** Shows `time` until told otherwise; `null` goes back to the time kept. Playing waits meanwhile. */
  look(time: number | null): void {
    this.preview = time === null ? null : clamp(time, this.start, this.end);
    this.tellTime();
  }

  setPlaying(playing: boolean): void {
    if (this.end <= this.start) return;
    if (playing && this.kept >= this.end) this.kept = this.start;
    this.playing = playing;
    this.tellTime();
    this.tellState();
  }

  setSpeed(speed: number): void {
    this.speed = speed;
    this.tellState();
  }

  setRepeats(repeats: boolean): void {
    this.repeats = repeats;
    this.tellState();
  }

  /** Lets `seconds` of the real clock pass. */
  advance(seconds: number): void {
    if (!this.playing || this.preview !== null) return;
    this.kept += seconds * this.speed;
    if (this.kept >= this.end) {
      if (this.repeats) this.kept = this.start + ((this.kept - this.start) % (this.end - this.start));
      else {
        this.kept = this.end;
        this.playing = false;
        this.tellState();
      }
    }
    this.tellTime();
  }

  private tellTime(): void {
    for (const listener of this.timeListeners) listener(this.time);
  }

  private tellState(): void {
    for (const listener of this.stateListeners) listener();
  }
}
