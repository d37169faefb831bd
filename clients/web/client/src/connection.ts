// SPDX-License-Identifier: MIT
// The client with the connection: receives, decodes, acknowledges and reconnects, in a worker.

import { Client, Decoding } from "./client";
import { Datagrams } from "./datagrams";
import { microseconds } from "./handle";
import { copyParts, FrameRing } from "./frame_ring";
import { StreamSocket } from "./socket";
import type { End, FromWorker, SentFrame, Start, Told, ToWorker } from "./thread_messages";
import { ClientEvent, ClientState } from "./types";
import { CoreModule } from "./wasm";

const kPeriodMs = 50;
// Close code of a client that may return: the server keeps its place for a while (docs/protocol.md).
const kMayReturn = 4001;
// Buffers that wait for use, when frames are transferred.
const kMaxBuffers = 4;

export interface Port {
  postMessage(message: FromWorker, transfer: Transferable[]): void;
}

export class Connection {
  private readonly client: Client;
  private readonly socket: StreamSocket;
  private readonly timer: ReturnType<typeof setInterval>;
  private readonly clockOffsetMs: number; // from the clock of this thread to that of the page
  private number = 0; // of the connection
  private ring: FrameRing | undefined;
  private buffers: ArrayBuffer[] = [];
  private waiting: Uint8Array<ArrayBuffer>[] = []; // messages of the page for the connection that is opening
  private datagrams: Datagrams | undefined; // of the connection
  private association = 0; // number of these datagrams; 0 without

  static async start(port: Port, options: Start): Promise<Connection> {
    return new Connection(port, options, await CoreModule.start(options.module));
  }

  private constructor(
    private readonly port: Port,
    private readonly options: Start,
    private readonly core: CoreModule,
  ) {
    this.clockOffsetMs = performance.timeOrigin - options.pageOrigin;
    this.client = new Client(core, "whole", options.scene, options.program, options.identity);
    this.client.want(options.quality);
    if ("code" in options.proof) this.client.setPairingCode(options.proof.code);
    else this.client.setToken(options.proof.token);
    this.client.setResumeToken(options.resumeToken);
    this.client.followRedirects(options.follows);
    this.socket = new StreamSocket(options.url, {
      opened: () => this.flush(),
      message: (bytes) => {
        if (this.datagrams) this.datagrams.receiveFromStream(new Uint8Array(bytes));
        else this.receive(bytes);
      },
      lost: (reason) => this.lose(reason),
    });
    this.timer = setInterval(() => this.tick(), kPeriodMs);
    this.connect();
  }

  handle(message: Exclude<ToWorker, Start | End>): void {
    switch (message.kind) {
      case "send":
        if (message.connection !== this.number) return;
        this.waiting.push(message.message);
        this.flush();
        return;
      case "channel":
        if (message.connection === this.number) this.openDatagrams(message.channel, message.association);
        return;
      case "offer":
        if (message.association !== this.association) return;
        this.client.offerDatagrams(message.offer);
        this.flush();
        return;
      case "reconnect":
        if (!this.socket.isOpen) this.connect();
        return;
      case "recycle":
        if (this.buffers.length < kMaxBuffers) this.buffers.push(message.buffer);
        return;
    }
  }

  // Leaves the scene. returns: the server keeps the participant's place for a while. Resolves when the server knows it, or
  // the browser has given up.
  async leave(returns = false): Promise<void> {
    clearInterval(this.timer);
    this.closeDatagrams();
    this.client.destroy();
    await this.socket.close(returns ? kMayReturn : undefined);
  }

  private now(): number {
    return performance.now() + this.clockOffsetMs;
  }

  private post(message: Told, transfer: Transferable[] = []): void {
    this.port.postMessage({ ...message, session: this.options.session }, transfer);
  }

  private connect(): void {
    const atMs = this.now();
    const server = this.client.connectServer;
    this.waiting = [];
    this.closeDatagrams();
    this.client.connecting(microseconds(atMs));
    this.post({ kind: "connecting", connection: ++this.number, atMs });
    this.socket.open(server);
  }

  private lose(reason: string): void {
    const atMs = this.now();
    this.closeDatagrams();
    this.client.disconnected(microseconds(atMs));
    this.post({ kind: "lost", atMs, reason, attemptAtMs: this.client.connectAtMs });
    // Times of the core are whole microseconds, and atMs may be earlier than the one made of it.
    if (microseconds(atMs) >= microseconds(this.client.connectAtMs)) this.connect();
  }

  private tick(): void {
    const atMs = this.now();
    if (this.client.state === ClientState.failed) return;
    this.client.update(microseconds(atMs));
    this.flush();
    this.tendDatagrams();
    if (atMs < this.client.connectAtMs) return;
    if (!this.socket.inUse) return this.connect();
    void this.socket.close(kMayReturn);
    this.lose("The server does not answer.");
  }

  // Uses a data channel, which is opening, for the present connection.
  private openDatagrams(channel: RTCDataChannel | MessagePort, association: number): void {
    this.closeDatagrams();
    this.association = association;
    const said = (isOpen: boolean) => this.post({ kind: "channel", association, isOpen });
    this.datagrams = new Datagrams(
      this.core,
      channel,
      {
        opened: () => said(true),
        message: ({ buffer }) => this.receive(buffer),
        streamMessage: (message) => this.socket.send(message),
        closed: () => said(false),
      },
      () => this.now(),
    );
  }

  // Tells the core the round trip, and the page what datagrams have done.
  private tendDatagrams(): void {
    const { datagrams, association } = this;
    if (!datagrams?.isOpen) return;
    const { roundTripMs } = this.client.frames.statistics();
    if (roundTripMs > 0) datagrams.setRoundTrip(roundTripMs);
    this.post({ kind: "datagrams", association, statistics: datagrams.statistics() });
  }

  private passAnswer(): void {
    const answer = this.client.datagramAnswer();
    if (answer) this.post({ kind: "answered", association: this.association, answer });
  }

  private closeDatagrams(): void {
    this.datagrams?.close();
    this.datagrams = undefined;
    this.association = 0;
  }

  // Sends what waits, while the socket is open: Hello first, then the messages of the page.
  private flush(): void {
    if (!this.socket.isOpen) return;
    for (let message = this.client.nextOutgoing(); message; message = this.client.nextOutgoing()) this.send(message);
    for (let message = this.waiting.shift(); message; message = this.waiting.shift()) this.send(message);
  }

  private send(message: Uint8Array<ArrayBuffer>): void {
    if (this.datagrams) this.datagrams.send(message);
    else this.socket.send(message);
  }

  private receive(bytes: ArrayBuffer): void {
    const arrivedMs = this.now();
    const before = this.client.frames.decodeErrors;
    const message = new Uint8Array(bytes);
    const events = this.client.receive(message, microseconds(arrivedMs));
    const decodeMs = this.now() - arrivedMs;
    this.flush();
    if (events & ClientEvent.description) this.prepare();
    if (events & ClientEvent.moving) this.socket.prepare(this.client.nextServer);
    if (events & ClientEvent.datagrams) this.passAnswer();
    const isFrame = (events & ClientEvent.frame) !== 0;
    const frame = isFrame ? this.pass(message, arrivedMs, decodeMs) : undefined;
    if (frame === "in the ring") return this.port.postMessage(this.options.session, []);
    const refused = this.client.frames.decodeErrors > before;
    const decoding = frame ? Decoding.done : refused ? Decoding.refused : Decoding.skipped;
    const transfer = frame?.buffer ? [bytes, frame.buffer] : [bytes];
    this.post({ kind: "message", message: bytes, arrivedMs, isFrame, decoding, frame }, transfer);
    if (this.client.state !== ClientState.failed) return;
    this.closeDatagrams();
    void this.socket.close();
  }

  // Makes room for the frames of a new description.
  private prepare(): void {
    this.buffers = [];
    if (!this.options.shares) return;
    this.ring = new FrameRing((this.client.frames.sendsNormals ? 6 : 3) * this.client.frames.vertexCount);
    this.post({ kind: "ring", memory: this.ring.memory });
  }

  // Hands the newest frame to the page, by the ring with its message or without. Undefined if the page has no time for it.
  private pass(message: Uint8Array, arrivedMs: number, decodeMs: number): SentFrame | "in the ring" | undefined {
    const { frames } = this.client;
    const parts = frames.sendsNormals ? [frames.positions(), frames.normals()] : [frames.positions()];
    const frame = { buffer: undefined, hasNormals: frames.sendsNormals, hash: frames.hash, decodeMs };
    if (this.ring) {
      const written = this.ring.write(parts, message, arrivedMs, frame);
      return written === "whole" ? "in the ring" : written === "large" ? frame : undefined;
    }
    const bytes = parts.reduce((sum, part) => sum + part.byteLength, 0);
    const kept = this.buffers.pop();
    const buffer = kept?.byteLength === bytes ? kept : new ArrayBuffer(bytes);
    copyParts(parts, new Float32Array(buffer));
    return { ...frame, buffer };
  }
}
