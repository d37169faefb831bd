// SPDX-License-Identifier: MIT
// Time from opening the page to the first picture that shows a frame of the stream.
import { launchBrowser } from "../../page/browser.mjs";

const kGoalMs = 1000;
const kWaitMs = 60_000;

// Runs in the page before its own scripts. Each drawn frame asks whether a frame of the stream is there; the picture is
// complete when the next one begins.
function watch() {
  const look = () => {
    if (window.clothstream?.statistics?.frames > 0) requestAnimationFrame(() => (window.firstFrameMs = performance.now()));
    else requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}

async function open(context, url) {
  const page = await context.newPage();
  try {
    await page.addInitScript(watch);
    await page.goto(url);
    await page.waitForFunction(() => window.firstFrameMs !== undefined, undefined, { timeout: kWaitMs });
    return await page.evaluate(() => window.firstFrameMs);
  } finally {
    await page.close();
  }
}

const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];

export async function firstFrameRows(url, { loads }) {
  const cold = [];
  const cached = [];
  for (let load = 0; load < loads; ++load) {
    // A new browser has no file, no compiled code and no shader.
    const browser = await launchBrowser();
    try {
      const context = await browser.newContext({ viewport: { width: 800, height: 450 } });
      cold.push(await open(context, url));
      cached.push(await open(context, url));
    } finally {
      await browser.close();
    }
  }
  return [
    { figure: `first frame, cold (median of ${loads})`, value: median(cold), unit: "ms" },
    { figure: `first frame, cached (median of ${loads})`, value: median(cached), unit: "ms", goal: kGoalMs, most: true },
    { figure: `first frame, cached (fastest of ${loads})`, value: Math.min(...cached), unit: "ms" },
  ];
}
