// SPDX-License-Identifier: MIT
// The page in Chromium as a participant who moves a sphere, in place of `clothstream load`. Prints the figures that link.py
// keeps, with the same names and meanings, as one line of JSON. The canvas is small, and calls that draw do nothing, because
// software rendering would take the processors from the stream.

import { createRequire } from "node:module";
import { writeFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";
import { drawNothing, launchBrowser, untilFrames, untilState } from "../../page/browser.mjs";

const kWeb = fileURLToPath(new URL("../../../clients/web/", import.meta.url));
const { build } = createRequire(`${kWeb}package.json`)("esbuild");
const kWaitMs = 60_000;
// Frames before the measurement: the delay of play-out has then recovered from the start.
const kFirstFrames = 144;

// The script of the page, with the hand.
async function bundle() {
  const { outputFiles } = await build({
    absWorkingDir: kWeb,
    entryPoints: ["page/src/main.ts"],
    inject: [fileURLToPath(new URL("hand.mjs", import.meta.url))],
    tsconfig: "page/tsconfig.json",
    bundle: true,
    minify: true,
    format: "esm",
    target: "es2022",
    write: false,
  });
  return outputFiles[0].text;
}

// Returns the page when it receives frames in datagrams and has compiled its shaders.
async function join(browser, url) {
  const page = await browser.newPage({ viewport: { width: 160, height: 90 } });
  page.setDefaultTimeout(kWaitMs);
  page.errors = [];
  page.on("pageerror", (error) => page.errors.push(String(error)));
  await page.addInitScript(drawNothing);
  const body = await bundle();
  await page.route("**/main.js", (route) => route.fulfill({ contentType: "text/javascript", body }));
  await page.goto(`${url}?transport=datagrams`);
  await untilState(page, "live");
  await page.waitForFunction(() => window.clothstream.link.transport === "datagrams" && window.clothstream.isComplete);
  await untilFrames(page, kFirstFrames);
  return page;
}

// Runs in the page.
async function measure(seconds) {
  const { clothstream } = window;
  const before = { ...clothstream.statistics, ms: performance.now() };
  for (const list of Object.values(window.hand)) list.length = 0;
  await new Promise((done) => setTimeout(done, 1000 * seconds));
  const after = { ...clothstream.statistics, ms: performance.now() };
  const grown = Object.fromEntries(Object.entries(after).map(([name, value]) => [name, value - before[name]]));
  const isLive = clothstream.state === "live";
  return { ...window.hand, before, grown, isLive, link: clothstream.link };
}

// Nearest rank.
function percentile(values, percent) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.max(Math.ceil((percent / 100) * sorted.length), 1) - 1];
}

// Figures of `clothstream load --json` that link.py keeps.
function figuresOf({ poses, decodedToDisplayable, frames, grown, isLive, link }) {
  const ages = frames.map(([, age]) => age);
  const seconds = grown.ms / 1000;
  const { inUse, ...datagrams } = link.statistics ?? {};
  return {
    framesPerSecond: grown.frames / seconds,
    tickAgeMsP50: percentile(ages, 50),
    tickAgeMsP99: percentile(ages, 99),
    dropped: grown.dropped,
    decodeErrors: grown.decodeErrors,
    hashMismatches: grown.hashMismatches,
    mbitPerSecond: (8e-6 * grown.bytes) / seconds,
    joined: 1,
    lost: isLive ? 0 : 1,
    withDatagrams: link.statistics ? 1 : 0,
    datagrams,
    poses: poses.length,
    poseToDisplayableMsP50: percentile(poses, 50),
    poseToDisplayableMsP99: percentile(poses, 99),
    decodedToDisplayableMsP50: percentile(decodedToDisplayable, 50),
  };
}

// Lines of `clothstream load --frames` that link.py reads.
function linesOf({ frames, before }) {
  return frames.map(([arrivedMs, ageMs, displayableMs]) => `${JSON.stringify({ seconds: (arrivedMs - before.ms) / 1000, ageMs, displayableMs })}\n`);
}

const text = { type: "string" };
const { values: options } = parseArgs({ options: { url: text, seconds: text, frames: text } });
const browser = await launchBrowser();
try {
  const page = await join(browser, options.url);
  const measured = await page.evaluate(measure, Number(options.seconds));
  if (page.errors.length > 0) throw new Error(`the page failed: ${page.errors[0]}`);
  if (options.frames) await writeFile(options.frames, linesOf(measured));
  console.log(JSON.stringify(figuresOf(measured)));
} finally {
  await browser.close();
}
