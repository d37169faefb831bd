// SPDX-License-Identifier: MIT
// Watches what can fail, chooses what the page says, and joins again where that may help.

import type { Session, SessionState } from "@clothstream/client";
import { FailureCard } from "./failure_card";
import { failureOf, type Failure, type FailureAction } from "./failure";
import { LateFrames } from "./late_frames";
import { watchLocalNetwork } from "./local_network";

const kPeriodMs = 250;

export interface FailuresListener {
  // Joins the scene of the address again, or the default scene.
  join(): void;
  joinDefault(): void;
  // Shows the choices of quality.
  viewWanted(): void;
  changed(failure: Failure | undefined): void;
}

export class Failures {
  // The failure that the page shows now.
  current: Failure | undefined;
  private readonly card = new FailureCard((action) => this.act(action));
  private readonly late = new LateFrames();
  private session: Session | undefined;
  private fatal: Failure | undefined; // nothing else matters
  private asked: Failure | undefined; // a person wanted to know
  private since = performance.now();
  private state: SessionState | undefined;
  private retried: Failure | undefined; // after which the page tries again by itself
  private hasJoined = false;
  private networkDenied = false;
  private listener: FailuresListener | undefined;

  constructor() {
    window.setInterval(() => this.update(), kPeriodMs);
    watchLocalNetwork((denied) => {
      this.networkDenied = denied;
      if (!denied) this.session?.reconnect();
      this.update();
    });
  }

  follow(session: Session, listener: FailuresListener): void {
    this.session = session;
    this.listener = listener;
    this.update();
  }

  // Says why the page cannot work at all. Undefined: it can.
  stop(failure: Failure | undefined): void {
    this.fatal = failure;
    // The controls do nothing.
    document.body.toggleAttribute("data-stopped", failure !== undefined);
    this.update();
  }

  // Says something that a person wanted to know, until it is closed.
  explain(failure: Failure | undefined): void {
    this.asked = failure;
    this.update();
  }

  // Call when the state of the session changes.
  stateChanged(): void {
    this.update();
  }

  // The longest pause between frames since the last call, ms; of a live connection that is expected to send some.
  // `intervalMs` is the usual time between frames.
  sample(pauseMs: number, intervalMs: number): void {
    this.late.sample(pauseMs, intervalMs, performance.now());
  }

  act(action: FailureAction): void {
    switch (action) {
      case "connect":
        return this.session?.reconnect();
      case "join":
        return this.listener?.join();
      case "default":
        return this.listener?.joinDefault();
      case "reload":
        return window.location.reload();
      case "view":
        return this.listener?.viewWanted();
      case "close":
        return this.explain(undefined);
    }
  }

  private update(): void {
    const now = performance.now();
    const before = JSON.stringify(this.current);
    this.current = this.fatal ?? this.ofSession(now);
    if (!this.current || this.current.quiet) this.current = this.asked ?? this.current;
    this.card.show(this.current);
    if (JSON.stringify(this.current) !== before) this.listener?.changed(this.current);
    if (this.current?.retryAt !== undefined && now >= this.current.retryAt) this.listener?.join();
  }

  private ofSession(now: number): Failure | undefined {
    if (!this.session) return undefined;
    const { state } = this.session;
    if (state.kind === "live") this.hasJoined = true;
    else this.late.forget();
    if (state !== this.state) {
      // One loss may take several attempts.
      if (state.kind !== "reconnecting" || this.state?.kind !== "reconnecting") this.since = now;
      this.state = state;
    }
    // The words stay while the page tries again by itself.
    if (state.kind === "connecting" && this.retried) return { ...this.retried, wait: "Trying now." };
    const failure = this.say(state, now);
    this.retried = failure?.retryAt === undefined ? undefined : { ...failure, retryAt: undefined };
    return failure;
  }

  private say(state: SessionState, now: number): Failure | undefined {
    return failureOf(state, {
      now,
      since: this.since,
      hasJoined: this.hasJoined,
      networkDenied: this.networkDenied,
      longestPauseMs: this.late.longestMs(now),
    });
  }
}
