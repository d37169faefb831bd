// SPDX-License-Identifier: MIT
// Datagrams in a browser with a real server: frames travel in them where UDP passes, and on the WebSocket where it does not.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { after, before, test } from "node:test";
import { kChromium, launchBrowser, openPage, takePicture, untilFrames, untilState, untilText } from "./browser.mjs";
import { makeLink } from "./link.mjs";
import { startServer } from "./server.mjs";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

let browser;
let server;
before(async () => {
  [browser, server] = await Promise.all([launchBrowser(), startServer(0, ["--scene", "curtain"])]);
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

async function withPage(url, use, options = {}) {
  const page = await openPage(browser, url, { draws: false, ...options });
  try {
    await use(page);
    assert.deepEqual(page.errors, []);
  } finally {
    await page.close();
  }
}

const untilDatagrams = (page) => page.waitForFunction(() => window.clothstream?.link.transport === "datagrams");
const untilReason = (page, pattern) =>
  page.waitForFunction((source) => new RegExp(source).test(window.clothstream?.link.reason), pattern.source);

// Waits until datagrams have brought more complete frames.
async function untilFramesInDatagrams(page, count) {
  const now = await page.evaluate(() => window.clothstream.link.statistics?.frames ?? 0);
  await page.waitForFunction((wanted) => window.clothstream.link.statistics?.frames >= wanted, now + count);
}

async function checkFrames(page) {
  await untilFrames(page, 30);
  const { hashMismatches, decodeErrors } = await page.evaluate(() => window.clothstream.statistics);
  assert.deepEqual({ hashMismatches, decodeErrors }, { hashMismatches: 0, decodeErrors: 0 });
}

test("frames travel in datagrams, and the figures say so", () =>
  withPage(
    server.url,
    async (page) => {
      await untilDatagrams(page);
      await untilFramesInDatagrams(page, 60);
      await checkFrames(page);
      await page.focus("#canvas");
      await page.keyboard.press("h");
      await page.waitForFunction(() =>
        /Frames by datagrams: loss [\d.]+ %, repaired \d+ \/min, requests \d+ \/min, parity [\d.]+ %/.test(document.getElementById("hud-canvas").ariaLabel),
      );
      await takePicture(page, "datagrams");
      await page.click("#tab-view");
      await untilText(page, "#transport", /^datagrams$/);
    },
    { draws: true },
  ));

test("a browser that cannot transfer channels relays datagrams", () => {
  const prepare = () => {
    const post = Worker.prototype.postMessage;
    Worker.prototype.postMessage = function (message, transfer) {
      if (transfer?.some?.((one) => one instanceof RTCDataChannel)) throw new DOMException("not transferable", "DataCloneError");
      window.relays ||= message.kind === "channel";
      post.call(this, message, transfer);
    };
  };
  return withPage(
    server.url,
    async (page) => {
      await untilDatagrams(page);
      await untilFramesInDatagrams(page, 30);
      await checkFrames(page);
      assert.ok(await page.evaluate(() => window.relays));
    },
    { prepare },
  );
});

test("a lost connection opens datagrams again", async () => {
  const link = await makeLink(server.port);
  try {
    await withPage(link.url, async (page) => {
      await untilDatagrams(page);
      link.cut();
      await untilState(page, "reconnecting");
      assert.equal(await page.evaluate(() => window.clothstream.link.transport), "websocket");
      link.restore();
      await untilState(page, "live");
      await untilDatagrams(page);
      await untilFramesInDatagrams(page, 30);
      await checkFrames(page);
    });
  } finally {
    link.close();
  }
});

test("the page can do without datagrams", () =>
  withPage(`${server.url}?transport=tcp`, async (page) => {
    await untilReason(page, /^The page does not ask for datagrams\.$/);
    await checkFrames(page);
    assert.equal(await page.evaluate(() => window.clothstream.link.statistics), undefined);
  }));

test("a server without datagrams says so", async () => {
  const other = await startServer(0, ["--scene", "curtain", "--transport", "tcp"]);
  try {
    await withPage(other.url, async (page) => {
      await untilReason(page, /^The server opens no datagrams\.$/);
      await checkFrames(page);
      await page.click("#tab-view");
      await untilText(page, "#transport", /^WebSocket\. The server opens no datagrams\.$/);
    });
    await withPage(`${other.url}?transport=datagrams`, async (page) => {
      await page.waitForSelector('#failure[data-kind="no-datagrams"]:not([hidden])');
      await untilText(page, "#failure-said", /The server opens no datagrams\./);
    });
  } finally {
    await other.stop();
  }
});

test("frames come although UDP is blocked", () => {
  // Candidates with the port of discard, on which nothing answers.
  const prepare = () => {
    const set = RTCPeerConnection.prototype.setRemoteDescription;
    RTCPeerConnection.prototype.setRemoteDescription = function ({ type, sdp }) {
      return set.call(this, { type, sdp: sdp.replaceAll(/ \d+ typ host/g, " 9 typ host") });
    };
  };
  return withPage(
    server.url,
    async (page) => {
      await untilReason(page, /^UDP port \d+ of the server cannot be reached\.$/);
      await checkFrames(page);
      assert.equal(await page.evaluate(() => window.clothstream.state), "live");
    },
    { prepare },
  );
});
