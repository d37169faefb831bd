// SPDX-License-Identifier: MIT
// The page /selftest: joins a scene, measures for two minutes, in VR if the device offers it, and shows the result.

import { Session, type Client, type SessionState } from "@clothstream/client";
import { CanvasPanel, Immersion, type Headset } from "@clothstream/three";
import { chosenDetail } from "../detail";
import { browserTokens, tabPlaces } from "../identity";
import { FrameWork } from "../frame_work";
import { element, write } from "../panel/dom";
import { expose } from "../probe";
import { View } from "../view";
import { makeHeadset } from "../view_headset";
import { stepText } from "./guide";
import { Measurement } from "./measurement";
import { Results } from "./results";

const kUsualSeconds = 120;
const kLeastSeconds = 3;
const kMostSeconds = 900;
const kStreamMs = 20_000; // for the first frame
const kRefreshMs = 250;
// Place of the panel in space, in metres from the user's feet: above and behind the near edge of the cloth.
const kPanelPlace = { x: 0, y: 1.55, z: -0.9 };
const kPanelScale = 1.8; // so that it can be read at this distance

class SelfTest {
  readonly headset: Headset;
  readonly work = new FrameWork(); // for the probe
  readonly panel = new CanvasPanel();
  private readonly results = new Results();
  private readonly startVr = element<HTMLButtonElement>("start-vr");
  private readonly startWindow = element<HTMLButtonElement>("start-window");
  private readonly stopButton = element<HTMLButtonElement>("stop");
  private measurement: Measurement | undefined;
  private waitsSince: number | undefined; // for the first frame of the stream
  private shownAt = -Infinity;

  constructor(
    private readonly view: View,
    private readonly session: Session,
    private readonly seconds: number,
  ) {
    this.headset = makeHeadset(view, session, {
      left: () => {
        view.resize();
        view.reset();
        this.end();
      },
      updated: () => this.panel.update(this.headset.body, this.headset.placement.matrix),
    });
    this.headset.seat.add(this.panel.mesh);
    this.panel.mesh.position.set(kPanelPlace.x, kPanelPlace.y, kPanelPlace.z);
    this.panel.mesh.scale.setScalar(kPanelScale);
    this.startVr.addEventListener("click", () => void this.enter());
    this.startWindow.addEventListener("click", () => this.begin());
    this.stopButton.addEventListener("click", () => this.end());
    document.addEventListener("visibilitychange", () => {
      if (!this.headset.session) this.measurement?.interrupted(!document.hidden);
    });
    void this.offer();
  }

  // Call for each drawn frame.
  draw(now: number, frame?: XRFrame): void {
    const began = performance.now();
    const { session, view, headset } = this;
    const client = session.state.kind === "live" ? session.client : undefined;
    if (frame) headset.update(frame, now, client);
    session.flush();
    view.draw(session.client, frame?.predictedDisplayTime ?? now);
    this.work.add(began, view, session);
    this.measurement?.add(now, began, view, session, headset, client);
    if (now - this.shownAt >= kRefreshMs) this.refresh(now, client);
  }

  grabsChanged(client: Client): void {
    const events = client.input.grabEvents();
    this.measurement?.grabbed(this.headset, events);
    for (const { grab, vertices } of events) if (vertices === 0) this.headset.slipped(grab);
  }

  stateChanged(state: SessionState): void {
    if (state.kind === "reconnecting") this.measurement?.reconnected();
    if (state.kind === "asking") say(`${state.reason} Open the main page first, and pair this browser there.`);
    else if (state.kind === "failed" || state.kind === "reconnecting") say(state.reason);
    else if (!this.measurement) say(state.kind === "live" ? "Connected." : "Connecting.");
    if (state.kind === "asking" || state.kind === "failed") this.end();
  }

  private async offer(): Promise<void> {
    const modes = await Immersion.offered();
    const offersVr = modes.includes("immersive-vr");
    this.startVr.hidden = !offersVr;
    this.startWindow.disabled = false;
    if (offersVr) return this.startVr.focus();
    write(element("no-vr"), window.isSecureContext ? kNoHeadset : kInsecure);
    element("no-vr").hidden = false;
    this.startWindow.classList.add("primary");
  }

  private async enter(): Promise<void> {
    try {
      await this.headset.enter("immersive-vr", this.session.client.frames.streamRate);
    } catch (error) {
      return say(`The headset did not start: ${error instanceof Error ? error.message : String(error)}`);
    }
    const { session } = this.headset;
    session?.addEventListener("visibilitychange", () => this.measurement?.interrupted(session.visibilityState === "visible"));
    this.begin();
  }

  // The measurement itself begins with the first frame of the stream.
  private begin(): void {
    this.results.hide();
    this.waitsSince = performance.now();
    this.offerStart(false);
  }

  private refresh(now: number, client: Client | undefined): void {
    this.shownAt = now;
    if (this.waitsSince !== undefined) {
      if (client && client.frames.statistics().frames > 0) {
        this.waitsSince = undefined;
        this.measurement = new Measurement(performance.now(), this.seconds, this.headset.mode ?? null);
      } else if (performance.now() - this.waitsSince > kStreamMs) {
        this.end();
        return say(`No frame came within ${kStreamMs / 1000} s.`);
      }
    }
    if (!this.measurement) return;
    const left = this.measurement.secondsLeft(performance.now());
    if (left === 0) return this.end();
    const step = stepText(this.headset.session !== undefined, 1 - left / this.seconds);
    const time = `${Math.ceil(left)} s`;
    write(element("step"), step);
    write(element("left"), time);
    this.panel.show(`Self-test: ${time}`, [{ text: step }]);
  }

  // Shows the result of a test that runs, and offers the next one.
  private end(): void {
    const { measurement } = this;
    this.measurement = this.waitsSince = undefined;
    this.offerStart(true);
    if (this.headset.session) void this.headset.leave();
    if (!measurement) return;
    const report = measurement.report(performance.now(), this.session.client, graphicsOf(this.view));
    if (report) this.results.show(report);
    else say("Nothing was measured: no frame was drawn.");
  }

  private offerStart(on: boolean): void {
    element("start").hidden = !on;
    element("run").hidden = on;
    write(element("step"), "Waiting for the stream");
    write(element("left"), "");
  }
}

function graphicsOf({ renderer }: View): string | null {
  const context = renderer.getContext();
  const names = context.getExtension("WEBGL_debug_renderer_info");
  return names ? String(context.getParameter(names.UNMASKED_RENDERER_WEBGL)) : null;
}

function say(text: string): void {
  write(element("message"), text);
}

function chosenSeconds(query: URLSearchParams): number {
  const given = query.get("seconds");
  if (given === null) return kUsualSeconds;
  const seconds = Number(given);
  if (given.trim() !== "" && seconds >= kLeastSeconds && seconds <= kMostSeconds) return seconds;
  write(element("wrong"), `seconds=${given} is not allowed; use ${kLeastSeconds} to ${kMostSeconds}. The test takes ${kUsualSeconds} s.`);
  element("wrong").hidden = false;
  return kUsualSeconds;
}

async function start(): Promise<void> {
  const query = new URLSearchParams(window.location.search);
  const seconds = chosenSeconds(query);
  write(element("length"), seconds >= 60 ? `${Math.round(seconds / 6) / 10} minutes` : `${seconds} seconds`);
  let view: View;
  try {
    view = new View(element<HTMLCanvasElement>("picture"), chosenDetail());
  } catch (error) {
    console.error(error);
    return say("This page needs WebGL 2, which this browser does not provide.");
  }
  const address = new URL("stream", window.location.href);
  address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
  address.search = "";
  // Messages of the worker come after this function has returned.
  const session: Session = await Session.open({
    url: address.href,
    scene: query.get("scene") ?? "",
    program: "clothstream self-test",
    identity: { name: "Self-test", role: 0 },
    tokens: browserTokens,
    places: tabPlaces,
    listener: {
      stateChanged: () => test.stateChanged(session.state),
      described: (client) => {
        probe.described(client);
        view.describe(client);
      },
      parametersChanged: (client) => view.dress(client),
      participantsChanged: (client) => view.name(client),
      grabsChanged: (client) => test.grabsChanged(client),
      notice: say,
      refused: (client) => say(client.errorText),
    },
  });
  const test = new SelfTest(view, session, seconds);
  const probe = expose(session, view, test);
  view.renderer.setAnimationLoop((now: number, frame?: XRFrame) => test.draw(now, frame));
}

const kNoHeadset = "This browser offers no headset. In a window, hands, controllers and grabs are not measured.";
const kInsecure =
  "Headsets need a secure page: start the server with --tls self and open its https address. In a window, hands, controllers and " +
  "grabs are not measured.";

start().catch((error: unknown) => {
  console.error(error);
  say(`The self-test did not start: ${error instanceof Error ? error.message : String(error)}`);
});
