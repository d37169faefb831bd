// SPDX-License-Identifier: MIT
// Headsets on the page: buttons to enter, and a panel in space with scenes, people and placement.

import * as THREE from "three";
import { Roles, type Client, type Session } from "@clothstream/client";
import { CanvasPanel, Headset, Immersion, type Doing, type Mode, type PanelRow } from "@clothstream/three";
import { isHeadsetBrowser, whyNoHeadset } from "./advice";
import { linesOf, type Failure, type FailureAction } from "./failure";
import type { Failures } from "./failures";
import { element, make, write } from "./panel/dom";
import type { View } from "./view";

const kMostScenes = 6;
const kMostPeople = 3;
const kEyes = 1.5; // m
// Place of the panel: to the left of the user's first look, in metres from the user's feet.
const kPanelPlace = { x: -0.55, y: 1.25, z: -0.55 };
// It faces the user's eyes.
const kPanelTurn = Math.atan2(-kPanelPlace.x, -kPanelPlace.z);
const kPanelTilt = -Math.atan2(kEyes - kPanelPlace.y, Math.hypot(kPanelPlace.x, kPanelPlace.z));

// Place of the panel while it says what went wrong: in the direction of the look, m.
const kBefore = 0.7;
const kBelowEyes = 0.1;
const kLineLength = 46; // characters
const kMostWords = 9;
// The others need the page.
const kActionsInVr: ReadonlySet<FailureAction> = new Set(["connect", "join", "default"]);

export interface HeadsetPageListener {
  sceneChosen(scene: string): void;
  notice(text: string): void;
}

export class HeadsetPage {
  readonly headset: Headset;
  readonly panel = new CanvasPanel();
  private scenes: string[] = [];
  private isBefore = false; // the panel is before the eyes
  private why: Failure | undefined; // there is no headset

  constructor(
    private readonly view: View,
    private readonly session: Session,
    private readonly listener: HeadsetPageListener,
    private readonly failures: Failures,
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
          this.isBefore = false;
          view.resize();
          view.reset();
        },
        pressed: (limb) => this.panel.press(limb),
        updated: () => this.panel.update(this.headset.body, this.headset.placement.matrix),
        doingChanged: () => this.show(),
      },
    );
    this.headset.seat.add(this.panel.mesh);
    this.put(kPanelPlace, kPanelTurn, kPanelTilt);
    for (const [mode, id] of kButtons) element(id).addEventListener("click", () => void this.enter(mode));
    element("why-no-headset").addEventListener("click", () => this.failures.explain(this.why));
    void this.offer();
    // A headset may be connected later.
    navigator.xr?.addEventListener("devicechange", () => void this.offer());
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
    const { current } = this.failures;
    if (current && !current.quiet) return this.showFailure(current);
    this.isBefore = false;
    this.put(kPanelPlace, kPanelTurn, kPanelTilt);
    const { client } = this.session;
    this.scenes = client.requests.scenes().map(({ name }) => name);
    const rows: PanelRow[] = [current ? { text: current.title, detail: current.wait ?? "" } : { text: statusText(this.session) }];
    const hint = kHints[this.headset.doing];
    if (hint) rows.push({ text: hint });
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

  // Brings the panel before the eyes with what went wrong.
  private showFailure({ title, text, said, wait, asks, actions }: Failure): void {
    const words = [...linesOf(text, kLineLength), ...(said ? linesOf(said, kLineLength) : []), ...(wait ? [wait] : [])];
    const rows: PanelRow[] = words.slice(0, kMostWords).map((line) => ({ text: line }));
    if (asks) rows.push({ text: "Leave VR to type the code or token." });
    for (const { label, action } of actions)
      if (kActionsInVr.has(action)) rows.push({ text: label, action: () => this.failures.act(action) });
    rows.push({ text: "Leave", action: () => void this.headset.leave() });
    this.panel.show(title, rows);
    if (this.isBefore) return;
    this.isBefore = true;
    const camera = this.view.renderer.xr.getCamera();
    const eye = camera.getWorldPosition(new THREE.Vector3());
    const look = camera.getWorldDirection(new THREE.Vector3()).setY(0);
    if (look.lengthSq() < 1e-6) look.set(0, 0, -1);
    look.normalize();
    const place = this.headset.seat.worldToLocal(eye.addScaledVector(look, kBefore).setY(eye.y - kBelowEyes));
    this.put(place, Math.atan2(-look.x, -look.z) - this.headset.seat.rotation.y, 0);
  }

  private put({ x, y, z }: { x: number; y: number; z: number }, turn: number, tilt: number): void {
    this.panel.mesh.position.set(x, y, z);
    this.panel.mesh.rotation.set(tilt, turn, 0, "YXZ");
  }

  // Shows a button for each mode that the device offers, or says what is missing.
  private async offer(): Promise<void> {
    const { isSecureContext: isSecure } = window;
    const modes = isSecure ? await Immersion.offered() : [];
    for (const [mode, id] of kButtons) element(id).hidden = !modes.includes(mode);
    const why = whyNoHeadset({ isSecure, hasWebXr: navigator.xr !== undefined, offers: modes.length > 0 });
    this.why = why;
    const isWanted = why !== undefined && (!isSecure || isHeadsetBrowser(navigator.userAgent));
    element("why-no-headset").hidden = !isWanted;
    element("headset").hidden = modes.length === 0 && !isWanted;
    element("no-headset").hidden = why === undefined;
    write(element("no-headset-title"), why?.title ?? "");
    write(element("no-headset-text"), why?.text ?? "");
    element("no-headset-steps").replaceChildren(...(why?.steps ?? []).map((step) => make("li", {}, step)));
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
