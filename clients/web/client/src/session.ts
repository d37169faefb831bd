// SPDX-License-Identifier: MIT
// Membership in a scene across several connections. The client core decides when to connect, and as which participant.

import { Client, ClientEvent, ClientState, kUnauthenticated, kWrongPairingCode, type Identity } from "./client";
import { StreamSocket } from "./socket";
import type { CoreModule } from "./wasm";

export type SessionState =
  | { kind: "connecting" }
  | { kind: "live" }
  | { kind: "reconnecting"; reason: string; attemptAt: number } // on the clock of performance.now()
  | { kind: "asking"; reason: string } // the server requires a token or a pairing code
  | { kind: "failed"; reason: string };

// What a person gives to a server that asks for it.
export type Proof = { token: string } | { code: string };

// Where the token of a server is kept between visits; "" means none.
export interface TokenStore {
  kept(): string;
  keep(token: string): void;
}

export interface SessionListener {
  stateChanged(): void;
  described(client: Client): void;
  parametersChanged(client: Client): void;
  participantsChanged(client: Client): void;
  scenesListed(scenes: string[]): void;
  grabsLost(client: Client): void;
  notice(text: string): void;
  pairingCodeMade(client: Client): void;
  // The server refused a request; the session continues.
  refused(client: Client): void;
}

const kPeriodMs = 50;

export class Session {
  state: SessionState = { kind: "connecting" };
  client: Client;
  private readonly socket: StreamSocket;
  private scene: string;

  constructor(
    private readonly core: CoreModule,
    url: string,
    scene: string,
    private readonly identity: Identity,
    private readonly tokens: TokenStore,
    private readonly listener: SessionListener,
  ) {
    this.scene = scene;
    this.client = new Client(core, scene, identity);
    this.client.setToken(this.tokens.kept());
    this.socket = new StreamSocket(url, {
      opened: () => this.flush(),
      message: (bytes) => this.receive(bytes),
      lost: (reason) => this.lose(reason),
    });
    window.setInterval(() => this.tick(), kPeriodMs);
    window.addEventListener("online", () => {
      if (this.state.kind === "reconnecting") this.connect();
    });
    // Closing the socket leaves the scene at once. Otherwise the server would keep the participant's place for a while.
    window.addEventListener("pagehide", () => this.socket.close());
    this.connect();
  }

  // Joins a scene. Joining the current scene again starts a new session.
  join(scene: string): void {
    const { token } = this.client;
    this.begin(scene);
    this.client.setToken(token);
    this.enter({ kind: "connecting" });
    this.connect();
  }

  // Joins with what a person has given.
  prove(proof: Proof): void {
    this.begin(this.scene);
    if ("code" in proof) this.client.setPairingCode(proof.code);
    else this.client.setToken(proof.token);
    this.enter({ kind: "connecting" });
    this.connect();
  }

  // Connects at once instead of at the scheduled time.
  reconnect(): void {
    if (this.state.kind === "reconnecting") this.connect();
  }

  // Sends queued messages while the socket is open.
  flush(): void {
    while (this.socket.isOpen) {
      const message = this.client.nextOutgoing();
      if (!message) return;
      this.socket.send(message);
    }
  }

  private begin(scene: string): void {
    this.scene = scene;
    this.client.destroy();
    this.client = new Client(this.core, scene, this.identity);
  }

  private connect(): void {
    this.client.connecting();
    this.client.listScenes();
    this.socket.open();
  }

  private tick(): void {
    if (this.state.kind === "failed" || this.state.kind === "asking") return;
    this.client.update();
    this.flush();
    if (performance.now() < this.client.connectAtMs) return;
    if (!this.socket.inUse) return this.connect();
    this.socket.close();
    this.lose("The server does not answer.");
  }

  private receive(bytes: ArrayBuffer): void {
    const client = this.client;
    const events = client.receive(bytes);
    if (events & ClientEvent.returned) client.listScenes();
    this.flush();
    if (events & ClientEvent.description) this.listener.described(client);
    if (events & (ClientEvent.description | ClientEvent.parameters)) this.listener.parametersChanged(client);
    if (events & ClientEvent.participants) this.listener.participantsChanged(client);
    if (events & ClientEvent.scenes) this.listener.scenesListed(client.scenes());
    if (events & ClientEvent.grabs) this.listener.grabsLost(client);
    if (events & ClientEvent.token) this.tokens.keep(client.token);
    if (events & ClientEvent.pairingCode) this.listener.pairingCodeMade(client);
    if (events & ClientEvent.notice) this.listener.notice(client.noticeText);
    if (events & ClientEvent.error) {
      if (client.state === ClientState.failed) this.fail(client);
      else this.listener.refused(client);
    }
    if (this.state.kind !== "live" && client.state === ClientState.joined) {
      // A token that a person has typed works: keep it.
      if (client.token) this.tokens.keep(client.token);
      this.enter({ kind: "live" });
    }
  }

  private lose(reason: string): void {
    this.client.disconnected();
    this.enter({ kind: "reconnecting", reason, attemptAt: this.client.connectAtMs });
    if (performance.now() >= this.client.connectAtMs) this.connect();
  }

  // Stops, because the same request would be refused again. The user must give a proof, or choose another scene.
  private fail(client: Client): void {
    this.socket.close();
    const reason = client.errorText;
    const asks = client.errorCode === kUnauthenticated || client.errorCode === kWrongPairingCode;
    if (client.errorCode === kUnauthenticated && client.token === this.tokens.kept()) this.tokens.keep("");
    this.enter(asks ? { kind: "asking", reason } : { kind: "failed", reason });
  }

  private enter(state: SessionState): void {
    this.state = state;
    this.listener.stateChanged();
  }
}
