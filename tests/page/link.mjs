// SPDX-License-Identifier: MIT
// A link to a port of this machine that can be cut, and returns.

import { once } from "node:events";
import net from "node:net";

export async function makeLink(target) {
  const sockets = new Set();
  let whole = true;
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
        // What was said last still goes through.
        to.destroySoon();
      });
      from.pipe(to);
    }
  });
  listener.listen(0, "127.0.0.1");
  await once(listener, "listening");
  return {
    url: `http://127.0.0.1:${listener.address().port}/`,
    // Resets every connection, and those that come until it is restored.
    cut() {
      whole = false;
      for (const socket of sockets) socket.resetAndDestroy();
    },
    restore() {
      whole = true;
    },
    close() {
      this.cut();
      listener.close();
    },
  };
}
