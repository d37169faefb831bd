// SPDX-License-Identifier: MIT
// Messages between the thread of the connection, which is a worker, and the thread of the page. Times are milliseconds
// of performance.now() of the page.

import type { DecodedFrame, Decoding } from "./client";
import type { DatagramAnswer, DatagramOffer } from "./session_description";
import type { DatagramStatistics, Identity } from "./types";

// Proof of identity: what a person gives, or a kept token ("" for none).
export type Proof = { token: string } | { code: string };

export interface Start {
  kind: "start";
  session: number; // repeated by all answers; a new start ends the session before it
  module: WebAssembly.Module;
  url: string;
  follows: boolean; // to another server, if the one of the URL names it
  scene: string;
  program: string;
  identity: Identity;
  proof: Proof;
  resumeToken: string;
  quality: number;
  pageOrigin: number; // performance.timeOrigin of the page
  shares: boolean; // whether frames go through shared memory
}

// Ends the session.
export type End =
  // Leaves the scene; the worker ends.
  | { kind: "leave" }
  // The page is closed or reloaded. returns: it can come back as the same participant.
  | { kind: "hide"; returns: boolean };

export type ToWorker =
  | Start
  // Message for the connection of this number; dropped when that has ended.
  | { kind: "send"; connection: number; message: Uint8Array<ArrayBuffer> }
  // Data channel of a new association for the connection of this number, or a port to it. It replaces the one before.
  | { kind: "channel"; connection: number; association: number; channel: RTCDataChannel | MessagePort }
  // Offer of this association to the server.
  | { kind: "offer"; association: number; offer: DatagramOffer }
  // Connects at once instead of at the scheduled time.
  | { kind: "reconnect" }
  | End
  // A buffer of a frame that may be used again.
  | { kind: "recycle"; buffer: ArrayBuffer };

// A number is a session, and says that the next frame of its ring is there with its message.
export type FromWorker = number | ({ session: number } & Told);

export type Told =
  | { kind: "connecting"; connection: number; atMs: number }
  | { kind: "lost"; atMs: number; reason: string; attemptAtMs: number }
  // Memory of a FrameRing for the frames that follow.
  | { kind: "ring"; memory: SharedArrayBuffer }
  // A message of the server that is not in the ring. `isFrame`: it has brought a frame, which is left out if the page has no time for it.
  | { kind: "message"; message: ArrayBuffer; arrivedMs: number; isFrame: boolean; decoding: Decoding; frame: SentFrame | undefined }
  // The server has answered the offer of this association.
  | { kind: "answered"; association: number; answer: DatagramAnswer }
  // Its channel has opened or closed.
  | { kind: "channel"; association: number; isOpen: boolean }
  // Its counts, while its channel is open.
  | { kind: "datagrams"; association: number; statistics: DatagramStatistics }
  // The worker cannot go on.
  | { kind: "broken"; reason: string };

// Decoded frame that belongs to a message. It is in the ring if there is no buffer.
export interface SentFrame extends DecodedFrame {
  buffer: ArrayBuffer | undefined;
}
