// SPDX-License-Identifier: MIT
// Makes the package for Unity: gathers this folder, the sources of the client core and what they include, licences, and a
// .meta file for each asset. Usage: node pack.mjs FOLDER SOURCE...
// FOLDER gets the folder com.clothstream.client and a tarball of it. SOURCE: the .cpp files of core and decoder.
import { execFileSync } from "node:child_process";
import { cpSync, existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { dirname, join, relative, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { writeMetas } from "./metas.mjs";

const [folder, ...sources] = process.argv.slice(2);
if (sources.length === 0) {
  console.error("Usage: node pack.mjs FOLDER SOURCE...");
  process.exit(2);
}
const unity = fileURLToPath(new URL(".", import.meta.url));
const root = resolve(unity, "../..");
const kParts = ["package.json", "README.md", "CHANGELOG.md", "Editor", "Runtime", "Samples~"];
const kLibrary = "Runtime/Plugins/Android/ClothStreamCore.androidlib";
// Headers of others, from the packages libprotozero-dev, libexpected-dev and libsimde-dev of Debian.
const kOthers = ["protozero", "tl", "simde"];
const kSystem = "/usr/include";
const kLicenses = [
  ["protozero", "/usr/share/doc/libprotozero-dev/copyright"],
  ["tl::expected", "/usr/share/doc/libexpected-dev/copyright"],
  ["SIMDe", "/usr/share/doc/libsimde-dev/copyright"],
];

// Copies a file to the same place below `target`, and all files of ours and of kOthers that it includes.
function gather(path, base, target, done) {
  const name = relative(base, path);
  if (done.has(name)) return;
  done.add(name);
  const text = readFileSync(path, "utf8");
  mkdirSync(dirname(join(target, name)), { recursive: true });
  writeFileSync(join(target, name), text);
  for (const [, mark, included] of text.matchAll(/^\s*#\s*include\s*(["<])([^">]+)[">]/gm)) {
    const isOther = kOthers.includes(included.split("/")[0]);
    if (isOther) gather(join(kSystem, included), kSystem, target, done);
    else if (mark === '"' && base === root) gather(join(root, included), root, target, done);
    else if (mark === '"' && existsSync(join(dirname(path), included))) gather(join(dirname(path), included), base, target, done);
  }
}

const { name, version } = JSON.parse(readFileSync(join(unity, "package.json"), "utf8"));
const packed = join(folder, name);
rmSync(packed, { recursive: true, force: true });
mkdirSync(packed, { recursive: true });
for (const part of kParts) cpSync(join(unity, part), join(packed, part), { recursive: true });
cpSync(join(root, "LICENSE"), join(packed, "LICENSE.md"));

const cpp = join(packed, kLibrary, "cpp");
const done = new Set();
for (const source of sources) gather(resolve(source), root, cpp, done);
const includes = sources.map((source) => `#include "${relative(root, resolve(source))}"\n`).sort();
writeFileSync(join(cpp, "clothstream_core.cpp"), `// All sources of the client core. Made by pack.mjs.\n${includes.join("")}`);

const notices = kLicenses.map(([work, file]) => `# ${work}\n\n${readFileSync(file, "utf8").trim()}\n`);
writeFileSync(join(packed, "Third Party Notices.md"), `ClothStream contains the following works of others, under their own licences.\n\n${notices.join("\n")}`);

writeMetas(packed, name);
const tarball = join(resolve(folder), `${name}-${version}.tgz`);
const stable = ["--sort=name", "--mtime=@0", "--owner=0", "--group=0", "--numeric-owner", "--use-compress-program=gzip -n"];
execFileSync("tar", [...stable, "-cf", tarball, "-C", folder, `--transform=s,^${name},package,`, name]);
