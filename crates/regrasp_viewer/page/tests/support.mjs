// What the tests of the page share: a browser, a page of a story, and pictures as pixels.

import { build } from "esbuild";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { inflateSync } from "node:zlib";
import { chromium } from "playwright-core";
import { CHROMIUM, FLAGS, hasChromium } from "../tools/browser.mjs";
import { wrap } from "../tools/wrap.mjs";

export { hasChromium };
const root = join(dirname(fileURLToPath(import.meta.url)), "..");
const scratch = mkdtempSync(join(tmpdir(), "regrasp-page-"));
process.on("exit", () => rmSync(scratch, { recursive: true, force: true }));
let made = 0;

/** A module of src/, as the tests' own. */
export async function load(name) {
  const outfile = join(scratch, `${name}-${made++}.mjs`);
  await build({ absWorkingDir: root, entryPoints: [`src/${name}.ts`], bundle: true, format: "esm", outfile, logLevel: "error" });
  return import(outfile);
}

export function write(text) {
  const file = join(scratch, `page-${made++}.html`);
  writeFileSync(file, text);
  return file;
}

export const launch = (...more) => chromium.launch({ executablePath: CHROMIUM, args: [...FLAGS, ...more] });

/** Opens a story's page from disk and keeps what it complains about and what it asks the network for. */
export async function open(browser, story, { width = 1280, height = 800, hash = "", scheme = "light", html = null } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, colorScheme: scheme, acceptDownloads: true });
  const page = await context.newPage();
  const complaints = [];
  const requests = [];
  page.on("console", (message) => {
    if (message.type() === "error") complaints.push(message.text());
  });
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("request", (request) => requests.push(request.url()));
  const file = write(html ?? wrap(story));
  await page.goto(`file://${file}${hash}`);
  await page.waitForSelector("#app > *");
  return { page, complaints, requests, file, close: () => context.close() };
}

/** Time shown, seconds. */
export const shownTime = async (page) => Number(await page.locator(".scrubber").inputValue());

/** Pixels of a PNG as Chromium writes it: 8 bits per channel, three or four channels, not interlaced. */
export function pixels(png) {
  const width = png.readUInt32BE(16);
  const height = png.readUInt32BE(20);
  const channels = { 2: 3, 6: 4 }[png[25]];
  if (png[24] !== 8 || !channels || png[28] !== 0) throw new Error("not a PNG of the expected kind");
  const data = [];
  for (let at = 8; at < png.length;) {
    const length = png.readUInt32BE(at);
    if (png.toString("latin1", at + 4, at + 8) === "IDAT") data.push(png.subarray(at + 8, at + 8 + length));
    at += 12 + length;
  }
  const raw = inflateSync(Buffer.concat(data));
  const row = width * channels;
  const found = Buffer.alloc(row * height);
  for (let y = 0; y < height; y++) {
    const filter = raw[y * (row + 1)];
    for (let i = 0; i < row; i++) {
      const left = i >= channels ? found[y * row + i - channels] : 0;
      const above = y > 0 ? found[(y - 1) * row + i] : 0;
      const corner = y > 0 && i >= channels ? found[(y - 1) * row + i - channels] : 0;
      const estimate = left + above - corner;
      const [a, b, c] = [left, above, corner].map((x) => Math.abs(estimate - x));
      const paeth = a <= b && a <= c ? left : b <= c ? above : corner;
      found[y * row + i] = raw[y * (row + 1) + 1 + i] + [0, left, above, (left + above) >> 1, paeth][filter];
    }
  }
  return { width, height, channels, data: found };
}

/** Number of different colours, and the share of the commonest one. */
export function colours(image) {
  const counts = new Map();
  for (let i = 0; i < image.data.length; i += image.channels) {
    const key = (image.data[i] << 16) | (image.data[i + 1] << 8) | image.data[i + 2];
    counts.set(key, (counts.get(key) ?? 0) + 1);
  }
  return { different: counts.size, commonest: Math.max(...counts.values()) / (image.width * image.height) };
}

/** Share of pixels that differ by more than a shade. */
export function difference(a, b) {
  let found = 0;
  for (let i = 0; i < a.data.length; i += a.channels) {
    if ([0, 1, 2].some((k) => Math.abs(a.data[i + k] - b.data[i + k]) > 12)) found++;
  }
  return found / (a.width * a.height);
}
