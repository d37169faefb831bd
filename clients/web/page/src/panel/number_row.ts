// SPDX-License-Identifier: MIT
// A number with its label, unit, range and help: an input for exact values and a slider for quick ones.

import type { NumberRange } from "@clothstream/client";
import { make } from "./dom";

const kSteps = 1000;

// Exponent that gives small values of a wide range most of the slider.
export function powerOf({ max }: NumberRange): number {
  return max >= 1000 ? 5 : max > 1 ? 2 : 3;
}

// Value at a place of the slider, 0 to 1, with three digits.
export function valueAt(range: NumberRange, place: number): number {
  const value = range.min + (range.max - range.min) * place ** powerOf(range);
  return Math.min(range.max, Math.max(range.min, Number(value.toPrecision(3))));
}

export function placeOf(range: NumberRange, value: number): number {
  const part = (value - range.min) / (range.max - range.min);
  return Math.min(1, Math.max(0, part)) ** (1 / powerOf(range));
}

// Text of a number without digits that float32 does not have.
export function numberText(value: number): string {
  return String(Number(value.toPrecision(6)));
}

export class NumberRow {
  readonly root: HTMLElement;
  private readonly input: HTMLInputElement;
  private readonly slider: HTMLInputElement;
  private changed: number | undefined;

  constructor(
    id: string,
    label: string,
    help: string,
    private readonly range: NumberRange,
    whole = false,
  ) {
    this.input = make("input", { id, type: "number", min: numberText(range.min), max: numberText(range.max), step: whole ? "1" : "any", required: true });
    this.slider = make("input", { type: "range", min: "0", max: String(kSteps), step: "1" });
    this.slider.setAttribute("aria-label", `${label}, coarse`);
    const hint = make("p", { id: `${id}-help`, className: "hint" }, `${help}. ${numberText(range.min)} to ${numberText(range.max)}${range.unit ? ` ${range.unit}` : ""}.`);
    for (const input of [this.input, this.slider]) input.setAttribute("aria-describedby", hint.id);
    this.input.addEventListener("change", () => {
      if (!this.input.validity.valid) return void this.input.reportValidity();
      this.take(this.input.valueAsNumber);
    });
    this.slider.addEventListener("input", () => {
      const value = valueAt(range, this.slider.valueAsNumber / kSteps);
      this.take(whole ? Math.round(value) : value);
    });
    const number = make("span", { className: "number" }, this.input, make("i", {}, range.unit));
    const field = make("label", { className: "field", htmlFor: id }, make("span", {}, label), number);
    this.root = make("div", { className: "parameter" }, field, this.slider, hint);
  }

  // Shows a value; undefined hides the row, because the cloth does not have the number.
  show(value: number | undefined): void {
    this.root.hidden = value === undefined;
    if (value === undefined || this.changed !== undefined) return;
    this.write(value);
  }

  // Returns the value to send if a person changed it since the last call.
  takeChange(): number | undefined {
    const value = this.changed;
    this.changed = undefined;
    return value;
  }

  private take(value: number): void {
    this.changed = value;
    this.write(value);
  }

  private write(value: number): void {
    const text = numberText(value);
    if (document.activeElement !== this.input || this.changed !== undefined) if (this.input.value !== text) this.input.value = text;
    if (document.activeElement !== this.slider) this.slider.value = String(Math.round(kSteps * placeOf(this.range, value)));
    this.slider.setAttribute("aria-valuetext", `${text} ${this.range.unit}`.trim());
  }
}
