// SPDX-License-Identifier: MIT
// Sizes of the page's files as a server with gzip sends them.
import { readdir, readFile } from "node:fs/promises";
import { join } from "node:path";
import { gzipSync } from "node:zlib";

const kGoal = 400; // kB
// Files that the page loads. The self-test is a page of its own (docs/selftest.md).
const kFiles = ["index.html", "main.css", "main.js", "worker.js", "clothstream_core.wasm"];

export async function bundleRows(folder) {
  const rows = [];
  for (const name of kFiles) {
    const bytes = await readFile(join(folder, name));
    rows.push({ figure: `${name}, gzipped`, value: gzipSync(bytes, { level: 9 }).length / 1000, unit: "kB" });
  }
  const others = (await readdir(folder)).filter((name) => !kFiles.includes(name) && !name.startsWith("selftest."));
  if (others.length > 0) throw new Error(`${folder} has files that bundle.mjs does not know: ${others.join(", ")}`);
  const sum = rows.reduce((total, { value }) => total + value, 0);
  return [...rows, { figure: "page, gzipped", value: sum, unit: "kB", goal: kGoal, most: true }];
}
