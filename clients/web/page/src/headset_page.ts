// SPDX-License-Identifier: MIT
// Headsets on the page: buttons to enter, and a panel in space.

import type { Client, Session } from "@clothstream/client";
import { CanvasPanel, Headset, Immersion, type Mode } from "@clothstream/three";
import { HeadsetPanel } from "./headset_panel";
import { element, write } from "./panel/dom";
import type { Panel } from "./panel/panel";
import type { View } from "./view";

const kEyes = 1.5; // m
// Place of the panel in metres from the feet of the user: to the left of the first look, nearer than the scene.
const kPanelPlace = { x: -0.6, y: 1.25, z: -0.3 };
// It faces the user's eyes.
const kPanelTurn = Math.atan2(-kPanelPlace.x, -kPanelPlace.z);
const kPanelTilt = -Math.atan2(kEyes - kPanelPlace.y, Math.hypot(kPanelPlace.x, kPanelPlace.z));

export interface HeadsetPageListener {
  sceneChosen(scene: string): void;
  notice(text: string): void;
}

export class HeadsetPage {
  readonly headset: Headset;
  readonly panel = new CanvasPanel();
  private readonly content: HeadsetPanel;

  constructor(
    view: View,
    private readonly session: Session,
    panel: Panel,
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
    this.content = new HeadsetPanel(session, panel, {
      sceneChosen: (scene) => listener.sceneChosen(scene),
      doingChosen: (doing) => this.headset.do(doing),
      left: () => void this.headset.leave(),
      changed: () => this.show(),
    });
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
    this.panel.show(this.session.client.sceneName || "ClothStream", this.content.rows(this.headset.mode, this.headset.doing));
  }

  // Shows a message on the panel for a moment.
  say(text: string): void {
    this.content.say(text);
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

const kInsecure =
  "Headsets enter VR only on a secure page. Start the server with --tls self, open its https address on the headset, and " +
  "accept the certificate there.";
