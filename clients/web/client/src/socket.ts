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
  private prepared: { server: string; socket: WebSocket } | undefined;

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

  // Closes the current socket, if any, and opens a new one, or uses the prepared one. `server`: DNS name in place of the
  // host of the URL; "" means the URL as it is.
  open(server: string): void {
    const prepared = this.takePrepared(server);
    void this.close();
    const socket = prepared ?? new WebSocket(at(this.url, server));
    let wasOpen = false;
    const opened = (): void => {
      wasOpen = true;
      this.listener.opened();
    };
    socket.binaryType = "arraybuffer";
    socket.onopen = opened;
    socket.onmessage = (event: MessageEvent) => {
      if (event.data instanceof ArrayBuffer) this.listener.message(event.data);
    };
    socket.onclose = (event) => {
      this.socket = undefined;
      this.listener.lost(explain(event, wasOpen));
    };
    this.socket = socket;
    if (this.isOpen) opened();
  }

  // Starts to open a socket for a later open() with this name.
  prepare(server: string): void {
    this.dropPrepared();
    this.prepared = { server, socket: new WebSocket(at(this.url, server)) };
  }

  private takePrepared(server: string): WebSocket | undefined {
    const { prepared } = this;
    if (prepared?.server !== server || prepared.socket.readyState > WebSocket.OPEN) return undefined;
    this.prepared = undefined;
    return prepared.socket;
  }

  private dropPrepared(): void {
    this.prepared?.socket.close();
    this.prepared = undefined;
  }

  // Says goodbye, so that the server does not keep the participant's place. Resolves when the socket is closed.
  close(code?: number): Promise<void> {
    const { socket } = this;
    this.dropPrepared();
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
