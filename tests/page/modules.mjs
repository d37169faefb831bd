// SPDX-License-Identifier: MIT
// Modules of the page without a browser.

import { createRequire } from "node:module";
import { fileURLToPath } from "node:url";

const web = fileURLToPath(new URL("../../clients/web", import.meta.url));
const { build } = createRequire(`${web}/package.json`)("esbuild");

// Loads TypeScript modules, named by their paths in clients/web, as one.
export async function load(...files) {
  const contents = files.map((file) => `export * from "./${file}";`).join("\n");
  const { outputFiles } = await build({
    stdin: { contents, resolveDir: web, loader: "ts" },
    bundle: true,
    write: false,
    format: "esm",
    tsconfig: `${web}/tsconfig.base.json`,
  });
  return import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);
}
