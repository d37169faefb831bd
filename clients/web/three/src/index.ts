// SPDX-License-Identifier: MIT
// What the package offers.

export * from "./cloth_mesh";
export * from "./collider_meshes";
