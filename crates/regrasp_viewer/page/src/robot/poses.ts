// Where bodies are at any time, between the frames of the replay.

import { interpolatePose, type Pose } from "../math";
import type { RobotReplay } from "../robot_file";

export class Poses {
  private readonly values: Float32Array;

  constructor(private readonly replay: RobotReplay) {
    const text = atob(replay.poses);
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
    const view = new DataView(bytes.buffer);
    this.values = new Float32Array(bytes.length / 4);
    for (let i = 0; i < this.values.length; i++) this.values[i] = view.getFloat32(4 * i, true);
    if (this.values.length !== 7 * replay.times.length * replay.n_columns) throw new Error("The poses of this page are cut off.");
  }

  private stored(frame: number, column: number): Pose {
    const at = 7 * (frame * this.replay.n_columns + column);
    const [x, y, z, a, b, c, d] = this.values.subarray(at, at + 7);
    return { position: [x, y, z], quat: [a, b, c, d] };
  }

  /** The pose of every column at `time`. */
  at(time: number): Pose[] {
    const { times, n_columns } = this.replay;
    let [low, high] = [0, times.length - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle;
      else high = middle;
    }
    const span = times[high] - times[low];
    const u = span > 0 ? Math.min(Math.max((time - times[low]) / span, 0), 1) : 0;
    return Array.from({ length: n_columns }, (_, column) => interpolatePose(this.stored(low, column), this.stored(high, column), u));
  }
}
