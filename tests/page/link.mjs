// SPDX-License-Identifier: MIT
// A TCP proxy to a local port. The link can be cut and restored.

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
        // Bytes that were already received are still forwarded.
        to.destroySoon();
      });
      from.pipe(to);
    }
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
    close() {
      this.cut();
      listener.close();
    },
  };
}
