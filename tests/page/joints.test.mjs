// SPDX-License-Identifier: MIT
// A client of the npm package moves a joint of a collider, and a page draws the collider and the cloth where they went.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { copyFile, mkdtemp, rm } from "node:fs/promises";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { after, before, test } from "node:test";
import { kChromium, launchBrowser, openPage, untilFrames, untilState } from "./browser.mjs";
import { startServer } from "./server.mjs";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

const repository = new URL("../../", import.meta.url);
const require = createRequire(new URL("clients/web/package.json", repository));
const kParticipant = 2; // cs_role
// The page draws hulls slightly smaller (collider_meshes.ts).
const kShrink = 0.985;

let folder;
let server;
let browser;
let frames; // of the package's part for tests
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-joints-"));
  const outfile = join(folder, "testing/frames.mjs");
  const source = fileURLToPath(new URL("clients/web/client/src/testing/frames.ts", repository));
  await require("esbuild").build({ entryPoints: [source], bundle: true, platform: "node", format: "esm", outfile });
  await copyFile(process.env.CLOTHSTREAM_CORE_WASM, join(folder, "clothstream_core.wasm"));
  ({ frames } = await import(pathToFileURL(outfile)));
  server = await startServer(0, ["--scene", "arm", "--scene-file", fileURLToPath(new URL("tests/e2e/arm.json", repository))]);
  browser = await launchBrowser();
});
after(async () => {
  await browser?.close();
  await server?.stop();
  if (folder) await rm(folder, { recursive: true });
});

// Farthest points of the drawn block, in its frame, and of the sheet along z.
const look = (page) =>
  page.evaluate(() => {
    const farthest = (values) => values.reduce((most, value, i) => (i % 3 === 2 ? Math.max(most, value) : most), 0);
    const { drawnColliderVertices, positions } = window.clothstream;
    return { front: farthest(drawnColliderVertices[0]), sheet: farthest(positions) };
  });

// Moves the front of the block by these distances along z, one for each frame.
async function moveFront(distances) {
  const waiting = [...distances];
  for await (const { client, hashMatches } of frames(`ws://127.0.0.1:${server.port}/stream`, { WebSocket: require("ws"), role: kParticipant })) {
    assert.ok(hashMatches);
    const z = waiting.shift();
    // The frame after the last message is received when the server has seen that message or will see it.
    if (z === undefined) return client.frames.hullVertices(client.frames.colliders()[0]).slice();
    client.input.moveJoints("block", [0, 0, 0, 0, 0, 0, 1, 0, 0, z, 0, 0, 0, 1]);
  }
}

test("a moved joint moves the drawn collider and the cloth of another client", async () => {
  const page = await openPage(browser, server.url);
  try {
    await untilState(page, "live");
    await untilFrames(page, 5);
    await page.waitForFunction(() => window.clothstream.drawnColliderVertices.length === 1);
    const before = await look(page);
    assert.ok(Math.abs(before.front - 0.1 * kShrink) < 1e-5 && before.sheet < 0.01, JSON.stringify(before));
    // Small steps, because the block would jump through the sheet if several came to the server at once.
    const corners = await moveFront(Array.from({ length: 20 }, (_, i) => 0.02 * (i + 1)));
    assert.equal(corners.length, 3 * 8);
    const wanted = 0.5 * kShrink;
    const moved = ([front, sheet]) => {
      const farthest = (values) => values.reduce((most, value, i) => (i % 3 === 2 ? Math.max(most, value) : most), 0);
      const { drawnColliderVertices, positions } = window.clothstream;
      return Math.abs(farthest(drawnColliderVertices[0]) - front) < 1e-4 && farthest(positions) > sheet;
    };
    await page.waitForFunction(moved, [wanted, 0.19]).catch(async (error) => {
      throw new Error(`the page shows ${JSON.stringify(await look(page))}`, { cause: error });
    });
    assert.deepEqual(page.errors, []);
  } finally {
    await page.close();
  }
});
