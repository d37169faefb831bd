// SPDX-License-Identifier: MIT
// Imports between modules of the packages, and of the page, have no cycle.
import { readdirSync, readFileSync } from "node:fs";
import { dirname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";
import { expect, test } from "vitest";

const kRoot = fileURLToPath(new URL("../../../clients/web", import.meta.url));
const kImport = /(?:^|\n)(?:import|export)\b[^;"]*"(\.[^"]+)"/g;

// Relative imports of each module, as paths without extension. Imports of types count, too.
function importsOf(folder: string): Map<string, string[]> {
  const imports = new Map<string, string[]>();
  for (const file of readdirSync(folder, { recursive: true, encoding: "utf8" })) {
    if (!file.endsWith(".ts") || file.endsWith(".d.ts")) continue;
    const path = join(folder, file);
    const found = [...readFileSync(path, "utf8").matchAll(kImport)].map((match) => normalize(join(dirname(path), match[1] ?? "")).replace(/\.(js|ts)$/, ""));
    imports.set(path.replace(/\.ts$/, ""), found);
  }
  return imports;
}

// A circle of modules that import each other, or nothing.
function circleIn(imports: Map<string, string[]>): string[] {
  const finished = new Set<string>();
  const visit = (module: string, path: string[]): string[] => {
    if (path.includes(module)) return [...path.slice(path.indexOf(module)), module];
    if (finished.has(module)) return [];
    for (const next of imports.get(module) ?? []) {
      const circle = visit(next, [...path, module]);
      if (circle.length > 0) return circle;
    }
    finished.add(module);
    return [];
  };
  for (const module of imports.keys()) {
    const circle = visit(module, []);
    if (circle.length > 0) return circle;
  }
  return [];
}

test.each(["client/src", "three/src", "page/src"])("imports of %s have no cycle", (folder) => {
  const imports = importsOf(join(kRoot, folder));
  expect(imports.size).toBeGreaterThan(5);
  expect(circleIn(imports)).toEqual([]);
});
