// SPDX-License-Identifier: MIT
// Tabs of the panel, and whether it is open. Keys in the bar of tabs: arrows, Home and End. Keys anywhere: P.

import { element } from "./dom";

export const kTabs = ["scene", "cloth", "air", "people", "view"] as const;
export type Tab = (typeof kTabs)[number];

export class Tabs {
  current: Tab = "scene";
  private readonly narrow = window.matchMedia("(max-width: 640px)");

  // `shown` is called when another tab is in front.
  constructor(private readonly shown: (tab: Tab) => void) {
    for (const tab of kTabs) {
      const button = this.button(tab);
      button.addEventListener("click", () => {
        // On a narrow screen a second press closes the sheet.
        if (this.narrow.matches && this.isOpen && tab === this.current) this.open(false);
        else {
          this.open(true);
          this.select(tab);
        }
      });
      button.addEventListener("keydown", (event) => this.move(event));
    }
    element("panel-close").addEventListener("click", () => {
      this.open(false);
      (this.narrow.matches ? this.button(this.current) : element("panel-open")).focus();
    });
    element("panel-open").addEventListener("click", () => {
      this.open(true);
      this.button(this.current).focus();
    });
    this.open(!this.narrow.matches);
  }

  get isOpen(): boolean {
    return document.body.dataset["panel"] !== "closed";
  }

  toggle(): void {
    this.open(!this.isOpen);
  }

  select(tab: Tab): void {
    this.current = tab;
    for (const one of kTabs) {
      const button = this.button(one);
      button.setAttribute("aria-selected", String(one === tab));
      button.tabIndex = one === tab ? 0 : -1;
      element(`page-${one}`).hidden = one !== tab;
    }
    this.shown(tab);
  }

  open(open: boolean): void {
    document.body.dataset["panel"] = open ? "open" : "closed";
    const button = element("panel-open");
    button.hidden = open;
    button.setAttribute("aria-expanded", String(open));
  }

  private move(event: KeyboardEvent): void {
    const tabs = kTabs.filter((tab) => this.button(tab).offsetParent !== null);
    const at = tabs.indexOf(this.current);
    const steps: Record<string, number> = { ArrowLeft: at - 1, ArrowRight: at + 1, Home: 0, End: tabs.length - 1 };
    const next = steps[event.key];
    if (next === undefined) return;
    event.preventDefault();
    const tab = tabs[(next + tabs.length) % tabs.length]!;
    this.select(tab);
    this.button(tab).focus();
  }

  private button(tab: Tab): HTMLButtonElement {
    return element<HTMLButtonElement>(`tab-${tab}`);
  }
}
