// SPDX-License-Identifier: MIT
// Data channel of the browser, for the thread that has it or for another one.

// Bytes that wait in the browser, above which datagrams are dropped: newer ones are worth more than old ones.
const kMostWaiting = 16 * 1024;

export interface ChannelListener {
  opened(): void;
  arrived(datagram: ArrayBuffer): void;
  closed(): void;
}

export class DatagramChannel {
  isOpen = false; // as far as the listener knows

  // A port leads to the channel of another thread (relay()).
  constructor(
    private readonly channel: RTCDataChannel | MessagePort,
    listener: ChannelListener,
  ) {
    const opened = () => {
      this.isOpen = true;
      listener.opened();
    };
    const closed = () => {
      this.isOpen = false;
      listener.closed();
    };
    if (isPort(channel)) {
      channel.onmessage = ({ data }: MessageEvent<ArrayBuffer | "opened" | "closed">) => {
        if (data instanceof ArrayBuffer) listener.arrived(data);
        else if (data === "opened") opened();
        else closed();
      };
      return;
    }
    channel.binaryType = "arraybuffer";
    channel.onopen = opened;
    channel.onclose = closed;
    channel.onmessage = ({ data }: MessageEvent<unknown>) => {
      if (data instanceof ArrayBuffer) listener.arrived(data);
    };
  }

  // Sends a datagram or drops it. Its buffer may be transferred.
  send(datagram: Uint8Array<ArrayBuffer>): void {
    const { channel } = this;
    if (isPort(channel)) channel.postMessage(datagram.buffer, [datagram.buffer]);
    else if (channel.readyState === "open" && channel.bufferedAmount <= kMostWaiting) channel.send(datagram);
  }

  close(): void {
    const { channel } = this;
    this.isOpen = false;
    if (isPort(channel)) channel.onmessage = null;
    else channel.onopen = channel.onclose = channel.onmessage = null;
    channel.close();
  }
}

// Keeps a channel in this thread, and returns a port with which another thread uses it.
export function relay(channel: RTCDataChannel): MessagePort {
  const { port1, port2 } = new MessageChannel();
  const own = new DatagramChannel(channel, {
    opened: () => port1.postMessage("opened"),
    arrived: (datagram) => port1.postMessage(datagram, [datagram]),
    closed: () => port1.postMessage("closed"),
  });
  port1.onmessage = ({ data }: MessageEvent<ArrayBuffer>) => own.send(new Uint8Array(data));
  return port2;
}

function isPort(channel: RTCDataChannel | MessagePort): channel is MessagePort {
  return "postMessage" in channel;
}
