// SPDX-License-Identifier: MIT
// The panel as a whole: connects its parts with the session.

import type { Client, Session, SessionOptions } from "@clothstream/client";
import { Controls } from "../controls";
import { ClothPanel } from "./cloth";
import { Create } from "./create";
import { element, write } from "./dom";
import { HudPanel } from "./hud_panel";
import { People } from "./people";
import { QualityChoice } from "./quality_choice";
import { Requests } from "./requests";
import { Scenes } from "./scenes";
import { Tabs, type Tab } from "./tabs";

const kListPeriodMs = 5000;

export interface PanelListener {
  sceneChosen(scene: string): void;
  viewReset(): void;
  // An action on a scene succeeded or failed. The panel shows it; another view may show it too.
  said(text: string): void;
}

export class Panel {
  readonly controls = new Controls();
  readonly hud = new HudPanel();
  private readonly cloth = new ClothPanel();
  readonly quality: QualityChoice;
  readonly scenes: Scenes;
  private readonly requests: Requests;
  private readonly people: People;
  readonly create: Create;
  private readonly tabs: Tabs;
  private readonly invite = element<HTMLInputElement>("invite-link");
  private listedAt = -Infinity;

  // `options` are those of the session; a change of quality joins the scene again with the new ones.
  constructor(
    private readonly session: () => Session,
    options: SessionOptions,
    listener: PanelListener,
  ) {
    this.requests = new Requests(session);
    this.scenes = new Scenes(this.requests, {
      sceneChosen: (scene) => listener.sceneChosen(scene),
      listWanted: () => this.wantList(),
      said: (text) => listener.said(text),
    });
    this.quality = new QualityChoice(options, () => listener.sceneChosen(session().client.sceneName));
    this.people = new People(this.requests, session);
    this.create = new Create(this.requests, (scene, repairs) => this.scenes.made(scene, repairs));
    this.tabs = new Tabs((tab) => this.shown(tab));
    element("reset").addEventListener("click", () => listener.viewReset());
    element("invite-copy").addEventListener("click", () => void this.copyLink());
    window.addEventListener("keydown", (event) => this.press(event));
  }

  // A new description has arrived.
  described(client: Client): void {
    this.controls.describe(client);
    this.cloth.describe(client);
    this.create.offer(client.parameters.materials());
    this.scenes.show(client);
    this.invite.value = this.linkTo(client.sceneName);
    write(element("server"), client.serverName);
    write(element("device"), client.deviceName);
    write(element("figure-vertices"), client.frames.vertexCount.toLocaleString("en"));
  }

  parametersChanged(client: Client): void {
    this.controls.show(client);
    this.cloth.show(client);
  }

  participantsChanged(client: Client): void {
    this.people.show(client);
    this.scenes.show(client);
    this.wantList();
  }

  scenesListed(client: Client): void {
    this.scenes.show(client);
  }

  answered(client: Client): void {
    this.requests.answered(client);
  }

  // The server reports something about the scene.
  noticed(): void {
    this.wantList();
  }

  refused(client: Client): void {
    this.controls.refused(client);
    this.cloth.show(client);
    this.people.refused(client);
  }

  stateChanged(): void {
    if (this.session().state.kind !== "live") this.requests.lost();
  }

  // Sends what people have changed. Call once per drawn frame, with the client of a live session.
  apply(client: Client | undefined): void {
    this.hud.countFrame();
    if (!client) return;
    this.controls.apply(client);
    this.cloth.apply(client);
  }

  get drawsConstraints(): boolean {
    return this.cloth.drawsConstraints;
  }

  // Whether the scene sends no frames, because it stands still.
  isPaused(client: Client): boolean {
    return this.scenes.isPaused || client.playback.state()?.paused === true;
  }

  // Opens the tab View at the choices of quality.
  showView(): void {
    this.tabs.open(true);
    this.tabs.select("view");
    element("quality").focus();
  }

  // Updates figures and the list of scenes. Call about four times a second. `pauseMs` is the longest pause between frames
  // since the last call.
  refresh(client: Client | undefined, now: number, pauseMs: number): void {
    const { link } = this.session();
    this.hud.sample(client, link, now, pauseMs);
    write(element("transport"), link.transport === "datagrams" ? "datagrams" : `WebSocket. ${link.reason}`);
    if (!client || !this.tabs.isOpen) return;
    if (this.tabs.current === "cloth") this.cloth.showReport(client);
    if (this.tabs.current === "air") this.controls.showRadius(client);
    if (this.tabs.current === "scene" && now - this.listedAt >= kListPeriodMs) this.wantList();
  }

  // Asks the server for its scenes.
  wantList(): void {
    const session = this.session();
    if (session.state.kind !== "live") return;
    this.listedAt = performance.now();
    session.client.listScenes();
    session.flush();
  }

  private shown(tab: Tab): void {
    if (tab === "scene") this.wantList();
    if (tab === "people") void this.people.showBans();
  }

  // Keys that work everywhere except where text is typed.
  private press(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
    if (target.matches("input:not([type=range], [type=checkbox]), select, textarea") || target.closest("dialog")) return;
    if (event.key.toLowerCase() === "h") this.hud.toggle();
    else if (event.key.toLowerCase() === "p") this.tabs.toggle();
  }

  private linkTo(scene: string): string {
    const url = new URL(window.location.href);
    url.search = "";
    url.searchParams.set("scene", scene);
    return url.href;
  }

  // Without a secure context there is no clipboard; the selected link can then be copied by hand.
  private async copyLink(): Promise<void> {
    this.invite.select();
    const button = element("invite-copy");
    try {
      await navigator.clipboard.writeText(this.invite.value);
      write(button, "Copied");
    } catch {
      write(button, "Press Ctrl C");
    }
    window.setTimeout(() => write(button, "Copy"), 2000);
  }
}
