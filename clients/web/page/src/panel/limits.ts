// SPDX-License-Identifier: MIT
// Quality and frame rate that the viewer wants. Both are kept in the address.

import type { SessionOptions } from "@clothstream/client";
import { element } from "./dom";

export type Limit = "quality" | "layers";

const kOptions = { quality: "quality", layers: "temporalLayers" } as const;

export class Limits {
  // `options` are those of the session. After `changed`, the scene must be joined again for the new ones to apply.
  constructor(
    private readonly options: SessionOptions,
    private readonly changed: () => void,
  ) {
    for (const limit of ["quality", "layers"] as const) {
      const list = this.list(limit);
      list.value = String(this.value(limit));
      list.addEventListener("change", () => this.choose(limit, Number(list.value)));
    }
  }

  value(limit: Limit): number {
    return this.options[kOptions[limit]] ?? 0;
  }

  // The choices with their names.
  choices(limit: Limit): { text: string; value: number }[] {
    return Array.from(this.list(limit).options, ({ text, value }) => ({ text, value: Number(value) }));
  }

  choose(limit: Limit, value: number): void {
    if (value === this.value(limit)) return;
    const url = new URL(window.location.href);
    if (value === 0) url.searchParams.delete(limit);
    else url.searchParams.set(limit, String(value));
    window.history.replaceState(null, "", url);
    this.options[kOptions[limit]] = value;
    this.list(limit).value = String(value);
    this.changed();
  }

  private list(limit: Limit): HTMLSelectElement {
    return element<HTMLSelectElement>(limit);
  }
}
