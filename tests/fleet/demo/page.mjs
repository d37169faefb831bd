// SPDX-License-Identifier: MIT
// Opens a page in Chromium without a window, and prints each frame, state and text that it shows as a line of JSON.
//   node page.mjs URL
// "picture NAME" on the standard input writes NAME.png to CLOTHSTREAM_SCREENSHOTS. The end of the input closes the page.
import { createInterface } from "node:readline";
import { launchBrowser, kPicture, openPage, takePixels } from "../../page/browser.mjs";

const kReadMs = 50;
// Milliseconds between drawn frames, in addition to those of openPage(). The servers need the processors.
const kDrawPauseMs = 150;

const say = (object) => console.log(JSON.stringify(object));

// Runs in the page: notes what changes. Times are seconds since 1970.
function watch(pauseMs) {
  const kLookMs = 10;
  const draw = window.requestAnimationFrame;
  window.requestAnimationFrame = (callback) => setTimeout(() => draw(callback), pauseMs);
  const seen = (window.demoSeen = []);
  const last = {};
  const note = (what, value, at) => {
    if (last[what] === value) return;
    last[what] = value;
    if (value) seen.push({ at, [what]: value });
  };
  const textOf = (id) => {
    const shown = document.getElementById(id);
    return shown && !shown.hidden ? shown.innerText.trim().replace(/\s+/g, " ") : "";
  };
  setInterval(() => {
    const page = window.clothstream;
    if (!page) return;
    const at = (performance.timeOrigin + performance.now()) / 1000;
    note("state", page.state, at);
    if (page.state === "live") note("tick", page.statistics?.tick, at);
  }, kLookMs);
  setInterval(() => note("said", textOf("notice"), Date.now() / 1000), 20 * kLookMs);
}

// Writes a picture, and says how much of it is cloth.
async function picture(page, name) {
  const { statistics, points, vertices } = await page.evaluate(() => {
    const { statistics, drawn, project, canvas } = window.clothstream;
    const points = [];
    for (const positions of drawn)
      for (let i = 0; i < positions.length; i += 3) points.push(project([...positions.subarray(i, i + 3)]));
    const open = points.filter(([x, y]) => document.elementFromPoint(x, y) === canvas);
    return { statistics: { ...statistics }, points: open, vertices: points.length };
  });
  const pixels = await takePixels(page, name);
  const colours = points.map(([x, y]) => pixels.colourAt(x, y));
  say({
    picture: name,
    vertices,
    cloth: colours.filter(isCloth).length / Math.max(1, colours.length),
    wrongFrames: statistics.decodeErrors + statistics.hashMismatches,
  });
}

function isCloth([red, green]) {
  return red > 1.5 * green;
}

const browser = await launchBrowser();
try {
  const page = await openPage(browser, process.argv[2], { prepare: `(${watch})(${kDrawPauseMs})`, viewport: kPicture });
  await page.click("#panel-close");
  // Software drawing makes frames late. The card about it would cover the cloth.
  await page.addStyleTag({ content: '#failure[data-kind="late"] { display: none !important; }' });
  page.on("crash", () => say({ error: "the page crashed" }));
  let pictures = Promise.resolve();
  let open = true;
  const input = createInterface({ input: process.stdin });
  input.on("line", (line) => {
    const [command, name] = line.split(" ");
    if (command === "picture") pictures = pictures.then(() => picture(page, name));
  });
  input.once("close", () => (open = false));
  for (let reported = 0; open; ) {
    for (const event of await page.evaluate(() => window.demoSeen.splice(0))) say(event);
    for (; reported < page.errors.length; ++reported) say({ error: page.errors[reported] });
    await new Promise((done) => setTimeout(done, kReadMs));
  }
  await pictures;
} finally {
  await browser.close();
}
