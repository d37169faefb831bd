// SPDX-License-Identifier: MIT
// Time that frames take on the main thread, divided into the page's own work and the renderer with its calls of WebGL.

import type { Session } from "@clothstream/client";
import { Samples } from "./samples";

// Times of the last draw, ms (view.ts).
export interface DrawTimes {
  readonly showMs: number;
  readonly renderMs: number;
}

export class FrameWork {
  // For each drawn frame: poses, touches, panels and what is sent, ms.
  readonly input: Samples;
  // For each drawn frame: play-out, local contact, colliders and copies into attributes, ms.
  readonly show: Samples;
  // For each drawn frame: three.js and WebGL, ms.
  readonly render: Samples;
  // For each frame of the stream: taking it from the worker, ms. Mean of those since the drawn frame before.
  readonly take: Samples;
  drawn = 0; // frames in all
  private takeMs = 0;
  private taken = 0;

  constructor(capacity = 1024) {
    this.input = new Samples(capacity);
    this.show = new Samples(capacity);
    this.render = new Samples(capacity);
    this.take = new Samples(capacity);
  }

  // Call at the end of each drawn frame. `beganMs` is performance.now() at its start.
  add(beganMs: number, { showMs, renderMs }: DrawTimes, session: Session): void {
    ++this.drawn;
    this.input.add(performance.now() - beganMs - showMs - renderMs);
    this.show.add(showMs);
    this.render.add(renderMs);
    const frames = session.framesTaken - this.taken;
    if (frames > 0) this.take.add((session.takeMs - this.takeMs) / frames);
    this.takeMs = session.takeMs;
    this.taken = session.framesTaken;
  }
}
