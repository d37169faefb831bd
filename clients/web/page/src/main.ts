// SPDX-License-Identifier: MIT
// Starts the page: core, view, session, panel, and the drawing loop.

import { ClothReports } from "./cloth_reports";
import { Roles, Session, type SessionListener, type Vec3 } from "@clothstream/client";
import { Controls } from "./controls";
import { Drag } from "./drag";
import { HeadsetPage } from "./headset_page";
import { element, Hud } from "./hud";
import { browserTokens, PairingPanel, ProofForm } from "./identity";
import { listenToKeys } from "./keys";
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
  const controls = new Controls({ sceneChosen: chooseScene, viewReset: () => view.reset() });
  const reports = new ClothReports();
  const castRay = (origin: Vec3, direction: Vec3) =>
    session.state.kind === "live" ? session.client.frames.castRay(origin, direction) : undefined;
  // Before Drag, so that its presses come first.
  const pusher = new Pusher(view, castRay);
  const tools = document.querySelectorAll<HTMLInputElement>('input[name="tool"]');
  for (const tool of tools) tool.addEventListener("change", () => (pusher.tool = tool.value as Tool));
  let pushed = false; // whether the server has a collider of the pointer
  const drag: Drag = new Drag(
    view,
    castRay,
    (collider) => (controls.collider = collider),
  );
  listenToKeys(view, drag, controls);
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
      controls.describe(client);
      reports.describe(client);
    },
    parametersChanged: (client) => {
      controls.show(client);
      reports.showSolvers(client);
      view.dress(client);
    },
    participantsChanged: (client) => {
      view.name(client);
      hud.showParticipants(client);
      pairing.showFor(client);
    },
    scenesListed: (scenes) => controls.listScenes(scenes, session.client.sceneName),
    grabsChanged: (client) =>
        client.input.grabEvents().forEach(({ grab, vertices }) => {
          if (vertices === 0) {
            drag.slipped(grab);
            headset.slipped(grab);
          }
        }),
    notice: (text) => hud.showNotice(text),
    refused: (client) => {
      hud.showNotice(client.errorText);
      controls.refused(client);
      reports.showSolvers(client);
    },
  };
  const session: Session = await Session.open({
    url: address.href,
    scene,
    identity,
    program: "clothstream page",
    tokens: browserTokens,
    listener,
  }).catch((error: unknown) => {
    hud.showFatal(`The client core did not start: ${error instanceof Error ? error.message : String(error)}`);
    throw error;
  });

  function chooseScene(name: string): void {
    const url = new URL(window.location.href);
    if (name) url.searchParams.set("scene", name);
    else url.searchParams.delete("scene");
    window.history.replaceState(null, "", url);
    session.join(name);
  }

  const headset: HeadsetPage = new HeadsetPage(view, session, { sceneChosen: chooseScene, notice: (text) => hud.showNotice(text) });
  const probe = expose(session, view, headset.headset);

  let figuresAt = 0;
  function draw(now: number, frame?: XRFrame): void {
    const client = session.state.kind === "live" ? session.client : undefined;
    if (frame) headset.draw(frame, now, client);
    player.draw(client);
    drag.enabled = !player.plays && pusher.tool === "hand";
    if (client) {
      controls.apply(client);
      reports.apply(client);
      const target = drag.take();
      if (target?.kind === "collider") client.parameters.setCollider(target.collider, { position: target.position });
      if (target?.kind === "grab") client.input.setGrabs(target.grab ? [target.grab] : []);
      if (!frame) {
        const colliders = pusher.update(now);
        if (colliders.length > 0 || pushed) client.input.setColliders(colliders);
        pushed = colliders.length > 0;
      }
      session.flush();
    }
    if (now - figuresAt >= kFiguresPeriodMs) {
      figuresAt = now;
      if (client) {
        hud.showFigures(client);
        reports.showReports(client);
      }
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
