// SPDX-License-Identifier: MIT
// Opens the page of a server, and waits until a number of frames has come in datagrams. Prints one line of JSON: what the
// page shows as its transport, its errors, and its statistics before and after these frames.
// Usage: node page.mjs URL FRAMES

import { launchBrowser, openPage } from "../page/browser.mjs";

const [url, frames] = process.argv.slice(2);
const browser = await launchBrowser();
try {
  const page = await openPage(browser, url, { draws: false });
  const look = () => page.evaluate(() => ({ stream: window.clothstream.statistics, datagrams: window.clothstream.link.statistics }));
  await page.waitForFunction(() => window.clothstream?.link.transport === "datagrams");
  const before = await look();
  await page.waitForFunction((count) => window.clothstream.link.statistics?.frames >= count, before.datagrams.frames + Number(frames));
  const after = await look();
  await page.click("#tab-view");
  const shown = await page.textContent("#transport");
  console.log(JSON.stringify({ shown, errors: page.errors, before, after }));
} finally {
  await browser.close();
}
