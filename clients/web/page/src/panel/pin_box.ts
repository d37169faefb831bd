// SPDX-License-Identifier: MIT
// Six numbers that give a box of pins: from and to along each axis of the mesh, in percent of its size.

import { element, make } from "./dom";
import type { PinBox } from "./pins";

const kAxes = [
  ["Left to right", 0, 100],
  ["Bottom to top", 90, 100],
  ["Back to front", 0, 100],
] as const;

export class PinBoxRows {
  private readonly root = element("create-box");
  private readonly rows: HTMLInputElement[][];

  constructor(changed: () => void) {
    this.rows = kAxes.map(([label, from, to]) => {
      const ends = ([["from", from], ["to", to]] as const).map(([end, value]) => {
        const input = make("input", { type: "number", min: "0", max: "100", step: "any", required: true });
        input.setAttribute("value", String(value)); // also after a reset of the form
        input.setAttribute("aria-label", `${label}, ${end}, percent`);
        input.addEventListener("input", changed);
        return input;
      });
      const fields = ends.map((input) => make("span", { className: "number" }, input, make("i", {}, "%")));
      this.root.append(make("div", { className: "range" }, make("span", {}, label), ...fields));
      return ends;
    });
  }

  set hidden(hidden: boolean) {
    this.root.hidden = hidden;
    for (const input of this.rows.flat()) input.disabled = hidden; // so that the form does not check it
  }

  // An empty number counts as an end of the mesh.
  get value(): PinBox {
    const part = (input: HTMLInputElement, otherwise: number) => (Number.isFinite(input.valueAsNumber) ? input.valueAsNumber / 100 : otherwise);
    return this.rows.map(([from, to]) => [part(from!, 0), part(to!, 1)]);
  }
}
