// SPDX-License-Identifier: MIT
// Writes the licences of what others made: of the client package, or of the whole page. Usage: node write_licenses.mjs
// client|page FILE
import { readdirSync, readFileSync, writeFileSync } from "node:fs";

const kDebian = "/usr/share/doc";
// Its name has the version of LLVM. Debian installs one of them at most.
const libcxx = readdirSync(kDebian).find((name) => /^libc\+\+-\d+-dev-wasm32$/.test(name));
if (!libcxx) {
  console.error(`write_licenses.mjs: ${kDebian} has no licence of libc++ for wasm32; install Debian's libc++-dev-wasm32`);
  process.exit(1);
}
const kCore = [
  ["libc++, libc++abi and compiler-rt of LLVM", `${kDebian}/${libcxx}/copyright`],
  ["wasi-libc", "/usr/share/doc/wasi-libc/copyright"],
  ["protozero", "/usr/share/doc/libprotozero-dev/copyright"],
];
const kClient = [["fzstd", new URL("node_modules/fzstd/LICENSE", import.meta.url)]];
const kPage = [
  ["three.js", new URL("node_modules/three/LICENSE", import.meta.url)],
  ["Draco", "/usr/share/doc/libdraco-dev/copyright"],
  ["Apache License, version 2.0, of which some of the texts above speak", "/usr/share/common-licenses/Apache-2.0"],
];
const parts = { client: [...kCore, ...kClient], page: [...kCore, ...kPage] };

const [kind, file] = process.argv.slice(2);
if (!(kind in parts) || !file) {
  console.error("Usage: node write_licenses.mjs client|page FILE");
  process.exit(2);
}
const text = parts[kind].map(([name, source]) => `${"=".repeat(80)}\n${name}\n${"=".repeat(80)}\n\n${readFileSync(source, "utf8").trim()}\n`);
writeFileSync(file, `ClothStream contains the following works of others, under their own licences.\n\n${text.join("\n")}`);
