// SPDX-License-Identifier: MIT
// Hands, controllers and grabs during a self-test.

import type { GrabEvent } from "@clothstream/client";
import type { Body, Limb } from "@clothstream/three";
import { rounded, type Report, type Sides } from "./report";

export class LimbWatch {
  private frames = 0;
  private readonly hands: Sides = { left: 0, right: 0 };
  private readonly controllers: Sides = { left: 0, right: 0 };
  private readonly pressed = new Set<Limb>();
  private readonly heldSince = new Map<Limb, number>();
  private readonly confirmed = new Set<number>(); // grabs
  private presses = 0;
  private taken = 0;
  private slips = 0;
  private longestMs = 0;

  // Call in each frame of a session, after the poses are read.
  add(body: Body, now: number): void {
    ++this.frames;
    for (const limb of body.present()) {
      if (limb.seen && limb.side !== "none") ++(limb.isHand ? this.hands : this.controllers)[limb.side];
      if (!limb.pressed) this.pressed.delete(limb);
      else if (!this.pressed.has(limb)) {
        this.pressed.add(limb);
        ++this.presses;
      }
      if (limb.grabber.holds && !this.heldSince.has(limb)) {
        this.heldSince.set(limb, now);
        ++this.taken;
      }
    }
    for (const [limb, since] of this.heldSince) {
      this.longestMs = Math.max(this.longestMs, now - since);
      if (!limb.present || !limb.grabber.holds) this.heldSince.delete(limb);
    }
  }

  // The server has changed grabs of this participant. Call before the body lets go of those that slipped.
  grabbed(body: Body, events: readonly GrabEvent[]): void {
    for (const { grab, vertices } of events) {
      if (vertices > 0) this.confirmed.add(grab);
      else for (const limb of body.present()) if (limb.grabber.isGrab(grab)) ++this.slips;
    }
  }

  report(): Pick<Report, "hands" | "controllers" | "grabs"> {
    if (this.frames === 0) return { hands: null, controllers: null, grabs: null };
    const share = ({ left, right }: Sides): Sides => ({ left: rounded(left / this.frames), right: rounded(right / this.frames) });
    return {
      hands: share(this.hands),
      controllers: share(this.controllers),
      grabs: {
        presses: this.presses,
        taken: this.taken,
        confirmed: this.confirmed.size,
        slipped: this.slips,
        longestSeconds: rounded(this.longestMs / 1000),
      },
    };
  }
}
