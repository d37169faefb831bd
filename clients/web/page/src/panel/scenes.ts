// SPDX-License-Identifier: MIT
// The scenes of the server as a list to choose from, and what can be done with the joined one.

import type { Client, SceneSummary } from "@clothstream/client";
import { confirmed, disable, element, make, write } from "./dom";
import type { Outcome, Requests } from "./requests";

const kViewer = 1;

export interface ScenesListener {
  sceneChosen(scene: string): void;
  // The list may have changed.
  listWanted(): void;
  // An action succeeded or failed.
  said(text: string): void;
}

export class Scenes {
  private readonly list = element("scenes");
  private readonly result = element("scene-result");
  private readonly buttons = {
    reset: element<HTMLButtonElement>("scene-reset"),
    pause: element<HTMLButtonElement>("scene-pause"),
    record: element<HTMLButtonElement>("scene-record"),
    delete: element<HTMLButtonElement>("scene-delete"),
  };
  private joined: SceneSummary | undefined;
  private role = kViewer;
  private shownList = "";
  private deleted = ""; // scene that the server was asked to delete; the next list shows whether it is gone

  constructor(
    private readonly requests: Requests,
    private readonly listener: ScenesListener,
  ) {
    this.buttons.reset.addEventListener("click", () => void this.reset());
    this.buttons.pause.addEventListener("click", () => void this.pause());
    this.buttons.record.addEventListener("click", () => void this.record());
    this.buttons.delete.addEventListener("click", () => void this.delete());
  }

  // Whether the joined scene is paused, by the newest list.
  get isPaused(): boolean {
    return this.joined?.paused === true;
  }

  // Whether this person may reset, pause and record.
  get mayAct(): boolean {
    return this.role !== kViewer;
  }

  // A scene was made from a file.
  made(scene: string, repairs: string): void {
    this.say([`${scene} is ready.`, ...repairs.split("\n")].join(" ").trim(), "done");
    this.listener.sceneChosen(scene);
  }

  // Shows the newest list, and the state of the joined scene.
  show(client: Client): void {
    const scenes = client.requests.scenes();
    const text = JSON.stringify([scenes, client.sceneName]);
    if (text !== this.shownList) {
      this.shownList = text;
      const focused = document.activeElement?.getAttribute("data-scene");
      this.list.replaceChildren(...scenes.map((scene) => this.item(scene, scene.name === client.sceneName)));
      if (focused) this.list.querySelector<HTMLElement>(`[data-scene="${CSS.escape(focused)}"]`)?.focus();
    }
    if (this.deleted && scenes.length > 0 && !scenes.some(({ name }) => name === this.deleted)) {
      this.say(`${this.deleted} is deleted.`, "done");
      this.deleted = "";
    }
    this.joined = scenes.find(({ name }) => name === client.sceneName);
    this.role = client.people.role;
    this.showActions();
  }

  private showActions(): void {
    const scene = this.joined;
    write(this.buttons.pause, scene?.paused ? "Continue" : "Pause");
    write(this.buttons.record, scene?.recorded ? "Stop recording" : "Record");
    const viewer = this.mayAct ? "" : "Viewers change nothing. An owner can give you another role.";
    for (const button of [this.buttons.reset, this.buttons.pause, this.buttons.record]) disable(button, viewer);
    const kept = scene && !scene.created ? "The server started with this scene, so it cannot be deleted." : "";
    disable(this.buttons.delete, viewer || kept);
    write(element("scene-why"), viewer);
    element("scene-why").hidden = !viewer;
  }

  private item(scene: SceneSummary, isJoined: boolean): HTMLElement {
    const count = (number: number, one: string, many: string) => `${number.toLocaleString("en")} ${number === 1 ? one : many}`;
    const badge = scene.isRecording ? "recording" : scene.recorded ? "● being recorded" : scene.paused ? "paused" : "";
    const size = [count(scene.vertexCount, "vertex", "vertices"), count(scene.clothCount, "cloth", "cloths"), count(scene.participants, "person", "people")];
    const button = make(
      "button",
      { type: "button", className: "scene" },
      make("span", { className: "title" }, make("span", {}, scene.name), ...(badge ? [make("span", { className: "badge" }, badge)] : [])),
      ...(scene.description ? [make("span", { className: "about" }, scene.description)] : []),
      make("span", { className: "size" }, size.join(" · ")),
    );
    button.dataset["scene"] = scene.name;
    if (isJoined) button.setAttribute("aria-current", "true");
    button.addEventListener("click", () => {
      if (!isJoined) this.listener.sceneChosen(scene.name);
    });
    return make("li", {}, button);
  }

  async reset(): Promise<void> {
    this.report(await this.requests.ask((requests) => requests.reset("")), "The cloth is back at its start.");
  }

  // Pauses the scene, or lets it continue.
  async pause(): Promise<void> {
    const paused = !this.isPaused;
    this.report(await this.requests.ask((requests) => requests.pause("", paused)), paused ? "Paused for everyone." : "Running again.");
  }

  private async record(): Promise<void> {
    if (!this.joined?.recorded) {
      const outcome = await this.requests.ask((requests) => requests.startRecording("", ""));
      return this.report(outcome, outcome.ok ? `Recording to ${outcome.answer.name} on the server.` : "");
    }
    const outcome = await this.requests.ask((requests) => requests.stopRecording(""));
    const text = outcome.ok ? `${outcome.answer.name} is complete: ${(outcome.answer.bytes / 1e6).toFixed(2)} MB on the server.` : "";
    this.report(outcome, text);
  }

  private async delete(): Promise<void> {
    const scene = this.joined;
    if (!scene) return;
    const others = scene.participants - 1;
    const leave = others > 0 ? ` ${others} other ${others === 1 ? "person leaves" : "people leave"} it.` : "";
    if (!(await confirmed(`Delete the scene ${scene.name}? This cannot be undone.${leave}`, "Delete"))) return;
    const outcome = await this.requests.ask((requests) => requests.delete(scene.name));
    // The server ends the streams of the scene, often before its answer arrives.
    if (!outcome.ok && !outcome.lost) return this.report(outcome, "");
    this.deleted = scene.name;
    this.listener.sceneChosen("");
  }

  private report(outcome: Outcome, done: string): void {
    this.say(outcome.ok ? done : outcome.error, outcome.ok ? "done" : "error");
    this.listener.listWanted();
  }

  private say(text: string, kind: "done" | "error"): void {
    write(this.result, text);
    this.result.dataset["kind"] = kind;
    this.result.hidden = false;
    this.listener.said(text);
  }
}
