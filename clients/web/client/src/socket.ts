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

  // Closes the current socket, if any, and opens a new one. `server`: DNS name in place of the host of the URL; "" means
  // the URL as it is.
  open(server: string): void {
    void this.close();
    const socket = new WebSocket(at(this.url, server));
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

  // Says goodbye, so that the server does not keep the participant's place. Resolves when the socket is closed.
  close(code?: number): Promise<void> {
    const { socket } = this;
    if (!socket) return Promise.resolve();
    this.socket = undefined;
    socket.onopen = socket.onmessage = null;
    return new Promise((closed) => {
      socket.onclose = () => closed();
      socket.close(code);
    });
  }

  send(message: Uint8Array<ArrayBuffer>): void {
    if (this.isOpen) this.socket?.send(message);
  }
}

// The URL with this host, and with the same scheme, port and path.
function at(url: string, server: string): string {
  if (server === "") return url;
  const other = new URL(url);
  other.hostname = server;
  return other.href;
}

function explain(event: CloseEvent, wasOpen: boolean): string {
  if (!wasOpen) return "The server cannot be reached.";
  if (event.reason) return `The server closed the connection: ${event.reason}.`;
  return event.wasClean ? "The server closed the connection." : "The connection was lost.";
}
