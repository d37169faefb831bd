// SPDX-License-Identifier: MIT
// Failures in a browser with a real server: what the page says, what it keeps, and how it comes back.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { kChromium, kQuick, launchBrowser, openPage, takePicture, untilFrames, untilState } from "./browser.mjs";
import { makeLink } from "./link.mjs";
import { dropFile, sheetGlb } from "./mesh_files.mjs";
import { startServer } from "./server.mjs";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

const kPhone = { width: 390, height: 844 };
// A name that leads to this machine and is not loopback to the browser, so its pages are not secure.
const kInsecureName = "cloth.test";

let folder;
let server;
let browser;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-failure-"));
  server = await startServer(0, ["--scene", "curtain", "--max-participants", "2", "--public-name", kInsecureName, "--insecure"]);
  browser = await launchBrowser([`--host-resolver-rules=MAP ${kInsecureName} 127.0.0.1`]);
});
after(async () => {
  await browser?.close();
  await server?.stop();
  if (folder) await rm(folder, { recursive: true });
});

// Opens a page with separate storage. `use` gets the page, which is closed afterwards.
async function withPage(url, options, use) {
  const context = await browser.newContext({ colorScheme: options.colorScheme ?? "light", viewport: options.viewport ?? kQuick });
  const page = await openPage(context, url, { draws: false, ...options });
  try {
    await use(page);
    assert.deepEqual(page.errors, []);
  } finally {
    await context.close();
  }
}

const untilFailure = (page, kind) => page.waitForSelector(`#failure[data-kind="${kind}"]:not([hidden])`);
const untilGood = async (page) => {
  await untilState(page, "live");
  await page.waitForSelector("#failure", { state: "hidden" });
};
const press = (page, action) => page.click(`#failure [data-action="${action}"]`);
const said = (page) => page.textContent("#failure-said");

async function giveCode(page, code) {
  await page.fill("#proof-input", code);
  await page.press("#proof-input", "Enter");
}

// Server that pairs, and its newest code. Tokens hold as long as the directory stays the same.
async function startPairing(state, port = 0) {
  const paired = await startServer(port, ["--scene", "curtain", "--pairing", "--state-dir", state]);
  return { paired, code: (await paired.line(/^pair +(\d{6})/))[1] };
}

test("wrong codes are explained, and after five of them the form waits for a minute, also after a reload", async () => {
  const { paired, code } = await startPairing(await mkdtemp(join(folder, "pairing-")));
  try {
    await withPage(paired.url, { viewport: kPhone, colorScheme: "dark" }, async (page) => {
      await untilFailure(page, "asking");
      assert.equal(await page.evaluate(() => document.activeElement.id), "proof-input");
      const wrong = code === "000000" ? "000001" : "000000";
      for (let count = 1; count <= 5; ++count) {
        await giveCode(page, wrong);
        await page.waitForFunction((kind) => document.getElementById("failure").dataset.kind === kind, count < 5 ? "wrong-code" : "locked-out");
        if (count === 1) await takePicture(page, "failure_wrong_code");
        await page.waitForSelector("#failure:not([hidden])");
      }
      assert.match(await page.textContent("#failure-wait"), /^You can try again in (60|5\d) s\.$/);
      assert.ok(await page.isDisabled("#proof-send"));
      await takePicture(page, "failure_locked_out");
      await page.reload();
      await untilFailure(page, "asking");
      await giveCode(page, code);
      await untilFailure(page, "locked-out");
      assert.match(await said(page), /5 wrong pairing codes came from your address/);
    });
  } finally {
    await paired.stop();
  }
});

test("a token that is refused is asked for again, and the new one is kept", async () => {
  let { paired, code } = await startPairing(await mkdtemp(join(folder, "first-")));
  try {
    await withPage(paired.url, {}, async (page) => {
      await untilFailure(page, "asking");
      await giveCode(page, code);
      await untilGood(page);
      await page.reload();
      await untilGood(page);
      // Another key: the server does not know the token any more.
      await paired.stop();
      ({ paired, code } = await startPairing(await mkdtemp(join(folder, "second-")), paired.port));
      await untilFailure(page, "token-refused");
      await takePicture(page, "failure_token_refused");
      await giveCode(page, code);
      await untilGood(page);
      await page.reload();
      await untilGood(page);
    });
  } finally {
    await paired.stop();
  }
});

test("banned people read so, also after a reload, and may join another scene", async () => {
  const { paired, code } = await startPairing(await mkdtemp(join(folder, "ban-")));
  try {
    await withPage(`${paired.url}?name=Ada`, {}, async (owner) => {
      await untilFailure(owner, "asking");
      await giveCode(owner, code);
      await untilGood(owner);
      await owner.click("#tab-people");
      await owner.click("#pairing");
      await owner.waitForSelector("#pairing-code:not([hidden])");
      const guests = (await owner.textContent("#pairing-code")).slice(0, 7);
      await withPage(`${paired.url}?name=Ben`, {}, async (guest) => {
        await untilFailure(guest, "asking");
        await giveCode(guest, guests);
        await untilGood(guest);
        await owner.click('[aria-label="Ban Ben"]');
        await owner.click("#confirm-yes");
        await untilFailure(guest, "banned");
        assert.match(await said(guest), /banned you/);
        await guest.reload();
        await untilFailure(guest, "banned");
        await takePicture(guest, "failure_banned");
        await guest.goto(`${paired.url}?name=Ben&scene=flag`);
        await untilGood(guest);
      });
    });
  } finally {
    await paired.stop();
  }
});

test("a removed person reads so and may join again; a full scene lets in when there is room; the name stays", () =>
  withPage(`${server.url}?name=Ada`, {}, async (owner) => {
    await untilGood(owner);
    await withPage(`${server.url}?name=Ben`, {}, async (guest) => {
      await untilGood(guest);
      // Both see each other.
      for (const page of [owner, guest]) await page.waitForFunction(() => window.clothstream.participants.map(({ name }) => name).sort().join() === "Ada,Ben");
      await owner.click("#tab-people");
      await owner.click('[aria-label="Remove Ben"]');
      await owner.click("#confirm-yes");
      await untilFailure(guest, "removed");
      await takePicture(guest, "failure_removed");
      await press(guest, "join");
      await untilGood(guest);
      await owner.waitForFunction(() => window.clothstream.participants.some(({ name }) => name === "Ben"));

      await withPage(`${server.url}?name=Cleo`, { viewport: kPhone }, async (third) => {
        await untilFailure(third, "full");
        assert.match(await third.textContent("#failure-wait"), /^Trying again in \d+ s\.$/);
        assert.match(await said(third), /2 participants, its maximum/);
        await takePicture(third, "failure_full");
        await third.reload();
        await untilFailure(third, "full");
        await guest.close();
        // By itself.
        await untilGood(third);
        await owner.waitForFunction(() => window.clothstream.participants.some(({ name }) => name === "Cleo"));
      });
    });
  }));

test("people in a scene that is deleted read so, and a button leads to the default scene", () =>
  withPage(server.url, {}, async (owner) => {
    await untilGood(owner);
    await dropFile(owner, "sheet.glb", sheetGlb(12, 0.05));
    await owner.click("#create-send");
    await owner.waitForFunction(() => document.getElementById("scene-name").textContent === "sheet");
    await withPage(`${server.url}?scene=sheet`, {}, async (guest) => {
      await untilGood(guest);
      await owner.click("#scene-delete");
      await owner.click("#confirm-yes");
      await untilFailure(guest, "not-found");
      assert.match(await said(guest), /There is no scene 'sheet'|was deleted/);
      await press(guest, "default");
      await untilGood(guest);
      assert.equal(await guest.textContent("#scene-name"), "curtain");
    });
  }));

test("a page without https works, and says how to get VR", () =>
  withPage(`http://${kInsecureName}:${server.port}/`, { colorScheme: "dark", draws: true }, async (page) => {
    assert.equal(await page.evaluate(() => window.isSecureContext), false);
    await untilGood(page);
    await untilFrames(page, 10);
    await page.click("#why-no-headset");
    await untilFailure(page, "insecure");
    assert.match(await page.textContent("#failure-steps"), /--tls self.*QR code.*fingerprint/s);
    await takePicture(page, "failure_insecure");
    await press(page, "close");
    await page.waitForSelector("#failure", { state: "hidden" });
    await page.click("#tab-view");
    assert.match(await page.textContent("#no-headset"), /need a secure page.*--tls self/s);
  }));

test("a browser without WebXR, and one without a headset, say so in the tab View", async () => {
  const shown = async (page) => {
    await untilGood(page);
    await page.click("#tab-view");
    await page.waitForSelector("#no-headset:not([hidden])");
    return page.textContent("#no-headset");
  };
  await withPage(server.url, { prepare: () => delete Navigator.prototype.xr }, async (page) => {
    assert.match(await shown(page), /This browser has no WebXR/);
    assert.ok(await page.isHidden("#headset"));
  });
  await withPage(server.url, {}, async (page) => assert.match(await shown(page), /No headset was found/));
});

test("a browser without WebGL 2 reads what to do", async () => {
  const plain = await launchBrowser(["--disable-3d-apis"]);
  try {
    const page = await openPage(plain, server.url, { viewport: kPhone });
    await untilFailure(page, "no-webgl");
    assert.match(await page.textContent("#failure-steps"), /hardware acceleration/);
    await takePicture(page, "failure_no_webgl");
  } finally {
    await plain.close();
  }
});

test("a page whose script does not start says so after a moment", async () => {
  const context = await browser.newContext();
  try {
    await context.route("**/main.js", (route) => route.fulfill({ status: 404, body: "" }));
    const page = await context.newPage();
    await page.goto(server.url);
    assert.ok(await page.isHidden("#no-start"));
    // The moment is an animation.
    await page.evaluate(() => document.getAnimations().forEach((one) => one.finish()));
    assert.ok(await page.isVisible("#no-start"));
  } finally {
    await context.close();
  }
});

test("a browser without WebAssembly reads what to do", () =>
  withPage(server.url, { prepare: () => delete window.WebAssembly }, (page) => untilFailure(page, "no-webassembly")));

test("files that do not arrive are loaded again, and a worker that does not start is told", async () => {
  const context = await browser.newContext({ viewport: kQuick });
  try {
    await context.route("**/clothstream_core.wasm", (route) => route.fulfill({ status: 503, body: "" }));
    const page = await openPage(context, server.url, { draws: false });
    await untilFailure(page, "not-loaded");
    assert.match(await said(page), /503/);
    await context.unroute("**/clothstream_core.wasm");
    await untilGood(page);
    await context.route("**/worker.js", (route) => route.fulfill({ status: 404, body: "" }));
    await page.reload();
    await untilFailure(page, "worker");
    await context.unroute("**/worker.js");
    await press(page, "reload");
    await untilGood(page);
  } finally {
    await context.close();
  }
});

test("lost graphics are explained, with a button to reload", () =>
  withPage(server.url, {}, async (page) => {
    await untilGood(page);
    await page.evaluate(() => document.getElementById("canvas").getContext("webgl2").getExtension("WEBGL_lose_context").loseContext());
    await untilFailure(page, "graphics-lost");
    await takePicture(page, "graphics_lost");
    await press(page, "reload");
    await untilGood(page);
  }));

test("a server of another version is told with a button to reload", async () => {
  const link = await makeLink(server.port);
  try {
    // ServerMessage with a fatal Error: UNSUPPORTED_VERSION.
    const text = "this server speaks 2";
    link.answerStreams(Buffer.from([0x42, 6 + text.length, 0x08, 4, 0x12, text.length, ...Buffer.from(text), 0x18, 1]));
    await withPage(link.url, {}, async (page) => {
      await untilFailure(page, "version");
      assert.equal(await said(page), "This server speaks 2.");
      link.answerStreams(undefined);
      await press(page, "reload");
      await untilGood(page);
    });
  } finally {
    link.close();
  }
});

test("a refused local network is explained, and the page connects when it is allowed", async () => {
  const link = await makeLink(server.port);
  try {
    await withPage(link.url, {}, async (page) => {
      await untilGood(page);
      const browserOfPage = await page.context().newCDPSession(page);
      const { targetInfo } = await browserOfPage.send("Target.getTargetInfo");
      const permit = (setting) =>
        browserOfPage.send("Browser.setPermission", {
          permission: { name: "local-network-access" },
          setting,
          origin: new URL(link.url).origin,
          browserContextId: targetInfo.browserContextId,
        });
      await permit("denied");
      link.cut();
      await untilFailure(page, "network-denied");
      await takePicture(page, "failure_network_denied");
      link.restore();
      await permit("granted");
      await untilGood(page);
    });
  } finally {
    link.close();
  }
});

test("the figures show a stall of 300 ms as one of at least 200 ms, and play-out recovers; longer stalls are shown until they end", async () => {
  const link = await makeLink(server.port);
  try {
    // Datagrams would not pass the link.
    await withPage(`${link.url}?transport=tcp`, {}, async (page) => {
      await untilGood(page);
      await untilFrames(page, 60);
      // A busy machine may notice the frames around the stall a little late.
      await link.stall(300);
      await page.waitForFunction(() => window.clothstream.longestPause >= 200);
      // Play-out neither holds nor leads on for half a second.
      await page.waitForFunction(() => {
        const { heldMs, ledOnMs } = window.clothstream.stages;
        const now = performance.now();
        if (window.calm?.at !== `${heldMs} ${ledOnMs}`) window.calm = { at: `${heldMs} ${ledOnMs}`, since: now };
        return now - window.calm.since > 500;
      });
      await page.focus("#canvas");
      await page.keyboard.press("h");
      await page.waitForFunction(() => Number(/longest pause (\d+) ms/.exec(document.getElementById("hud-canvas").ariaLabel)?.[1]) >= 200);
      await link.stall(1500);
      await untilFailure(page, "late");
      assert.match(await page.textContent("#failure-wait"), /^The longest pause was \d+\.\d s\.$/);
      await takePicture(page, "failure_late");
      await press(page, "view");
      assert.equal(await page.evaluate(() => document.activeElement.id), "quality");
      await page.waitForSelector("#failure", { state: "hidden" });
    });
  } finally {
    link.close();
  }
});
