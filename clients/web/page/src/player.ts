// SPDX-License-Identifier: MIT
// Timeline of a recording: pause, seek, speed and loop, which act for every participant.

import type { Client, Playback } from "@clothstream/client";
import { element, write } from "./panel/dom";

// Period of seek requests while the user drags the timeline. The server accepts ten requests per second.
const kSeekPeriodMs = 200;

export class Player {
  private readonly card = element("player");
  private readonly pause = element<HTMLButtonElement>("player-pause");
  private readonly timeline = element<HTMLInputElement>("player-position");
  private readonly time = element("player-time");
  private readonly speed = element<HTMLSelectElement>("player-speed");
  private readonly loop = element<HTMLInputElement>("player-loop");
  private client: Client | undefined;
  private playback: Playback | undefined;
  private seeks: number | undefined; // requested time, s; not sent yet
  private soughtAt = -Infinity; // time of the last request, on the clock of performance.now()
  private dragged = false;

  constructor() {
    this.pause.addEventListener("click", () => this.client?.playback.pause(!this.playback?.paused));
    this.timeline.addEventListener("input", () => {
      this.dragged = true;
      this.seeks = this.timeline.valueAsNumber;
    });
    this.timeline.addEventListener("change", () => {
      this.dragged = false;
      this.seek(this.timeline.valueAsNumber);
    });
    this.speed.addEventListener("change", () => this.client?.playback.setSpeed(Number(this.speed.value)));
    this.loop.addEventListener("change", () => this.client?.playback.setLoop(this.loop.checked));
  }

  // Whether the scene is a recording.
  get plays(): boolean {
    return this.playback !== undefined;
  }

  // Updates the timeline. Call once per drawn frame.
  draw(client: Client | undefined): void {
    this.client = client;
    this.playback = client?.playback.state();
    this.card.hidden = !this.playback;
    document.body.toggleAttribute("data-recording", this.plays);
    if (!this.playback) return;
    if (this.seeks !== undefined && performance.now() - this.soughtAt >= kSeekPeriodMs) this.seek(this.seeks);
    const { length, position, paused, loop, speed } = this.playback;
    this.timeline.max = String(length);
    if (!this.dragged) this.timeline.valueAsNumber = position;
    const text = `${clock(this.timeline.valueAsNumber)} / ${clock(length)}`;
    write(this.time, text);
    if (this.timeline.getAttribute("aria-valuetext") !== text) this.timeline.setAttribute("aria-valuetext", text);
    write(this.pause, paused ? "▶" : "❚❚");
    this.pause.setAttribute("aria-label", paused ? "Play" : "Pause");
    this.loop.checked = loop;
    this.showSpeed(speed);
  }

  private seek(seconds: number): void {
    this.seeks = undefined;
    this.soughtAt = performance.now();
    this.client?.playback.seek(Math.min(seconds, this.playback?.length ?? 0));
  }

  // Another client may choose a speed that is not in the list.
  private showSpeed(speed: number): void {
    const value = String(speed);
    if (![...this.speed.options].some((option) => option.value === value)) {
      this.speed.add(new Option(speed === 0 ? "max" : `× ${value}`, value)); // 0: in lockstep, as fast as frames are acknowledged
    }
    this.speed.value = value;
  }
}

// Formats a time, such as 1:02.5.
function clock(seconds: number): string {
  const tenths = Math.floor(10 * seconds);
  const rest = ((tenths % 600) / 10).toFixed(1).padStart(4, "0");
  return `${Math.floor(tenths / 600)}:${rest}`;
}
