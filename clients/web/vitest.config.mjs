// SPDX-License-Identifier: MIT
// Tests of modules that need neither a browser nor a server. They lie in tests/page/pure.
import { fileURLToPath } from "node:url";

const path = (file) => fileURLToPath(new URL(file, import.meta.url));

export default {
  root: path("."),
  resolve: {
    alias: { "@clothstream/client": path("client/src/index.ts"), "@clothstream/three": path("three/src/index.ts") },
    // The tests are outside of the root, but take these from its node_modules.
    dedupe: ["three", "vitest"],
  },
  server: { fs: { allow: [path("../..")] } },
  test: { dir: path("../../tests/page/pure"), include: ["**/*.test.ts"] },
};
