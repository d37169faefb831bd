// SPDX-License-Identifier: MIT
// People of the scene with their roles. Owners change roles, remove and ban.

import { Roles, type Client, type Participant, type Session } from "@clothstream/client";
import { confirmed, disable, element, make } from "./dom";
import type { Requests } from "./requests";

const kOwner = 3;
const kOnlyOwners = "Only owners change roles and remove people.";

export class People {
  private readonly list = element("participants");
  private readonly bans = element("bans");
  private shownList = "";

  constructor(
    private readonly requests: Requests,
    private readonly session: () => Session,
  ) {}

  // Disconnected people stay in the list during their reconnect grace.
  show(client: Client): void {
    const people = client.people.participants();
    const isOwner = client.people.role === kOwner;
    element("people-why").hidden = isOwner;
    const text = JSON.stringify([isOwner, people], (_, value: unknown) => (typeof value === "bigint" ? String(value) : value));
    if (text === this.shownList) return;
    this.shownList = text;
    const focused = document.activeElement?.id;
    this.list.replaceChildren(...people.map((person) => this.item(person, isOwner)));
    if (focused) document.getElementById(focused)?.focus();
  }

  // Lists the people that may not come back. Others than owners see no list.
  async showBans(): Promise<void> {
    if (this.session().client.people.role !== kOwner) return void (element("bans-row").hidden = true);
    const outcome = await this.requests.ask((requests) => requests.listBans(""));
    if (!outcome.ok) return;
    const bans = this.session().client.requests.bans();
    element("bans-row").hidden = bans.length === 0;
    this.bans.replaceChildren(
      ...bans.map(({ subject, displayName }) => {
        const lift = make("button", { type: "button" }, "Lift");
        lift.setAttribute("aria-label", `Lift the ban of ${displayName || subject}`);
        lift.addEventListener("click", () => void this.requests.ask((requests) => requests.liftBan("", subject)).then(() => this.showBans()));
        return make("li", { className: "person" }, make("span", { className: "who" }, displayName || subject), lift);
      }),
    );
  }

  // The server's answer restores the list after a refused change.
  refused(client: Client): void {
    this.shownList = "";
    this.show(client);
  }

  private item({ id, name, role, away, self }: Participant, isOwner: boolean): HTMLElement {
    const who = make("span", { className: "who" }, `${name}${self ? " (you)" : ""}${away ? ", disconnected" : ""}`);
    const roles = make("select", { id: `role-${id}` }, ...Array.from(Roles, ([value, label]) => new Option(label, String(value))));
    if (!Roles.has(role)) roles.append(new Option(`role ${role}`, String(role)));
    roles.value = String(role);
    roles.setAttribute("aria-label", `Role of ${name}`);
    roles.addEventListener("change", () => this.send((people) => people.setRole(id, Number(roles.value))));
    const remove = this.button(`remove-${id}`, "Remove", `Remove ${name}`, async () => {
      if (await confirmed(`Remove ${name} from the scene?`, "Remove")) this.send((people) => people.remove(id));
    });
    const ban = this.button(`ban-${id}`, "Ban", `Ban ${name}`, async () => {
      if (await confirmed(`Ban ${name}? Until an owner lifts the ban, the person cannot join this scene again.`, "Ban"))
        this.send((people) => people.ban(id));
    });
    for (const control of [roles, remove, ban]) disable(control, isOwner ? "" : kOnlyOwners);
    const item = make("li", { className: "person" }, who, roles, ...(self ? [] : [remove, ban]));
    item.classList.toggle("away", away);
    return item;
  }

  private button(id: string, text: string, label: string, action: () => Promise<void>): HTMLButtonElement {
    const button = make("button", { id, type: "button" }, text);
    button.setAttribute("aria-label", label);
    button.addEventListener("click", () => void action());
    return button;
  }

  private send(change: (people: Client["people"]) => void): void {
    const session = this.session();
    change(session.client.people);
    session.flush();
    window.setTimeout(() => void this.showBans(), 500);
  }
}
