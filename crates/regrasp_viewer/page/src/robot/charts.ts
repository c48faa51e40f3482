// Charts of the page: a line follows the time, and a click goes there.

import { el } from "../dom";
import { clamp } from "../math";
import type { Player } from "../player";
import type { RobotReplay } from "../robot_file";

export function followCharts(replay: RobotReplay, player: Player): void {
  const { times: [first, last], edges: [left, right] } = replay.axis;
  const length = Math.max(last - first, 1e-9);
  for (const chart of document.querySelectorAll<HTMLElement>(".timed")) {
    const line = el("span", { class: "cursor", "aria-hidden": "true" });
    chart.append(line);
    const picture = chart.querySelector("svg")!;
    player.onTime((time) => {
      const share = left + (right - left) * clamp((time - first) / length, 0, 1);
      line.style.left = `${picture.getBoundingClientRect().left - chart.getBoundingClientRect().left + share * picture.clientWidth}px`;
    });
    picture.addEventListener("click", (event) => {
      const box = picture.getBoundingClientRect();
      const share = ((event.clientX - box.left) / box.width - left) / (right - left);
      player.setPlaying(false);
      player.seek(first + clamp(share, 0, 1) * length);
    });
  }
  player.seek(player.kept);
}
