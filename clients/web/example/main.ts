// SPDX-License-Identifier: MIT
// Joins a scene, draws its cloths, and takes hold of them with the pointer. Address: ?server=ws://HOST:PORT/stream
import * as THREE from "three";
import { Session } from "@clothstream/client";
import { Cloths, Grabber } from "@clothstream/three";

const renderer = new THREE.WebGLRenderer({ canvas: document.querySelector("canvas")!, antialias: true });
renderer.setSize(window.innerWidth, window.innerHeight, false);
const camera = new THREE.PerspectiveCamera(40, window.innerWidth / window.innerHeight);
camera.position.set(0.8, 1.4, 3);
camera.lookAt(0, 1, 0);
const cloths = new Cloths();
const scene = new THREE.Scene().add(cloths.group, new THREE.HemisphereLight(0xffffff, 0x806040, 5));
const pointer = new THREE.Raycaster();
const grabber = new Grabber();
const hand = { point: camera.position, orientation: camera.quaternion, ray: pointer.ray };
const aim = ({ clientX: x, clientY: y }: PointerEvent) =>
  pointer.setFromCamera(new THREE.Vector2((2 * x) / window.innerWidth - 1, 1 - (2 * y) / window.innerHeight), camera);

async function start(url: string, status: Element): Promise<void> {
  const show = () => (status.textContent = "reason" in session.state ? session.state.reason : session.state.kind);
  const listener = { described: cloths.describe.bind(cloths), stateChanged: show };
  const session = await Session.open({ url, listener });
  const send = () => {
    const grab = grabber.grab(hand);
    session.client.input.setGrabs(grab ? [grab] : []);
    session.flush();
  };
  window.onpointerdown = (event) => (aim(event), grabber.take(hand, session.client.frames, 0), send());
  window.onpointermove = (event) => (aim(event), grabber.holds && send());
  window.onpointerup = () => (grabber.release(), send());
  renderer.setAnimationLoop((now) => {
    cloths.show(session.client, now);
    renderer.render(scene, camera);
  });
}
const server = new URLSearchParams(window.location.search).get("server") ?? "ws://localhost:8080/stream";
const status = document.querySelector("output")!;
start(server, status).catch((error: unknown) => (status.textContent = String(error)));
