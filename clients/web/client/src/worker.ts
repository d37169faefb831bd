// SPDX-License-Identifier: MIT
// Entry of the worker: one connection at a time.

import { Connection, type Port } from "./connection";
import type { ToWorker } from "./thread_messages";

const scope = self as unknown as Port & { onmessage: (event: MessageEvent<ToWorker>) => void };

let connection: Promise<Connection> | undefined;

scope.onmessage = ({ data }) => {
  if (data.kind === "start") {
    const before = connection;
    connection = (async () => {
      (await before?.catch(() => undefined))?.stop();
      return Connection.start(scope, data);
    })();
    connection.catch((error: unknown) => {
      const reason = error instanceof Error ? error.message : String(error);
      scope.postMessage({ session: data.session, kind: "broken", reason }, []);
    });
    return;
  }
  const ended = connection;
  if (data.kind === "stop") connection = undefined;
  void ended?.then((one) => one.handle(data)).catch(() => undefined);
};
