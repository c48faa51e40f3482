// Frames per second of a page that plays: node tools/frames.mjs page.html [seconds [width height]]
// Width and height are those of the 3-D view's canvas. Prints the whole and the slowest window of one second.

import { chromium } from "playwright-core";
import { resolve } from "node:path";
import { CHROMIUM, FLAGS } from "./browser.mjs";

const [file, seconds = "12", width = "800", height = "600"] = process.argv.slice(2);
const browser = await chromium.launch({ executablePath: CHROMIUM, args: FLAGS });
const page = await browser.newPage({ viewport: { width: 1500, height: 772 } });
await page.goto(`file://${resolve(file)}`);
// The view is made exactly as large as asked for; the rest of the page stays as it is.
await page.evaluate(([w, h]) => {
  const view = document.querySelector(".viewport");
  view.style.flex = "none";
  view.style.width = `${w}px`;
  view.style.height = `${h}px`;
}, [Number(width), Number(height)]);
await page.waitForTimeout(1500);
await page.getByRole("button", { name: "Play", exact: true }).click();
const found = await page.evaluate((milliseconds) => new Promise((done) => {
  const canvas = document.querySelector(".viewport > canvas");
  const frames = [];
  const sizes = new Set();
  const begin = performance.now();
  const next = (now) => {
    frames.push(now);
    sizes.add(`${canvas.width} x ${canvas.height}`);
    if (now - begin < milliseconds) requestAnimationFrame(next);
    else done({ frames, sizes: [...sizes] });
  };
  requestAnimationFrame(next);
}), 1000 * Number(seconds));
const { frames } = found;
let slowest = Infinity;
for (let i = 0; i < frames.length; i++) {
  let end = i;
  while (end < frames.length && frames[end] < frames[i] + 1000) end++;
  if (end < frames.length) slowest = Math.min(slowest, end - i);
}
const intervals = frames.slice(1).map((t, i) => t - frames[i]);
console.log(JSON.stringify({
  frames_per_second: Number(((1000 * (frames.length - 1)) / (frames.at(-1) - frames[0])).toFixed(1)), slowest_second: slowest,
  longest_frame_ms: Number(Math.max(...intervals).toFixed(1)), drawn_at: found.sizes, seconds: Number(seconds),
}));
await browser.close();
