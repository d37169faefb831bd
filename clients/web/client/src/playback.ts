// SPDX-License-Identifier: MIT
// The clock of the scene and of a recording.

import { CS_PLAYBACK_VERSION, cs_playback } from "./layout";
import { nowUs, type CoreHandle } from "./handle";
import type { Playback } from "./types";

export class PlaybackControl {
  constructor(private readonly handle: CoreHandle) {}

  // State of the playback; undefined unless the scene is a recording.
  state(): Playback | undefined {
    if (this.handle.core.exports.cs_get_playback(this.handle.pointer, nowUs(), this.handle.prepared(CS_PLAYBACK_VERSION)) === 0) return undefined;
    const view = this.handle.core.view();
    return {
      length: view.getFloat64(this.handle.scratch + cs_playback.length, true),
      position: view.getFloat64(this.handle.scratch + cs_playback.position, true),
      speed: view.getFloat64(this.handle.scratch + cs_playback.speed, true),
      loop: view.getInt32(this.handle.scratch + cs_playback.loop, true) !== 0,
      paused: view.getInt32(this.handle.scratch + cs_playback.paused, true) !== 0,
    };
  }

  // The four functions below act for every participant of the scene.
  pause(paused: boolean): void {
    this.handle.core.exports.cs_pause(this.handle.pointer, paused ? 1 : 0);
  }
  seek(seconds: number): void {
    this.handle.core.exports.cs_seek(this.handle.pointer, seconds);
  }
  setSpeed(speed: number): void {
    this.handle.core.exports.cs_set_speed(this.handle.pointer, speed);
  }
  setLoop(loop: boolean): void {
    this.handle.core.exports.cs_set_loop(this.handle.pointer, loop ? 1 : 0);
  }
}
