// SPDX-License-Identifier: MIT
// No `any`, neither written nor inferred. Run in the repository's root: node clients/web/node_modules/eslint/bin/eslint.js
// --config clients/web/eslint.config.mjs clients/web tests/page
import ts from "typescript-eslint";

const rules = ["no-explicit-any", "no-unsafe-argument", "no-unsafe-assignment", "no-unsafe-call", "no-unsafe-member-access", "no-unsafe-return"];

export default ts.config(
  { ignores: ["**/*.mjs", "**/node_modules/**", "**/dist/**"] },
  {
    files: ["**/*.ts"],
    extends: [ts.configs.base],
    languageOptions: { parserOptions: { projectService: true } },
    rules: Object.fromEntries(rules.map((rule) => [`@typescript-eslint/${rule}`, "error"])),
  },
);
