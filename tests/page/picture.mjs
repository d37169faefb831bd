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
const kScene = { width: 1120, height: 960 };
const kMiddle = { x: 100, y: 320, width: 720, height: 600 };
// When a scene shows what it is for (s), and the part of the page where that is (pixels).
const kPictures = [
  { scene: "dress", second: 1.5, part: { x: 0, y: 280, width: 400, height: 320 } },
  { scene: "gown", second: 2.8, part: { x: 20, y: 280, width: 400, height: 320 } },
  { scene: "balloon", second: 0.5, part: { x: 160, y: 160, width: 660, height: 600 } },
  { scene: "cushion", second: 4.5, part: kMiddle },
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

// Returns the file of a recording of the first seconds of a scene, and for how many seconds the page saw them: a slow scene
// takes longer.
async function recorded(scene, seconds) {
  const own = await mkdtemp(join(folder, "recorded-"));
  let length = 0;
  const started = await startServer(0, ["--scene", scene, "--record", own]);
  try {
    const page = await openPage(browser, started.url);
    await untilState(page, "live");
    const begin = performance.now();
    await untilSecond(page, seconds);
    length = (performance.now() - begin) / 1000;
    await page.close();
  } finally {
    await started.stop();
  }
  const [file] = await readdir(own);
  return { file: join(own, file), length };
}

// Plays a recording slowly, because a picture takes long, and calls `use` with a page that shows nothing else.
async function playSlowly(recording, from, viewport, use) {
  const started = await startServer(0, ["play", recording, "--speed", String(kSlow), "--from", String(from)]);
  try {
    const page = await openPage(browser, started.url, { viewport });
    await untilState(page, "live");
    await page.addStyleTag({ content: ".card, #notice, #panel { display: none !important; }" });
    await use(page);
  } finally {
    await started.stop();
  }
}

async function pictureOf({ scene, second, part }) {
  const { file, length } = await recorded(scene, second + 1);
  await playSlowly(file, (length * second) / (second + 1), kScene, async (page) => {
    await untilSecond(page, second);
    await page.screenshot({ path: join(kDocs, "images", `${scene}.png`), clip: part });
  });
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

async function movingPicture() {
  const frames = [];
  const { file: curtain } = await recorded("curtain", kStart + kSwing + 1);
  await playSlowly(curtain, kStart, kMoving, async (page) => {
    for (let frame = 0; frame < kSwing * kFramesPerSecond; ++frame) {
      await page.waitForFunction((time) => window.clothstream.playback.position >= time, kStart + frame / kFramesPerSecond);
      const file = join(folder, `${String(frame).padStart(3, "0")}.png`);
      await writeFile(file, await page.screenshot());
      frames.push(file);
    }
  });
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
