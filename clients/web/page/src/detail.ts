// SPDX-License-Identifier: MIT
// How much detail is drawn: chosen by the option `detail` of the address, or by the kind of device.

import type { Detail } from "@clothstream/three";

// Devices that are only touched are phones and tablets, which get reduced detail.
export function chosenDetail(): Detail {
  const wanted = new URLSearchParams(window.location.search).get("detail");
  if (wanted === "full" || wanted === "reduced") return wanted;
  return window.matchMedia("(hover: none) and (pointer: coarse)").matches ? "reduced" : "full";
}
