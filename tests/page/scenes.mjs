// SPDX-License-Identifier: MIT
// Scene files for the tests.

import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";

// Writes a scene with a square sheet, which lies level 12 cm above the origin and sticks out to both sides of it along z:
// 42 cm towards -z, and 18 cm towards z. It falls, since nothing is below it.
export async function writeFallingSheet(folder) {
  const sheet = {
    name: "sheet",
    grid: { rows: 25, columns: 25, width: 0.6, height: 0.6, pose: { position: { y: 0.12, z: 0.18 }, orientation: { x: Math.SQRT1_2, w: Math.SQRT1_2 } } },
    mass: 0.12,
    structural: { stiffness: 12, damping: 0.002 },
    shear: { stiffness: 4, damping: 0.001 },
    bend: { stiffness: 0.5, damping: 0.001 },
    damping: 0.8,
    drag: 0.5,
    thickness: 0.002,
  };
  const file = join(folder, "falling.json");
  await writeFile(file, JSON.stringify({ name: "falling", description: "A sheet that falls.", simulationRate: 72, streamRate: 36, substeps: 8, cloths: [sheet] }));
  return file;
}

// Writes the scene "swing" with a rod at rest, so that a late page still finds the cloth where it was drawn.
export async function writeHangingSheet(folder) {
  const swing = JSON.parse(await readFile(new URL("../../server/scenes/swing.json", import.meta.url), "utf8"));
  delete swing.cloths[0].attachments[0].motion;
  const file = join(folder, "hanging.json");
  await writeFile(file, JSON.stringify({ ...swing, name: "hanging" }));
  return file;
}
