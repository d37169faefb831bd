// SPDX-License-Identifier: MIT
// Headsets on the page: buttons to enter, and a panel in space.

import * as THREE from "three";
import type { Client, Session } from "@clothstream/client";
import { CanvasPanel, Immersion, type Headset, type Mode, type PanelRow } from "@clothstream/three";
import { isHeadsetBrowser, whyNoHeadset } from "./advice";
import type { Failure, FailureAction } from "./failure";
import type { Failures } from "./failures";
import { HeadsetPanel } from "./headset_panel";
import { element, make, write } from "./panel/dom";
import type { Panel } from "./panel/panel";
import { RoomSharing } from "./room_sharing";
import type { View } from "./view";
import { makeHeadset } from "./view_headset";

const kEyes = 1.5; // m
// Place of the panel in metres from the feet of the user: to the left of the first look, nearer than the scene.
const kPanelPlace = { x: -0.6, y: 1.25, z: -0.3 };
// It faces the user's eyes.
const kPanelTurn = Math.atan2(-kPanelPlace.x, -kPanelPlace.z);
const kPanelTilt = -Math.atan2(kEyes - kPanelPlace.y, Math.hypot(kPanelPlace.x, kPanelPlace.z));

// Place of the panel while it says what went wrong: in the direction of the look, m.
const kBefore = 0.7;
const kBelowEyes = 0.1;
// The others need the page.
const kActionsInVr: ReadonlySet<FailureAction> = new Set(["connect", "join", "default"]);

export interface HeadsetPageListener {
  sceneChosen(scene: string): void;
  notice(text: string): void;
}

export class HeadsetPage {
  readonly headset: Headset;
  readonly panel = new CanvasPanel();
  private readonly content: HeadsetPanel;
  private readonly room: RoomSharing;
  private isBefore = false; // the panel is before the eyes
  private why: Failure | undefined; // there is no headset
  private worn = ""; // name of the own body, as it is drawn

  constructor(
    private readonly view: View,
    private readonly session: Session,
    panel: Panel,
    private readonly listener: HeadsetPageListener,
    private readonly failures: Failures,
  ) {
    this.headset = makeHeadset(view, session, {
      left: () => {
        this.isBefore = false;
        this.wear("");
        this.showBody("");
        this.room.end();
        view.resize();
        view.reset();
      },
      pressed: (limb) => this.panel.press(limb),
      updated: () => this.panel.update(this.headset.body, this.headset.placement.matrix),
      doingChanged: () => this.show(),
    });
    this.room = new RoomSharing(session, () => this.headset.realRoom, (text) => this.say(text), () => this.show());
    this.content = new HeadsetPanel(session, panel, this.room, {
      sceneChosen: (scene) => listener.sceneChosen(scene),
      doingChosen: (doing) => this.headset.do(doing),
      left: () => void this.headset.leave(),
      fanToggled: () => this.holdFan(!this.headset.body.holdsFan),
      bodyChosen: (body) => this.wear(body),
      changed: () => this.show(),
    });
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

  // Whether a refusal of the server is about the real room, and nothing that the user has to know.
  refused({ errorText, errorCode }: Client): boolean {
    return this.room.refused(errorText, errorCode);
  }

  // Call first in each frame of a session.
  draw(frame: XRFrame, now: number, client: Client | undefined): void {
    this.headset.update(frame, now, client);
    this.showBody(client?.wearing.isWearing ? client.wearing.own : "");
    if (client) this.session.flush();
  }

  // Updates the panel.
  show(): void {
    if (!this.headset.session) return;
    this.room.watch();
    const { current } = this.failures;
    if (current && !current.quiet) return this.showFailure(current);
    this.isBefore = false;
    this.put(kPanelPlace, kPanelTurn, kPanelTilt);
    const words = current ? [current.title + ".", current.wait].join(" ").trim() : undefined;
    this.panel.show(this.session.client.sceneName || "ClothStream", this.content.rows(this.headset.mode, this.headset.doing, this.headset.body.holdsFan, words));
  }

  // Takes a body of the scene, or gives the own one back.
  private wear(body: string): void {
    this.session.client.wearing.wear(body || undefined);
    this.session.flush();
    this.show();
  }

  private showBody(body: string): void {
    if (body === this.worn) return;
    this.worn = body;
    const { head, headOrientation } = this.headset.body;
    this.view.wear(body, head, new THREE.Vector3(0, 0, -1).applyQuaternion(headOrientation));
    this.show();
  }

  // Takes the fan in the hand, or puts it away.
  holdFan(on: boolean): void {
    this.headset.body.holdsFan = on;
    this.show();
  }

  // Shows a message on the panel for a moment.
  say(text: string): void {
    this.content.say(text);
  }

  // Brings the panel before the eyes with what went wrong.
  private showFailure({ title, text, said, wait, asks, actions }: Failure): void {
    const rows: PanelRow[] = [text, said, wait, asks && "Leave VR to type the code or token."].filter((words) => typeof words === "string").map((words) => ({ text: words }));
    for (const { label, action } of actions)
      if (kActionsInVr.has(action)) rows.push({ buttons: [{ text: label, action: () => this.failures.act(action) }] });
    rows.push({ buttons: [{ text: "Leave", action: () => void this.headset.leave() }] });
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
      const answer = mode === "immersive-ar" ? await this.room.ask() : "keep";
      if (!answer) return;
      await this.headset.enter(mode, this.session.client.frames.streamRate, answer === "send");
      this.room.begin(answer);
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
