// A page from a story, as the Rust side makes it: for tests and for work on the page.
//   node tools/wrap.mjs story.json page.html

import { createHash } from "node:crypto";
import { readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const page = join(dirname(fileURLToPath(import.meta.url)), "..");
const hash = (text) => `'sha256-${createHash("sha256").update(text, "utf8").digest("base64")}'`;

/** JSON that is nothing but text to HTML. */
export const escaped = (json) =>
  json.replace(/[<>&\u2028\u2029]/g, (c) => `\\u${c.charCodeAt(0).toString(16).padStart(4, "0")}`);

export function wrap(story) {
  const script = readFileSync(join(page, "dist/viewer.js"), "utf8");
  const style = readFileSync(join(page, "dist/viewer.css"), "utf8");
  const policy = `default-src 'none'; script-src ${hash(script)}; style-src ${hash(style)}; img-src data: blob:; base-uri 'none'; form-action 'none'`;
  const json = typeof story === "string" ? story : JSON.stringify(story);
  return `<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="${policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>regrasp</title>
<style>${style}</style>
</head>
<body>
<div id="app"></div>
<script type="application/json" id="story">${escaped(json)}</script>
<script>${script}</script>
</body>
</html>
`;
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const [from, to] = process.argv.slice(2);
  writeFileSync(to, wrap(readFileSync(from, "utf8")));
}
