// SPDX-License-Identifier: MIT
// Times of a frame on both threads, in an emulated headset whose hand moves through the cloth; and memory that a frame
// allocates on the main thread, in a window.
import { drawNothing, untilFrames, untilState } from "../../page/browser.mjs";
import { enter, openHeadset, reach, vertex } from "../../page/headset.mjs";

const kMainGoalMs = 0.5;
const kWorkerGoalMs = 1.5;
const kStep = 0.02; // m, way of the hand between two drawn frames
const kTouchMs = 60_000; // time within which the hand meets the cloth
const kSamplingBytes = 256; // mean distance of sampled allocations

// Waits for a number of drawn frames in all, and fails if they do not come.
async function untilDrawn(page, count) {
  const kMs = 30_000 + 200 * count;
  await page.waitForFunction((wanted) => window.clothstream.drawnFrames >= wanted, count, { timeout: kMs, polling: 200 });
}

const at = (sorted, part) => sorted[Math.round(part * (sorted.length - 1))];

export async function threadRows(browser, url, options) {
  const [before] = await timeRows(browser, `${url}&normals=cpu`, options);
  const rows = await timeRows(browser, url, options);
  const compared = { ...before, figure: "  with normals of the processor (?normals=cpu)", goal: undefined };
  return [rows[0], compared, ...rows.slice(1), ...(await memoryRows(browser, url, options))];
}

// The first row is the time of the main thread.
async function timeRows(browser, url, { size, frames }) {
  const page = await openHeadset(browser, url, { viewport: { width: 160, height: 90 }, prepare: drawNothing });
  try {
    await untilState(page, "live");
    await untilFrames(page, 10);
    await enter(page, "vr");
    const middle = Math.floor(size / 2) * (size + 1);
    const drawn = () => page.evaluate(() => window.clothstream.drawnFrames);
    const enough = (await drawn()) + frames;
    let corrected = 0;
    const end = performance.now() + kTouchMs;
    // The cloth swings, so that not every stroke meets it.
    while ((await drawn()) < enough || (corrected === 0 && performance.now() < end)) {
      for (const depth of [0.2, -0.2]) {
        const seen = await reach(page, "right", await vertex(page, middle), [0, 0, depth], kStep, "() => window.clothstream.localCorrection");
        corrected = Math.max(corrected, ...seen);
      }
    }
    const { work, statistics, isolated } = await page.evaluate(() => ({
      work: window.clothstream.work,
      statistics: { ...window.clothstream.statistics },
      isolated: window.crossOriginIsolated,
    }));
    const decoded = (await page.workers()[0].evaluate(() => self.frameTimes)).sort((a, b) => a - b);
    if (page.errors.length > 0) throw new Error(`the page failed: ${page.errors[0]}`);
    if (statistics.hashMismatches + statistics.decodeErrors > 0) throw new Error("frames were decoded to another state than the server's");
    if (decoded.length === 0 || work.take.length === 0) throw new Error("no frame of the stream came");
    if (corrected === 0) throw new Error("the hand did not touch the cloth");
    if (!isolated) throw new Error("the page is not isolated, so that clocks are coarse and frames are not in shared memory");
    const main = at(work.show, 0.5) + at(work.take, 0.5);
    const time = (figure, value, goal) => ({ figure, value, unit: "ms", ...(goal && { goal, most: true }) });
    return [
      time("main thread, without the renderer", main, kMainGoalMs),
      time("  taking a frame from the worker", at(work.take, 0.5)),
      time("  play-out, contact, attributes", at(work.show, 0.5)),
      time("  the same, 90th percentile", at(work.show, 0.9)),
      time("poses and input, with the emulator", at(work.input, 0.5)),
      time("renderer, without drawing", at(work.render, 0.5)),
      time("worker", at(decoded, 0.5), kWorkerGoalMs),
      time("  90th percentile", at(decoded, 0.9)),
    ];
  } finally {
    await page.context().close();
  }
}

// Bytes of a sampled call tree, in the renderer and elsewhere.
function divide(node, inside = false) {
  const isRenderer = inside || /(^|\.)render$/.test(node.callFrame.functionName);
  const sum = { renderer: isRenderer ? node.selfSize : 0, page: isRenderer ? 0 : node.selfSize };
  for (const child of node.children ?? []) {
    const { renderer, page } = divide(child, isRenderer);
    sum.renderer += renderer;
    sum.page += page;
  }
  return sum;
}

async function memoryRows(browser, url, { frames }) {
  const context = await browser.newContext({ viewport: { width: 640, height: 360 } });
  try {
    await context.addInitScript(drawNothing);
    const page = await context.newPage();
    await page.goto(url);
    await untilState(page, "live");
    await untilDrawn(page, frames); // by then the engine has optimised what runs in each frame
    const profiler = await context.newCDPSession(page);
    await profiler.send("HeapProfiler.enable");
    const collected = { includeObjectsCollectedByMajorGC: true, includeObjectsCollectedByMinorGC: true };
    await profiler.send("HeapProfiler.startSampling", { samplingInterval: kSamplingBytes, ...collected });
    const before = await page.evaluate(() => window.clothstream.drawnFrames);
    await untilDrawn(page, before + frames / 2);
    const after = await page.evaluate(() => window.clothstream.drawnFrames);
    const { profile } = await profiler.send("HeapProfiler.stopSampling");
    const { renderer, page: own } = divide(profile.head);
    if (renderer === 0) throw new Error("the allocations of the renderer were not found");
    const bytes = (figure, value, goal) => ({ figure, value: value / (after - before), unit: "bytes", ...goal });
    return [
      bytes("allocated for a drawn frame, without the renderer", own, { goal: 0, most: true }),
      bytes("  by three.js in the renderer", renderer),
    ];
  } finally {
    await context.close();
  }
}
