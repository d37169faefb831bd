// SPDX-License-Identifier: MIT
// A server with two scenes of a size: the moving curtain with its ball, and a hanging one that waits for hands.
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { startServer } from "../../page/server.mjs";
import { copyWithTimedWorker } from "./timed_worker.mjs";

// The curtain of server/scenes with another number of nodes, and the same mass per node.
async function resizedCurtain(size) {
  const scene = JSON.parse(await readFile(new URL("../../../server/scenes/curtain.json", import.meta.url), "utf8"));
  const [cloth] = scene.cloths;
  cloth.mass *= size ** 2 / (cloth.grid.rows * cloth.grid.columns);
  cloth.grid.rows = cloth.grid.columns = size;
  cloth.pins[0].lastColumn = size - 1;
  return scene;
}

// Calls `use` with the addresses of both scenes. `built` is the folder of the built page.
export async function withScenes(built, size, use) {
  const folder = await mkdtemp(join(tmpdir(), "clothstream-bench-page-"));
  let server;
  try {
    const moving = { ...(await resizedCurtain(size)), name: "moving" };
    const still = { ...(await resizedCurtain(size)), name: "still", colliders: [] };
    const page = join(folder, "page");
    await copyWithTimedWorker(built, page);
    const options = ["--page", page];
    for (const scene of [moving, still]) {
      const file = join(folder, `${scene.name}.json`);
      await writeFile(file, JSON.stringify(scene));
      options.push("--scene-file", file);
    }
    server = await startServer(0, [...options, "--scene", "moving"]);
    await use({ moving: `${server.url}?scene=moving`, still: `${server.url}?scene=still` });
  } finally {
    await server?.stop();
    await rm(folder, { recursive: true });
  }
}
