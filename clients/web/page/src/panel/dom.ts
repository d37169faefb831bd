// SPDX-License-Identifier: MIT
// Short ways to find, make and write elements.

export function element<Type extends HTMLElement = HTMLElement>(id: string): Type {
  const found = document.getElementById(id);
  if (!found) throw new Error(`The page has no element '${id}'`);
  return found as Type;
}

// Makes an element with properties and children.
export function make<Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag,
  properties: Partial<HTMLElementTagNameMap[Tag]> = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[Tag] {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

// Writes only changed text, so that screen readers do not repeat it.
export function write(target: HTMLElement, text: string): void {
  if (target.textContent !== text) target.textContent = text;
}

// Disables a button or choice, and says why.
export function disable(target: HTMLButtonElement | HTMLSelectElement, reason: string): void {
  target.disabled = reason !== "";
  target.title = reason;
}

// Asks a question in a dialog. Resolves to whether the person agrees; closing the dialog is a no.
export function confirmed(question: string, action: string): Promise<boolean> {
  const dialog = element<HTMLDialogElement>("confirm");
  write(element("confirm-text"), question);
  write(element("confirm-yes"), action);
  dialog.returnValue = "no";
  dialog.showModal();
  return new Promise((answer) =>
    dialog.addEventListener("close", () => answer(dialog.returnValue === "yes"), { once: true }),
  );
}
