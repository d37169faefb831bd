// SPDX-License-Identifier: MIT
// How the picture is drawn: chosen by options of the address, or by the kind of device.

import type { Detail } from "@clothstream/three";

// Devices that are only touched are phones and tablets, which get reduced detail.
export function chosenDetail(): Detail {
  const wanted = new URLSearchParams(window.location.search).get("detail");
  if (wanted === "full" || wanted === "reduced") return wanted;
  return window.matchMedia("(hover: none) and (pointer: coarse)").matches ? "reduced" : "full";
}

// The option `normals` of the address: cpu computes normals without the graphics device, to compare both ways.
export function gathersNormals(): boolean {
  return new URLSearchParams(window.location.search).get("normals") !== "cpu";
}
