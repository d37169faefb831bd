// SPDX-License-Identifier: MIT
// Membership in a scene across several connections. A worker has the connection and decodes; this thread has the mirror
// that the program reads, draws and writes to.

import { Client, Decoding, type DecodedFrame } from "./client";
import { FrameGaps } from "./frame_gaps";
import { FrameRing } from "./frame_ring";
import { microseconds } from "./handle";
import { Negotiation } from "./negotiation";
import type { FromWorker, Proof, Told, ToWorker } from "./thread_messages";
import { ClientEvent, ClientState, ErrorCode, type Identity, type Link, type Transport } from "./types";
import { CoreModule } from "./wasm";

export type SessionState =
  | { kind: "connecting" }
  | { kind: "live" }
  | { kind: "reconnecting"; reason: string; attemptAt: number } // on the clock of performance.now()
  // The server requires a token or a pairing code. `code` is an ErrorCode. wasGiven: it has refused one.
  | { kind: "asking"; reason: string; code: number; wasGiven: boolean }
  // Nothing happens until the program joins again. "server": it refuses, with an ErrorCode. "client": the client core does
  // not understand the server. "worker": the worker did not start, or has stopped. "datagrams": they cannot be opened, and
  // the option `transport` requires them.
  | { kind: "failed"; reason: string; cause: "server" | "client" | "worker" | "datagrams"; code: number };

// Where a token is kept between visits; "" means none.
export interface TokenStore {
  kept(): string;
  keep(token: string): void;
}

// Events of a session. All are optional.
export interface SessionListener {
  stateChanged?(): void;
  described?(client: Client): void;
  parametersChanged?(client: Client): void;
  participantsChanged?(client: Client): void;
  scenesListed?(client: Client): void;
  // A request of client.requests succeeded or failed.
  answered?(client: Client): void;
  grabsChanged?(client: Client): void;
  // Surfaces of the real rooms of others.
  surfacesChanged?(client: Client): void;
  notice?(text: string): void;
  pairingCodeMade?(client: Client): void;
  // The server refused a request; the session continues.
  refused?(client: Client): void;
}

export interface SessionOptions {
  url: string; // of the server's stream, wss://…/stream or ws://…/stream
  scene?: string; // "": the server's default scene
  identity?: Identity;
  program?: string; // name of the program, for other participants
  tokens?: TokenStore; // for the server's token. Default: nothing is kept
  // For the place in the scene while the page reloads. Default: after a reload, one joins as a new participant.
  places?: TokenStore;
  quality?: number; // best quality wanted, 0 (finest, the default) to 3
  transport?: Transport; // default: "auto"
  surfaces?: boolean; // gets surfaces of the real rooms of others. Default: false
  // Addresses of the package's own files, where a bundler does not find them.
  wasmUrl?: string | URL;
  makeWorker?: () => Worker;
  listener?: SessionListener;
}

const kNoValues = new Float32Array();
const kNoTokens: TokenStore = { kept: () => "", keep: () => undefined };

export class Session {
  state: SessionState = { kind: "connecting" };
  client: Client;
  // Frames that were taken from the worker, and the time that this took on this thread, ms.
  framesTaken = 0;
  takeMs = 0;
  readonly gaps = new FrameGaps(); // between frames of the present connection
  private number = 0; // of the session in the worker
  private connection = 0;
  private ring: FrameRing | undefined;
  private readonly negotiation: Negotiation; // of datagrams
  private readonly frame: DecodedFrame = { hasNormals: false, hash: 0n, decodeMs: 0 }; // of the ring, for one call
  private readonly listener: SessionListener;
  private readonly tokens: TokenStore;
  private readonly places: TokenStore;

  // Loads the client core, and joins the scene.
  static async open(options: SessionOptions): Promise<Session> {
    const url = options.wasmUrl ?? new URL("./clothstream_core.wasm", import.meta.url);
    const module = await CoreModule.compile(url);
    return new Session(options, module, await CoreModule.start(module));
  }

  private readonly worker: Worker;

  private constructor(
    private readonly options: SessionOptions,
    private readonly module: WebAssembly.Module,
    private readonly core: CoreModule,
  ) {
    this.listener = options.listener ?? {};
    this.tokens = options.tokens ?? kNoTokens;
    this.places = options.places ?? kNoTokens;
    this.worker = options.makeWorker?.() ?? new Worker(new URL("./worker.js", import.meta.url), { type: "module" });
    this.worker.onmessage = ({ data }: MessageEvent<FromWorker>) => this.handle(data);
    this.worker.onerror = ({ message }) => this.breakDown(message || "its script could not be loaded");
    this.negotiation = new Negotiation(options.transport ?? "auto", {
      post: (message, transfer) => this.post(message, transfer),
      required: (reason) => this.missDatagrams(reason),
    });
    this.scene = options.scene ?? "";
    this.client = this.begin(this.scene, { token: this.tokens.kept() }, this.takePlace());
    window.addEventListener("online", this.reconnect);
    window.addEventListener("pagehide", this.hide);
    window.addEventListener("pageshow", this.comeBack);
  }

  // Leaves the scene for good.
  close(): void {
    window.removeEventListener("online", this.reconnect);
    window.removeEventListener("pagehide", this.hide);
    window.removeEventListener("pageshow", this.comeBack);
    this.worker.onmessage = this.worker.onerror = null;
    this.negotiation.stop("The session has ended.");
    this.post({ kind: "leave" });
    this.client.destroy();
  }

  // Joins a scene. Joining the current scene again starts a new session.
  join(scene: string): void {
    this.restart(scene, { token: this.client.token });
  }

  // Joins with what a person has given.
  prove(proof: Proof): void {
    this.restart(this.scene, proof);
  }

  // Connects at once instead of at the scheduled time.
  readonly reconnect = (): void => {
    if (this.state.kind === "reconnecting") this.post({ kind: "reconnect" });
  };

  // Sends what the program has set since the last call. Call after changes; once per drawn frame is enough.
  flush(): void {
    // Meshes of surfaces are sent a few parts at a time.
    this.client.update();
    for (let message = this.client.nextOutgoing(); message; message = this.client.nextOutgoing())
      this.post({ kind: "send", connection: this.connection, message }, [message.buffer]);
  }

  // How frames travel at present.
  get link(): Link {
    return this.negotiation.link;
  }

  private scene = "";

  // The page is closed or reloaded. The server keeps the participant's place for a while if the page can come back.
  private readonly hide = (): void => {
    const { kind } = this.state;
    if (kind === "live" || kind === "reconnecting") this.places.keep(`${this.client.resumeToken} ${this.wanted()}`);
    this.negotiation.stop("The page is hidden.");
    this.post({ kind: "hide", returns: this.options.places !== undefined });
  };
  // The browser shows a page again that it had put aside.
  private readonly comeBack = (event: PageTransitionEvent): void => {
    if (event.persisted) this.restart(this.scene, { token: this.client.token }, this.takePlace());
  };
  // Takes the kept place out of the store, and returns its resume token if it is the wanted one. Only one page may have a
  // place: the store of a tab is copied when the tab is duplicated.
  private takePlace(): string {
    const kept = this.places.kept();
    if (!kept) return "";
    this.places.keep("");
    const end = kept.indexOf(" ");
    return kept.slice(end + 1) === this.wanted() ? kept.slice(0, end) : "";
  }
  private wanted(): string {
    return JSON.stringify([this.scene, this.options.identity?.name, this.options.identity?.role]);
  }

  private restart(scene: string, proof: Proof, resumeToken = ""): void {
    // The caller, for example a listener, may use the client until it returns.
    const old = this.client;
    queueMicrotask(() => old.destroy());
    this.client = this.begin(scene, proof, resumeToken);
    this.enter({ kind: "connecting" });
  }

  private begin(scene: string, proof: Proof, resumeToken = ""): Client {
    const { url, program = "", identity = { name: "", role: 0 }, quality = 0 } = this.options;
    this.scene = scene;
    this.ring = undefined;
    this.negotiation.stop("The connection is being opened.");
    const client = new Client(this.core, "mirror", scene, program, identity);
    if ("token" in proof) client.setToken(proof.token);
    client.setResumeToken(resumeToken);
    // Secrets go to other machines only with TLS.
    const follows = url.startsWith("wss:") || ("token" in proof && proof.token === "");
    client.followRedirects(follows);
    client.input.surfaces.follow(this.options.surfaces === true);
    client.frames.playOut();
    client.frames.keepClothInFrontOfHands(true);
    this.post({
      kind: "start",
      session: ++this.number,
      module: this.module,
      url,
      follows,
      scene,
      program,
      identity,
      proof,
      resumeToken,
      quality,
      pageOrigin: performance.timeOrigin,
      shares: globalThis.crossOriginIsolated,
    });
    return client;
  }

  private post(message: ToWorker, transfer: Transferable[] = []): void {
    this.worker.postMessage(message, transfer);
  }

  private handle(message: FromWorker): void {
    if (typeof message === "number") {
      if (message === this.number) this.receiveFrame(this.ring!);
      return;
    }
    if (message.session !== this.number) return;
    switch (message.kind) {
      case "connecting":
        this.gaps.restart();
        this.connection = message.connection;
        this.client.connecting(microseconds(message.atMs));
        this.client.listScenes();
        this.flush();
        return this.negotiation.start(message.connection);
      case "lost":
        this.gaps.restart();
        this.client.disconnected(microseconds(message.atMs));
        return this.enter({ kind: "reconnecting", reason: message.reason, attemptAt: message.attemptAtMs });
      case "ring":
        this.ring = new FrameRing(message.memory);
        return;
      case "message":
        return this.receive(message);
      case "answered":
      case "channel":
      case "datagrams":
        return this.negotiation.handle(message);
      case "broken":
        return this.breakDown(message.reason);
    }
  }

  private receive({ message, arrivedMs, isFrame, decoding, frame }: Told & { kind: "message" }): void {
    const began = performance.now();
    const values = frame?.buffer ? new Float32Array(frame.buffer) : frame ? this.ring!.oldest().values : kNoValues;
    const events = this.client.receiveDecoded(new Uint8Array(message), message.byteLength, decoding, frame, values, microseconds(arrivedMs));
    if (isFrame) this.gaps.arrived(arrivedMs);
    if (frame?.buffer) this.post({ kind: "recycle", buffer: frame.buffer }, [frame.buffer]);
    else if (frame) this.ring!.take();
    this.received(events, frame ? performance.now() - began : undefined);
  }

  // Takes the next frame of the ring. Frames are many, so this allocates nothing.
  private receiveFrame(ring: FrameRing): void {
    const began = performance.now();
    const slot = ring.oldest();
    const { arrivedMs } = slot;
    slot.read(this.frame);
    const events = this.client.receiveDecoded(slot.message, slot.messageBytes, Decoding.done, this.frame, slot.values, microseconds(arrivedMs));
    this.gaps.arrived(arrivedMs);
    ring.take();
    this.received(events, performance.now() - began);
  }

  // `takeMs` is the time that a frame took.
  private received(events: number, takeMs: number | undefined): void {
    const { client, listener } = this;
    if (takeMs !== undefined) {
      ++this.framesTaken;
      this.takeMs += takeMs;
    }
    if (events & ~ClientEvent.frame) this.report(client, listener, events);
    if (this.state.kind !== "live" && client.state === ClientState.joined) {
      // A token that a person has typed works: keep it.
      if (client.token) this.tokens.keep(client.token);
      this.enter({ kind: "live" });
    }
  }

  private report(client: Client, listener: SessionListener, events: number): void {
    if (events & ClientEvent.returned) client.listScenes();
    this.flush();
    if (events & ClientEvent.description) listener.described?.(client);
    if (events & (ClientEvent.description | ClientEvent.parameters)) listener.parametersChanged?.(client);
    if (events & ClientEvent.participants) listener.participantsChanged?.(client);
    if (events & ClientEvent.scenes) listener.scenesListed?.(client);
    if (events & ClientEvent.answer) listener.answered?.(client);
    if (events & ClientEvent.grabs) listener.grabsChanged?.(client);
    if (events & ClientEvent.surfaces) listener.surfacesChanged?.(client);
    if (events & ClientEvent.token) this.tokens.keep(client.token);
    if (events & ClientEvent.pairingCode) listener.pairingCodeMade?.(client);
    if (events & ClientEvent.notice) listener.notice?.(client.noticeText);
    if (events & ClientEvent.error) {
      if (client.state === ClientState.failed) this.fail(client);
      else listener.refused?.(client);
    }
  }

  // Stops, because the same request would be refused again. The user must give a proof, or choose another scene.
  private fail(client: Client): void {
    const { errorCode: code, errorText: reason, token } = client;
    if (code === ErrorCode.unauthenticated && token === this.tokens.kept()) this.tokens.keep("");
    if (code === ErrorCode.unauthenticated || code === ErrorCode.wrongPairingCode)
      return this.enter({ kind: "asking", reason, code, wasGiven: code === ErrorCode.wrongPairingCode || token !== "" });
    this.enter({ kind: "failed", reason, cause: code === 0 ? "client" : "server", code });
  }

  // The program requires datagrams, and they cannot be opened.
  private missDatagrams(reason: string): void {
    ++this.number; // messages that are under way do not count
    this.post({ kind: "hide", returns: false });
    this.enter({ kind: "failed", reason, cause: "datagrams", code: 0 });
  }

  private breakDown(reason: string): void {
    this.enter({ kind: "failed", reason, cause: "worker", code: 0 });
  }

  private enter(state: SessionState): void {
    this.state = state;
    if ("reason" in state) this.negotiation.stop(state.reason);
    this.listener.stateChanged?.();
  }
}
