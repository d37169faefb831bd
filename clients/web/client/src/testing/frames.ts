// SPDX-License-Identifier: MIT
// The frames of a stream, one after the other, in Node.

import { readFile } from "node:fs/promises";
import { Client } from "../client";
import { nowUs } from "../handle";
import { ClientEvent, ClientState } from "../types";
import { CoreModule } from "../wasm";

const kPeriodMs = 50;
const kViewer = 1; // cs_role

export type SocketConstructor = new (url: string) => WebSocket;

export interface FollowOptions {
  // Constructor of a WebSocket, such as that of the package ws. Default: that of Node 22 and later.
  WebSocket?: SocketConstructor;
  // Name of the scene. Default: the default scene of the server.
  scene?: string;
  // Role to ask for: 1 is a viewer, 2 a participant, 3 an owner. Default 1.
  role?: number;
}

export interface ReceivedFrame {
  tick: number;
  // Hash of the decoded frame, 16 hexadecimal digits.
  hash: string;
  // Whether it is the hash of the frame that the server encoded.
  hashMatches: boolean;
  // 3 floats per vertex, metres.
  positions: Float32Array;
  // The client that has decoded it.
  client: Client;
}

// Joins, as a viewer by default, and yields every frame that the server sends, until a played recording is at its end. In lockstep the
// next frame comes when the loop asks for it. Throws if the connection or the stream fails.
export async function* frames(url: string, options: FollowOptions = {}): AsyncGenerator<ReceivedFrame, void, void> {
  const Socket = options.WebSocket ?? (globalThis as { WebSocket?: SocketConstructor }).WebSocket;
  if (!Socket) throw new Error("This Node has no WebSocket: use Node 22, or give that of the package ws");
  const module = await WebAssembly.compile(new Uint8Array(await readFile(new URL("../clothstream_core.wasm", import.meta.url))));
  const client = new Client(await CoreModule.start(module), "whole", options.scene ?? "", "test", { name: "", role: options.role ?? kViewer });
  const arrivals = new Arrivals(new Socket(url));
  const flush = () => {
    for (let message = client.nextOutgoing(); message; message = client.nextOutgoing()) arrivals.socket.send(message);
  };
  const timer = setInterval(() => {
    client.update(nowUs());
    if (arrivals.isOpen) flush();
  }, kPeriodMs);
  try {
    client.connecting(nowUs());
    await arrivals.opened;
    flush();
    let mismatches = 0;
    for (;;) {
      const events = client.receive(await arrivals.next(), nowUs());
      if (client.state === ClientState.failed) throw new Error(client.errorText);
      if (events & ClientEvent.frame) {
        const { tick, hashMismatches } = client.frames.statistics();
        const hashMatches = hashMismatches === mismatches;
        mismatches = hashMismatches;
        const hash = client.frames.hash.toString(16).padStart(16, "0");
        yield { tick, hash, hashMatches, positions: client.frames.positions().slice(), client };
      }
      flush();
      if (events & ClientEvent.playback && client.playback.state()?.paused) return;
    }
  } finally {
    clearInterval(timer);
    arrivals.socket.close();
    client.destroy();
  }
}

// Messages of a socket in the order of their arrival.
class Arrivals {
  readonly opened: Promise<void>;
  private readonly messages: Uint8Array[] = [];
  private wake: () => void = () => undefined;
  private lost = false;

  constructor(readonly socket: WebSocket) {
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }: MessageEvent<unknown>) => {
      if (data instanceof ArrayBuffer) this.messages.push(new Uint8Array(data));
      this.wake();
    };
    this.opened = new Promise((resolve, reject) => {
      socket.onopen = () => resolve();
      socket.onerror = () => reject(new Error(`${socket.url} cannot be reached`));
    });
    socket.onclose = () => {
      this.lost = true;
      this.wake();
    };
  }

  get isOpen(): boolean {
    return this.socket.readyState === this.socket.OPEN;
  }

  async next(): Promise<Uint8Array> {
    for (;;) {
      const message = this.messages.shift();
      if (message) return message;
      if (this.lost) throw new Error("The server closed the connection");
      await new Promise<void>((resolve) => (this.wake = resolve));
    }
  }
}
