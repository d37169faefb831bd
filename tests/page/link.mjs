// SPDX-License-Identifier: MIT
// A TCP proxy to a local port. The link can be cut, restored and stalled, and can answer in place of the server.

import { once } from "node:events";
import net from "node:net";

export async function makeLink(target) {
  const sockets = new Set();
  let whole = true;
  let answer;
  const listener = net.createServer((client) => {
    if (!whole) return client.resetAndDestroy();
    const server = net.connect(target, "127.0.0.1");
    for (const [from, to] of [
      [client, server],
      [server, client],
    ]) {
      sockets.add(from);
      from.on("error", () => {});
      from.on("close", () => {
        sockets.delete(from);
        // Bytes that were already received are still forwarded.
        to.destroySoon();
      });
      if (from === client || answer === undefined) from.pipe(to);
    }
    if (answer !== undefined) answerStream(server, client, answer);
  });
  listener.listen(0, "127.0.0.1");
  await once(listener, "listening");
  return {
    url: `http://127.0.0.1:${listener.address().port}/`,
    // Resets all connections, and new ones until restore().
    cut() {
      whole = false;
      for (const socket of sockets) socket.resetAndDestroy();
    },
    restore() {
      whole = true;
    },
    // Delivers nothing to the page for a time, and then everything.
    async stall(milliseconds) {
      for (const socket of sockets) socket.pause();
      await new Promise((done) => setTimeout(done, milliseconds));
      for (const socket of sockets) socket.resume();
    },
    // New streams get this message of the server, and nothing else.
    answerStreams(message) {
      answer = message;
    },
    close() {
      this.cut();
      listener.close();
    },
  };
}

// Forwards what the server answers, until it opens a stream: the page then gets only the message.
function answerStream(server, client, message) {
  let isStream = false;
  server.on("data", (bytes) => {
    if (isStream) return;
    isStream = bytes.toString("latin1", 0, 12) === "HTTP/1.1 101";
    if (!isStream) return client.write(bytes);
    // A binary frame of a WebSocket that is shorter than 126 bytes.
    const end = bytes.indexOf("\r\n\r\n") + 4;
    client.write(Buffer.concat([bytes.subarray(0, end), Buffer.from([0x82, message.length]), message]));
  });
}
