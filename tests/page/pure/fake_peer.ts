// SPDX-License-Identifier: MIT
// A data channel and a peer connection without a network, for tests: they open, lose and close them.

export class FakeChannel {
  readyState = "connecting";
  binaryType = "blob";
  bufferedAmount = 0;
  sent: Uint8Array[] = [];
  onopen: (() => void) | null = null;
  onclose: (() => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;

  constructor(
    readonly label = "",
    readonly options: RTCDataChannelInit = {},
  ) {}
  send(datagram: Uint8Array): void {
    if (this.readyState !== "open") throw new Error("the channel is not open");
    this.sent.push(datagram);
  }
  close(): void {
    this.readyState = "closed";
  }
  opens(): void {
    this.readyState = "open";
    this.onopen?.();
  }
  loses(): void {
    this.readyState = "closed";
    this.onclose?.();
  }
}

export const kBrowserDescription = [
  "v=0",
  "o=- 1 2 IN IP4 127.0.0.1",
  "s=-",
  "t=0 0",
  "a=group:BUNDLE data",
  "m=application 9 UDP/DTLS/SCTP webrtc-datachannel",
  "c=IN IP4 0.0.0.0",
  "a=ice-ufrag:2rl4",
  "a=ice-pwd:zgW3Um2rzsROYUKLk/JSr4rl",
  `a=fingerprint:sha-256 ${Array.from({ length: 32 }, (_, index) => (index + 160).toString(16)).join(":").toUpperCase()}`,
  "a=setup:actpass",
  "a=mid:data",
  "a=sctp-port:5000",
  "",
].join("\r\n");

export class FakePeer {
  static made: FakePeer[] = [];
  static description = kBrowserDescription;
  connectionState = "new";
  localDescription: { sdp: string } | null = null;
  remote: RTCSessionDescriptionInit | undefined;
  closed = false;
  channel: FakeChannel | undefined;
  onconnectionstatechange: (() => void) | null = null;
  refusal: Error | undefined; // of the next description

  constructor() {
    FakePeer.made.push(this);
  }
  createDataChannel(label: string, options: RTCDataChannelInit): FakeChannel {
    return (this.channel = new FakeChannel(label, options));
  }
  async setLocalDescription(): Promise<void> {
    if (this.refusal) throw this.refusal;
    this.localDescription = { sdp: FakePeer.description };
  }
  async setRemoteDescription(description: RTCSessionDescriptionInit): Promise<void> {
    if (this.refusal) throw this.refusal;
    this.remote = description;
  }
  close(): void {
    this.closed = true;
  }
  enters(state: string): void {
    this.connectionState = state;
    this.onconnectionstatechange?.();
  }
}
