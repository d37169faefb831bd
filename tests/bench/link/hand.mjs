// SPDX-License-Identifier: MIT
// Runs in the page before main.ts: moves a sphere around the middle of the cloth, and times each pose until play-out can
// first show its effect, like `clothstream load` (clients/load/participant.cpp, pose_timing.h). `window.hand` has the times.

import { Client, ClientEvent, ClientState, Shape } from "@clothstream/client";

const kOrbitMs = 3000;
const kOrbitRadius = 0.5; // m
// The server interpolates the positions of spheres but uses the radius of the newest pose at the tick. Radii identify
// poses in frames; they repeat after kNumbers poses. Floats represent them exactly.
const kNumbers = 1024;
const kLeastRadius = 3 / 64; // m
const kRadiusStep = 2 ** -20; // m

// Times of performance.now() at which poses were set.
class Poses {
  #setMs = new Float64Array(kNumbers);
  #set = 0;
  #shown = 0;

  // Radius for a pose that is set now.
  next(nowMs) {
    const number = this.#set++ % kNumbers;
    this.#setMs[number] = nowMs;
    return kLeastRadius + number * kRadiusStep;
  }

  // Calls `use` with the time of each pose that a frame with this radius is the first to show.
  show(radius, use) {
    const number = (radius - kLeastRadius) / kRadiusStep;
    if (!Number.isInteger(number) || number < 0 || number >= kNumbers) return;
    const newer = (this.#set - 1 - number + kNumbers) % kNumbers;
    if (newer >= this.#set - this.#shown) return;
    this.#shown = Math.max(this.#shown, this.#set - kNumbers);
    for (; this.#shown < this.#set - newer; ++this.#shown) use(this.#setMs[this.#shown % kNumbers]);
  }
}

const poses = new Poses();
let client; // of the page, when a frame has come
let tickBeforeMs; // start of the tick of the frame before, by the clock of the page

// `poses`: ms from a pose to the first frame that can show it. `decodedToDisplayable`: the part of it in play-out. `frames`:
// for each frame the time of its arrival, its age then, and its age when it can be shown, ms.
window.hand = { poses: [], decodedToDisplayable: [], frames: [] };

// Runs before the page draws a frame, in which it sends the pose.
function move(nowMs) {
  requestAnimationFrame(move);
  if (client?.state !== ClientState.joined) return;
  const middle = 3 * Math.floor(client.frames.vertexCount / 2);
  const [x, y, z] = client.frames.positions().subarray(middle, middle + 3);
  const turn = (2 * Math.PI * nowMs) / kOrbitMs;
  const position = [x + kOrbitRadius * Math.cos(turn), y, z + kOrbitRadius * Math.sin(turn)];
  client.input.setColliders([{ shape: Shape.sphere, position, radius: poses.next(performance.now()) }]);
}
requestAnimationFrame(move);

function decoded(frames, arrivedMs) {
  const { serverMs, networkMs, delayMs } = frames.stages();
  const beforeMs = tickBeforeMs;
  const ageMs = serverMs + networkMs;
  tickBeforeMs = ageMs === 0 ? undefined : arrivedMs - ageMs; // the server's clock is not known yet
  if (beforeMs === undefined || tickBeforeMs === undefined) return;
  const decodedMs = performance.now();
  // The frame becomes visible when play-out passes the frame before it.
  const displayableMs = Math.max(decodedMs, beforeMs + delayMs);
  window.hand.frames.push([arrivedMs, ageMs, displayableMs - tickBeforeMs]);
  for (const { participantId, radius } of frames.colliders()) {
    if (participantId === 0n) continue;
    poses.show(radius, (setMs) => {
      window.hand.poses.push(displayableMs - setMs);
      window.hand.decodedToDisplayable.push(displayableMs - decodedMs);
    });
  }
}

const { receiveDecoded } = Client.prototype;
Client.prototype.receiveDecoded = function (...message) {
  const events = receiveDecoded.apply(this, message);
  client = this;
  if (events & ClientEvent.frame) decoded(this.frames, Number(message.at(-1)) / 1000);
  return events;
};
