// The page in a real browser, opened from disk.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { after, before, test } from "node:test";
import { wrap } from "../tools/wrap.mjs";
import { colours, difference, hasChromium, launch, open, pixels, shownTime } from "./support.mjs";
import { synthetic, tracking, withOthers } from "./synthetic.mjs";

const options = { skip: hasChromium ? false : "SKIPPED: no Chromium", timeout: 120_000 };
if (!hasChromium) console.log("SKIPPED: no Chromium: tests of the page in a browser");

const ball = synthetic({ triangles: 3000 });
let browser;
before(async () => {
  if (hasChromium) browser = await launch();
});
after(() => browser?.close());

/** Asserts what holds of every page: nothing asked of the network, nothing complained about. */
async function finish({ page, complaints, requests, file, close }) {
  const own = `file://${file}`;
  assert.deepEqual(requests.filter((url) => url.split("#")[0] !== own), []);
  assert.deepEqual(complaints, []);
  assert.equal(await page.evaluate(() => window.__ran), undefined);
  await close();
}

const canvas = (page) => page.locator(".viewport > canvas");
const picture = async (page) => pixels(await canvas(page).screenshot());

test("opens from disk with hand, object and charts", options, async () => {
  const opened = await open(browser, ball);
  const { page } = opened;
  await page.waitForTimeout(400);
  const { different, commonest } = colours(await picture(page));
  assert.ok(different > 500 && commonest < 0.9, `${different} colours, ${commonest} of one`);
  assert.equal(await page.locator(".verdict").textContent(), "Accepted by the checker for motion");
  const charts = page.locator(".chart canvas[role=img]");
  assert.equal(await charts.count(), 5);
  for (let i = 0; i < 5; i++) {
    await charts.nth(i).scrollIntoViewIfNeeded();
    assert.ok(colours(pixels(await charts.nth(i).screenshot())).different > 10, `chart ${i} is blank`);
  }
  assert.match(await charts.first().getAttribute("aria-label"), /4 fingers, 8 relocations/);
  await page.locator(".ball").scrollIntoViewIfNeeded();
  assert.ok(colours(pixels(await page.locator(".ball-plot").screenshot())).different > 10);
  await finish(opened);
});

test("a plan that the planner made is shown without its shapes too", options, async () => {
  const story = JSON.parse(readFileSync(new URL("stories/sphere_180z.json", import.meta.url), "utf8"));
  const opened = await open(browser, story);
  assert.equal(await opened.page.locator(".figures dd").first().innerText(), "2");
  assert.equal(await opened.page.locator(".facts tr").count(), story.facts.length);
  await finish(opened);
});

test("all bodies have names, links and joints, and can be hidden", options, async () => {
  const opened = await open(browser, withOthers(ball));
  const { page } = opened;
  await page.waitForTimeout(400);
  const entries = page.locator(".outliner li");
  const names = (await entries.locator(".head .name").allTextContents());
  assert.deepEqual(names, ["hand", "ball", "left", "other object", "robot/arm", "table"]);
  const kinds = await entries.locator(".head .kind").allTextContents();
  assert.deepEqual(kinds, ["hand, moves", "object, moves", "hand, at rest", "object, at rest", "robot, at rest", "support"]);

  // An arm's joint rests where the story says; those of the hand that moves follow the time.
  await entries.nth(4).locator("summary").click();
  assert.equal(await entries.nth(4).locator("table tr").textContent(), "elbow_joint29\u00b0");
  assert.match(await entries.nth(4).locator("p").textContent(), /^Links elbow$/);
  await entries.nth(0).locator("summary").click();
  const positions = () => entries.nth(0).locator("td").allTextContents();
  const before = await positions();
  assert.equal(before.length, ball.scene.hands[0].joints.length);
  await page.keyboard.press("End");
  assert.notDeepEqual(await positions(), before);

  // Hiding what moves changes the picture, showing it again brings it back. The mouse stays where no body is pointed out.
  const away = () => page.mouse.move(2, 2);
  const settled = async () => {
    await away();
    await page.waitForTimeout(700);
    return picture(page);
  };
  const shown = await settled();
  await entries.nth(0).locator("input").uncheck();
  const without = await settled();
  assert.ok(difference(shown, without) > 0.02, `${difference(shown, without)}`);
  await entries.nth(0).locator("input").check();
  assert.ok(difference(shown, await settled()) < 0.002);

  // A body that is clicked at in the view is found in the list.
  const { x, y, width, height } = await canvas(page).boundingBox();
  let chosen = 0;
  for (const share of [0.5, 0.45, 0.55, 0.4, 0.6]) {
    await page.mouse.click(x + width * 0.5, y + height * share);
    chosen = await page.locator(".outliner li.chosen").count();
    if (chosen) break;
  }
  assert.equal(chosen, 1);
  await finish(opened);
});

test("tracking is told with its own words, marks and path", options, async () => {
  const story = tracking(ball);
  const opened = await open(browser, story, { hash: "#t=0.5" });
  const { page } = opened;
  assert.equal(await page.locator(".figures dt").first().innerText(), "Sub-goals on the path");
  assert.equal(await page.locator(".figures dd").first().innerText(), "40");
  const [first, second] = story.plan.segments;
  assert.equal(await page.locator(".caption").textContent(),
    `${first.moving_finger} moves (dark rim), the object rolls on ${first.rolling_finger} (grey rim)`);
  const states = await page.locator(".legend .state").allTextContents();
  assert.deepEqual(states, ["rolls, moving finger", "rolls, object on it", "slides", "slides"]);
  assert.match(await page.locator("#chart-gait").innerText(), /slides[^]*moving finger[^]*object rolls on it/);
  assert.doesNotMatch(await page.locator("body").innerText(), /transfer|relocat/i);
  assert.equal(await page.locator("#chart-margin").count(), 0, "no margin was judged");
  // The fingertips' rims change with who moves.
  const before = await picture(page);
  await page.getByRole("button", { name: "Next change of the moving finger" }).click();
  assert.ok(Math.abs((await shownTime(page)) - second.waypoints[0].time) < 1e-6);
  assert.match(await page.locator(".caption").textContent(), new RegExp(`^${second.moving_finger} moves`));
  await page.waitForTimeout(400);
  assert.ok(difference(before, await picture(page)) > 0.001);
  const path = page.locator(".orientation-path");
  await path.scrollIntoViewIfNeeded();
  assert.ok(colours(pixels(await path.locator(".ball-plot").screenshot())).different > 20);
  const told = await path.locator(".readout").textContent();
  const [, turned, all] = told.match(/turned ([0-9.]+)\u00b0 of ([0-9.]+)\u00b0 along the path/).map(Number);
  assert.ok(turned > 1 && turned < all, told);
  const still = pixels(await path.locator(".ball-plot").screenshot());
  await path.locator("canvas[role=img]").focus();
  await page.keyboard.press("ArrowLeft");
  assert.ok(difference(still, pixels(await path.locator(".ball-plot").screenshot())) > 0.01, "it can be turned");
  await finish(opened);
});

test("playing moves time and hand, pausing stops both", options, async () => {
  const opened = await open(browser, ball, { hash: "#t=6.2" });
  const { page } = opened;
  await page.waitForTimeout(500);
  const first = await picture(page);
  await page.getByRole("button", { name: "Play", exact: true }).click();
  await page.waitForFunction(() => Number(document.querySelector(".scrubber").value) > 7.5);
  await page.getByRole("button", { name: "Pause", exact: true }).click();
  const paused = await shownTime(page);
  await page.waitForTimeout(500);
  assert.equal(await shownTime(page), paused);
  assert.ok(difference(first, await picture(page)) > 0.01);
  await finish(opened);
});

test("hovering a chart looks at a time, leaving goes back, clicking keeps it", options, async () => {
  const opened = await open(browser, ball, { hash: "#t=1" });
  const { page } = opened;
  await page.waitForTimeout(500);
  const first = await picture(page);
  for (const id of ["gait", "margin", "clearance", "joints", "force"]) {
    const plot = page.locator(`#chart-${id} .plot`);
    await plot.scrollIntoViewIfNeeded();
    const box = await plot.boundingBox();
    await page.mouse.move(box.x + box.width * 0.6, box.y + box.height / 2);
    const looked = await shownTime(page);
    assert.ok(looked > 4 && looked < 8, `${id}: ${looked}`);
    if (id === "gait") {
      await page.waitForTimeout(500);
      assert.ok(difference(first, await picture(page)) > 0.01, "the hand did not move");
    }
    await page.mouse.move(2, 2);
    assert.equal(await shownTime(page), 1, id);
  }
  await page.locator("#chart-margin .plot").scrollIntoViewIfNeeded();
  const box = await page.locator("#chart-margin .plot").boundingBox();
  await page.mouse.click(box.x + box.width * 0.8, box.y + box.height / 2);
  await page.mouse.move(2, 2);
  const kept = await shownTime(page);
  assert.ok(kept > 8 && kept < 11, `${kept}`);
  await finish(opened);
});

test("keys do what the help says", options, async () => {
  const opened = await open(browser, ball);
  const { page } = opened;
  const end = Math.max(...ball.plan.segments.map((s) => s.waypoints.at(-1).time));
  const relocations = ball.plan.segments.filter((s) => s.kind === "regrasp").map((s) => s.waypoints[0].time);
  const press = async (key, expected) => {
    await page.keyboard.press(key);
    assert.ok(Math.abs((await shownTime(page)) - expected) < 1e-6, `${key}: ${await shownTime(page)}, not ${expected}`);
  };
  await press("ArrowRight", 0.1);
  await press("Shift+ArrowRight", 1.1);
  await press("ArrowLeft", 1.0);
  await press("]", relocations[0]);
  await press("]", relocations[1]);
  await press("[", relocations[0]);
  await press("End", end);
  await press("[", relocations.at(-1));
  await press("Home", 0);
  await press(".", ball.plan.segments[0].waypoints[1].time);
  await press(",", 0);
  await page.keyboard.press("<");
  assert.equal(await page.locator(".speed").inputValue(), "0.5");
  await page.keyboard.press("Space");
  await page.waitForFunction(() => Number(document.querySelector(".scrubber").value) > 0.2);
  await page.keyboard.press("Space");
  await page.getByRole("button", { name: "Pause", exact: true }).waitFor({ state: "detached" });
  await page.keyboard.press("?");
  assert.ok(await page.locator("dialog").isVisible());
  await page.keyboard.press("Escape");
  assert.ok(!(await page.locator("dialog").isVisible()));
  await page.keyboard.press("t");
  assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), "dark");
  // A button reached with the tabulator key is pressed by space, and does not play.
  await page.getByRole("button", { name: "Next relocation" }).focus();
  await page.keyboard.press("Tab");
  await page.keyboard.press("Shift+Tab");
  await press("Home", 0);
  await press("Space", relocations[0]);
  await finish(opened);
});

test("the address keeps time and camera", options, async () => {
  const opened = await open(browser, ball, { hash: "#t=3.2&cam=20,40,0.5,0.01,0,0.06" });
  const { page } = opened;
  assert.equal(await shownTime(page), 3.2);
  await page.keyboard.press("ArrowRight");
  await page.waitForFunction(() => location.hash.startsWith("#t=3.3"));
  assert.equal(await page.evaluate(() => location.hash), "#t=3.3&cam=20,40,0.5,0.01,0,0.06");
  const box = await canvas(page).boundingBox();
  await page.mouse.move(box.x + 200, box.y + 200);
  await page.mouse.down();
  await page.mouse.move(box.x + 300, box.y + 220, { steps: 4 });
  await page.mouse.up();
  await page.waitForFunction(() => !location.hash.includes("cam=20,40"));
  const turned = await page.evaluate(() => location.hash);
  await page.keyboard.press("l");
  await page.keyboard.press("+");
  await page.waitForFunction((before) => location.hash !== before, turned);
  await page.evaluate(() => { location.hash = "#t=1.5"; });
  await page.waitForFunction(() => document.querySelector(".clock").textContent.startsWith("1.50"));
  await finish(opened);
});

test("the worst moments are a click away, and parts have names", options, async () => {
  const opened = await open(browser, ball);
  const { page } = opened;
  const times = ball.plan.segments.flatMap((segment) => segment.waypoints.map((w) => w.time));
  for (const [i, values] of [[0, ball.judged.margin], [1, ball.judged.clearance]]) {
    await page.locator(".figures .at").nth(i).click();
    assert.equal(await shownTime(page), times[values.indexOf(Math.min(...values))]);
  }
  const box = await canvas(page).boundingBox();
  const seen = new Set();
  for (let k = 1; k < 12; k++) {
    await page.mouse.move(box.x + (box.width * k) / 12, box.y + box.height * 0.35);
    await page.waitForTimeout(60);
    if (await page.locator(".hint").isVisible()) seen.add(await page.locator(".hint").textContent());
  }
  assert.ok(seen.has("ball") && seen.size > 1, [...seen].join());
  await finish(opened);
});

test("stands in a sandboxed frame of another page", options, async () => {
  const context = await browser.newContext();
  const page = await context.newPage();
  const complaints = [];
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("console", (message) => message.type() === "error" && complaints.push(message.text()));
  await page.setContent('<iframe sandbox="allow-scripts" width="1000" height="700"></iframe>');
  await page.locator("iframe").evaluate((frame, html) => { frame.srcdoc = html; }, wrap(ball));
  const frame = page.frameLocator("iframe");
  await frame.locator(".play").click();
  await frame.locator(".clock", { hasText: /^[1-9]/ }).waitFor();
  await frame.locator(".play").click();
  await page.waitForTimeout(700);
  assert.deepEqual(complaints, []);
  await context.close();
});

test("what is shown can be chosen", options, async () => {
  const opened = await open(browser, synthetic({ shape: "box", triangles: 2000, obstacle: true }));
  const { page } = opened;
  await page.waitForTimeout(500);
  const whole = await picture(page);
  await page.getByRole("button", { name: "What is shown" }).click();
  for (const name of ["Friction cones", "Contacts and normals", "See through the hand", "Obstacles"]) {
    await page.getByLabel(name).click();
    await page.waitForTimeout(500);
    // The panel covers the same part of both pictures from the second on.
    assert.ok(difference(whole, await picture(page)) > 0.0005, name);
  }
  assert.equal(await page.getByLabel("Visual shapes").count(), 0);
  await finish(opened);
});

test("the plan can be taken out of the page", options, async () => {
  const opened = await open(browser, ball);
  const [download] = await Promise.all([
    opened.page.waitForEvent("download"),
    opened.page.getByRole("button", { name: "Download plan.json" }).click(),
  ]);
  assert.equal(download.suggestedFilename(), "plan.json");
  assert.deepEqual(JSON.parse(readFileSync(await download.path(), "utf8")), ball.plan);
  assert.deepEqual(opened.requests.filter((url) => !/^(file|blob):/.test(url)), []);
  assert.deepEqual(opened.complaints, []);
  await opened.close();
});

test("the content security policy stops other scripts", options, async () => {
  const { page, close } = await open(browser, ball);
  const failed = [];
  const answered = [];
  page.on("requestfailed", (request) => failed.push(request.failure().errorText));
  page.on("response", (response) => answered.push(response.url()));
  await page.evaluate(() => {
    const script = document.createElement("script");
    script.textContent = "window.__ran = 1";
    document.body.append(script);
    const holder = document.createElement("div");
    holder.innerHTML = '<img src="x" onerror="window.__ran = 2"><p id="styled" style="color: rgb(1, 2, 3)">x</p>';
    document.body.append(holder);
    fetch("https://example.invalid/").catch(() => {});
    new Image().src = "https://example.invalid/picture.png";
  });
  await page.waitForTimeout(500);
  assert.equal(await page.evaluate(() => window.__ran), undefined);
  assert.notEqual(await page.evaluate(() => getComputedStyle(document.getElementById("styled")).color), "rgb(1, 2, 3)");
  assert.deepEqual(answered, []);
  assert.ok(failed.length > 0 && failed.every((why) => why === "csp"), `${failed}`);
  // Later, on the page's own account: what a debugger evaluates may make functions of text.
  const blocked = await page.evaluate(() => new Promise((done) => setTimeout(() => {
    try {
      done(new Function("return 1")());
    } catch (error) {
      done(error.name);
    }
  }, 0)));
  assert.equal(blocked, "EvalError");
  await close();
  // The same page without its policy does run them: the test can see.
  const open2 = await open(browser, null, { html: wrap(ball).replace(/<meta http-equiv[^>]*>/, "") });
  await open2.page.evaluate(() => {
    const script = document.createElement("script");
    script.textContent = "window.__ran = 1";
    document.body.append(script);
  });
  assert.equal(await open2.page.evaluate(() => window.__ran), 1);
  await open2.close();
});

/** Names that a page without care would run or break on; every one is different. */
function hostile(count) {
  const kinds = [
    (n) => `<img src=x onerror="window.__ran=${n}">`, (n) => `</script><script>window.__ran=${n}</script>`, (n) => `<svg onload=window.__ran=${n}>`,
    (n) => `"><iframe srcdoc="<script>parent.__ran=${n}</script>">`, (n) => `javascript:window.__ran=${n}`, (n) => `</style><b>${n}`,
    (n) => `'"\`\${window.__ran=${n}}{{${n}}}`, (n) => `\u202e${n}\u2066<i>\u0000`, (n) => `<!--<script>${n}`, (n) => `&lt;b&gt;&amp;${n}`,
    (n) => `${n}${"W".repeat(3000)}`, (n) => `${n}\u2028\u2029\n\r\t\\u003c`, (n) => `__proto__${n}`, (n) => `]]>${n}<![CDATA[`, (n) => `\ud83e\udd16\ufffd\uffff${n}`,
  ];
  return kinds[count % kinds.length](count);
}

test("300 names with markup run nothing and break nothing", options, async () => {
  const names = new Set();
  for (let round = 0; names.size < 300 || round < 4; round++) {
    const given = new Map();
    const nameOf = (name) => {
      if (!given.has(name)) given.set(name, hostile(names.size));
      names.add(given.get(name));
      return given.get(name);
    };
    const fails = round === 2;
    const story = synthetic({ fingers: 8, duration: 2, triangles: 1500, obstacle: true, roadmap: fails, fails, nameOf });
    if (story.judged) Object.assign(story.judged, { accepted: false, violations: [nameOf("violation one"), nameOf("violation two")] });
    for (let k = 0; k < 40; k++) story.facts.push([nameOf(`fact ${k}`), nameOf(`value ${k}`)]);
    const opened = await open(browser, story, { width: round % 2 ? 390 : 1280 });
    const { page } = opened;
    await page.waitForTimeout(300);
    assert.equal(await page.evaluate(() => document.querySelectorAll("script, style").length), 3);
    const strange = await page.evaluate(() => [...document.querySelectorAll("#app *")].map((e) => e.localName)
      .filter((name) => ["img", "iframe", "script", "style", "i", "b", "object", "link"].includes(name)));
    assert.deepEqual(strange, []);
    const handlers = await page.evaluate(() => [...document.querySelectorAll("*")].flatMap((e) => [...e.attributes]).filter((a) => a.name.startsWith("on")).length);
    assert.equal(handlers, 0);
    // Names stand in the page as they are (a script that reads them back sees the same characters).
    assert.equal(await page.locator("h1").evaluate((e) => e.textContent), story.title);
    const cells = await page.locator(".facts td").evaluateAll((all) => all.map((e) => e.textContent));
    assert.deepEqual(cells, story.facts.map(([, value]) => value));
    if (!fails) {
      assert.deepEqual(await page.locator(".wrong li").evaluateAll((all) => all.map((e) => e.textContent)), story.judged.violations);
      assert.equal(await page.locator(".legend li").count(), 8);
    }
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "wider than the window");
    await finish(opened);
  }
  assert.ok(names.size >= 300);
});

test("fits phones and desktops, light and dark", options, async () => {
  const brightness = [];
  for (const [width, height, scheme] of [[360, 740, "light"], [390, 844, "dark"], [768, 1024, "light"], [1280, 800, "dark"]]) {
    const opened = await open(browser, ball, { width, height, scheme });
    const { page } = opened;
    await page.waitForTimeout(300);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), `${width}: wider than the window`);
    const view = await canvas(page).boundingBox();
    assert.ok(view.width > 0.5 * width && view.height > 150, JSON.stringify(view));
    // Every control can be seen without scrolling, none under another.
    for (const button of await page.locator(".transport button, .top button").all()) {
      const box = await button.boundingBox();
      assert.ok(box.x >= 0 && box.x + box.width <= width && box.y + box.height <= height, JSON.stringify(box));
      assert.ok(await button.evaluate((e) => {
        const { x, y, width: w, height: h } = e.getBoundingClientRect();
        return e.contains(document.elementFromPoint(x + w / 2, y + h / 2));
      }));
    }
    const { data } = pixels(await page.screenshot());
    brightness.push(data.reduce((sum, x) => sum + x, 0) / data.length);
    await finish(opened);
  }
  assert.ok(brightness[0] > 180 && brightness[2] > 180 && brightness[1] < 90 && brightness[3] < 90, `${brightness}`);
});

test("a page without a plan says why", options, async () => {
  const story = synthetic({ fails: true, roadmap: true, triangles: 2000 });
  const opened = await open(browser, story);
  const { page } = opened;
  await page.waitForTimeout(400);
  assert.equal(await page.locator(".verdict").innerText(), "No plan found");
  assert.equal(await page.locator(".causes li").count(), story.failure.causes.length);
  const widths = await page.locator(".causes .bar").evaluateAll((bars) => bars.map((b) => b.getBoundingClientRect().width));
  story.failure.causes.forEach((cause, i) => assert.ok(Math.abs(widths[i] / widths[0] - cause.share / story.failure.causes[0].share) < 0.02));
  const text = await page.locator(".failure").textContent();
  for (const part of [story.failure.message, story.failure.advice, "60.7\u00b0", "52 %"]) assert.ok(text.includes(part), part);
  assert.equal(await page.locator(".transport, .chart").count(), 0);
  assert.ok(colours(await picture(page)).different > 500);
  assert.match(await page.locator(".ball .key").innerText(), /isolated node/);
  await finish(opened);

  const bare = await open(browser, { ...story, roadmap: null, asked: [], failure: { ...story.failure, nearest_miss: null, causes: [] } });
  assert.equal(await bare.page.locator(".verdict").innerText(), "No plan found");
  await finish(bare);
});

test("a rejected plan says so first", options, async () => {
  const story = { ...ball, judged: { ...ball.judged, accepted: false, violations: ["finger \"index\" slips 0.4 mm at 3.1 s"], margin: ball.judged.margin.map(() => null) } };
  const opened = await open(browser, story);
  assert.equal(await opened.page.locator(".verdict").textContent(), "Rejected by the checker for motion");
  assert.match(await opened.page.locator(".wrong").innerText(), /slips 0\.4 mm/);
  await finish(opened);
});

test("stories of another version, or none, are refused in words", options, async () => {
  for (const [html, words] of [
    [wrap({ ...ball, version: 3 }), /version 3/],
    [wrap({ format: "something" }), /not a plan/],
    [wrap("{"), /./],
    [wrap(ball).replace('id="story"', 'id="other"'), /no plan/],
  ]) {
    const opened = await open(browser, null, { html });
    assert.match(await opened.page.locator(".message").innerText(), words);
    await finish(opened);
  }
});

test("without WebGL charts and facts are there", options, async () => {
  const plain = await launch("--disable-3d-apis");
  const opened = await open(plain, ball);
  const { page } = opened;
  assert.match(await page.locator(".no-webgl").innerText(), /WebGL/);
  await page.keyboard.press("End");
  assert.ok((await shownTime(page)) > 10);
  const chart = page.locator("#chart-gait canvas").first();
  assert.ok(colours(pixels(await chart.screenshot())).different > 10);
  await finish(opened);
  await plain.close();
});
