// SPDX-License-Identifier: MIT
// The binary WebSocket to the server, opened again with back-off whenever it is lost.

const kFirstDelayMs = 500;
const kLongestDelayMs = 8000;
// A connection that held this long was a good one: the next loss starts with the first delay again.
const kStableMs = 5000;

export interface SocketListener {
  // A new connection: the session starts from the beginning.
  opened(): void;
  message(bytes: ArrayBuffer): void;
  // Lost, or never there: the next attempt comes in `delayMs`.
  lost(reason: string, delayMs: number): void;
}

export class StreamSocket {
  private socket: WebSocket | undefined;
  private timer: number | undefined;
  private delayMs = kFirstDelayMs;

  constructor(
    private readonly url: string,
    private readonly listener: SocketListener,
  ) {}

  // Drops what there is, if anything, and connects now.
  open(): void {
    this.close();
    const socket = new WebSocket(this.url);
    let openedAt: number | undefined;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      openedAt = performance.now();
      this.listener.opened();
    };
    socket.onmessage = (event: MessageEvent) => {
      if (event.data instanceof ArrayBuffer) this.listener.message(event.data);
    };
    socket.onclose = (event) => {
      this.socket = undefined;
      if (openedAt !== undefined && performance.now() - openedAt > kStableMs) this.delayMs = kFirstDelayMs;
      const delayMs = this.delayMs;
      this.delayMs = Math.min(2 * delayMs, kLongestDelayMs);
      this.timer = window.setTimeout(() => this.open(), delayMs);
      this.listener.lost(explain(event, openedAt !== undefined), delayMs);
    };
    this.socket = socket;
  }

  // No further attempts, until open().
  close(): void {
    window.clearTimeout(this.timer);
    if (!this.socket) return;
    this.socket.onopen = this.socket.onmessage = this.socket.onclose = null;
    this.socket.close();
    this.socket = undefined;
  }

  send(message: Uint8Array<ArrayBuffer>): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(message);
  }
}

function explain(event: CloseEvent, wasOpen: boolean): string {
  if (!wasOpen) return "The server cannot be reached.";
  if (event.reason) return `The server closed the connection: ${event.reason}.`;
  return event.wasClean ? "The server closed the connection." : "The connection was lost.";
}
