// SPDX-License-Identifier: MIT
// A headset that shows the scene of a view and sends its input in a session.

import type { Session } from "@clothstream/client";
import { Headset, type HeadsetHost, type HeadsetListener } from "@clothstream/three";
import type { View } from "./view";

export function makeHeadset(view: View, session: Session, listener: HeadsetListener): Headset {
  const host: HeadsetHost = {
    renderer: view.renderer,
    scene: view.scene,
    bounds: () => view.box,
    change: (change) => {
      change(session.client.input);
      session.flush();
    },
    passThrough: (on, hasFloor) => view.passThrough(on, hasFloor),
  };
  return new Headset(host, listener);
}
