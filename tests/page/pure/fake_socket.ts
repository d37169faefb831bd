// SPDX-License-Identifier: MIT
// A WebSocket without a network, for tests: they open and close it, and read what was sent.

export type Closed = Pick<CloseEvent, "reason" | "wasClean">;

export class FakeSocket {
  static readonly OPEN = 1;
  static made: FakeSocket[] = [];
  readyState = 0;
  binaryType = "blob";
  sent: unknown[] = [];
  closed = false;
  closeCode: number | undefined;
  onopen: (() => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  onclose: ((event: Closed) => void) | null = null;

  constructor(readonly url: string) {
    FakeSocket.made.push(this);
  }
  send(message: unknown): void {
    this.sent.push(message);
  }
  close(code?: number): void {
    this.closed = true;
    this.closeCode = code;
  }
  opens(): void {
    this.readyState = FakeSocket.OPEN;
    this.onopen?.();
  }
}
