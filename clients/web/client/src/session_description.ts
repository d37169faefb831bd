// SPDX-License-Identifier: MIT
// Session descriptions (SDP, RFC 8866) of one data channel (RFC 8841): reads the offer of the browser, and writes the
// server's answer to it. Pure.

// How a peer proves itself: user name and password of ICE (RFC 8839, section 5.4), and SHA-256 of its certificate.
export interface DatagramOffer {
  ufrag: string;
  password: string;
  fingerprint: Uint8Array<ArrayBuffer>; // 32 bytes
}

export interface DatagramAnswer extends DatagramOffer {
  addresses: readonly string[]; // IPv4 or IPv6, best first. None: the server opens no datagrams
  port: number;
}

const kMaxMessageBytes = 1150; // of a datagram (docs/datagrams.md)

// Reads a description of the browser. Undefined if something is missing.
export function offerIn(description: string): DatagramOffer | undefined {
  const ufrag = attribute(description, "ice-ufrag");
  const password = attribute(description, "ice-pwd");
  const digits = /^sha-256 ((?:[0-9a-f]{2}:){31}[0-9a-f]{2})$/i.exec(attribute(description, "fingerprint") ?? "")?.[1];
  if (ufrag === undefined || password === undefined || digits === undefined) return undefined;
  return { ufrag, password, fingerprint: Uint8Array.from(digits.split(":"), (byte) => parseInt(byte, 16)) };
}

// Writes the server's description, which answers this description of the browser. The server is an ICE-lite agent
// (RFC 8445, section 2.5), waits for the handshake of DTLS, and has host candidates only.
export function describeServer({ ufrag, password, fingerprint, addresses, port }: DatagramAnswer, offer: string): string {
  const mid = attribute(offer, "mid") ?? "0";
  const lines = [
    "v=0",
    "o=- 0 0 IN IP4 0.0.0.0",
    "s=-",
    "t=0 0",
    "a=ice-lite",
    `a=group:BUNDLE ${mid}`,
    `m=application ${port} UDP/DTLS/SCTP webrtc-datachannel`,
    "c=IN IP4 0.0.0.0",
    `a=mid:${mid}`,
    `a=ice-ufrag:${ufrag}`,
    `a=ice-pwd:${password}`,
    `a=fingerprint:sha-256 ${Array.from(fingerprint, (byte) => byte.toString(16).padStart(2, "0")).join(":").toUpperCase()}`,
    "a=setup:passive",
    "a=sctp-port:5000",
    `a=max-message-size:${kMaxMessageBytes}`,
    ...addresses.map((address, index) => `a=candidate:${index + 1} 1 udp ${priority(index)} ${address} ${port} typ host`),
    "a=end-of-candidates",
  ];
  return `${lines.join("\r\n")}\r\n`;
}

// Priority of a host candidate (RFC 8445, section 5.1.2.1). Earlier addresses have higher ones.
function priority(index: number): number {
  return 126 * 2 ** 24 + (65535 - index) * 2 ** 8 + 255;
}

// Value of the first attribute with this name, of the session or of a medium.
function attribute(description: string, name: string): string | undefined {
  const prefix = `a=${name}:`;
  return description.split(/\r?\n/).find((line) => line.startsWith(prefix))?.slice(prefix.length).trim();
}
