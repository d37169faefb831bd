// SPDX-License-Identifier: MIT
// Packs the packages client and three for npm. Usage: node pack.mjs FOLDER CORE RECORDING. FOLDER gets a tarball of each
// package, CORE is clothstream_core.wasm and RECORDING clothstream_recording.wasm. `tsc --build client three` has written
// their modules to dist.
import { execFileSync } from "node:child_process";
import { cpSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import ts from "typescript";

const [folder, core, recording] = process.argv.slice(2);
if (!recording) {
  console.error("Usage: node pack.mjs FOLDER CORE RECORDING");
  process.exit(2);
}
const web = fileURLToPath(new URL(".", import.meta.url));

// Adds ".js" to the relative imports of a module or of its types. Browsers, and webpack in packages of modules, find no
// file without it.
function withExtensions(code) {
  const { importedFiles } = ts.preProcessFile(code, true, true);
  const ends = importedFiles.filter(({ fileName }) => fileName.startsWith(".")).map(({ pos, fileName }) => code.indexOf(fileName, pos) + fileName.length);
  for (const end of ends.sort((a, b) => b - a)) code = `${code.slice(0, end)}.js${code.slice(end)}`;
  return code;
}

// Writes the modules and types of all sources of a package. Other files in dist are left out: they may be of deleted sources.
function writeModules(from, to) {
  const sources = readdirSync(join(from, "src"), { recursive: true }).filter((name) => name.endsWith(".ts") && !name.endsWith(".d.ts"));
  for (const source of sources) {
    for (const ending of [".js", ".d.ts"]) {
      const name = source.replace(/\.ts$/, ending);
      mkdirSync(dirname(join(to, name)), { recursive: true });
      writeFileSync(join(to, name), withExtensions(readFileSync(join(from, "dist", name), "utf8")));
    }
  }
}

const staging = mkdtempSync(join(tmpdir(), "clothstream-pack-"));
try {
  mkdirSync(folder, { recursive: true });
  for (const name of ["client", "three"]) {
    const from = join(web, name);
    const to = join(staging, name);
    writeModules(from, join(to, "dist"));
    if (name === "client") {
      cpSync(core, join(to, "dist", "clothstream_core.wasm"));
      cpSync(recording, join(to, "dist", "clothstream_recording.wasm"));
      // Part of the tarball, so that the package needs no other.
      cpSync(join(web, "node_modules/fzstd"), join(to, "node_modules/fzstd"), { recursive: true });
      execFileSync("node", [join(web, "write_licenses.mjs"), "client", join(to, "THIRD_PARTY_LICENSES.txt")]);
    }
    for (const file of ["package.json", "README.md"]) cpSync(join(from, file), join(to, file));
    cpSync(join(web, "../../LICENSE"), join(to, "LICENSE"));
    execFileSync("npm", ["pack", "--silent", "--pack-destination", resolve(folder)], { cwd: to });
  }
} finally {
  rmSync(staging, { recursive: true });
}
