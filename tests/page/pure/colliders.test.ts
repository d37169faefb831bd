// SPDX-License-Identifier: MIT
// Reach of colliders, which the view must show, and meshes that joints move.

import { assert, test } from "vitest";
import { Shape, type Client, type Collider } from "@clothstream/client";
import { ColliderMeshes, reachOf } from "@clothstream/three";

const vertices = Float32Array.of(0.1, 0, 0, 0, -3, 4, 1, 1, 1);
const client = { frames: { hull: () => ({ vertices, triangles: Uint32Array.of(0, 1, 2) }) } } as unknown as Client;

function collider(shape: Shape): Collider {
  const orientation = [0, 0, 0, 1] as const;
  return { index: 0, name: "", shape, position: [9, 9, 9], orientation, radius: 0.5, topRadius: 0.5, length: 2, size: [2, 3, 6], participantId: 0n, isHead: false, yields: false };
}

test("the reach of a collider is its farthest point, and nothing for a plane", () => {
  assert.equal(reachOf(client, collider(Shape.sphere)), 0.5);
  assert.equal(reachOf(client, collider(Shape.capsule)), 1.5);
  assert.equal(reachOf(client, { ...collider(Shape.capsule), topRadius: 0.75 }), 1.75);
  assert.equal(reachOf(client, collider(Shape.box)), 3.5);
  assert.equal(reachOf(client, collider(Shape.hull)), 5);
  assert.equal(reachOf(client, collider(Shape.plane)), 0);
});

test("a tapered capsule is drawn as it is", () => {
  const drawn = new ColliderMeshes();
  drawn.place(client, [{ ...collider(Shape.capsule), topRadius: 1 }]);
  const places = drawn.meshes[0]!.geometry.getAttribute("position").array;
  for (let i = 0; i < places.length; i += 3) {
    const away = Math.hypot(places[i]!, places[i + 2]!), y = places[i + 1]!;
    // The nearest ball: the radius grows by 0.25 for each metre, in the drawing by 0.985 times as much.
    const slope = 0.985 * 0.25, lean = slope / Math.sqrt(1 - slope * slope);
    const centre = Math.min(Math.max(y + lean * away, -1), 1);
    assert.closeTo(Math.hypot(away, y - centre), 0.985 * 0.5 + slope * (centre + 1), 1e-6);
  }
});

test("the drawn vertices of a small mesh follow its joints", () => {
  const triangles = Uint32Array.of(0, 1, 2, 2, 1, 0);
  let now = vertices;
  const moving = { frames: { hull: () => ({ vertices: now.slice(), triangles }), hullVertices: () => now } } as unknown as Client;
  const drawn = new ColliderMeshes();
  const places = () => [...drawn.meshes[0]!.geometry.getAttribute("position").array];
  const expected = () => [...triangles].flatMap((corner) => [...now.subarray(3 * corner, 3 * corner + 3)].map((value) => Math.fround(0.985 * value)));
  drawn.place(moving, [collider(Shape.hull)]);
  places().forEach((value, i) => assert.closeTo(value, expected()[i]!, 1e-6));
  now = Float32Array.of(0.1, 0, 0, 0, 3, 4, 1, 2, 1);
  drawn.place(moving, [collider(Shape.hull)]);
  assert.deepEqual(places(), expected());
});

test("the own body is drawn without its head, which mirrors show", () => {
  const corners = new Float32Array(3 * 200).map((_, i) => Math.sin(i)); // too many for a convex hull
  const worn = {
    frames: { hull: () => ({ vertices: corners.slice(), triangles: Uint32Array.of(0, 1, 2, 3, 4, 5, 6, 7, 8) }), hullVertices: () => corners },
    wearing: { belowNeck: () => Uint32Array.of(3, 4, 5) },
  } as unknown as Client;
  const drawn = new ColliderMeshes();
  const place = () => drawn.place(worn, [{ ...collider(Shape.hull), name: "avatar" }]);
  const count = () => drawn.meshes[0]!.geometry.drawRange.count;
  place();
  assert.equal(count(), Infinity);
  drawn.wear("avatar");
  place();
  assert.deepEqual([...drawn.meshes[0]!.geometry.index!.array], [3, 4, 5, 0, 1, 2, 6, 7, 8]);
  assert.equal(count(), 3);
  drawn.drawForMirror(true);
  assert.equal(count(), Infinity);
  drawn.drawForMirror(false);
  assert.equal(count(), 3);
  drawn.wear("");
  place();
  assert.equal(count(), Infinity);
});
