// The page: reads the story, builds everything, runs the clock.

import "./page.css";
import { Ball } from "./ball";
import { movingHand } from "./bodies";
import { ChartStack } from "./charts/stack";
import { button, el, icon } from "./dom";
import { keepLink, readLink } from "./link";
import { Motion, still } from "./motion";
import { OrientationPath } from "./orientation_path";
import { planOf } from "./plan";
import { Player } from "./player";
import type { Story } from "./story";
import type { Story as StoryFile } from "./story_file";
import { Theme } from "./theme";
import { helpPanel, listenToKeys } from "./ui/keys";
import { Outliner } from "./ui/outliner";
import * as panels from "./ui/panels";
import { Transport } from "./ui/transport";
import { Viewport } from "./ui/viewport";
import { Stage } from "./view/stage";

/** The story, and the plan file that it was told. */
function readStory(): { story: Story; file: unknown } {
  const text = document.getElementById("story")?.textContent;
  if (!text) throw new Error("This page carries no plan.");
  const story = JSON.parse(text) as StoryFile;
  if (story.format !== "regrasp-story") throw new Error("What this page carries is not a plan.");
  if (story.version !== 2) {
    throw new Error(`This page shows plans of version 2; it carries version ${String(story.version)}. Make it again with one version of regrasp.`);
  }
  return { story: { ...story, plan: story.plan && planOf(story.plan) }, file: story.plan };
}

function stageOf(story: Story, motion: Motion, theme: Theme, onCamera: () => void): Stage | null {
  try {
    return new Stage(story, motion, theme, onCamera);
  } catch (error) {
    if (movingHand(story.scene).links.length > 0 && !(error instanceof Error && /webgl/i.test(error.message))) throw error;
    return null;
  }
}

function download(file: unknown): void {
  const address = URL.createObjectURL(new Blob([JSON.stringify(file, null, 1)], { type: "application/json" }));
  const link = el("a", { href: address, download: "plan.json" });
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}

function header(story: Story, file: unknown, theme: Theme, help: () => void): HTMLElement {
  const scheme = button(icon("sun"), "Light or dark", () => theme.toggle(), "button quiet");
  return el(
    "header",
    { class: "top" },
    el("h1", { title: story.title }, story.title || "Plan"),
    panels.verdict(story),
    el("span", { class: "gap" }),
    story.plan ? button(icon("download"), "Download plan.json", () => download(file), "button quiet") : null,
    scheme,
    button("?", "Keys and help", help, "button quiet question"),
  );
}

function start(): void {
  const app = document.getElementById("app") ?? document.body.appendChild(el("div", { id: "app" }));
  const theme = new Theme();
  let story: Story;
  let file: unknown;
  try {
    ({ story, file } = readStory());
  } catch (error) {
    app.replaceChildren(el("main", { class: "message", role: "alert" }, el("h1", {}, "Nothing to show"), el("p", {}, (error as Error).message)));
    return;
  }
  document.title = story.title ? `${story.title} \u2013 regrasp` : "regrasp";
  const motion = new Motion(story.plan ?? still(story));
  const player = new Player(motion.start, motion.end);

  let keep = () => {};
  const stage = stageOf(story, motion, theme, () => keep());
  const outliner = new Outliner(story, motion, player, stage);
  const viewport = new Viewport(story, motion, player, stage, (key) => outliner.choose(key));
  const help = helpPanel();
  const moves = story.plan !== null && motion.end > motion.start;
  const transport = moves ? new Transport(motion, player, theme) : null;
  const charts = moves ? new ChartStack(story, motion, player, theme) : null;
  const path = motion.isTracking && story.plan ? new OrientationPath(story.plan, motion, player, theme) : null;
  const ball = new Ball(story, motion, player, theme);

  app.replaceChildren(
    header(story, file, theme, help.open),
    el(
      "main",
      {},
      el("div", { class: "left" }, viewport.element, transport?.element),
      el(
        "div",
        { class: "right" },
        panels.violations(story),
        panels.failure(story),
        panels.figures(story, motion, (time) => {
          player.setPlaying(false);
          player.seek(time);
        }),
        charts ? el("section", { class: "card", "aria-label": "Charts over time" }, charts.element) : null,
        panels.components(story),
        path?.element,
        ball.element,
        outliner.element,
        panels.facts(story),
      ),
    ),
    help.element,
  );

  if (stage) {
    const fit = () => stage.resize(viewport.element.clientWidth, viewport.element.clientHeight);
    fit();
    new ResizeObserver(fit).observe(viewport.element);
    player.onTime((time) => stage.setTime(time));
  }
  charts?.draw();
  path?.draw();
  ball.draw();

  const follow = () => {
    const { time, camera } = readLink(location.hash);
    if (camera) stage?.place(camera);
    if (time !== null) player.seek(time);
  };
  follow();
  addEventListener("hashchange", follow);
  keep = keepLink(player, () => stage?.cameraPlace() ?? null);
  player.onTime(() => keep());
  player.onState(() => keep());

  listenToKeys(player, motion, {
    frame: () => stage?.frame(),
    orbit: (azimuth, elevation, closer) => stage?.orbit(azimuth, elevation, closer),
    toggle: (layer) => viewport.toggle(layer),
    theme: () => theme.toggle(),
  }, help.open);

  let before = performance.now();
  const tick = (now: number): void => {
    // After a pause of the browser's own (another tab), the plan goes on where it was.
    player.advance(Math.min((now - before) / 1000, 0.25));
    before = now;
    stage?.draw(now);
    requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
}

start();
