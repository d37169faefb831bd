// SPDX-License-Identifier: MIT
// Content of the panel in space: scenes, people, quality, figures and the real room, each under its tab, and where the scene
// stands.

import { Roles, type Session } from "@clothstream/client";
import type { Doing, Mode, PanelButton, PanelRow } from "@clothstream/three";
import { drawHud, kHudHeight, kHudWidth, type HudTheme } from "./panel/hud_drawing";
import type { Panel } from "./panel/panel";
import type { RoomSharing } from "./room_sharing";

const kTabs = ["Scenes", "People", "Quality", "Figures", "Room"] as const;
const kOnePage = 7; // rows of a list
const kFiguresRows = 6.7;
const kMessageMs = 6000;
const kMostBodies = 3; // buttons in a row

// Colours of the figures on the panel, which is dark.
const kTheme: HudTheme = {
  text: "#ffffff",
  quiet: "#b4b8c2",
  line: "#3a3d46",
  accent: "#e6a850",
  bad: "#f08b7b",
  stages: ["#7aa6d8", "#e6a850", "#5c86b5", "#c97b63", "#6b7a70"],
  font: "system-ui, sans-serif",
};

export interface HeadsetPanelListener {
  sceneChosen(scene: string): void;
  doingChosen(doing: Doing): void;
  left(): void;
  fanToggled(): void;
  // "" gives the own body back.
  bodyChosen(body: string): void;
  // The rows have changed by a press.
  changed(): void;
}

export class HeadsetPanel {
  private tab: (typeof kTabs)[number] = "Scenes";
  private page = 0; // of a list that is longer than the panel
  private message = { text: "", until: 0 };

  constructor(
    private readonly session: Session,
    private readonly panel: Panel,
    private readonly room: RoomSharing,
    private readonly listener: HeadsetPanelListener,
  ) {}

  // Shows a message for a moment.
  say(text: string): void {
    this.message = { text, until: performance.now() + kMessageMs };
    this.listener.changed();
  }

  // `words` replace the usual figures in the last row.
  rows(mode: Mode | undefined, doing: Doing, holdsFan: boolean, words: string | undefined): PanelRow[] {
    const { listener } = this;
    const place = mode === "immersive-ar" ? "Place on a surface" : "Place before me";
    const room = this.room.rows();
    if (!room && this.tab === "Room") this.tab = "Scenes";
    const tabs = room ? kTabs : kTabs.slice(0, -1);
    return [
      { buttons: tabs.map((tab) => ({ text: tab, isChosen: tab === this.tab, action: () => this.open(tab) })) },
      ...this.content(holdsFan),
      {
        buttons: [
          { text: place, action: () => listener.doingChosen("place") },
          { text: "Share this room", action: () => listener.doingChosen("points") },
          { text: "Leave", action: () => listener.left() },
        ],
      },
      // Last, so that a long text moves no button.
      { text: kHints[doing] ?? (performance.now() < this.message.until ? this.message.text : (words ?? statusText(this.session))) },
    ];
  }

  private content(holdsFan: boolean): PanelRow[] {
    switch (this.tab) {
      case "Scenes": {
        const bodies = this.bodies();
        return [this.actions(holdsFan), ...bodies, ...this.list(this.scenes(), kOnePage - bodies.length)];
      }
      case "People":
        return this.list(this.people(), kOnePage + 1);
      case "Quality":
        return [
          { text: "Best quality of your stream" },
          this.qualities(),
          { text: "A change joins the scene again." },
        ];
      case "Figures":
        return [this.figures()];
      case "Room":
        return this.room.rows() ?? [];
    }
  }

  private open(tab: (typeof kTabs)[number]): void {
    this.tab = tab;
    this.page = 0;
    if (tab === "Scenes") this.panel.wantList();
    this.listener.changed();
  }

  private actions(holdsFan: boolean): PanelRow {
    const { scenes } = this.panel;
    const allowed = this.session.state.kind === "live" && scenes.mayAct;
    const button = (text: string, action: () => Promise<void>): PanelButton => ({ text, ...(allowed ? { action: () => void action() } : {}) });
    const fan = { text: "Fan", isChosen: holdsFan, action: () => this.listener.fanToggled() };
    return { buttons: [button("Reset", () => scenes.reset()), button(scenes.isPaused ? "Continue" : "Pause", () => scenes.pause()), fan] };
  }

  // A button for each body of the scene that no other participant wears. None if the scene has no bodies.
  private bodies(): PanelRow[] {
    const { wearing, frames, people } = this.session.client;
    if (this.session.state.kind !== "live") return [];
    const { own } = wearing;
    const taken = new Set(people.participants().filter(({ self }) => !self).map(({ body }) => body));
    const names = frames
      .colliders()
      .filter(({ index, participantId }) => participantId === 0n && wearing.isBody(index))
      .map(({ name }) => name)
      .slice(0, kMostBodies);
    if (names.length === 0) return [];
    const buttons = names.map((name) => {
      const isChosen = name === own;
      const action = () => this.listener.bodyChosen(isChosen ? "" : name);
      return { text: `${isChosen ? "Take off" : "Wear"} ${name.replaceAll("_", " ")}`, isChosen, ...(taken.has(name) ? {} : { action }) };
    });
    return [{ buttons }];
  }

  private scenes(): PanelRow[] {
    const { client } = this.session;
    return client.requests.scenes().map(({ name, participants }) => ({
      buttons: [
        {
          text: name.replaceAll("_", " "),
          detail: `${participants} ${participants === 1 ? "person" : "people"}`,
          isChosen: name === client.sceneName,
          action: () => this.listener.sceneChosen(name),
        },
      ],
    }));
  }

  private people(): PanelRow[] {
    return this.session.client.people
      .participants()
      .map(({ name, role, self, away }) => ({ text: self ? `${name} (you)` : name, detail: away ? "away" : (Roles.get(role) ?? "") }));
  }

  // One page of a list, with buttons for the others if there are any.
  private list(rows: PanelRow[], most: number): PanelRow[] {
    if (rows.length <= most) return rows;
    const pages = Math.ceil(rows.length / (most - 1));
    this.page = Math.min(this.page, pages - 1);
    const turn = (text: string, by: number): PanelButton => {
      const page = this.page + by;
      const turns = () => {
        this.page = page;
        this.listener.changed();
      };
      return { text, ...(page >= 0 && page < pages ? { action: turns } : {}) };
    };
    const first = this.page * (most - 1);
    return [...rows.slice(first, first + most - 1), { text: `${this.page + 1} of ${pages}`, buttons: [turn("Back", -1), turn("More", 1)] }];
  }

  private qualities(): PanelRow {
    const { quality } = this.panel;
    return {
      buttons: quality.choices.map(({ text, value }) => ({
        text,
        isChosen: value === quality.value,
        action: () => quality.choose(value),
      })),
    };
  }

  private figures(): PanelRow {
    const { history } = this.panel.hud;
    return {
      drawing: {
        rows: kFiguresRows,
        version: history.added,
        draw: (context, width, height) => {
          const scale = Math.min(width / kHudWidth, height / kHudHeight);
          context.scale(scale, scale);
          drawHud(context, history, kTheme);
        },
      },
    };
  }
}

const kHints: Record<Doing, string | undefined> = {
  touch: undefined,
  place: "Look at a surface and press",
  points: "Touch the first point, then the second, and press at each",
};

function statusText({ state, client }: Session): string {
  switch (state.kind) {
    case "live": {
      const { framesPerSecond, roundTripMs } = client.frames.statistics();
      return `${Math.round(framesPerSecond)} frames/s, round trip ${Math.round(roundTripMs)} ms`;
    }
    case "reconnecting":
      return "Reconnecting";
    case "connecting":
      return "Connecting";
    default:
      return "Not joined";
  }
}
