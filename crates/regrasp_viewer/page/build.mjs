// Builds src/ into dist/viewer.* (plans of hands) and dist/robot.* (plans of robots), each with .js and .css. The same sources and package-lock.json give the same bytes.
// `--check` builds in memory and fails where dist/ differs.

import { build } from "esbuild";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const LARGEST = 3 * 1024 * 1024;

const licence = readFileSync(join(here, "node_modules/three/LICENSE"), "utf8").replaceAll("\u00a9", "(c)").trim();
const banner = `/*!\nThis page contains three.js (https://threejs.org):\n\n${licence}\n*/`;

const result = await build({
  absWorkingDir: here,
  entryPoints: { viewer: "src/main.ts", robot: "src/robot/main.ts" },
  outdir: "dist",
  bundle: true,
  write: false,
  minify: true,
  format: "iife",
  target: ["es2020"],
  charset: "ascii",
  treeShaking: true,
  legalComments: "none",
  banner: { js: banner },
  logLevel: "warning",
});

let total = 0;
let failed = false;
for (const file of result.outputFiles) {
  const name = `dist/${file.path.split(/[\\/]/).pop()}`;
  // Both stand inline in HTML: nothing in them may end or comment out their element.
  if (/<\/(script|style)|<!--/i.test(file.text)) throw new Error(`${name} holds text that HTML reads as markup`);
  total += file.contents.length;
  if (process.argv.includes("--check")) {
    const committed = readFileSync(join(here, name), "utf8");
    const same = committed === file.text;
    console.log(`${name}: ${file.contents.length} bytes, ${same ? "as committed" : "DIFFERS from what is committed: run `npm run build`"}`);
    failed ||= !same;
  } else {
    mkdirSync(join(here, "dist"), { recursive: true });
    writeFileSync(join(here, name), file.contents);
    console.log(`${name}: ${file.contents.length} bytes`);
  }
}
if (total > LARGEST) throw new Error(`dist/ has ${total} bytes, more than ${LARGEST}`);
process.exit(failed ? 1 : 0);
