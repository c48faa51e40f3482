// The page of a robot's plan: replays it, and lets the charts follow the time. Charts, key frames and facts stand in the page already.

import "../page.css";
import "./robot.css";
import { el } from "../dom";
import { Player } from "../player";
import type { RobotReplay } from "../robot_file";
import { Theme } from "../theme";
import { followCharts } from "./charts";
import { RobotStage } from "./stage";
import { RobotTransport, saidOf, segmentAt } from "./transport";

function readReplay(): RobotReplay {
  const text = document.getElementById("story")?.textContent;
  if (!text) throw new Error("This page carries no plan.");
  const replay = JSON.parse(text) as RobotReplay;
  if (replay.format !== "regrasp-robot-replay" || replay.version !== 1) {
    throw new Error("What this page carries was made by another version of regrasp. Make the page again.");
  }
  return replay;
}

function start(): void {
  const home = document.getElementById("replay") ?? document.body.appendChild(el("div"));
  const theme = new Theme();
  let replay: RobotReplay;
  try {
    replay = readReplay();
  } catch (error) {
    home.replaceChildren(el("p", { class: "no-webgl", role: "alert" }, (error as Error).message));
    return;
  }
  const player = new Player(replay.times[0], replay.times[replay.times.length - 1]);
  const caption = el("p", { class: "caption" });
  const viewport = el("div", { class: "viewport" });
  let stage: RobotStage | null = null;
  try {
    stage = new RobotStage(replay, theme);
    stage.canvas.setAttribute("role", "img");
    stage.canvas.setAttribute("aria-label", "Robot and objects in 3-D; drag to turn");
    viewport.append(stage.canvas);
  } catch (error) {
    if (!(error instanceof Error && /webgl/i.test(error.message))) throw error;
    viewport.append(el("p", { class: "no-webgl" },
      "The 3-D view needs WebGL 2, which this browser does not offer. Charts, key frames and facts are complete without it."));
  }
  viewport.append(caption);
  const transport = new RobotTransport(replay, player, theme);
  home.replaceChildren(viewport, transport.element);
  followCharts(replay, player);

  const show = (time: number): void => {
    stage?.setTime(time);
    const said = saidOf(replay.segments[segmentAt(replay, time)]);
    if (caption.textContent !== said) caption.textContent = said;
  };
  player.onTime(show);
  show(player.time);
  if (stage) {
    const fit = () => stage.resize(viewport.clientWidth, viewport.clientHeight);
    fit();
    new ResizeObserver(fit).observe(viewport);
  }
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    const typing = event.target instanceof HTMLElement && event.target.matches("select, button:focus-visible, summary:focus-visible");
    const does: Record<string, () => void> = {
      " ": () => player.setPlaying(!player.playing),
      ArrowLeft: () => player.seek(player.kept - (event.shiftKey ? 1 : 0.1)),
      ArrowRight: () => player.seek(player.kept + (event.shiftKey ? 1 : 0.1)),
      "[": () => transport.step(-1),
      "]": () => transport.step(1),
      Home: () => player.seek(player.start),
      End: () => player.seek(player.end),
      f: () => stage?.frame(),
      t: () => theme.toggle(),
    };
    const act = does[event.key];
    if (!act || typing) return;
    event.preventDefault();
    act();
  });
  let before = performance.now();
  const tick = (now: number): void => {
    player.advance(Math.min((now - before) / 1000, 0.25));
    before = now;
    stage?.draw();
    requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
}

start();
