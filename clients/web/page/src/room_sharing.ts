// SPDX-License-Identifier: MIT
// Whether the shape of the user's real room may be sent, and to whom. The page asks before each AR session, and again when
// others would receive the shape.

import { ErrorCode, Roles, SurfacePolicy, type Session } from "@clothstream/client";
import type { PanelRow, RealRoom } from "@clothstream/three";
import { element, write } from "./panel/dom";

export type RoomAnswer = "send" | "keep";

export class RoomSharing {
  // Who would receive the shape when the user agreed. Undefined: the user has not agreed in this session.
  private agreedTo: string | undefined;
  private hasAsked = false; // the user has agreed at the start of this session, and may do so again

  constructor(
    private readonly session: Session,
    private readonly room: () => RealRoom,
    private readonly say: (text: string) => void,
    private readonly changed: () => void,
  ) {}

  // Asks before an AR session. Undefined if the user closes the question. Servers that take no surfaces, and viewers, are
  // not asked.
  async ask(): Promise<RoomAnswer | undefined> {
    if (!this.isPossible) return "keep";
    const dialog = element<HTMLDialogElement>("room");
    const to = this.receivers;
    write(element("room-who"), to);
    dialog.returnValue = "";
    dialog.showModal();
    await new Promise((done) => dialog.addEventListener("close", done, { once: true }));
    const { returnValue } = dialog;
    if (returnValue === "send") this.agree(to);
    return returnValue === "send" || returnValue === "keep" ? returnValue : undefined;
  }

  // A session has begun.
  begin(answer: RoomAnswer): void {
    this.hasAsked = answer === "send";
    if (this.hasAsked && !this.room().detects) this.say("Your headset gives no shape of the room.");
  }

  end(): void {
    this.hasAsked = false;
    this.agreedTo = undefined;
    this.session.client.input.surfaces.allow(SurfacePolicy.own);
  }

  // Stops to share when others would receive the shape than those to whom the user has agreed. Until then the client sends
  // nothing to them. Call often.
  watch(): void {
    if (!this.room().shares || this.session.state.kind !== "live" || this.agreedTo === this.receivers) return;
    this.stop();
    if (this.isPossible) this.say("Others would receive the shape of your room now, so it is taken back. See Room.");
  }

  // Whether an error is about a surface, and nothing that the user has to know.
  refused(text: string, code: number): boolean {
    if (!text.startsWith("surface")) return false;
    const id = /^surface\.id = (\d+)/.exec(text)?.[1];
    if (code === ErrorCode.resourceExhausted) {
      if (id) return this.room().refused(Number(id));
      this.room().tryLater(performance.now());
    } else if (code === ErrorCode.permissionDenied) {
      this.stop();
    }
    return false;
  }

  // Rows of the panel in space. Undefined if there is nothing to decide.
  rows(): PanelRow[] | undefined {
    if (!this.hasAsked) return undefined;
    const room = this.room();
    if (!room.detects)
      return [{ text: "Your headset gives no shape of the room: it has refused, or cannot." }, { text: "Cloth passes through your furniture." }];
    if (!this.isPossible) return [{ text: "The server does not take the shape of your room." }];
    const { detected, sent } = room.counts;
    const action = room.shares ? () => this.stop() : () => this.share();
    return [
      { text: room.shares ? `The server has ${sent} of ${detected} surfaces of your room.` : "The server has nothing of your room." },
      { text: this.receivers },
      { buttons: [{ text: room.shares ? "Take back" : "Send the shape of my room", action }] },
    ];
  }

  private share(): void {
    this.agree(this.receivers);
    this.room().shares = true;
    this.changed();
  }

  // A client that joins later is not allowed more than the server.
  private agree(to: string): void {
    this.agreedTo = to;
    if (this.policy === SurfacePolicy.everyone) this.session.client.input.surfaces.allow(SurfacePolicy.everyone);
  }

  private stop(): void {
    this.agreedTo = undefined;
    this.session.client.input.surfaces.allow(SurfacePolicy.own);
    this.room().shares = false;
    this.changed();
  }

  private get policy(): SurfacePolicy {
    return this.session.client.input.surfaces.policy;
  }

  private get isPossible(): boolean {
    const { client, state } = this.session;
    return state.kind === "live" && this.policy >= SurfacePolicy.own && Roles.get(client.people.role) !== "viewer";
  }

  // Receivers of the shape.
  private get receivers(): string {
    const { client } = this.session;
    const server = `The server ${window.location.host} uses the shape for the cloth`;
    const rest = "It records and keeps nothing of it.";
    if (this.policy === SurfacePolicy.everyone) return `${server}, and sends it to everyone who is in the scene "${client.sceneName}" or joins it. ${rest}`;
    return `${server}, and sends it to no one. ${rest} Others see how the cloth lies.`;
  }
}
