// SPDX-License-Identifier: MIT
// What a cloth costs a client: to receive it from the server, and to simulate it itself, in the same WebAssembly
// engine. `./dev bench offload` runs it. A size is measured only after both are checked.
import { execFileSync } from "node:child_process";
import { mkdirSync } from "node:fs";
import { cpus } from "node:os";
import { join } from "node:path";
import { parseArgs } from "node:util";
import { instantiate, readCase } from "./case.mjs";
import { checkSimulation, SimulatedCloth } from "./simulated_cloth.mjs";
import { checkStream, StreamedCloth } from "./streamed_cloth.mjs";

const kUsage = `usage: node offload.mjs [--build DIR] [--sizes N,N...] [--frames N] [--rounds N] [--json] [--check]
  --build DIR    build directory. Default: build/release
  --sizes N,...  rows and columns of the cloths, 8 to 512 each. Default: 32,64,100,128,182,256
  --frames N     frames of a pass at 72 Hz, 91 to 7200. Default: 180
  --rounds N     passes of each kind, 1 to 100. Default: 5
  --json         print the rows as one JSON array
  --check        only check, and measure nothing`;
const kSolvers = ["massSpring", "xpbd"];
const kFewSubsteps = 10; // of the scene `curtain`
// Frames that are timed together. Of each group the fastest of all passes counts, because other programs slow a
// processor down, and never speed it up.
const kGroup = 12;

function fail(text) {
  console.error(`offload.mjs: ${text}`);
  process.exit(2);
}

function whole(name, text, least, most) {
  const value = Number(text);
  if (!Number.isInteger(value) || value < least || value > most) fail(`--${name}: ${text} is not allowed; use ${least} to ${most}`);
  return value;
}

function readOptions() {
  let values;
  try {
    ({ values } = parseArgs({
      options: {
        build: { type: "string", default: "build/release" },
        sizes: { type: "string", default: "32,64,100,128,182,256" },
        frames: { type: "string", default: "180" },
        rounds: { type: "string", default: "5" },
        json: { type: "boolean", default: false },
        check: { type: "boolean", default: false },
        help: { type: "boolean", default: false },
      },
    }));
  } catch (error) {
    fail(`${error.message}\n${kUsage}`);
  }
  if (values.help) {
    console.log(kUsage);
    process.exit(0);
  }
  return {
    ...values,
    sizes: values.sizes.split(",").map((size) => whole("sizes", size, 8, 512)),
    frames: whole("frames", values.frames, 91, 7200),
    rounds: whole("rounds", values.rounds, 1, 100),
  };
}

// Records the stream of a size, and returns the case. Exits like the program that records: 77 without a Vulkan device.
function record(options, size) {
  const folder = join(options.build, "offload");
  mkdirSync(folder, { recursive: true });
  const path = join(folder, `${size}_${options.frames}`);
  try {
    execFileSync(join(options.build, "bin/write_offload_case"), ["--size", size, "--frames", options.frames, path], {
      stdio: ["ignore", "inherit", "inherit"],
    });
  } catch (error) {
    process.exit(error.status ?? 2);
  }
  return readCase(path);
}

// Milliseconds of processor time of this process, all threads. Other programs add nothing to it.
function millisecondsOf(work) {
  const before = process.cpuUsage();
  work();
  const { user, system } = process.cpuUsage(before);
  return (user + system) / 1000;
}

// Milliseconds of each group of kGroup frames.
function groupTimes(frames, work) {
  const times = [];
  for (let first = 0; first < frames; first += kGroup)
    times.push(
      millisecondsOf(() => {
        for (let frame = first; frame < Math.min(first + kGroup, frames); ++frame) work(frame);
      }),
    );
  return times;
}

// One pass of each kind.
function measurePasses(core, cloth, of) {
  const frames = of.frames.length;
  const times = {};
  const streamed = new StreamedCloth(core, of);
  times.stream = groupTimes(frames, (index) => streamed.frame(index));
  streamed.destroy();
  for (const solver of kSolvers) {
    const simulated = new SimulatedCloth(cloth, of, solver);
    times[solver] = groupTimes(frames, (tick) => simulated.frame(tick));
    times.present = groupTimes(frames, () => simulated.present());
    simulated.destroy();
  }
  return times;
}

function measure(core, cloth, of, rounds) {
  measurePasses(core, cloth, of); // the engine optimises code that runs often
  const passes = Array.from({ length: rounds }, () => measurePasses(core, cloth, of));
  const perFrame = (kind, choose) =>
    passes[0][kind].reduce((sum, _, group) => sum + choose(passes.map((pass) => pass[kind][group])), 0) / of.frames.length;
  const best = (kind) => perFrame(kind, (times) => Math.min(...times));
  const median = (kind) => perFrame(kind, (times) => times.sort((a, b) => a - b)[Math.floor(times.length / 2)]);
  const bytes = of.frames.reduce((sum, [, size]) => sum + size, 0);
  const row = {
    suite: "offload",
    vertices: of.vertices,
    size: of.rows,
    substeps: of.substeps,
    streamMs: best("stream"),
    streamMsMedian: median("stream"),
    kbitPerSecond: (8e-3 * bytes * of.rate) / of.frames.length,
    bitsPerVertex: (8 * bytes) / (of.frames.length * of.vertices),
    presentMs: best("present"),
  };
  for (const solver of kSolvers) {
    const substepMs = (best(solver) - row.presentMs) / of.substeps;
    row[`${solver}Ms`] = best(solver);
    row[`${solver}MsMedian`] = median(solver);
    row[`${solver}SubstepMs`] = substepMs;
    row[`${solver}FewMs`] = row.presentMs + kFewSubsteps * substepMs;
    // Number of substeps that cost as much as streaming.
    row[`${solver}EvenSubsteps`] = (row.streamMs - row.presentMs) / substepMs;
  }
  return {
    ...row,
    frames: of.frames.length,
    rounds,
    engine: `node ${process.version}, V8 ${process.versions.v8}`,
    processor: cpus()[0]?.model ?? "unknown",
  };
}

// Vertices from which streaming costs less than `kind`, between two sizes by a straight line over logarithms.
function crossing(rows, kind) {
  const gains = rows.map((row) => Math.log(row[kind] / row.streamMs));
  const last = gains.findLastIndex((gain) => gain <= 0);
  if (last < 0) return `at every size measured, ${rows[0].vertices.toLocaleString("en")} vertices and more`;
  if (last === rows.length - 1) return "at no size measured";
  const part = gains[last] / (gains[last] - gains[last + 1]);
  const [a, b] = [rows[last].vertices, rows[last + 1].vertices].map(Math.log);
  return `from about ${Number(Math.exp(a + part * (b - a)).toPrecision(2)).toLocaleString("en")} vertices on`;
}

function print(rows) {
  const number = (value) => (value >= 100 ? value.toFixed(0) : value.toPrecision(3));
  const table = rows.map((row) => ({
    vertices: row.vertices,
    "stream ms": number(row.streamMs),
    "kbit/s": number(row.kbitPerSecond),
    substeps: row.substeps,
    "mass-spring ms": number(row.massSpringMs),
    "XPBD ms": number(row.xpbdMs),
    "mass-spring, 10 substeps": number(row.massSpringFewMs),
    "XPBD, 10 substeps": number(row.xpbdFewMs),
    "stream = mass-spring substeps": number(row.massSpringEvenSubsteps),
    "stream = XPBD substeps": number(row.xpbdEvenSubsteps),
  }));
  console.log(`${rows[0].engine}; ${rows[0].processor}; processor time a frame, mean of ${rows[0].frames} frames, the fastest of ${rows[0].rounds} passes`);
  const columns = Object.keys(table[0]);
  const widths = columns.map((name) => Math.max(name.length, ...table.map((row) => String(row[name]).length)));
  for (const cells of [columns, ...table.map((row) => columns.map((name) => String(row[name])))])
    console.log(cells.map((cell, index) => cell.padStart(widths[index])).join("  "));
  console.log("Streaming costs the client less than");
  console.log(`  mass-spring with the substeps of the server ${crossing(rows, "massSpringMs")}`);
  console.log(`  XPBD with the substeps of the server ${crossing(rows, "xpbdMs")}`);
  console.log(`  mass-spring with ${kFewSubsteps} substeps ${crossing(rows, "massSpringFewMs")}`);
  console.log(`  XPBD with ${kFewSubsteps} substeps ${crossing(rows, "xpbdFewMs")}`);
}

const options = readOptions();
const core = instantiate(join(options.build, "web-wasm/clothstream_core.wasm"));
const cloth = instantiate(join(options.build, "tests/bench/offload/client_cloth.wasm"));
const rows = [];
try {
  for (const size of options.sizes) {
    const of = record(options, size);
    for (const solver of kSolvers) {
      const { distance } = checkSimulation(cloth, of, solver);
      if (options.check) console.log(`${size}x${size}, ${solver}: within ${distance.toExponential(1)} m of the reference; ${of.tolerance.toExponential(1)} m are allowed`);
    }
    checkStream(core, of);
    if (options.check) console.log(`${size}x${size}: ${of.frames.length} frames decode to the server's hashes`);
    else rows.push(measure(core, cloth, of, options.rounds));
  }
} catch (error) {
  console.error(`offload.mjs: ${error.message}`);
  process.exit(1);
}
if (rows.length > 0) {
  if (options.json) console.log(JSON.stringify(rows, null, 2));
  else print(rows);
}
