// SPDX-License-Identifier: MIT
// Makes the pictures "page" (docs/picture.png, the page with a collider in the curtain), "cloth" (docs/cloth.webp, one swing
// of the collider), and those of built-in scenes (docs/images/SCENE.png). With names it makes only those.
//   CLOTHSTREAM_SERVER=build/release/bin/clothstream-server node tests/page/picture.mjs [NAME...]
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
const kScene = { width: 1280, height: 960 };
// When a scene shows what it is for (s), and the part of the page where that is (pixels).
const kPictures = [
  { scene: "dress", second: 4, part: { x: 0, y: 160, width: 600, height: 500 } },
  { scene: "balloon", second: 1, part: { x: 0, y: 0, width: 1280, height: 960 } },
  { scene: "cushion", second: 2, part: { x: 0, y: 0, width: 1280, height: 960 } },
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
  await page.waitForFunction((end) => window.clothstream.statistics.tick / 72 > end, second);
}

async function pictureOf({ scene, second, part }) {
  const started = await startServer(0, ["--scene", scene]);
  try {
    const page = await openPage(browser, started.url, { viewport: kScene });
    await untilState(page, "live");
    await page.addStyleTag({ content: "#notice, .card { display: none !important; }" });
    await untilSecond(page, second);
    await page.screenshot({ path: join(kDocs, "images", `${scene}.png`), clip: part });
    await page.close();
  } finally {
    await started.stop();
  }
}

async function pictureOfPage() {
  const started = await startServer(0, ["--scene", "curtain", "--scene-file", await writePushedCurtain(folder)]);
  try {
    const page = await openPage(browser, started.url, { viewport: kDesktop });
    await untilState(page, "live");
    // Software simulation and software drawing together may be too slow for real time. The notice about it is hidden.
    await page.addStyleTag({ content: "#notice { display: none !important; }" });
    await untilSecond(page, 7);
    await page.screenshot({ path: join(kDocs, "picture.png") });
    await page.close();
  } finally {
    await started.stop();
  }
}

async function recordSwing() {
  const started = await startServer(0, ["--scene", "curtain", "--record", folder]);
  try {
    const page = await openPage(browser, started.url);
    await untilState(page, "live");
    await untilSecond(page, kStart + kSwing + 1);
    await page.close();
  } finally {
    await started.stop();
  }
  const [recording] = (await readdir(folder)).filter((name) => name.endsWith(".mcap"));
  return join(folder, recording);
}

async function movingPicture() {
  const recording = await recordSwing();
  const started = await startServer(0, ["play", recording, "--speed", String(kSlow), "--from", String(kStart)]);
  const frames = [];
  try {
    const page = await openPage(browser, started.url, { viewport: kMoving });
    await untilState(page, "live");
    await page.addStyleTag({ content: ".card { display: none !important; }" });
    for (let frame = 0; frame < kSwing * kFramesPerSecond; ++frame) {
      await page.waitForFunction((time) => window.clothstream.playback.position >= time, kStart + frame / kFramesPerSecond);
      const file = join(folder, `${String(frame).padStart(3, "0")}.png`);
      await writeFile(file, await page.screenshot());
      frames.push(file);
    }
  } finally {
    await started.stop();
  }
  const options = ["-loop", "0", "-lossy", "-q", "75", "-m", "4", "-d", String(Math.round(1000 / kFramesPerSecond))];
  execFileSync("img2webp", [...options, ...frames, "-o", join(kDocs, "cloth.webp")]);
}

const pictures = new Map([
  ["page", pictureOfPage],
  ["cloth", movingPicture],
  ...kPictures.map((picture) => [picture.scene, () => pictureOf(picture)]),
]);
const names = process.argv.length > 2 ? process.argv.slice(2) : [...pictures.keys()];
const unknown = names.filter((name) => !pictures.has(name));
if (unknown.length > 0) throw new Error(`There is no picture ${unknown.join(", ")}; there are ${[...pictures.keys()].join(", ")}.`);

const folder = await mkdtemp(join(tmpdir(), "clothstream-picture-"));
const browser = await launchBrowser();
try {
  for (const name of names) await pictures.get(name)();
} finally {
  await browser.close();
  await rm(folder, { recursive: true });
}
