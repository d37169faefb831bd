// SPDX-License-Identifier: MIT
// Binary WebSocket to the server.

export interface SocketListener {
  opened(): void;
  message(bytes: ArrayBuffer): void;
  // The connection was lost or could not be opened.
  lost(reason: string): void;
}

export class StreamSocket {
  private socket: WebSocket | undefined;

  constructor(
    private readonly url: string,
    private readonly listener: SocketListener,
  ) {}

  // True while the socket is open or opening.
  get inUse(): boolean {
    return this.socket !== undefined;
  }

  get isOpen(): boolean {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  // Closes the current socket, if any, and opens a new one.
  open(): void {
    this.close();
    const socket = new WebSocket(this.url);
    let wasOpen = false;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      wasOpen = true;
      this.listener.opened();
    };
    socket.onmessage = (event: MessageEvent) => {
      if (event.data instanceof ArrayBuffer) this.listener.message(event.data);
    };
    socket.onclose = (event) => {
      this.socket = undefined;
      this.listener.lost(explain(event, wasOpen));
    };
    this.socket = socket;
  }

  close(): void {
    if (!this.socket) return;
    this.socket.onopen = this.socket.onmessage = this.socket.onclose = null;
    this.socket.close();
    this.socket = undefined;
  }

  send(message: Uint8Array<ArrayBuffer>): void {
    if (this.isOpen) this.socket?.send(message);
  }
}

function explain(event: CloseEvent, wasOpen: boolean): string {
  if (!wasOpen) return "The server cannot be reached.";
  if (event.reason) return `The server closed the connection: ${event.reason}.`;
  return event.wasClean ? "The server closed the connection." : "The connection was lost.";
}
