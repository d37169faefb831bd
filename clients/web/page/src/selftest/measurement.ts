// SPDX-License-Identifier: MIT
// Collects the figures of one self-test while it runs.

import type { Client, GrabEvent, Session } from "@clothstream/client";
import type { Headset } from "@clothstream/three";
import { FrameWork, type DrawTimes } from "../frame_work";
import { kStages } from "../panel/hud_history";
import { poseStages } from "../panel/pose_stages";
import { Samples } from "../samples";
import { LimbWatch } from "./limb_watch";
import { kSchema, kVersion, rounded, spread, type Report } from "./report";

const kMostRate = 144; // Hz, for the memory that is kept
const kSamplePeriodMs = 100;
const kLongGap = 1.5; // times the median

// Counts of the stream, which start again with each client.
interface Counts {
  frames: number;
  dropped: number;
  decodeErrors: number;
  hashMismatches: number;
}
const kCounts = ["frames", "dropped", "decodeErrors", "hashMismatches"] as const;

export class Measurement {
  private readonly gaps: Samples;
  private readonly work: FrameWork;
  private readonly decode: Samples;
  private readonly latency: Samples;
  private readonly roundTrip: Samples;
  private readonly kbit: Samples;
  private readonly limbs = new LimbWatch();
  private readonly counts: Counts = { frames: 0, dropped: 0, decodeErrors: 0, hashMismatches: 0 };
  private last: (Counts & { client: Client }) | undefined;
  private frames = 0;
  private frameAt: number | undefined; // undefined: the next gap does not count
  private gapsMs = 0;
  private sampledAt = -Infinity;
  private touched = 0; // frames with local contact
  private largestCorrection = 0; // m
  private interruptions = 0;
  private reconnects = 0;
  private session: Report["session"] | undefined;

  // Times are milliseconds of performance.now().
  constructor(
    private readonly startedAt: number,
    private readonly requestedSeconds: number,
    private readonly mode: string | null,
  ) {
    const frames = Math.ceil(requestedSeconds * kMostRate);
    const samples = Math.ceil((1000 * requestedSeconds) / kSamplePeriodMs) + 1;
    this.gaps = new Samples(frames);
    this.work = new FrameWork(frames);
    this.decode = new Samples(samples);
    this.latency = new Samples(samples);
    this.roundTrip = new Samples(samples);
    this.kbit = new Samples(samples);
  }

  // Seconds that are left.
  secondsLeft(now: number): number {
    return Math.max(0, this.requestedSeconds - (now - this.startedAt) / 1000);
  }

  // Call at the end of each drawn frame. `frameMs` is the time that the browser gives to the frame, `beganMs` the time at
  // which its work began. `client` is undefined without a connection.
  add(frameMs: number, beganMs: number, draw: DrawTimes, session: Session, headset: Headset, client: Client | undefined): void {
    ++this.frames;
    if (this.frameAt !== undefined) {
      this.gaps.add(frameMs - this.frameAt);
      this.gapsMs += frameMs - this.frameAt;
    }
    this.frameAt = frameMs;
    this.work.add(beganMs, draw, session);
    if (headset.session) this.limbs.add(headset.body, beganMs);
    if (!client) return;
    const correction = client.frames.localCorrection;
    if (correction > 0) ++this.touched;
    this.largestCorrection = Math.max(this.largestCorrection, correction);
    if (beganMs - this.sampledAt < kSamplePeriodMs) return;
    this.sampledAt = beganMs;
    this.sample(client);
    if (headset.session) this.session = this.sessionOf(headset.session);
  }

  // The picture is hidden by the system, or seen again. The pause does not count as a gap.
  interrupted(visible: boolean): void {
    this.frameAt = undefined;
    if (!visible) ++this.interruptions;
  }

  reconnected(): void {
    ++this.reconnects;
  }

  // The server has changed grabs of this participant. Call before the headset lets go of those that slipped.
  grabbed(headset: Headset, events: readonly GrabEvent[]): void {
    this.limbs.grabbed(headset.body, events);
  }

  // Undefined if no frame of the stream came or none was drawn.
  report(now: number, client: Client, graphics: string | null): Report | undefined {
    const gaps = spread(this.gaps);
    if (this.counts.frames === 0 || !gaps) return undefined;
    const seconds = (now - this.startedAt) / 1000;
    const longGaps = this.gaps.sorted().filter((gap) => gap > kLongGap * gaps.median).length;
    return {
      schema: kSchema,
      version: kVersion,
      date: new Date().toISOString(),
      requestedSeconds: this.requestedSeconds,
      seconds: rounded(seconds),
      complete: seconds >= this.requestedSeconds,
      device: { userAgent: navigator.userAgent, processors: navigator.hardwareConcurrency ?? null, graphics },
      page: { secure: window.isSecureContext, isolated: window.crossOriginIsolated },
      session: { ...(this.session ?? kWindow), interruptions: this.interruptions },
      display: { frames: this.frames, rate: rounded((1000 * this.gaps.count) / this.gapsMs), gapMs: gaps, longGaps },
      stream: {
        scene: client.sceneName,
        vertices: client.frames.vertexCount,
        nominalRate: client.frames.streamRate,
        ...this.counts,
        rate: rounded(this.counts.frames / seconds),
        reconnects: this.reconnects,
        kbitPerSecond: spread(this.kbit)?.median ?? null,
        roundTripMs: spread(this.roundTrip)?.median ?? null,
      },
      threads: {
        decodeMs: spread(this.decode),
        takeMs: spread(this.work.take),
        inputMs: spread(this.work.input),
        showMs: spread(this.work.show),
        renderMs: spread(this.work.render),
      },
      poseToDisplayableMs: spread(this.latency),
      ...this.limbs.report(),
      touch: this.mode === null ? null : { share: rounded(this.touched / this.frames), largestCorrectionMm: rounded(1000 * this.largestCorrection) },
    };
  }

  private sample(client: Client): void {
    const statistics = client.frames.statistics();
    const stages = client.frames.stages();
    const last = this.last?.client === client ? this.last : { ...statistics, client };
    for (const name of kCounts) this.counts[name] += Math.max(0, statistics[name] - last[name]);
    this.last = { ...statistics, client };
    this.kbit.add(statistics.kbitPerSecond);
    if (statistics.roundTripMs > 0) this.roundTrip.add(statistics.roundTripMs);
    if (!stages) return;
    this.decode.add(stages.decodeMs);
    const parts = poseStages(statistics, stages);
    this.latency.add(kStages.reduce((sum, stage) => sum + parts[stage], 0));
  }

  private sessionOf(session: XRSession): Report["session"] {
    return {
      mode: this.mode,
      features: session.enabledFeatures ? [...session.enabledFeatures] : null,
      rates: session.supportedFrameRates ? [...session.supportedFrameRates] : null,
      rate: session.frameRate ?? null,
      interruptions: 0,
    };
  }
}

const kWindow: Report["session"] = { mode: null, features: null, rates: null, rate: null, interruptions: 0 };
