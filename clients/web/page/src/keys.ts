// SPDX-License-Identifier: MIT
// Keys on the picture: arrows turn, plus and minus zoom, W A S D move the collider, R resets the view.

import type { Controls } from "./controls";
import type { Drag } from "./drag";
import type { View } from "./view";

const kZoomStep = 1.1;
const kNudge = 0.03; // m

export function listenToKeys(view: View, drag: Drag, controls: Controls): void {
  const actions: Record<string, () => void> = {
    arrowleft: () => view.turn(-1, 0),
    arrowright: () => view.turn(1, 0),
    arrowup: () => view.turn(0, 1),
    arrowdown: () => view.turn(0, -1),
    "+": () => view.zoom(1 / kZoomStep),
    "=": () => view.zoom(1 / kZoomStep),
    "-": () => view.zoom(kZoomStep),
    r: () => view.reset(),
    w: () => drag.nudge(controls.collider, 0, kNudge),
    s: () => drag.nudge(controls.collider, 0, -kNudge),
    a: () => drag.nudge(controls.collider, -kNudge, 0),
    d: () => drag.nudge(controls.collider, kNudge, 0),
  };
  view.canvas.addEventListener("keydown", (event) => {
    const action = actions[event.key.toLowerCase()];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action();
  });
}
