// SPDX-License-Identifier: MIT
// Best quality that the viewer wants, which is kept in the address.

import type { SessionOptions } from "@clothstream/client";
import { element } from "./dom";

export class QualityChoice {
  private readonly list = element<HTMLSelectElement>("quality");

  // `options` are those of the session. After `changed`, the scene must be joined again for the new quality to apply.
  constructor(
    private readonly options: SessionOptions,
    private readonly changed: () => void,
  ) {
    this.list.value = String(this.value);
    this.list.addEventListener("change", () => this.choose(Number(this.list.value)));
  }

  get value(): number {
    return this.options.quality ?? 0;
  }

  // The choices with their names.
  get choices(): { text: string; value: number }[] {
    return Array.from(this.list.options, ({ text, value }) => ({ text, value: Number(value) }));
  }

  choose(value: number): void {
    if (value === this.value) return;
    const url = new URL(window.location.href);
    if (value === 0) url.searchParams.delete("quality");
    else url.searchParams.set("quality", String(value));
    window.history.replaceState(null, "", url);
    this.options.quality = value;
    this.list.value = String(value);
    this.changed();
  }
}
