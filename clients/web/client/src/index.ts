// SPDX-License-Identifier: MIT
// What the package offers.

export * from "./client";
export * from "./session";
export { CoreModule } from "./wasm";
