// SPDX-License-Identifier: MIT
// Datagrams of one association (core.h): frames and input on a data channel, in addition to the messages of the stream.

import { DatagramChannel } from "./datagram_channel";
import { microseconds } from "./handle";
import { CS_DATAGRAM_STATISTICS_VERSION, cs_datagram_statistics } from "./layout";
import type { DatagramStatistics } from "./types";
import { CoreBuffer, type CoreModule } from "./wasm";

// Longest time until the core is asked again, ms. Timers of browsers cannot wait forever.
const kMostWaitMs = 60_000;

export interface DatagramsListener {
  opened(): void;
  // A message for Client.receive().
  message(message: Uint8Array<ArrayBuffer>): void;
  // A message to send on the stream.
  streamMessage(message: Uint8Array<ArrayBuffer>): void;
  closed(): void;
}

export class Datagrams {
  private pointer: number; // 0 after close()
  private readonly scratch: number;
  private readonly buffer: CoreBuffer<Uint8Array>;
  private readonly channel: DatagramChannel;
  private isPumping = false;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private timerAtMs = Infinity;

  // `now` is the clock of the client, ms.
  constructor(
    private readonly core: CoreModule,
    channel: RTCDataChannel | MessagePort,
    private readonly listener: DatagramsListener,
    private readonly now: () => number,
  ) {
    this.pointer = core.exports.cs_create_datagrams();
    if (this.pointer === 0) throw new Error("The client core has no memory left for datagrams");
    this.scratch = core.allocate(cs_datagram_statistics.sizeof);
    this.buffer = new CoreBuffer(core, (pointer, count) => core.bytes(pointer, count));
    this.channel = new DatagramChannel(channel, {
      opened: () => listener.opened(),
      arrived: (datagram) => this.receive(datagram),
      closed: () => listener.closed(),
    });
  }

  // Takes a message of the stream. The listener gets it now, later, or never if it is an old frame.
  receiveFromStream(message: Uint8Array<ArrayBuffer>): void {
    const held = this.core.exports.cs_hold_message(this.pointer, this.buffer.write(message), message.byteLength, this.nowUs());
    this.pump(held === 0 ? message : undefined);
  }

  // Takes a message to the server, which travels in datagrams or on the stream.
  send(message: Uint8Array<ArrayBuffer>): void {
    const taken = this.core.exports.cs_send_in_datagram(this.pointer, this.buffer.write(message), message.byteLength, this.nowUs());
    if (taken === 0) this.listener.streamMessage(message);
    this.pump();
  }

  // Whether datagrams can be sent now.
  get isOpen(): boolean {
    return this.channel.isOpen;
  }

  // Round-trip time of the link to the server.
  setRoundTrip(milliseconds: number): void {
    this.core.exports.cs_set_datagram_round_trip(this.pointer, microseconds(milliseconds));
  }

  statistics(): DatagramStatistics {
    const { core, pointer, scratch } = this;
    core.view().setUint32(scratch, CS_DATAGRAM_STATISTICS_VERSION, true);
    core.exports.cs_get_datagram_statistics(pointer, this.nowUs(), scratch);
    const view = core.view();
    const count = (offset: number) => Number(view.getBigUint64(scratch + offset, true));
    return {
      inUse: view.getInt32(scratch + cs_datagram_statistics.in_use, true) !== 0,
      packets: count(cs_datagram_statistics.packets),
      lostPackets: count(cs_datagram_statistics.lost_packets),
      parityPackets: count(cs_datagram_statistics.parity_packets),
      frames: count(cs_datagram_statistics.frames),
      repairedFrames: count(cs_datagram_statistics.repaired_frames),
      lostFrames: count(cs_datagram_statistics.lost_frames),
      requests: count(cs_datagram_statistics.requests),
      heldFrames: count(cs_datagram_statistics.held_frames),
    };
  }

  // Closes the channel. Nothing may be called afterwards.
  close(): void {
    clearTimeout(this.timer);
    this.channel.close();
    this.core.exports.cs_destroy_datagrams(this.pointer);
    this.core.exports.free(this.scratch);
    this.buffer.free();
    this.pointer = 0;
  }

  private nowUs(): bigint {
    return microseconds(this.now());
  }

  private receive(datagram: ArrayBuffer): void {
    this.core.exports.cs_receive_datagram(this.pointer, this.buffer.write(new Uint8Array(datagram)), datagram.byteLength, this.nowUs());
    this.pump();
  }

  // Hands on this message and everything that the core has ready, and sets the timer. What a listener sends meanwhile waits
  // for its turn.
  private pump(message?: Uint8Array<ArrayBuffer>): void {
    if (this.isPumping) return;
    this.isPumping = true;
    if (message) this.listener.message(message);
    const { cs_next_datagram_message, cs_next_datagram, cs_next_stream_message } = this.core.exports;
    this.take(cs_next_datagram_message, (next) => this.listener.message(next));
    this.take(cs_next_datagram, (datagram) => this.channel.send(datagram));
    this.take(cs_next_stream_message, (next) => this.listener.streamMessage(next));
    this.isPumping = false;
    if (this.pointer !== 0) this.schedule();
  }

  // Passes copies of what `next` returns to `use`, which may close the datagrams.
  private take(next: (datagrams: number, nowUs: bigint, bytes: number) => number, use: (bytes: Uint8Array<ArrayBuffer>) => void): void {
    while (this.pointer !== 0) {
      const at = next(this.pointer, this.nowUs(), this.scratch);
      if (at === 0) return;
      use(this.core.bytes(at, this.core.view().getUint32(this.scratch, true)).slice());
    }
  }

  private schedule(): void {
    const dueMs = Number(BigInt.asUintN(64, this.core.exports.cs_datagrams_due_at(this.pointer))) / 1000;
    if (dueMs >= this.timerAtMs) return; // the timer asks again
    clearTimeout(this.timer);
    const waitMs = Math.min(Math.max(0, Math.ceil(dueMs - this.now())), kMostWaitMs);
    this.timerAtMs = dueMs;
    this.timer = setTimeout(() => {
      this.timerAtMs = Infinity;
      this.pump();
    }, waitMs);
  }
}
