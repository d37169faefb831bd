// SPDX-License-Identifier: MIT
// A stay in a scene, over however many connections it takes: each connection has a client of its own.

import { Client, ClientEvent, ClientState } from "./client";
import { StreamSocket } from "./socket";
import type { CoreModule } from "./wasm";

export type SessionState =
  | { kind: "connecting" }
  | { kind: "live" }
  | { kind: "reconnecting"; reason: string; attemptAt: number } // on performance.now()'s clock
  | { kind: "failed"; reason: string };

export interface SessionListener {
  stateChanged(): void;
  described(client: Client): void;
  parametersChanged(client: Client): void;
  scenesListed(scenes: string[]): void;
  grabsLost(client: Client): void;
  notice(text: string): void;
  // The server refused something, and goes on.
  refused(client: Client): void;
}

const kPingPeriodMs = 100;

export class Session {
  state: SessionState = { kind: "connecting" };
  // Of the newest connection; there is one from the first connection on.
  client: Client | undefined;
  private readonly socket: StreamSocket;

  constructor(
    private readonly core: CoreModule,
    url: string,
    private scene: string,
    private readonly listener: SessionListener,
  ) {
    this.socket = new StreamSocket(url, {
      opened: () => this.begin(),
      message: (bytes) => this.receive(bytes),
      lost: (reason, delayMs) => this.lose(reason, delayMs),
    });
    window.setInterval(() => {
      if (this.state.kind !== "live" && this.state.kind !== "connecting") return;
      this.client?.update();
      this.flush();
    }, kPingPeriodMs);
    this.socket.open();
  }

  join(scene: string): void {
    this.scene = scene;
    this.reconnect();
  }

  // At once, whatever the state.
  reconnect(): void {
    this.enter({ kind: "connecting" });
    this.socket.open();
  }

  // Sends what the client has to say.
  flush(): void {
    for (let message = this.client?.nextOutgoing(); message; message = this.client?.nextOutgoing()) this.socket.send(message);
  }

  private begin(): void {
    this.client?.destroy();
    this.client = new Client(this.core, this.scene);
    this.enter({ kind: "connecting" });
    this.client.listScenes();
    this.flush();
  }

  private receive(bytes: ArrayBuffer): void {
    const client = this.client;
    if (!client) return;
    const events = client.receive(bytes);
    this.flush();
    if (events & ClientEvent.description) this.listener.described(client);
    if (events & (ClientEvent.description | ClientEvent.parameters)) this.listener.parametersChanged(client);
    if (events & ClientEvent.scenes) this.listener.scenesListed(client.scenes());
    if (events & ClientEvent.grabs) this.listener.grabsLost(client);
    if (events & ClientEvent.notice) this.listener.notice(client.noticeText);
    if (events & ClientEvent.error) {
      if (client.state === ClientState.failed) this.fail(client.errorText);
      else this.listener.refused(client);
    }
    if (this.state.kind === "connecting" && client.state === ClientState.joined) this.enter({ kind: "live" });
  }

  private lose(reason: string, delayMs: number): void {
    this.enter({ kind: "reconnecting", reason, attemptAt: performance.now() + delayMs });
  }

  // Asking the same again would be refused again: it waits for somebody to choose.
  private fail(reason: string): void {
    this.socket.close();
    this.enter({ kind: "failed", reason });
  }

  private enter(state: SessionState): void {
    this.state = state;
    this.listener.stateChanged();
  }
}
