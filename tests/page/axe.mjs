// SPDX-License-Identifier: MIT
// Rules of accessibility that a page breaks, by axe-core.

import { readFile } from "node:fs/promises";

const source = await readFile(new URL("../../clients/web/node_modules/axe-core/axe.min.js", import.meta.url), "utf8");

// WCAG 2.2 A and AA, and the best practices of axe-core. Returns a line for each element and broken rule.
export async function brokenRules(page) {
  if (!(await page.evaluate(() => "axe" in window))) await page.evaluate(source);
  return page.evaluate(async () => {
    const { violations } = await window.axe.run(document, { resultTypes: ["violations"] });
    return violations.flatMap(({ id, help, nodes }) => nodes.map(({ target, failureSummary }) => `${id} (${help}): ${target} ${failureSummary}`));
  });
}
