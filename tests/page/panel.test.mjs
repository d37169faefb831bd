// SPDX-License-Identifier: MIT
// The panel on a real server: scenes, recordings, parameters, people, figures, keyboard and contrast.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { mkdtemp, readdir, rm, stat } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { kChromium, launchBrowser, openPage, takePicture, untilFrames, untilScene, untilState, untilText } from "./browser.mjs";
import { poorContrast } from "./contrast.mjs";
import { startServer } from "./server.mjs";
import { kClothParameters } from "../../clients/web/client/dist/tables.js";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

const kTabs = ["scene", "cloth", "air", "people", "view"];
const kDesktop = { width: 800, height: 450 };

let folder;
let server;
let browser;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-panel-"));
  server = await startServer(0, ["--scene", "sphere_drop", "--recordings", folder]);
  browser = await launchBrowser();
});
after(async () => {
  await browser?.close();
  await server?.stop();
  if (folder) await rm(folder, { recursive: true });
});

async function withPage(query, options, use) {
  const page = await openPage(browser, server.url + query, options);
  try {
    await untilState(page, "live");
    await use(page);
    assert.deepEqual(page.errors, []);
  } finally {
    await page.close();
  }
}

test("the list of scenes tells what they are, and a click joins one", () =>
  withPage("?name=Ada", { viewport: kDesktop }, async (page) => {
    await page.waitForSelector('[data-scene="flag"]');
    const text = await page.innerText('[data-scene="sphere_drop"]');
    assert.match(text, /vertices · \d+ cloths? · 1 person/);
    assert.ok((await page.textContent('[data-scene="flag"] .about')).length > 10);
    assert.equal(await page.getAttribute('[data-scene="sphere_drop"]', "aria-current"), "true");
    assert.ok(await page.isDisabled("#scene-delete"));
    assert.match(await page.getAttribute("#scene-delete", "title"), /started with this scene/);
    await page.click('[data-scene="flag"]');
    await untilScene(page, "flag");
    assert.match(page.url(), /scene=flag/);
    await page.waitForSelector('[data-scene="flag"][aria-current="true"]');
  }));

test("a scene is recorded on the server, and the recording plays", () =>
  withPage("", { viewport: kDesktop }, async (page) => {
    await page.click("#scene-record");
    await untilText(page, "#scene-record", /^Stop recording$/);
    await untilText(page, '[data-scene="sphere_drop"] .badge', /being recorded/);
    const started = /Recording to (\S+) on the server/.exec(await page.textContent("#scene-result"));
    assert.ok(started, await page.textContent("#scene-result"));
    await untilFrames(page, 40);
    await page.click("#scene-record");
    await untilText(page, "#scene-result", /is complete: \d+\.\d\d MB on the server/);
    const [file] = (await readdir(folder)).filter((name) => name.startsWith(started[1].replace(/\.mcap$/, "")));
    assert.ok((await stat(join(folder, file))).size > 1000);

    const player = await startServer(0, ["play", join(folder, file), "--loop"]);
    const viewer = await openPage(browser, player.url, { viewport: kDesktop });
    try {
      await untilState(viewer, "live");
      await untilFrames(viewer, 3);
      assert.ok(await viewer.isVisible("#player"));
      assert.ok((await viewer.evaluate(() => window.clothstream.playback.length)) > 0.1);
      await viewer.waitForSelector('[data-scene] .badge');
      assert.equal(await viewer.textContent("[data-scene] .badge"), "recording");
      assert.ok(await viewer.isHidden("#tab-cloth"));
      assert.deepEqual(viewer.errors, []);
    } finally {
      await viewer.close();
      await player.stop();
    }
  }));

test("parameters of cloth and air change on a second page", () =>
  withPage("", {}, (first) =>
    withPage("", {}, async (second) => {
      await first.click("#tab-cloth");
      await first.click("#parameters summary:text('Material')");
      for (const [id, value] of [["number-drag", "1.25"], ["number-friction", "0.7"], ["number-thickness", "0.011"]]) {
        await first.fill(`#${id}`, value);
        await first.press(`#${id}`, "Enter");
        await first.evaluate(() => document.activeElement.blur());
        await second.waitForFunction(
          ([where, wanted]) => document.getElementById(where).value === wanted,
          [id, value],
        );
      }
      // Every number has a field with its unit, and a help text with its range.
      const rows = await first.evaluate((options) =>
        options.map((option) => ({
          unit: document.getElementById(`number-${option}`).closest(".number").textContent,
          help: document.getElementById(`number-${option}-help`).textContent,
        })), kClothParameters.map(({ option }) => option));
      kClothParameters.forEach(({ option, unit, help }, index) => {
        assert.ok(rows[index].help.startsWith(help), `${option}: ${rows[index].help}`);
        assert.match(rows[index].help, /\. \S+ to \S+( [^.]+)?\.$/);
        assert.equal(rows[index].unit, unit, option);
      });
      // Values out of range are not sent.
      await first.fill("#number-drag", "11");
      await first.press("#number-drag", "Enter");
      assert.equal(await first.evaluate(() => document.getElementById("number-drag").validity.valid), false);
      assert.match(await first.textContent("#number-drag-help"), /Drag coefficient in air\. 0 to 10\./);

      await first.selectOption("#solver", "4");
      await second.waitForFunction(() => document.getElementById("solver").value === "4");
      await second.waitForFunction(() => !document.getElementById("solver-iterations").closest(".parameter").hidden);
      await first.click("#tab-air");
      await first.focus("#wind");
      for (let i = 0; i < 10; ++i) await first.keyboard.press("ArrowRight");
      await first.focus("#wind-heading");
      for (let i = 0; i < 90; ++i) await first.keyboard.press("ArrowRight");
      await untilText(second, "#wind-value", /^1\.0 m\/s$/);
      await untilText(second, "#wind-heading-value", /^90°$/);
      await first.focus("#density");
      await first.keyboard.press("Home");
      await untilText(second, "#density-value", /^0\.00 kg\/m³$/);
      await first.focus("#gust-seconds");
      await first.keyboard.press("End");
      await untilText(second, "#gust-seconds-value", /^10\.0 s$/);
    }),
  ));

test("owners change roles and remove people; others see why they cannot", () =>
  withPage("?name=Ada", { viewport: kDesktop }, async (ada) => {
    const ben = await openPage(browser, `${server.url}?name=Ben`, { viewport: kDesktop });
    try {
      await untilState(ben, "live");
      for (const page of [ada, ben]) await page.click("#tab-people");
      await ada.waitForFunction(() => document.querySelectorAll("#participants .person").length === 2);
      await takePicture(ada, "panel_people");
      assert.match(await ben.textContent("#people-why"), /Only owners/);
      assert.ok(await ben.locator("#participants select").first().isDisabled());
      assert.match(await ben.locator("#participants select").first().getAttribute("title"), /Only owners/);
      assert.match(await ada.inputValue("#invite-link"), /\?scene=sphere_drop$/);

      await ada.getByLabel("Role of Ben").selectOption("1");
      await ben.waitForFunction(() => window.clothstream.participants.find(({ self }) => self).role === 1);
      await ben.click("#tab-scene");
      assert.ok(await ben.isDisabled("#scene-reset"));
      assert.match(await ben.textContent("#scene-why"), /Viewers change nothing/);

      await ada.getByLabel("Remove Ben").click();
      assert.match(await ada.textContent("#confirm-text"), /Remove Ben from the scene\?/);
      await ada.click("#confirm-yes");
      await untilState(ben, "failed");
      assert.ok((await ben.textContent("#failure-text")).length > 10);
      await ada.waitForFunction(() => document.querySelectorAll("#participants .person").length === 1);
      assert.deepEqual(ben.errors, []);
    } finally {
      await ben.close();
    }
  }));

test("figures are hidden at first, and stay when no frame comes", () =>
  withPage("", { viewport: kDesktop }, async (page) => {
    assert.ok(await page.isHidden("#hud"));
    await page.focus("#canvas");
    await page.keyboard.press("h");
    assert.ok(await page.isVisible("#hud"));
    const label = (pattern) =>
      page.waitForFunction((source) => new RegExp(source).test(document.getElementById("hud-canvas").ariaLabel), pattern.source);
    await label(/display [1-9]\d* \/s, stream [1-9]\d* \/s, frame age \d+ ms, round trip \d+\.\d ms, network \d+ kbit\/s, precision \d+\.\d bit\/vertex, longest pause \d+ ms, dropped \d+ \/min;/);
    await label(/pose to picture \d+\.\d ms: up \d+\.\d, server [\d.]+, down [\d.]+, decode [\d.]+, play-out [\d.]+\./);
    const drawn = await page.evaluate(() => {
      const canvas = document.getElementById("hud-canvas");
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      let inked = 0;
      for (let i = 3; i < data.length; i += 4) if (data[i] > 0) ++inked;
      return inked / (data.length / 4);
    });
    assert.ok(drawn > 0.02, `${drawn} of the picture is drawn`);
    await takePicture(page, "panel_figures");
    await server.stop();
    await untilState(page, "reconnecting");
    await label(/stream 0 \/s, frame age \d{4,} ms/);
    server = await startServer(server.port, ["--scene", "sphere_drop", "--recordings", folder]);
    await untilState(page, "live");
    await page.click("#tab-view");
    await page.click("#hud-toggle");
    assert.ok(await page.isHidden("#hud"));
  }));

test("a change of quality joins again, and stays in the address", () =>
  withPage("", { viewport: kDesktop }, async (page) => {
    await page.click("#tab-view");
    await page.selectOption("#quality", "2");
    await page.waitForURL(/quality=2/);
    await untilState(page, "live");
    await untilFrames(page, 3);
    await page.reload();
    await untilState(page, "live");
    assert.equal(await page.inputValue("#quality"), "2");
  }));

test("the keyboard reaches everything in the order of the screen", () =>
  withPage("", { viewport: kDesktop }, async (page) => {
    await page.waitForSelector("[data-scene]");
    await page.focus("#canvas");
    const next = async () => {
      await page.keyboard.press("Tab");
      return page.evaluate(() => {
        const at = document.activeElement;
        return at.id || at.parentElement.id || at.dataset.scene;
      });
    };
    const order = [];
    for (let i = 0; i < 6; ++i) order.push(await next());
    assert.deepEqual(order.slice(0, 5), ["tab-scene", "scene-reset", "scene-pause", "scene-record", "create"]);
    assert.ok(await page.evaluate(() => document.activeElement.dataset.scene !== undefined), order.join(" "));
    const focused = await page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle);
    assert.equal(focused, "solid");
    await page.focus("#tab-scene");
    for (const tab of [...kTabs.slice(1), "scene"]) {
      await page.keyboard.press("ArrowRight");
      assert.equal(await page.evaluate(() => document.activeElement.id), `tab-${tab}`);
      assert.ok(await page.isVisible(`#page-${tab}`));
    }
    await page.keyboard.press("End");
    assert.equal(await page.evaluate(() => document.activeElement.id), "tab-view");
    await page.keyboard.press("p");
    assert.ok(await page.isHidden("#panel"));
    await page.click("#panel-open");
    assert.ok(await page.isVisible("#panel"));
    // Every control has a name.
    const nameless = await page.evaluate(() =>
      [...document.querySelectorAll("button, input, select, textarea")]
        .filter((one) => !one.labels?.length && !one.ariaLabel && one.textContent.trim() === "")
        .map((one) => one.outerHTML),
    );
    assert.deepEqual(nameless, []);
  }));

for (const colorScheme of ["dark", "light"]) {
  test(`text has enough contrast in the ${colorScheme} scheme`, async () => {
    const context = await browser.newContext({ colorScheme, viewport: kDesktop, reducedMotion: "reduce" });
    const page = await context.newPage();
    try {
      await page.goto(server.url);
      await untilState(page, "live");
      for (const tab of kTabs) {
        await page.click(`#tab-${tab}`);
        assert.deepEqual(await poorContrast(page, 4.5), [], tab);
      }
      const moving = await page.evaluate(() => getComputedStyle(document.getElementById("reset")).transitionDuration);
      assert.equal(moving, "0s");
    } finally {
      await context.close();
    }
  });
}

test("on a phone the panel is a sheet below the picture", () =>
  withPage("", { viewport: { width: 390, height: 844 } }, async (page) => {
    const bottomOf = (id) => page.evaluate((name) => document.getElementById(name).getBoundingClientRect().bottom, id);
    const topOf = (id) => page.evaluate((name) => document.getElementById(name).getBoundingClientRect().top, id);
    assert.ok(await page.isHidden("#page-scene"));
    assert.ok((await topOf("panel")) > 780);
    await page.click("#tab-air");
    assert.ok(await page.isVisible("#wind"));
    assert.ok((await topOf("panel")) < 500);
    assert.ok((await bottomOf("canvas")) <= (await topOf("panel")) + 1, "the sheet does not cover the picture");
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth));
    await takePicture(page, "panel_phone");
    await page.click("#tab-air");
    assert.ok(await page.isHidden("#page-air"));
  }));
