// SPDX-License-Identifier: MIT
// Cost of the page: bytes, time to the first frame, time and memory a frame, and how well hands hold the cloth.
// `./dev bench page` runs it. A figure is printed only after its run is checked. No goal fails the run.
import { existsSync } from "node:fs";
import { cpus } from "node:os";
import { join } from "node:path";
import { parseArgs } from "node:util";
import { kChromium, launchBrowser } from "../../page/browser.mjs";
import { bundleRows } from "./bundle.mjs";
import { firstFrameRows } from "./first_frame.mjs";
import { withScenes } from "./scenes.mjs";
import { threadRows } from "./threads.mjs";
import { touchRows } from "./touch.mjs";

const kUsage = `usage: node page.mjs [--build DIR] [--size N] [--frames N] [--loads N] [--grabs N] [--json] [--check]
  --build DIR   build directory. Default: build/release
  --size N      rows and columns of the cloth, 16 to 256. Default: 100
  --frames N    drawn frames that are timed, 50 to 10000. Default: 2000
  --loads N     times that the page is opened cold and cached, 1 to 50. Default: 5
  --grabs N     pinches, 1 to 100. Default: 10
  --json        print the rows as one JSON array
  --check       a short run: --size 32 --frames 100 --loads 1 --grabs 2`;
const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test

function fail(text) {
  console.error(`page.mjs: ${text}`);
  process.exit(2);
}

function readOptions() {
  let values;
  try {
    const text = (value) => ({ type: "string", default: value });
    const flag = { type: "boolean", default: false };
    ({ values } = parseArgs({
      options: {
        build: text("build/release"),
        size: text(undefined),
        frames: text(undefined),
        loads: text(undefined),
        grabs: text(undefined),
        json: flag,
        check: flag,
        help: flag,
      },
    }));
  } catch (error) {
    fail(`${error.message}\n${kUsage}`);
  }
  if (values.help) {
    console.log(kUsage);
    process.exit(0);
  }
  const whole = (name, usual, brief, least, most) => {
    const given = values[name] ?? (values.check ? brief : usual);
    const value = Number(given);
    if (!Number.isInteger(value) || value < least || value > most) fail(`--${name}: ${given} is not allowed; use ${least} to ${most}`);
    return value;
  };
  return {
    build: values.build,
    json: values.json,
    size: whole("size", 100, 32, 16, 256),
    frames: whole("frames", 2000, 100, 50, 10000),
    loads: whole("loads", 5, 1, 1, 50),
    grabs: whole("grabs", 10, 2, 1, 100),
  };
}

// Text of the goal, and whether it is reached.
function verdict({ value, goal, most }) {
  if (goal === undefined) return "";
  const reached = most ? value <= goal : value >= goal;
  return `${most ? "at most" : "at least"} ${goal}: ${reached ? "reached" : "missed"}`;
}

function print(rows, engine) {
  console.log(`${engine}; ${cpus().length} cores of ${cpus()[0]?.model ?? "an unknown processor"}`);
  const table = rows.map((row) => [row.figure, Number(row.value.toPrecision(3)).toLocaleString("en"), row.unit, verdict(row)]);
  const widths = [0, 1].map((column) => Math.max(...table.map((cells) => cells[column].length)));
  for (const [figure, value, unit, goal] of table) console.log(`${figure.padEnd(widths[0])}  ${value.padStart(widths[1])} ${unit.padEnd(12)} ${goal}`);
}

const options = readOptions();
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}
process.env.CLOTHSTREAM_SERVER ??= join(options.build, "bin/clothstream-server");
let browser;
try {
  const built = join(options.build, "web");
  const rows = await bundleRows(built);
  await withScenes(built, options.size, async (urls) => {
    rows.push(...(await firstFrameRows(urls.moving, options)));
    browser = await launchBrowser();
    rows.push(...(await threadRows(browser, urls.moving, options)));
    rows.push(...(await touchRows(browser, urls.still, options)));
  });
  const engine = `Chromium ${browser.version()}`;
  if (options.json) console.log(JSON.stringify(rows.map((row) => ({ suite: "page", vertices: options.size ** 2, ...row, verdict: verdict(row), engine })), null, 2));
  else print(rows, engine);
} catch (error) {
  console.error(`page.mjs: ${error.message}`);
  process.exitCode = 1;
} finally {
  await browser?.close();
}
