// SPDX-License-Identifier: MIT
// The figures over the picture: samples them four times a second, and draws them while they are shown.

import type { Client, Link } from "@clothstream/client";
import { element } from "./dom";
import { drawHud, hudText, kHudHeight, kHudWidth, type HudTheme } from "./hud_drawing";
import { HudHistory } from "./hud_history";
import { LinkCounter } from "./link_counts";
import { poseStages } from "./pose_stages";

const kLabelPeriodMs = 1000;

export class HudPanel {
  readonly history = new HudHistory();
  private readonly card = element("hud");
  private readonly canvas = element<HTMLCanvasElement>("hud-canvas");
  private readonly button = element<HTMLButtonElement>("hud-toggle");
  private drawn = 0; // frames since the last sample
  private sampledAt = performance.now();
  private labelledAt = -Infinity;
  private frames = 0;
  private dropped = 0;
  private frameAt = -Infinity; // arrival of the newest frame
  private displayableMs = 0; // of the newest frame
  private readonly linkCounter = new LinkCounter();

  constructor() {
    this.button.addEventListener("click", () => this.toggle());
  }

  get isShown(): boolean {
    return !this.card.hidden;
  }

  toggle(): void {
    this.card.hidden = !this.card.hidden;
    this.button.setAttribute("aria-pressed", String(this.isShown));
    if (this.isShown) this.draw();
  }

  // Call once per drawn frame.
  countFrame(): void {
    ++this.drawn;
  }

  // Takes a sample, also without a connection. Call about four times a second. `pauseMs` is the longest pause between frames
  // since the last call.
  sample(client: Client | undefined, link: Link, now: number, pauseMs: number): void {
    const seconds = (now - this.sampledAt) / 1000;
    const statistics = client?.frames.statistics();
    const stages = client?.frames.stages();
    if (statistics && statistics.frames !== this.frames) {
      this.frames = statistics.frames;
      this.frameAt = now;
      this.displayableMs = stages?.displayableMs ?? 0;
    }
    const dropped = statistics?.dropped ?? this.dropped;
    const age = this.displayableMs + now - this.frameAt;
    this.history.add({
      displayRate: seconds > 0 ? this.drawn / seconds : 0,
      streamRate: statistics?.framesPerSecond ?? 0,
      frameAge: Number.isFinite(age) ? age : 0,
      roundTrip: statistics?.roundTripMs ?? 0,
      kbit: statistics?.kbitPerSecond ?? 0,
      bitsPerVertex: statistics?.bitsPerVertex ?? 0,
      drops: Math.max(0, dropped - this.dropped),
      pause: pauseMs,
      ...poseStages(statistics, stages),
      ...this.linkCounter.take(link.statistics),
    });
    this.history.link = link;
    this.dropped = dropped;
    this.drawn = 0;
    this.sampledAt = now;
    if (this.isShown) this.draw();
  }

  private draw(): void {
    const context = this.canvas.getContext("2d");
    if (!context) return;
    const ratio = Math.min(window.devicePixelRatio, 2);
    const width = Math.round(kHudWidth * ratio);
    if (this.canvas.width !== width) {
      this.canvas.width = width;
      this.canvas.height = Math.round(kHudHeight * ratio);
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, kHudWidth, kHudHeight);
    drawHud(context, this.history, themeOf(this.canvas));
    if (performance.now() - this.labelledAt < kLabelPeriodMs) return;
    this.labelledAt = performance.now();
    this.canvas.setAttribute("aria-label", hudText(this.history));
  }
}

// Colours of the page's scheme.
function themeOf(canvas: HTMLCanvasElement): HudTheme {
  const style = getComputedStyle(canvas);
  const colour = (name: string) => style.getPropertyValue(`--${name}`).trim();
  return {
    text: colour("text"),
    quiet: colour("quiet"),
    line: colour("line"),
    accent: colour("accent"),
    bad: colour("bad"),
    stages: ["stage-1", "stage-2", "stage-3", "stage-4", "stage-5"].map(colour),
    font: "system-ui, sans-serif",
  };
}
