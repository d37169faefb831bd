// SPDX-License-Identifier: MIT
// Scene files for the tests.

import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";

// Writes the scene "swing" with a rod at rest, so that a late page still finds the cloth where it was drawn.
export async function writeHangingSheet(folder) {
  const swing = JSON.parse(await readFile(new URL("../../server/scenes/swing.json", import.meta.url), "utf8"));
  delete swing.cloths[0].attachments[0].motion;
  const file = join(folder, "hanging.json");
  await writeFile(file, JSON.stringify({ ...swing, name: "hanging" }));
  return file;
}
