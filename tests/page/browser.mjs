// SPDX-License-Identifier: MIT
// Opens pages in Debian's Chromium without a window, waits for their state, and reads the pixels of screenshots.

import { createRequire } from "node:module";
import { mkdir } from "node:fs/promises";
import path from "node:path";

const require = createRequire(new URL("../../clients/web/package.json", import.meta.url));
const { chromium } = require("playwright-core");

export const kChromium = "/usr/bin/chromium";
const kScreenshots = process.env.CLOTHSTREAM_SCREENSHOTS;
const kWaitMs = 60_000;
// Size of screenshots, in pixels.
export const kPicture = { width: 800, height: 450 };
// Size of pages between screenshots. Software rendering takes most of the tests' time, in proportion to the pixels.
// The width keeps the layout of wide screens.
export const kQuick = { width: 656, height: 200 };
// Milliseconds between drawn frames, at least. Without a pause, software rendering would take the processors from the
// server.
const kDrawPeriodMs = 50;

// `more` are further arguments of the browser.
export function launchBrowser(more = []) {
  return chromium.launch({
    executablePath: kChromium,
    args: [
      "--no-sandbox",
      "--use-gl=angle",
      "--use-angle=swiftshader",
      "--enable-unsafe-swiftshader",
      "--disable-background-networking",
      "--disable-component-update",
      "--no-first-run",
      ...more,
    ],
  });
}

// Opens a page in a browser, or in a context, which then decides on the viewport. `prepare` runs in it before its own
// scripts. Errors of the page are collected in `errors`. Without a viewport the page is small, and takes the size of a
// picture only for screenshots. With `draws: false` the cloth is not drawn, which takes most of the time; the page does
// everything else. `touch` gives it a touch screen.
export async function openPage(browser, url, { prepare, viewport, draws = true, touch = false } = {}) {
  const page = await browser.newPage({ viewport: viewport ?? kQuick, hasTouch: touch });
  page.grows = viewport === undefined;
  page.setDefaultTimeout(kWaitMs);
  page.errors = [];
  page.on("pageerror", (error) => page.errors.push(String(error)));
  await page.addInitScript((period) => {
    const draw = window.requestAnimationFrame.bind(window);
    window.requestAnimationFrame = (callback) => setTimeout(() => draw(callback), period);
  }, kDrawPeriodMs);
  if (!draws) await page.addInitScript(drawNothing);
  if (prepare) await page.addInitScript(prepare);
  await page.goto(url);
  return page;
}

// Runs in a page before its own scripts: calls that draw do nothing, so that frames come as on a device with a graphics
// processor. All other calls of WebGL are made.
export function drawNothing() {
  for (const name of ["drawArrays", "drawElements", "drawArraysInstanced", "drawElementsInstanced"])
    WebGL2RenderingContext.prototype[name] = () => undefined;
}

// Waits for a state: connecting, live, reconnecting or failed.
export function untilState(page, state) {
  return page.waitForFunction((wanted) => window.clothstream?.state === wanted, state);
}

// Waits until the text of an element matches.
export function untilText(page, selector, pattern) {
  return page.waitForFunction(
    ([where, source]) => new RegExp(source).test(document.querySelector(where)?.textContent ?? ""),
    [selector, pattern.source],
  );
}

// Waits until the page is in a scene.
export function untilScene(page, name) {
  return page.waitForFunction(
    (wanted) => document.getElementById("scene-name").textContent === wanted && window.clothstream.state === "live",
    name,
  );
}

// Waits for `count` more frames.
export async function untilFrames(page, count) {
  const now = await page.evaluate(() => window.clothstream.statistics?.frames ?? 0);
  await page.waitForFunction((wanted) => window.clothstream.statistics?.frames >= wanted, now + count);
}

// Saves a screenshot under its name.
export async function takePicture(page, name) {
  await mkdir(kScreenshots, { recursive: true });
  if (page.grows) await resize(page, kPicture);
  const png = await page.screenshot({ path: path.join(kScreenshots, `${name}.png`) });
  if (page.grows) await page.setViewportSize(kQuick);
  return png;
}

// Waits until the page has drawn in the new size.
async function resize(page, size) {
  await page.setViewportSize(size);
  await page.evaluate(
    () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(done)))),
  );
}

// Saves a screenshot under its name. Returns its pixels: colourAt(x, y) is [red, green, blue], each 0 to 255.
export async function takePixels(page, name) {
  const png = await takePicture(page, name);
  const { width, height, base64 } = await page.evaluate(async (source) => {
    const bytes = Uint8Array.from(atob(source), (character) => character.charCodeAt(0));
    const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    const context = canvas.getContext("2d");
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
    let text = "";
    for (let i = 0; i < data.length; i += 8192) text += String.fromCharCode(...data.subarray(i, i + 8192));
    return { width: bitmap.width, height: bitmap.height, base64: btoa(text) };
  }, png.toString("base64"));
  const pixels = Buffer.from(base64, "base64");
  return {
    width,
    height,
    colourAt(x, y) {
      const at = 4 * (Math.round(y) * width + Math.round(x));
      return [pixels[at], pixels[at + 1], pixels[at + 2]];
    },
  };
}

export function luminance([red, green, blue]) {
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
}
