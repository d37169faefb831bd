// SPDX-License-Identifier: MIT
// A copy of the page whose worker times its frames: `frameTimes` in the worker, ms.
import { cp, readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";

// Runs in the worker before its own script: times each message that brings a frame, from its arrival to its hand-over.
function timeFrames() {
  const kMost = 1024;
  let isFrame = false;
  let count = 0;
  self.frameTimes = [];
  const post = self.postMessage.bind(self);
  self.postMessage = (message, transfer) => {
    isFrame ||= typeof message === "number" || message.frame !== undefined;
    post(message, transfer);
  };
  const { set } = Object.getOwnPropertyDescriptor(WebSocket.prototype, "onmessage");
  Object.defineProperty(WebSocket.prototype, "onmessage", {
    set(handler) {
      const timed = (event) => {
        isFrame = false;
        const began = performance.now();
        handler(event);
        if (isFrame) self.frameTimes[count++ % kMost] = performance.now() - began;
      };
      set.call(this, handler && timed);
    },
  });
}

export async function copyWithTimedWorker(page, folder) {
  await cp(page, folder, { recursive: true });
  const worker = join(folder, "worker.js");
  await writeFile(worker, `(${timeFrames})();\n${await readFile(worker, "utf8")}`);
}
