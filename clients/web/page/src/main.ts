// SPDX-License-Identifier: MIT
// Starts the page: core, view, session, panel, and the drawing loop.

import { Roles, Session, type SessionListener, type SessionOptions, type Vec3 } from "@clothstream/client";
import { Drag } from "./drag";
import { HeadsetPage } from "./headset_page";
import { Hud } from "./hud";
import { browserTokens, PairingPanel, ProofForm } from "./identity";
import { listenToKeys } from "./keys";
import { element } from "./panel/dom";
import { Panel } from "./panel/panel";
import { Player } from "./player";
import { Pusher, type Tool } from "./pusher";
import { expose } from "./probe";
import { showAddress } from "./share";
import { View } from "./view";
import { chosenDetail } from "./detail";

const kFiguresPeriodMs = 250;

async function start(): Promise<void> {
  const hud = new Hud(() => {
    if (session.state.kind === "failed") chooseScene("");
    else session.reconnect();
  });
  let view: View;
  try {
    view = new View(element<HTMLCanvasElement>("canvas"), chosenDetail());
  } catch (error) {
    hud.showFatal(
      "This page needs WebGL 2, which this browser does not provide. " +
        "Turn on hardware acceleration, or use another browser.",
    );
    console.error(error);
    return;
  }
  void showAddress();
  const player = new Player();

  const address = new URL("stream", window.location.href);
  address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
  address.search = "";
  const query = new URLSearchParams(window.location.search);
  const scene = query.get("scene") ?? "";
  const role = query.get("role");
  const wanted = [...Roles].find(([, name]) => name === role)?.[0];
  const identity = { name: query.get("name") ?? "", role: wanted ?? 0 };
  if (role !== null && wanted === undefined)
    hud.showNotice(`"${role}" is not a role; use ${[...Roles.values()].join(", ")}.`);
  const proof = new ProofForm((given) => session.prove(given));
  const pairing = new PairingPanel(() => {
    session.client.people.createPairingCode();
    session.flush();
  });
  const listener: SessionListener = {
    stateChanged: () => {
      hud.showState(session.state);
      panel.stateChanged();
      proof.show(session.state.kind === "asking" ? session.state.reason : undefined);
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
      notify(client.errorText);
      panel.refused(client);
    },
  };
  const options: SessionOptions = {
    url: address.href,
    scene,
    identity,
    program: "clothstream page",
    tokens: browserTokens,
    quality: limit("quality", 3),
    temporalLayers: limit("layers", 3),
    listener,
  };
  const panel: Panel = new Panel(() => session, options, { sceneChosen: chooseScene, viewReset: () => view.reset(), said: (text) => headset.say(text) });
  const session: Session = await Session.open(options).catch((error: unknown) => {
    hud.showFatal(`The client core did not start: ${error instanceof Error ? error.message : String(error)}`);
    throw error;
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

  // Number of the query, 0 to `most`. Returns 0 without a valid one.
  function limit(name: string, most: number): number {
    const value = Number(query.get(name));
    return Number.isInteger(value) && value >= 0 && value <= most ? value : 0;
  }

  function chooseScene(name: string): void {
    const url = new URL(window.location.href);
    if (name) url.searchParams.set("scene", name);
    else url.searchParams.delete("scene");
    window.history.replaceState(null, "", url);
    headset.headset.body.letGo();
    session.join(name);
  }

  function notify(text: string): void {
    hud.showNotice(text);
    headset.say(text);
  }

  const headset: HeadsetPage = new HeadsetPage(view, session, panel, { sceneChosen: chooseScene, notice: (text) => hud.showNotice(text) });
  const probe = expose(session, view, headset, panel.create);

  let figuresAt = 0;
  function draw(now: number, frame?: XRFrame): void {
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
      panel.refresh(client, now);
      hud.showState(session.state);
      headset.show();
    }
    view.draw(session.client, displayTime(now, frame));
  }
  view.renderer.setAnimationLoop(draw);
}

// Time at which the frame will be seen. A headset may predict it.
function displayTime(now: number, frame: XRFrame | undefined): number {
  return frame?.predictedDisplayTime ?? now;
}

void start();
