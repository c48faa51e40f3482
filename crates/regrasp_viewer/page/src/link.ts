// The part of the address after `#`: `t` the time, `cam` the camera (azimuth, elevation in degrees; distance, target in metres).

import type { Player } from "./player";

export interface CameraPlace { azimuth: number; elevation: number; distance: number; target: [number, number, number] }

export function readLink(hash: string): { time: number | null; camera: CameraPlace | null } {
  const found = new URLSearchParams(hash.replace(/^#/, ""));
  const number = (text: string | null): number | null => {
    const value = text === null || text.trim() === "" ? NaN : Number(text);
    return Number.isFinite(value) ? value : null;
  };
  const cam = (found.get("cam") ?? "").split(",").map(number);
  const whole = cam.length === 6 && cam.every((x) => x !== null && Math.abs(x) < 1e6) && cam[2]! > 0;
  const [azimuth, elevation, distance, x, y, z] = cam as number[];
  return {
    time: number(found.get("t")),
    camera: whole ? { azimuth, elevation, distance, target: [x, y, z] } : null,
  };
}

export function writeLink(time: number, camera: CameraPlace | null): string {
  const parts = [`t=${Number(time.toFixed(3))}`];
  if (camera) {
    const { azimuth, elevation, distance, target } = camera;
    parts.push(`cam=${[azimuth.toFixed(1), elevation.toFixed(1), distance.toFixed(4), ...target.map((x) => x.toFixed(4))].map(Number).join(",")}`);
  }
  return `#${parts.join("&")}`;
}

/** Keeps the address in step, at most twice a second and not while playing. */
export function keepLink(player: Player, camera: () => CameraPlace | null): () => void {
  let waiting: ReturnType<typeof setTimeout> | null = null;
  const write = () => {
    waiting = null;
    if (player.playing) return;
    try {
      history.replaceState(null, "", writeLink(player.kept, camera()));
    } catch {
      // Pages inside other pages may have no address of their own.
    }
  };
  return () => {
    waiting ??= setTimeout(write, 500);
  };
}
