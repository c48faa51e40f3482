// The page of a robot: poses between frames, the clock, charts that follow it.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { escaped } from "../tools/wrap.mjs";
import { hasChromium, launch, load, shownTime, write } from "./support.mjs";

const dist = join(dirname(fileURLToPath(import.meta.url)), "../dist");
const packed = (values) => Buffer.from(new Float32Array(values).buffer).toString("base64");
const still = { position: [0, 0, 0], quat_xyzw: [0, 0, 0, 1] };

/** A link that slides and turns for two seconds, with an object that rests for the first of them. */
function replay() {
  const half = Math.SQRT1_2;
  const frames = [[0, 0, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, half, half], [1, 2, 0, 0, 0, half, half]];
  const corner = Buffer.from(new Uint16Array([0, 0, 0, 65535, 0, 0, 0, 65535, 0, 0, 0, 65535]).buffer).toString("base64");
  const faces = Buffer.from(new Uint16Array([0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]).buffer).toString("base64");
  const mesh = { vertices: corner, lower: [0, 0, 0], upper: [0.2, 0.2, 0.2], triangles: faces, smooth_below: 0 };
  const pieces = [{ mesh: 0, from_mesh: still }];
  return {
    format: "regrasp-robot-replay",
    version: 1,
    up: [0, 0, 1],
    times: [0, 1, 2],
    poses: packed(frames.flat()),
    n_columns: 1,
    meshes: [mesh],
    bodies: [
      { name: "link", kind: "link", pieces, column: 0, pose: still },
      { name: "table", kind: "support", pieces, column: null, pose: still },
    ],
    segments: [
      { kind: "transit", start: 0, end: 1, held_by: ["table"] },
      { kind: "carry", start: 1, end: 2, held_by: ["right"] },
    ],
    holders: [{ name: "right", color: "#0072b2" }, { name: "table", color: "#9a8f80" }],
    axis: { times: [0, 2], edges: [0.25, 0.75] },
  };
}

function page(story) {
  const [script, style] = ["robot.js", "robot.css"].map((name) => readFileSync(join(dist, name), "utf8"));
  return `<!doctype html><html><head><meta charset="utf-8"><style>${style}</style></head><body><main><div class="left" id="replay"></div>
<div class="right"><figure class="card timed"><svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 400 50" width="400" height="50"></svg></figure></div></main>
<script type="application/json" id="story">${escaped(JSON.stringify(story))}</script><script>${script}</script></body></html>`;
}

test("poses between frames go straight and turn by the shortest way", async () => {
  const { Poses } = await load("robot/poses");
  const poses = new Poses(replay());
  const [middle] = poses.at(0.5);
  assert.deepEqual(middle.position, [0.5, 0, 0]);
  assert.ok(Math.abs(middle.quat[2] - Math.sin(Math.PI / 8)) < 1e-6);
  assert.deepEqual(poses.at(9)[0].position, [1, 2, 0]);
  assert.throws(() => new Poses({ ...replay(), n_columns: 2 }), /cut off/);
});

test("keys, charts and caption follow the plan", { skip: !hasChromium && "no Chromium" }, async () => {
  const browser = await launch();
  try {
    const context = await browser.newContext({ viewport: { width: 1200, height: 700 } });
    const shown = await context.newPage();
    const [complaints, requests] = [[], []];
    shown.on("pageerror", (error) => complaints.push(String(error)));
    shown.on("request", (request) => requests.push(request.url()));
    const file = write(page(replay()));
    await shown.goto(`file://${file}`);
    await shown.waitForSelector("#replay canvas");
    assert.equal(await shown.locator(".caption").textContent(), "Transit: held by table");
    await shown.keyboard.press("]");
    assert.equal(await shownTime(shown), 1);
    assert.equal(await shown.locator(".caption").textContent(), "Carry: held by right");
    const picture = await shown.locator(".timed svg").boundingBox();
    const line = await shown.locator(".timed .cursor").boundingBox();
    assert.ok(Math.abs(line.x - picture.x - picture.width / 2) < 2, "the line is in the middle");
    await shown.locator(".timed svg").click({ position: { x: picture.width * 0.625, y: 10 } });
    assert.ok(Math.abs((await shownTime(shown)) - 1.5) < 0.02);
    await shown.keyboard.press(" ");
    await shown.waitForTimeout(1200);
    assert.equal(await shownTime(shown), 2);
    assert.deepEqual(complaints, []);
    assert.deepEqual(requests, [`file://${file}`]);
    const broken = write(page({ ...replay(), version: 7 }));
    await shown.goto(`file://${broken}`);
    assert.match(await shown.locator("#replay [role=alert]").textContent(), /another version/);
  } finally {
    await browser.close();
  }
});
