// SPDX-License-Identifier: MIT
// Entry of the worker: one connection at a time.

import { Connection, type Port } from "./connection";
import type { ToWorker } from "./thread_messages";

const scope = self as unknown as Port & { onmessage: (event: MessageEvent<ToWorker>) => void; close(): void };

let connection: Promise<Connection> | undefined;
let session = 0;

scope.onmessage = ({ data }) => {
  if (data.kind === "start") {
    const before = connection;
    connection = (async () => {
      void (await before?.catch(() => undefined))?.leave();
      return Connection.start(scope, data);
    })();
    session = data.session;
    connection.catch((error: unknown) => complain(data.session, error));
    return;
  }
  if (data.kind === "leave" || data.kind === "hide") {
    const returns = data.kind === "hide" && data.returns;
    const left = Promise.resolve(connection).then((one) => one?.leave(returns), () => undefined);
    if (data.kind === "leave") void left.finally(() => scope.close());
    connection = undefined;
    return;
  }
  const of = session;
  // A failed start is reported already.
  connection?.then((one) => one.handle(data), () => undefined).catch((error: unknown) => complain(of, error));
};

function complain(of: number, error: unknown): void {
  scope.postMessage({ session: of, kind: "broken", reason: error instanceof Error ? error.message : String(error) }, []);
}
