// SPDX-License-Identifier: MIT
// The page in Chromium as a participant who moves a sphere. Prints one line of JSON: the figures of `clothstream load` that
// link.py keeps, with the same meanings. The canvas is small, and calls that draw do nothing, because software rendering
// would take the processors from the stream. Usage: node browser.mjs --url URL --seconds N [--frames FILE]

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

// Runs in the page. Returns the times of the hand, and by how much counts have grown. `datagrams` is undefined if they are
// not open at the end.
async function measure(seconds) {
  const { clothstream, hand } = window;
  const look = () => ({ stream: { ...clothstream.statistics, ms: performance.now() }, datagrams: clothstream.link.statistics });
  const growth = (after, before) => after && Object.fromEntries(Object.entries(after).map(([name, value]) => [name, value - before[name]]));
  for (const list of Object.values(hand)) list.length = 0;
  const before = look();
  await new Promise((done) => setTimeout(done, 1000 * seconds));
  const after = look();
  const isLive = clothstream.state === "live";
  return { ...hand, startMs: before.stream.ms, isLive, stream: growth(after.stream, before.stream), datagrams: growth(after.datagrams, before.datagrams) };
}

// Nearest rank.
function percentile(values, percent) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.max(Math.ceil((percent / 100) * sorted.length), 1) - 1];
}

// Figures of `clothstream load --json` that link.py keeps.
function figuresOf({ poses, decodedToDisplayable, frames, isLive, stream, datagrams }) {
  const ages = frames.map(([, age]) => age);
  const seconds = stream.ms / 1000;
  const { inUse, ...counts } = datagrams ?? {};
  return {
    framesPerSecond: stream.frames / seconds,
    tickAgeMsP50: percentile(ages, 50),
    tickAgeMsP99: percentile(ages, 99),
    dropped: stream.dropped,
    decodeErrors: stream.decodeErrors,
    hashMismatches: stream.hashMismatches,
    mbitPerSecond: (8e-6 * stream.bytes) / seconds,
    joined: 1,
    lost: isLive ? 0 : 1,
    withDatagrams: datagrams ? 1 : 0,
    datagrams: counts,
    poses: poses.length,
    poseToDisplayableMsP50: percentile(poses, 50),
    poseToDisplayableMsP99: percentile(poses, 99),
    decodedToDisplayableMsP50: percentile(decodedToDisplayable, 50),
  };
}

// Lines of `clothstream load --frames` that link.py reads.
function linesOf({ frames, startMs }) {
  const line = ([arrivedMs, ageMs, displayableMs]) =>
    `{"seconds":${((arrivedMs - startMs) / 1000).toFixed(4)},"ageMs":${ageMs.toFixed(2)},"displayableMs":${displayableMs.toFixed(2)}}\n`;
  return frames.map(line).join("");
}

const text = { type: "string" };
const { values: options } = parseArgs({ options: { url: text, seconds: text, frames: text } });
if (!options.url || !(Number(options.seconds) > 0)) {
  console.error("browser.mjs: --url URL and --seconds N are required, with N greater than 0");
  process.exit(2);
}
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
