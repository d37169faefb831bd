// SPDX-License-Identifier: MIT
// Starts the page: core, view, session, panel, and the drawing loop.

import { kTransports, Roles, Session, type Client, type SessionListener, type SessionOptions, type Transport, type Vec3 } from "@clothstream/client";
import { kGraphicsLost, kNoWebAssembly, kNoWebGl, notLoaded } from "./advice";
import { Drag } from "./drag";
import { FrameWork } from "./frame_work";
import { HeadsetPage } from "./headset_page";
import { Failures } from "./failures";
import { Hud } from "./hud";
import { browserTokens, listenToProof, PairingPanel, tabPlaces } from "./identity";
import { listenToKeys } from "./keys";
import { element } from "./panel/dom";
import { Panel } from "./panel/panel";
import { Player } from "./player";
import { Pusher, type Tool } from "./pusher";
import { expose } from "./probe";
import { showAddress } from "./share";
import { View } from "./view";
import { chosenDetail, gathersNormals } from "./detail";

const kFiguresPeriodMs = 250;
const kYields = "The cloth has no room to give way there. What you hold against it is red, and waits.";
const kLoadAgainMs = 3000;

async function start(): Promise<void> {
  element("no-start").remove();
  const hud = new Hud();
  const failures = new Failures();
  if (typeof WebAssembly !== "object") {
    hud.showState("stopped");
    return failures.stop(kNoWebAssembly);
  }
  void showAddress();
  const player = new Player();

  const address = new URL("stream", window.location.href);
  address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
  address.search = "";
  const query = new URLSearchParams(window.location.search);
  const scene = sceneOfAddress();
  const role = query.get("role");
  const wanted = [...Roles].find(([, name]) => name === role)?.[0];
  const identity = { name: query.get("name") ?? "", role: wanted ?? 0 };
  if (role !== null && wanted === undefined)
    hud.showNotice(`"${role}" is not a role; use ${[...Roles.values()].join(", ")}.`);
  listenToProof((given) => session.prove(given));
  const pairing = new PairingPanel(() => {
    session.client.people.createPairingCode();
    session.flush();
  });
  const listener: SessionListener = {
    stateChanged: () => {
      hud.showState(session.state.kind);
      panel.stateChanged();
      failures.stateChanged();
    },
    pairingCodeMade: (client) => {
      const made = client.people.pairingCode();
      if (made) pairing.showCode(made);
    },
    described: (client) => {
      hud.showScene(client);
      probe.described(client);
      view.describe(client);
      panel.described(client);
    },
    parametersChanged: (client) => {
      panel.parametersChanged(client);
      view.dress(client);
    },
    participantsChanged: (client) => {
      view.name(client);
      panel.participantsChanged(client);
      pairing.showFor(client);
    },
    scenesListed: (client) => panel.scenesListed(client),
    answered: (client) => panel.answered(client),
    surfacesChanged: (client) => view.showRooms(client),
    grabsChanged: (client) => {
      for (const { grab, vertices } of client.input.grabEvents()) {
        if (vertices > 0) continue;
        drag.slipped(grab);
        headset.slipped(grab);
      }
    },
    notice: (text) => {
      notify(text);
      panel.noticed();
    },
    refused: (client) => {
      if (headset.refused(client)) return;
      notify(client.errorText);
      if (client.errorText.startsWith("colliderPoses.winds")) putFanAway();
      panel.refused(client);
    },
  };
  const options: SessionOptions = {
    url: address.href,
    scene,
    identity,
    program: "clothstream page",
    tokens: browserTokens,
    places: tabPlaces,
    quality: qualityOfAddress(),
    surfaces: true,
    transport: transportOfAddress((text) => hud.showNotice(text)),
    listener,
  };
  const panel: Panel = new Panel(() => session, options, { sceneChosen: chooseScene, viewReset: () => view.reset(), said: (text) => headset.say(text) });
  const session: Session = await open(options, failures);
  const canvas = element<HTMLCanvasElement>("canvas");
  canvas.addEventListener("webglcontextlost", () => failures.stop(kGraphicsLost));
  // Afterwards, because the worker joins the scene while this thread makes the textures of the room.
  let view: View;
  try {
    view = new View(canvas, chosenDetail(), gathersNormals());
  } catch (error) {
    session.close();
    hud.showState("stopped");
    failures.stop(kNoWebGl);
    console.error(error);
    return;
  }
  failures.follow(session, {
    join: () => chooseScene(sceneOfAddress()),
    joinDefault: () => chooseScene(""),
    viewWanted: () => panel.showView(),
    changed: () => headset.show(),
  });

  const castRay = (origin: Vec3, direction: Vec3) =>
    session.state.kind === "live" ? session.client.frames.castRay(origin, direction) : undefined;
  // Before Drag, so that its presses come first.
  const pusher = new Pusher(view, castRay);
  const tools = document.querySelectorAll<HTMLInputElement>('input[name="tool"]');
  for (const tool of tools) tool.addEventListener("change", () => (pusher.tool = tool.value as Tool));
  const drag: Drag = new Drag(
    view,
    castRay,
    (collider) => (panel.controls.collider = collider),
  );
  listenToKeys(view, drag, panel.controls);

  function chooseScene(name: string): void {
    const url = new URL(window.location.href);
    if (name) url.searchParams.set("scene", name);
    else url.searchParams.delete("scene");
    window.history.replaceState(null, "", url);
    headset.headset.body.letGo();
    session.join(name);
  }

  // The server would refuse it in each frame.
  function putFanAway(): void {
    for (const tool of tools) tool.checked = tool.value === "hand";
    pusher.tool = "hand";
    headset.holdFan(false);
  }

  function notify(text: string): void {
    hud.showNotice(text);
    headset.say(text);
  }

  const headset: HeadsetPage = new HeadsetPage(view, session, panel, { sceneChosen: chooseScene, notice: (text) => hud.showNotice(text) }, failures);
  const work = new FrameWork();
  const probe = expose(session, view, { headset: headset.headset, panel: headset.panel, work, history: panel.hud.history, create: panel.create });

  // Longest pause between frames since the last call, ms. 0 while none are expected.
  function takePause(client: Client | undefined): number {
    if (!client || panel.isPaused(client)) session.gaps.restart();
    const pauseMs = session.gaps.take(performance.now());
    if (client) failures.sample(pauseMs, intervalOf(client));
    return pauseMs;
  }
  // A hidden page draws nothing, and its frames may wait.
  document.addEventListener("visibilitychange", () => session.gaps.restart());

  let figuresAt = 0;
  let yielded = false;
  function draw(now: number, frame?: XRFrame): void {
    const began = performance.now();
    const client = session.state.kind === "live" ? session.client : undefined;
    if (frame) headset.draw(frame, now, client);
    player.draw(client);
    drag.enabled = !player.plays && pusher.tool === "hand";
    panel.apply(client);
    if (client) {
      const target = drag.take();
      if (target?.kind === "collider") client.parameters.setCollider(target.collider, { position: target.position });
      if (target?.kind === "grab") client.input.setGrabs(target.grab ? [target.grab] : []);
      if (!frame) pusher.send(client.input, now);
      session.flush();
    }
    if (now - figuresAt >= kFiguresPeriodMs) {
      figuresAt = now;
      const pauseMs = takePause(client);
      panel.refresh(client, now, pauseMs);
      headset.show();
      if (view.ownYields && !yielded) notify(kYields);
      yielded = view.ownYields;
    }
    view.drawsConstraints = panel.drawsConstraints;
    view.draw(session.client, displayTime(now, frame));
    work.add(began, view, session);
  }
  view.renderer.setAnimationLoop(draw);
}

// Opens the session. Tries again until the server has sent everything, because it may just be starting.
async function open(options: SessionOptions, failures: Failures): Promise<Session> {
  for (;;) {
    try {
      const session = await Session.open(options);
      failures.stop(undefined);
      return session;
    } catch (error) {
      const said = error instanceof Error ? error.message : String(error);
      const isUnusable = error instanceof WebAssembly.CompileError || error instanceof WebAssembly.LinkError;
      failures.stop(notLoaded(said, isUnusable ? undefined : performance.now() + kLoadAgainMs));
      if (isUnusable) throw error;
      await new Promise((done) => window.setTimeout(done, kLoadAgainMs));
    }
  }
}

function sceneOfAddress(): string {
  return new URLSearchParams(window.location.search).get("scene") ?? "";
}

// 0, the finest, without a valid one.
function qualityOfAddress(): number {
  const value = Number(new URLSearchParams(window.location.search).get("quality"));
  return Number.isInteger(value) && value >= 0 && value <= 3 ? value : 0;
}

function transportOfAddress(complain: (text: string) => void): Transport {
  const value = new URLSearchParams(window.location.search).get("transport") ?? "auto";
  const known = kTransports.find((one) => one === value);
  if (!known) complain(`"${value}" is not a transport; use ${kTransports.join(", ")}.`);
  return known ?? "auto";
}

// Usual time between frames, ms.
function intervalOf({ frames }: Client): number {
  return (1000 * frames.divisor) / Math.max(1, frames.streamRate);
}

// Time at which the frame will be seen. A headset may predict it.
function displayTime(now: number, frame: XRFrame | undefined): number {
  return frame?.predictedDisplayTime ?? now;
}

void start();
