// SPDX-License-Identifier: MIT
// Shows a report as a table, and saves it as a file or to the clipboard. Nothing is sent anywhere.

import { element, make, write } from "../panel/dom";
import type { Report } from "./report";
import { verdictsOn, type Grade } from "./verdicts";

const kGrades: Record<Grade, string> = { good: "good", poor: "poor", unknown: "not measured" };

export class Results {
  private readonly text = element<HTMLTextAreaElement>("json");
  private readonly download = element<HTMLAnchorElement>("download");
  private readonly copy = element<HTMLButtonElement>("copy");

  constructor() {
    this.copy.addEventListener("click", () => void this.copyText());
  }

  show(report: Report): void {
    const verdicts = verdictsOn(report);
    const poor = verdicts.filter(({ grade }) => grade === "poor").length;
    const where = report.session.mode === null ? "in a window, without a headset" : `in ${report.session.mode}`;
    const left = report.complete ? "" : " It was ended early.";
    write(
      element("summary"),
      `${Math.round(report.seconds)} s ${where}: ${poor === 0 ? "no fault was found" : `${poor} of ${verdicts.length} figures are poor`}.${left}`,
    );
    element("verdicts").replaceChildren(
      ...verdicts.map(({ name, result, grade, text }) => {
        const mark = make("td", { textContent: kGrades[grade], className: grade });
        return make("tr", {}, make("th", { textContent: name, scope: "row" }), make("td", { textContent: result }), mark, make("td", { textContent: text }));
      }),
    );
    this.text.value = `${JSON.stringify(report, null, 2)}\n`;
    URL.revokeObjectURL(this.download.href);
    this.download.href = URL.createObjectURL(new Blob([this.text.value], { type: "application/json" }));
    this.download.download = `clothstream-selftest-${report.date.slice(0, 19).replaceAll(":", "")}.json`;
    element("results").hidden = false;
    element("summary").focus();
  }

  hide(): void {
    element("results").hidden = true;
  }

  // Without a secure context there is no clipboard; the selected text can then be copied by hand.
  private async copyText(): Promise<void> {
    this.text.select();
    try {
      await navigator.clipboard.writeText(this.text.value);
      write(this.copy, "Copied");
    } catch {
      write(this.copy, "Selected below");
    }
    window.setTimeout(() => write(this.copy, "Copy"), 2000);
  }
}
