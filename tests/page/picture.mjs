// SPDX-License-Identifier: MIT
// Makes docs/picture.png and docs/cloth.webp: the page with a collider in the curtain, and one swing of the collider.
// Makes docs/images/dress.png and gown.png: the figures of the scenes "dress" and "gown".
//   CLOTHSTREAM_SERVER=build/release/bin/clothstream-server node tests/page/picture.mjs
// Needs Chromium, and img2webp of Debian's package webp.

import { execFileSync } from "node:child_process";
import { mkdtemp, readFile, readdir, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { launchBrowser, openPage, untilState } from "./browser.mjs";
import { startServer } from "./server.mjs";

const kDocs = fileURLToPath(new URL("../../docs/", import.meta.url));
const kDesktop = { width: 1280, height: 800 };
const kMoving = { width: 560, height: 400 };
const kSwing = 5; // s, period of the collider's motion
const kSmall = { width: 640, height: 480 };
// Scenes with a figure, a time in s when clothes are well seen, and the part of the page where the figure then is.
const kFigures = [
  { scene: "dress", second: 4, clip: { x: 0, y: 80, width: 300, height: 250 } },
  { scene: "gown", second: 2.8, clip: { x: 40, y: 80, width: 300, height: 250 } },
];
const kStart = 6.25; // s, after the first swing
const kFramesPerSecond = 12;
const kSlow = 0.1; // speed of the playback while frames are taken

// Writes the scene "curtain" with a collider that pushes once and then rests deep in the cloth.
async function writePushedCurtain(folder) {
  const source = new URL("../../server/scenes/curtain.json", import.meta.url);
  const curtain = JSON.parse(await readFile(source, "utf8"));
  const { motion } = curtain.colliders[0];
  const [start, end] = motion.keys;
  motion.keys = [start, end, { ...end, time: 600 }, { ...start, time: 603 }];
  const file = join(folder, "curtain.json");
  await writeFile(file, JSON.stringify(curtain));
  return file;
}

async function untilSecond(page, second) {
  await page.waitForFunction((end) => window.clothstream.statistics.tick / 72 > end, second, { timeout: 0 });
}

const folder = await mkdtemp(join(tmpdir(), "clothstream-picture-"));
const browser = await launchBrowser();
let server;
try {
  server = await startServer(0, ["--scene", "curtain", "--scene-file", await writePushedCurtain(folder)]);
  const page = await openPage(browser, server.url, { viewport: kDesktop });
  await untilState(page, "live");
  // Software simulation and software drawing together may be too slow for real time. The notice about it is hidden.
  await page.addStyleTag({ content: "#notice { display: none !important; }" });
  await untilSecond(page, 7);
  await page.screenshot({ path: join(kDocs, "picture.png") });
  await page.close();
  await server.stop();

  for (const { scene, second, clip } of kFigures) {
    server = await startServer(0, ["--scene", scene]);
    const dressed = await openPage(browser, server.url, { viewport: kSmall });
    await untilState(dressed, "live");
    await dressed.addStyleTag({ content: "#notice, .card { display: none !important; }" });
    await untilSecond(dressed, second);
    await dressed.screenshot({ path: join(kDocs, "images", `${scene}.png`), clip });
    await dressed.close();
    await server.stop();
  }

  server = await startServer(0, ["--scene", "curtain", "--record", folder]);
  const recorded = await openPage(browser, server.url);
  await untilState(recorded, "live");
  await untilSecond(recorded, kStart + kSwing + 1);
  await recorded.close();
  await server.stop();

  const [recording] = (await readdir(folder)).filter((name) => name.endsWith(".mcap"));
  server = await startServer(0, ["play", join(folder, recording), "--speed", String(kSlow), "--from", String(kStart)]);
  const player = await openPage(browser, server.url, { viewport: kMoving });
  await untilState(player, "live");
  await player.addStyleTag({ content: ".card { display: none !important; }" });
  const frames = [];
  for (let frame = 0; frame < kSwing * kFramesPerSecond; ++frame) {
    await player.waitForFunction((time) => window.clothstream.playback.position >= time, kStart + frame / kFramesPerSecond);
    const file = join(folder, `${String(frame).padStart(3, "0")}.png`);
    await writeFile(file, await player.screenshot());
    frames.push(file);
  }
  const options = ["-loop", "0", "-lossy", "-q", "75", "-m", "4", "-d", String(Math.round(1000 / kFramesPerSecond))];
  execFileSync("img2webp", [...options, ...frames, "-o", join(kDocs, "cloth.webp")]);
} finally {
  await browser.close();
  await server?.stop();
  await rm(folder, { recursive: true });
}
