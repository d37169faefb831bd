// SPDX-License-Identifier: MIT
// What the package offers.

export { Client } from "./client";
export * from "./session";
export { Frames } from "./frames";
export { Input } from "./input";
export type { Proof } from "./thread_messages";
export * from "./types";
