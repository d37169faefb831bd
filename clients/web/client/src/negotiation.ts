// SPDX-License-Identifier: MIT
// Opens datagrams: the peer connection of the page, which workers do not have, and what it exchanges with the server on
// the stream. The worker has the data channel.

import { relay } from "./datagram_channel";
import { describeServer, offerIn, type DatagramAnswer } from "./session_description";
import type { Told, ToWorker } from "./thread_messages";
import type { DatagramStatistics, Link, Transport } from "./types";

// Time within which the channel must open after the server's answer, ms. Chromium itself gives up after 15 s.
const kOpenMs = 30_000;
// Time until lost datagrams are opened again: this, ms, then twice as long each time, at most kMostWaitMs.
const kFirstWaitMs = 2000;
const kMostWaitMs = 60_000;

export interface NegotiationListener {
  post(message: ToWorker, transfer?: Transferable[]): void;
  // Datagrams are required, and cannot be opened.
  required(reason: string): void;
}

export class Negotiation {
  private reason = ""; // why no channel is open; "" while one is
  private statistics: DatagramStatistics | undefined; // of the channel that is open
  private peer: RTCPeerConnection | undefined;
  private connection = 0; // of the worker, on which the offer is sent
  private association = 0; // number of the peer connection
  private wasOpen = false;
  private waitMs = kFirstWaitMs;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly transport: Transport,
    private readonly listener: NegotiationListener,
  ) {}

  get link(): Link {
    const { statistics } = this;
    if (statistics?.inUse) return { transport: "datagrams", reason: "", statistics };
    return { transport: "websocket", reason: this.reason || "No datagrams arrive at present.", statistics };
  }

  // Offers datagrams on a connection that starts to open. Those of the connection before it end.
  start(connection: number): void {
    this.connection = connection;
    this.waitMs = kFirstWaitMs;
    if (this.transport === "tcp") this.stop("The page does not ask for datagrams.");
    else this.open();
  }

  // Ends the datagrams, if any.
  stop(reason: string): void {
    clearTimeout(this.timer);
    this.peer?.close();
    this.peer = this.statistics = undefined;
    this.reason = reason;
  }

  // Takes a message of the worker. Those for an earlier peer connection are ignored.
  handle(message: Told & { kind: "answered" | "channel" | "datagrams" }): void {
    const { peer } = this;
    if (!peer || message.association !== this.association) return;
    switch (message.kind) {
      case "answered":
        return this.connect(peer, message.answer);
      case "channel":
        if (!message.isOpen) return this.end("The server has closed the datagrams.");
        clearTimeout(this.timer);
        this.wasOpen = true;
        this.reason = "";
        return;
      case "datagrams":
        this.statistics = message.statistics;
        return;
    }
  }

  private open(): void {
    this.stop("Datagrams are being opened.");
    if (typeof RTCPeerConnection === "undefined") return this.end("This browser has no WebRTC.");
    try {
      const peer = new RTCPeerConnection();
      this.peer = peer;
      ++this.association;
      // A channel can be transferred only in the task that makes it.
      this.hand(peer.createDataChannel("clothstream", { ordered: false, maxRetransmits: 0 }));
      this.settle(peer, this.offer(peer));
    } catch (error) {
      this.refuse(error);
    }
  }

  // Gives the channel to the worker, or a port to it where the browser does not transfer channels.
  private hand(channel: RTCDataChannel): void {
    const { connection, association } = this;
    const give = (given: RTCDataChannel | MessagePort) =>
      this.listener.post({ kind: "channel", connection, association, channel: given }, [given]);
    try {
      give(channel);
    } catch {
      give(relay(channel));
    }
  }

  private async offer(peer: RTCPeerConnection): Promise<void> {
    await peer.setLocalDescription();
    if (peer !== this.peer) return;
    const offer = offerIn(peer.localDescription?.sdp ?? "");
    if (!offer) throw new Error("its description has no user name, password or fingerprint");
    this.listener.post({ kind: "offer", association: this.association, offer });
  }

  private connect(peer: RTCPeerConnection, answer: DatagramAnswer): void {
    if (answer.addresses.length === 0) return this.end("The server opens no datagrams.");
    const unreachable = () => this.end(`UDP port ${answer.port} of the server cannot be reached.`);
    this.timer = setTimeout(unreachable, kOpenMs);
    peer.onconnectionstatechange = () => {
      if (peer === this.peer && peer.connectionState === "failed") unreachable();
    };
    this.settle(peer, peer.setRemoteDescription({ type: "answer", sdp: describeServer(answer, peer.localDescription!.sdp) }));
  }

  private settle(peer: RTCPeerConnection, step: Promise<void>): void {
    step.catch((error: unknown) => peer === this.peer && this.refuse(error));
  }

  private refuse(error: unknown): void {
    this.end(`The browser opens no datagrams: ${error instanceof Error ? error.message : String(error)}.`);
  }

  // The datagrams have ended, or could not be opened. Those that could be opened once are opened again.
  private end(reason: string): void {
    this.stop(reason);
    if (this.wasOpen) {
      this.timer = setTimeout(() => this.open(), this.waitMs);
      this.waitMs = Math.min(2 * this.waitMs, kMostWaitMs);
    } else if (this.transport === "datagrams") this.listener.required(reason);
  }
}
