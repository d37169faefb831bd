// SPDX-License-Identifier: MIT
// Headsets on the page: buttons to enter, and a panel in space with scenes, people and placement.

import { Roles, type Client, type Session } from "@clothstream/client";
import { CanvasPanel, Headset, Immersion, type Doing, type Mode, type PanelRow } from "@clothstream/three";
import { element, write } from "./panel/dom";
import type { View } from "./view";

const kMostScenes = 6;
const kMostPeople = 3;
const kEyes = 1.5; // m
// Place of the panel: to the left of the user's first look, in metres from the user's feet.
const kPanelPlace = { x: -0.55, y: 1.25, z: -0.55 };
// It faces the user's eyes.
const kPanelTurn = Math.atan2(-kPanelPlace.x, -kPanelPlace.z);
const kPanelTilt = -Math.atan2(kEyes - kPanelPlace.y, Math.hypot(kPanelPlace.x, kPanelPlace.z));

export interface HeadsetPageListener {
  sceneChosen(scene: string): void;
  notice(text: string): void;
}

export class HeadsetPage {
  readonly headset: Headset;
  private readonly panel = new CanvasPanel();
  private scenes: string[] = [];

  constructor(
    view: View,
    private readonly session: Session,
    private readonly listener: HeadsetPageListener,
  ) {
    this.headset = new Headset(
      {
        renderer: view.renderer,
        scene: view.scene,
        bounds: () => view.box,
        change: (change) => {
          change(session.client.input);
          session.flush();
        },
        passThrough: (on) => view.passThrough(on),
      },
      {
        left: () => {
          view.resize();
          view.reset();
        },
        pressed: (limb) => this.panel.press(limb),
        updated: () => this.panel.update(this.headset.body, this.headset.placement.matrix),
        doingChanged: () => this.show(),
      },
    );
    this.headset.seat.add(this.panel.mesh);
    this.panel.mesh.position.set(kPanelPlace.x, kPanelPlace.y, kPanelPlace.z);
    this.panel.mesh.rotation.set(kPanelTilt, kPanelTurn, 0, "YXZ");
    void this.offer();
  }

  slipped(grab: number): void {
    this.headset.slipped(grab);
  }

  // Call first in each frame of a session.
  draw(frame: XRFrame, now: number, client: Client | undefined): void {
    this.headset.update(frame, now, client);
    if (client) this.session.flush();
  }

  // Updates the panel.
  show(): void {
    if (!this.headset.session) return;
    const { client, state } = this.session;
    this.scenes = client.requests.scenes().map(({ name }) => name);
    const rows: PanelRow[] = [{ text: statusText(this.session) }];
    const hint = kHints[this.headset.doing];
    if (hint) rows.push({ text: hint });
    if (state.kind === "failed") rows.push({ text: "Join the default scene", action: () => this.listener.sceneChosen("") });
    if (this.headset.mode === "immersive-ar") rows.push({ text: "Place on a surface", action: () => this.headset.do("place") });
    else rows.push({ text: "Place before me", action: () => this.headset.do("place") });
    rows.push({ text: "Share this room: touch two points", action: () => this.headset.do("points") });
    for (const scene of this.scenes.slice(0, kMostScenes))
      rows.push({ text: scene.replaceAll("_", " "), isChosen: scene === client.sceneName, action: () => this.listener.sceneChosen(scene) });
    for (const { name, role, self, away } of client.people.participants().slice(0, kMostPeople))
      rows.push({ text: self ? `${name} (you)` : name, detail: away ? "away" : (Roles.get(role) ?? "") });
    rows.push({ text: "Leave", action: () => void this.headset.leave() });
    this.panel.show(client.sceneName || "ClothStream", rows);
  }

  // Shows a button for each mode that the device offers, or says what is missing.
  private async offer(): Promise<void> {
    if (!window.isSecureContext) {
      const hint = element("insecure");
      write(hint, kInsecure);
      hint.hidden = false;
      return;
    }
    const modes = await Immersion.offered();
    for (const [mode, id] of kButtons) {
      const button = element<HTMLButtonElement>(id);
      button.hidden = !modes.includes(mode);
      button.addEventListener("click", () => void this.enter(mode));
    }
    element("headset").hidden = modes.length === 0;
  }

  private async enter(mode: Mode): Promise<void> {
    try {
      await this.headset.enter(mode, this.session.client.frames.streamRate);
      this.show();
    } catch (error) {
      this.listener.notice(`The headset did not start: ${error instanceof Error ? error.message : String(error)}`);
    }
  }
}

const kButtons: readonly (readonly [Mode, string])[] = [
  ["immersive-vr", "enter-vr"],
  ["immersive-ar", "enter-ar"],
];

const kHints: Record<Doing, string | undefined> = {
  touch: undefined,
  place: "Look at a surface and press",
  points: "Touch the first point, then the second, and press at each",
};

const kInsecure =
  "Headsets enter VR only on a secure page. Start the server with --tls self, open its https address on the headset, and " +
  "accept the certificate there.";

function statusText({ state, client }: Session): string {
  switch (state.kind) {
    case "live": {
      const { framesPerSecond, roundTripMs } = client.frames.statistics();
      return `${Math.round(framesPerSecond)} frames/s, round trip ${Math.round(roundTripMs)} ms`;
    }
    case "reconnecting":
      return `${state.reason} Reconnecting.`;
    case "connecting":
      return "Connecting";
    default:
      return state.reason;
  }
}
