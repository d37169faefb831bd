// SPDX-License-Identifier: MIT
// Sizes of the page's files as a server with gzip sends them.
import { readdir, readFile } from "node:fs/promises";
import { join } from "node:path";
import { gzipSync } from "node:zlib";

const kGoal = 400; // kB
// Files that the page loads when it starts.
const kFiles = ["index.html", "main.css", "main.js", "worker.js", "clothstream_core.wasm"];

export async function bundleRows(folder) {
  const sizeOf = async (name) => gzipSync(await readFile(join(folder, name)), { level: 9 }).length / 1000;
  const row = (figure, value) => ({ figure: `${figure}, gzipped`, value, unit: "kB" });
  const rows = [];
  for (const name of kFiles) rows.push(row(name, await sizeOf(name)));
  const sum = rows.reduce((total, { value }) => total + value, 0);
  rows.push({ ...row("page", sum), goal: kGoal, most: true });
  for (const name of (await readdir(folder)).filter((one) => !kFiles.includes(one)).sort()) rows.push(row(`  not part of it: ${name}`, await sizeOf(name)));
  return rows;
}
