// SPDX-License-Identifier: MIT
// A participant with a head and hands, who draws nothing: a page with only the client core.

import { readFileSync } from "node:fs";

const { core: described } = JSON.parse(readFileSync(new URL("../../clients/interface/interface.json", import.meta.url), "utf8"));

// Joins from a new page. `head` is {position, orientation, radius}; each of `hands` is {side, wrist}; `ball` is {x, y, z,
// radius}, in metres. Resolves when the server has sent a frame. Close the returned page to leave.
export async function joinAsGuest(browser, url, guest) {
  const page = await browser.newPage();
  await page.goto(new URL("main.css", url).href);
  await page.evaluate(play, { ...guest, described });
  return page;
}

// Runs in the page.
async function play({ scene, name, head, hands, ball, described }) {
  const kFrame = 1; // CS_EVENT_FRAME
  const kJoints = 25; // of WebXR, without the palm
  const { instance } = await WebAssembly.instantiate(await (await fetch("clothstream_core.wasm")).arrayBuffer());
  const core = instance.exports;
  core._initialize();
  const now = () => BigInt(Math.round(performance.now() * 1000));
  const text = (value) => {
    const bytes = new TextEncoder().encode(value + "\0");
    const pointer = core.malloc(bytes.length);
    new Uint8Array(core.memory.buffer, pointer, bytes.length).set(bytes);
    return pointer;
  };
  // A struct of core.h with these members; the others are 0.
  const struct = (kind, members) => {
    const { size, fields } = described.structs[kind];
    const pointer = core.malloc(size.wasm32);
    const view = new DataView(core.memory.buffer, pointer, size.wasm32);
    for (let at = 0; at < size.wasm32; ++at) view.setUint8(at, 0);
    view.setUint32(0, described.constants[`${kind.toUpperCase()}_VERSION`], true);
    for (const [member, value] of Object.entries(members)) {
      const { type, offset } = fields.find((field) => field.name === member);
      [value].flat().forEach((number, i) => view[type === "float" ? "setFloat32" : "setUint32"](offset.wasm32 + 4 * i, number, true));
    }
    return pointer;
  };
  const client = core.cs_create(struct("cs_client_options", { scene: text(scene), client_name: text("test"), display_name: text(name) }));

  // A flat hand: five fingers of five joints from the wrist along -Z. The thumb has one joint fewer.
  const joints = (side, [x, y, z]) => {
    const list = [[x, y, z, 0.03]];
    for (let finger = 0; finger < 5; ++finger) {
      const across = (finger - 2) * 0.024 * (side === 1 ? -1 : 1);
      const reach = finger === 0 ? 4 : 5;
      for (let joint = 1; joint <= reach; ++joint)
        list.push([x + across, y - 0.006 * joint, z - 0.02 - 0.034 * joint * (finger === 0 ? 0.8 : 1), 0.012 - 0.001 * joint]);
    }
    return list.flat();
  };
  const pose = () => {
    const floats = core.malloc(28);
    new Float32Array(core.memory.buffer, floats, 7).set([...head.position, ...head.orientation]);
    core.cs_set_head(client, floats, floats + 12, head.radius, now());
    core.free(floats);
    const sphere = struct("cs_own_collider", { position: ball.slice(0, 3), radius: ball[3] });
    if (core.cs_set_colliders(client, sphere, 1, now()) === 0) throw new Error("the core refuses the ball");
    core.free(sphere);
    for (const { side, wrist } of hands) {
      const points = core.malloc(16 * kJoints);
      new Float32Array(core.memory.buffer, points, 4 * kJoints).set(joints(side, wrist));
      if (core.cs_set_hand(client, side, points, kJoints, now()) === 0) throw new Error("the core refuses the hand");
      core.free(points);
    }
  };

  const address = new URL("stream", window.location.href);
  address.protocol = "ws:";
  const socket = new WebSocket(address);
  socket.binaryType = "arraybuffer";
  await new Promise((opened, failed) => {
    socket.onopen = opened;
    socket.onerror = failed;
  });
  core.cs_connecting(client, now());
  const size = core.malloc(8);
  const flush = () => {
    for (let at = core.cs_next_outgoing(client, size); at !== 0; at = core.cs_next_outgoing(client, size))
      socket.send(new Uint8Array(core.memory.buffer, at, new Uint32Array(core.memory.buffer, size, 1)[0]).slice());
  };
  flush();
  await new Promise((joined) => {
    let posed = false;
    socket.onmessage = ({ data }) => {
      const inbox = core.malloc(data.byteLength);
      new Uint8Array(core.memory.buffer, inbox, data.byteLength).set(new Uint8Array(data));
      const events = core.cs_receive(client, inbox, data.byteLength, now());
      core.free(inbox);
      if (events & kFrame && !posed) {
        posed = true;
        pose();
        joined();
      }
      flush();
    };
  });
  setInterval(() => {
    core.cs_update(client, now());
    flush();
  }, 50);
}
