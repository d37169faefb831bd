// SPDX-License-Identifier: MIT
// The page for people who do not see it, use no mouse, or want less motion; and without internet.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { brokenRules } from "./axe.mjs";
import { kChromium, launchBrowser, openPage, takePicture, untilState } from "./browser.mjs";
import { dropFile, sheetGlb } from "./mesh_files.mjs";
import { startServer } from "./server.mjs";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

const kDesktop = { width: 800, height: 600 };
const kPhone = { width: 390, height: 844 };
const kTabs = ["scene", "cloth", "air", "people", "view"];

let folder;
let server;
let paired;
let browser;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-accessible-"));
  server = await startServer(0, ["--scene", "sphere_drop", "--recordings", folder]);
  paired = await startServer(0, ["--scene", "curtain", "--pairing", "--state-dir", folder]);
  // Without names, and with no machine but this one.
  browser = await launchBrowser(["--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"]);
});
after(async () => {
  await browser?.close();
  await server?.stop();
  await paired?.stop();
  if (folder) await rm(folder, { recursive: true });
});

async function withPage(url, { colorScheme = "light", viewport = kDesktop, prepare }, use) {
  const context = await browser.newContext({ colorScheme, viewport, reducedMotion: "reduce" });
  const page = await openPage(context, url, { prepare, viewport, draws: false });
  try {
    await use(page);
    assert.deepEqual(page.errors, []);
  } finally {
    await context.close();
  }
}

const untilFailure = (page, kind) => page.waitForSelector(`#failure[data-kind="${kind}"]:not([hidden])`);

for (const [colorScheme, viewport] of [["light", kDesktop], ["dark", kPhone]]) {
  test(`every tab, the figures, a new scene and a question break no rule of axe-core (${colorScheme}, ${viewport.width} wide)`, () =>
    withPage(server.url, { colorScheme, viewport }, async (page) => {
      assert.deepEqual(await brokenRules(page), [], "at the start");
      await untilState(page, "live");
      await page.waitForSelector("[data-scene]", { state: "attached" });
      for (const tab of kTabs) {
        await page.click(`#tab-${tab}`);
        await page.locator(`#page-${tab} details`).evaluateAll((all) => all.forEach((one) => (one.open = true)));
        assert.deepEqual(await brokenRules(page), [], tab);
      }
      await page.click("#hud-toggle");
      assert.deepEqual(await brokenRules(page), [], "figures");
      await page.click("#hud-toggle");
      await dropFile(page, "sheet.glb", sheetGlb(12, 0.05));
      await page.waitForSelector("#create-fields:not([hidden])");
      assert.deepEqual(await brokenRules(page), [], "new scene");
      await page.click("#create-send");
      await page.waitForFunction(() => document.getElementById("scene-name").textContent === "sheet");
      await page.waitForFunction(() => !document.getElementById("scene-delete").disabled);
      await page.click("#scene-delete");
      await page.waitForSelector("#confirm[open]");
      assert.deepEqual(await brokenRules(page), [], "question");
      await takePicture(page, `accessible_${colorScheme}`);
      await page.click("#confirm-yes");
      await page.waitForFunction(() => document.getElementById("scene-name").textContent === "sphere_drop");
    }));
}

for (const colorScheme of ["light", "dark"]) {
  test(`what the page says about failures breaks no rule of axe-core (${colorScheme})`, async () => {
    await withPage(paired.url, { colorScheme }, async (page) => {
      await untilFailure(page, "asking");
      assert.deepEqual(await brokenRules(page), [], "asking");
      await page.fill("#proof-input", "not a token");
      await page.press("#proof-input", "Enter");
      await untilFailure(page, "token-refused");
      assert.deepEqual(await brokenRules(page), [], "token refused");
    });
    await withPage(`${server.url}?scene=no_such_scene`, { colorScheme }, async (page) => {
      await untilFailure(page, "not-found");
      assert.deepEqual(await brokenRules(page), [], "not found");
      // Words that matter interrupt, others wait for their turn.
      assert.equal(await page.getAttribute("#failure-words", "role"), "alert");
    });
    await withPage(server.url, { colorScheme, prepare: () => (HTMLCanvasElement.prototype.getContext = () => null) }, async (page) => {
      await untilFailure(page, "no-webgl");
      assert.deepEqual(await brokenRules(page), [], "no WebGL");
    });
  });
}

test("the Tab key reaches every control of every tab, and its focus is seen", () =>
  withPage(server.url, {}, async (page) => {
    await untilState(page, "live");
    for (const list of ["[data-scene]", "#participants select"]) await page.waitForSelector(list, { state: "attached" });
    for (const tab of kTabs) {
      await page.click(`#tab-${tab}`);
      await page.locator(`#page-${tab} details`).evaluateAll((all) => all.forEach((one) => (one.open = true)));
      await page.focus(`#tab-${tab}`);
      const count = await page.evaluate(() => {
        window.reached = new Set();
        const controls = [...document.querySelectorAll("#panel :is(button, input, select, summary, a[href], canvas[tabindex])")];
        window.wanted = controls.filter((one) => one.checkVisibility() && !one.disabled && one.tabIndex >= 0);
        return window.wanted.length;
      });
      assert.ok(count >= 5, `${count} controls in the tab ${tab}`);
      // Once around the page, which has a few controls outside of the panel.
      for (let presses = 0; presses < count + 20; ++presses) {
        await page.keyboard.press("Tab");
        const done = await page.evaluate(() => {
          const at = document.activeElement;
          window.reached.add(at);
          // Radio buttons of a group have one stop together.
          if (at.type === "radio") for (const one of document.querySelectorAll(`[name="${at.name}"]`)) window.reached.add(one);
          const outlined = [at, ...at.labels ?? []].some((one) => getComputedStyle(one).outlineStyle !== "none");
          const { top, bottom, height } = (at.labels?.[0] ?? at).getBoundingClientRect();
          const isIn = bottom > 0 && top < window.innerHeight && height > 0;
          if (window.wanted.includes(at) && !(outlined && isIn)) (window.hiddenFocus ??= []).push(at.id || at.outerHTML);
          return window.wanted.every((one) => window.reached.has(one));
        });
        if (done) break;
      }
      const left = await page.evaluate(() => window.wanted.filter((one) => !window.reached.has(one)).map((one) => one.id || one.outerHTML));
      assert.deepEqual(left, [], `not reached in the tab ${tab}`);
      assert.deepEqual(await page.evaluate(() => window.hiddenFocus ?? []), [], `no visible focus in the tab ${tab}`);
    }
  }));

test("a question takes the focus, Escape says no, and the focus returns", () =>
  withPage(server.url, {}, async (page) => {
    await untilState(page, "live");
    await dropFile(page, "asked.glb", sheetGlb(12, 0.05));
    await page.click("#create-send");
    await page.waitForFunction(() => document.getElementById("scene-name").textContent === "asked" && !document.getElementById("scene-delete").disabled);
    await page.focus("#scene-delete");
    await page.keyboard.press("Enter");
    await page.waitForSelector("#confirm[open]");
    assert.ok(await page.evaluate(() => document.getElementById("confirm").contains(document.activeElement)));
    await page.keyboard.press("Escape");
    await page.waitForSelector("#confirm", { state: "hidden" });
    assert.equal(await page.evaluate(() => document.activeElement.id), "scene-delete");
    assert.equal(await page.textContent("#scene-name"), "asked");
  }));

test("nothing moves for people who want less motion", () =>
  withPage(server.url, {}, async (page) => {
    await untilState(page, "live");
    const moving = await page.evaluate(() =>
      [...document.querySelectorAll("body *")]
        .filter((one) => {
          const { transitionDuration, animationName } = getComputedStyle(one);
          return animationName !== "none" || transitionDuration.split(", ").some((time) => parseFloat(time) > 0);
        })
        .map((one) => one.id || one.outerHTML),
    );
    assert.deepEqual(moving, []);
    // The view stops when the mouse does.
    await page.mouse.move(60, 300);
    await page.mouse.down();
    await page.mouse.move(160, 320, { steps: 4 });
    const still = () => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(window.clothstream.project([0, 1, 0]))))));
    const before = await still();
    await page.mouse.up();
    await still();
    assert.deepEqual(await still(), before);
  }));

test("every request goes to the server itself, and the page works without internet", async () => {
  const context = await browser.newContext({ viewport: kDesktop });
  const asked = [];
  context.on("request", (request) => asked.push(request.url()));
  try {
    const page = await openPage(context, server.url, { draws: false });
    await untilState(page, "live");
    for (const tab of kTabs) await page.click(`#tab-${tab}`);
    await page.keyboard.press("h");
    await dropFile(page, "sheet.glb", sheetGlb(12, 0.05));
    await page.click('[data-scene="flag"]');
    await page.waitForFunction(() => document.getElementById("scene-name").textContent === "flag" && window.clothstream.state === "live");
    assert.ok(asked.length >= 5, asked.join(" "));
    const { origin } = new URL(server.url);
    const foreign = asked.filter((url) => new URL(url).origin !== origin && !/^(data|blob):/.test(url));
    assert.deepEqual(foreign, []);
    const files = new Set(asked.filter((url) => url.startsWith(origin)).map((url) => new URL(url).pathname));
    for (const file of ["/", "/main.js", "/main.css", "/worker.js", "/clothstream_core.wasm"]) assert.ok(files.has(file), file);
    const licenses = await (await context.request.get(new URL(await page.getAttribute("#page-view a", "href"), origin).href)).text();
    for (const name of ["libc++", "three.js", "Draco"]) assert.ok(licenses.includes(`=\n${name}`), name);
    // Addresses in what was loaded that a browser would follow by itself.
    for (const file of ["/", "/main.css"]) {
      const text = await (await context.request.get(new URL(file, origin).href)).text();
      assert.doesNotMatch(text, /(src|href)="?https?:|url\(["']?https?:|@import/);
    }
  } finally {
    await context.close();
  }
});
