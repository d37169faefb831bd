// SPDX-License-Identifier: MIT
// The one place where the page shows a failure: a card over the picture with words, buttons and the form for a code.

import type { Failure, FailureAction } from "./failure";
import { element, make, write } from "./panel/dom";

export class FailureCard {
  private readonly card = element("failure");
  private readonly words = element("failure-words");
  private readonly steps = element("failure-steps");
  private readonly said = element("failure-said");
  private readonly wait = element("failure-wait");
  private readonly actions = element("failure-actions");
  private readonly proof = element<HTMLFormElement>("proof");
  private readonly proofInput = element<HTMLInputElement>("proof-input");
  private readonly proofSend = element<HTMLButtonElement>("proof-send");
  private shown = ""; // what the card says, without what changes every second

  constructor(private readonly act: (action: FailureAction) => void) {}

  // Call when the failure changes, and regularly for the time that is left.
  show(failure: Failure | undefined): void {
    const state = failure ? JSON.stringify({ ...failure, wait: undefined, locked: undefined, retryAt: undefined }) : "";
    if (state !== this.shown) {
      this.shown = state;
      if (failure) this.write(failure);
      this.card.hidden = !failure;
    }
    if (!failure) return;
    // Outside of the words that screen readers speak: they would repeat it every second.
    const { retryAt, wait = "" } = failure;
    const left = retryAt === undefined ? undefined : Math.max(0, Math.ceil((retryAt - performance.now()) / 1000));
    write(this.wait, left === undefined ? wait : `Trying again in ${left} s.`);
    this.wait.hidden = this.wait.textContent === "";
    this.proofSend.disabled = failure.locked === true;
  }

  private write({ kind, title, text, steps = [], said, asks = false, quiet = false, actions }: Failure): void {
    const opens = asks && (this.card.hidden || this.proof.hidden);
    this.card.dataset["kind"] = kind;
    this.card.toggleAttribute("data-quiet", quiet);
    this.words.setAttribute("role", quiet ? "status" : "alert");
    write(element("failure-title"), title);
    write(element("failure-text"), text);
    this.steps.replaceChildren(...steps.map((step) => make("li", {}, step)));
    this.steps.hidden = steps.length === 0;
    write(this.said, said ? sentence(said) : "");
    this.said.hidden = !said;
    this.proof.hidden = !asks;
    this.actions.replaceChildren(
      ...actions.map(({ label, action }, index) => {
        const button = make("button", { type: "button", className: index === 0 && !quiet ? "primary" : "" }, label);
        button.dataset["action"] = action;
        button.addEventListener("click", () => this.act(action));
        return button;
      }),
    );
    this.actions.hidden = actions.length === 0;
    this.card.hidden = false;
    if (opens) this.proofInput.focus();
  }
}

// The server's words begin with a small letter, because programs put them after a name.
function sentence(text: string): string {
  const end = /[.!?]$/.test(text) ? "" : ".";
  return text.charAt(0).toUpperCase() + text.slice(1) + end;
}
