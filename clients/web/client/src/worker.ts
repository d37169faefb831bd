// SPDX-License-Identifier: MIT
// Entry of the worker: one connection at a time.

import { Connection, type Port } from "./connection";
import type { ToWorker } from "./thread_messages";

const scope = self as unknown as Port & { onmessage: (event: MessageEvent<ToWorker>) => void };

let connection: Promise<Connection> | undefined;
let session = 0;

scope.onmessage = ({ data }) => {
  if (data.kind === "start") {
    const before = connection;
    connection = (async () => {
      (await before?.catch(() => undefined))?.stop();
      return Connection.start(scope, data);
    })();
    session = data.session;
    connection.catch((error: unknown) => complain(data.session, error));
    return;
  }
  const ended = connection;
  if (data.kind === "stop") connection = undefined;
  const of = session;
  // A failed start is reported already.
  ended?.then((one) => one.handle(data), () => undefined).catch((error: unknown) => complain(of, error));
};

function complain(of: number, error: unknown): void {
  scope.postMessage({ session: of, kind: "broken", reason: error instanceof Error ? error.message : String(error) }, []);
}
