// SPDX-License-Identifier: MIT
// Surfaces of the real room on their way to the server: what is sent, when, and what is taken back. The headset and the
// client are made up.

import * as THREE from "three";
import { assert, test } from "vitest";
import { SurfacePolicy, type Surface, type Surfaces } from "@clothstream/client";
import { Placement, RealRoom } from "@clothstream/three";

interface Detected {
  matrix: THREE.Matrix4;
  lastChangedTime: number;
  polygon?: { x: number; z: number }[];
  vertices?: Float32Array;
  indices?: Uint32Array;
  semanticLabel?: string;
}

// A session whose room has these planes and meshes, seen by an eye 1.6 m above the floor.
class FakeHeadset {
  readonly planes: Detected[] = [];
  readonly meshes: Detected[] = [];
  readonly room = new RealRoom();
  readonly placement = new Placement();
  isMoving = false;
  now = 0;

  constructor(public features: string[] | undefined = ["plane-detection", "mesh-detection"]) {
    this.room.begin(this.session);
  }

  get session(): XRSession {
    return { enabledFeatures: this.features } as XRSession;
  }

  // Draws for half a second.
  run(surfaces: FakeSurfaces | undefined, ms = 500): void {
    const spaces = (list: Detected[]) => list.map((one) => Object.assign(one, { planeSpace: one, meshSpace: one }));
    const frame = {
      session: this.session,
      detectedPlanes: new Set(spaces(this.planes)),
      detectedMeshes: new Set(spaces(this.meshes)),
      getPose: (of: unknown) => ({ transform: { matrix: new Float32Array((of as Detected).matrix.elements) } }),
      getViewerPose: () => ({ transform: { position: { x: 0, y: 1.6, z: 0 } } }),
    } as unknown as XRFrame;
    for (const end = this.now + ms; this.now < end; this.now += 10)
      this.room.update(frame, {} as XRReferenceSpace, this.placement, new THREE.Vector3(), this.isMoving, surfaces as unknown as Surfaces | undefined, this.now);
  }
}

class FakeSurfaces {
  readonly has = new Map<number, Surface>();
  log: string[] = [];
  policy = SurfacePolicy.own;

  set(surface: Surface): boolean {
    this.log.push(`set ${surface.id}`);
    this.has.set(surface.id, surface);
    return true;
  }
  move(id: number, position: Surface["position"], orientation: Surface["orientation"]): boolean {
    this.log.push(`move ${id}`);
    Object.assign(this.has.get(id)!, { position, orientation });
    return true;
  }
  remove(id: number): boolean {
    this.log.push(`remove ${id}`);
    return this.has.delete(id);
  }
  // Events since the last call.
  take(): string[] {
    return this.log.splice(0);
  }
  // Vertices of a surface in the scene.
  places(id: number): THREE.Vector3[] {
    const { positions, position, orientation } = this.has.get(id)!;
    const matrix = new THREE.Matrix4().compose(new THREE.Vector3(...position), new THREE.Quaternion(...orientation), new THREE.Vector3(1, 1, 1));
    return Array.from({ length: positions.length / 3 }, (_, vertex) => new THREE.Vector3().fromArray(positions, 3 * vertex).applyMatrix4(matrix));
  }
  // Sum of the normals of a surface in the scene.
  normal(id: number): THREE.Vector3 {
    const places = this.places(id);
    const { triangles } = this.has.get(id)!;
    const sum = new THREE.Vector3();
    for (let at = 0; at < triangles.length; at += 3) {
      const [a, b, c] = [places[triangles[at]!]!, places[triangles[at + 1]!]!, places[triangles[at + 2]!]!];
      sum.add(b.clone().sub(a).cross(c.clone().sub(a)));
    }
    return sum.normalize();
  }
}

// A plane of 2 m by 2 m at a height; `turn` leads from its frame to the room.
function plane(height: number, turn = new THREE.Euler(), more: Partial<Detected> = {}): Detected {
  const matrix = new THREE.Matrix4().makeRotationFromEuler(turn).setPosition(0, height, -1);
  return { matrix, lastChangedTime: 1, polygon: [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, z]) => ({ x: x!, z: z! })), ...more };
}

// A scan of `count` triangles in a row along x.
function scan(count: number): Detected {
  const vertices = new Float32Array(9 * count);
  for (let i = 0; i < count; ++i) vertices.set([i / 1000, 0, 0, i / 1000, 0, 0.1, i / 1000, 0.1, 0], 9 * i);
  return { matrix: new THREE.Matrix4(), lastChangedTime: 1, vertices, indices: Uint32Array.from({ length: 3 * count }, (_, i) => i) };
}

function near(actual: THREE.Vector3, expected: THREE.Vector3, tolerance = 1e-5): void {
  assert.isBelow(actual.distanceTo(expected), tolerance, `${actual.toArray().join(" ")} is not ${expected.toArray().join(" ")}`);
}

test("surfaces are sent once, where they are in the scene", () => {
  const headset = new FakeHeadset();
  const surfaces = new FakeSurfaces();
  headset.placement.set(new THREE.Vector3(0.4, 0.1, -0.2), 0.7, 2);
  headset.planes.push(plane(0.75));
  headset.run(surfaces);
  assert.deepEqual(surfaces.take(), ["set 1"]);
  const corner = new THREE.Vector3(-1, 0.75, -2);
  near(surfaces.places(1)[0]!.applyMatrix4(headset.placement.matrix), corner);
  headset.run(surfaces, 3000);
  assert.isEmpty(surfaces.take());
  assert.deepEqual(headset.room.counts, { detected: 1, sent: 1 });
});

test("the front of a surface is above, of a ceiling below, and of a wall towards the user", () => {
  const upsideDown = new THREE.Euler(Math.PI, 0, 0);
  const cases: [Detected, THREE.Vector3][] = [
    [plane(0.75), new THREE.Vector3(0, 1, 0)],
    [plane(0.75, upsideDown), new THREE.Vector3(0, 1, 0)],
    [plane(2.5), new THREE.Vector3(0, -1, 0)],
    [plane(2.5, upsideDown), new THREE.Vector3(0, -1, 0)],
    // A shelf above the eyes, and a low ceiling.
    [plane(1.8, new THREE.Euler(), { semanticLabel: "shelf" }), new THREE.Vector3(0, 1, 0)],
    [plane(1.5, new THREE.Euler(), { semanticLabel: "ceiling" }), new THREE.Vector3(0, -1, 0)],
    // A wall at z = -1, whose y points either way.
    [plane(1, new THREE.Euler(Math.PI / 2, 0, 0)), new THREE.Vector3(0, 0, 1)],
    [plane(1, new THREE.Euler(-Math.PI / 2, 0, 0)), new THREE.Vector3(0, 0, 1)],
  ];
  for (const [detected, normal] of cases) {
    const headset = new FakeHeadset();
    const surfaces = new FakeSurfaces();
    headset.planes.push(detected);
    headset.run(surfaces);
    near(surfaces.normal(1), normal);
  }
});

test("a moved chair moves, a changed one is sent again, and one that is gone is removed", () => {
  const headset = new FakeHeadset();
  const surfaces = new FakeSurfaces();
  headset.planes.push(plane(0.45), plane(0));
  headset.run(surfaces);
  assert.deepEqual(surfaces.take(), ["set 1", "set 2"]);
  headset.planes[0]!.matrix.setPosition(0.5, 0.45, 0);
  headset.run(surfaces);
  assert.deepEqual(surfaces.take(), ["move 1"]);
  near(surfaces.places(1)[0]!, new THREE.Vector3(-0.5, 0.45, -1));
  // Noise of tracking is no change, and a new time without a new shape is none.
  headset.planes[0]!.matrix.setPosition(0.5005, 0.45, 0);
  headset.planes[1]!.lastChangedTime = 2;
  headset.run(surfaces);
  assert.isEmpty(surfaces.take());
  headset.planes[1]!.polygon![0] = { x: -2, z: -1 };
  headset.planes[1]!.lastChangedTime = 3;
  headset.run(surfaces);
  assert.deepEqual(surfaces.take(), ["set 2"]);
  headset.planes.shift();
  headset.run(surfaces);
  assert.deepEqual(surfaces.take(), ["remove 1"]);
});

test("the room is read at most twice per second", () => {
  const headset = new FakeHeadset();
  const surfaces = new FakeSurfaces();
  headset.planes.push(plane(0.45));
  headset.run(surfaces);
  surfaces.take();
  for (let step = 0; step < 40; ++step) {
    headset.planes[0]!.matrix.setPosition(0.01 * step, 0.45, 0);
    headset.run(surfaces, 100);
  }
  assert.isAtMost(surfaces.take().length, 8);
});

test("the scene is moved: surfaces follow when it stands, and are sent again in another scale", () => {
  const headset = new FakeHeadset();
  const surfaces = new FakeSurfaces();
  headset.isMoving = true;
  headset.planes.push(plane(0.45));
  headset.run(surfaces);
  assert.isEmpty(surfaces.take());
  headset.isMoving = false;
  headset.run(surfaces);
  assert.deepEqual(surfaces.take(), ["set 1"]);
  headset.placement.set(new THREE.Vector3(1, 0, 0), 0, 1);
  headset.isMoving = true;
  headset.run(surfaces);
  assert.isEmpty(surfaces.take());
  headset.isMoving = false;
  headset.run(surfaces);
  assert.deepEqual(surfaces.take(), ["move 1"]);
  headset.placement.set(new THREE.Vector3(1, 0, 0), 0, 0.5);
  headset.run(surfaces);
  assert.deepEqual(surfaces.take(), ["set 1"]);
  near(surfaces.places(1)[0]!.applyMatrix4(headset.placement.matrix), new THREE.Vector3(-1, 0.45, -2));
});

test("all is taken back when the user says so, and at the end", () => {
  const headset = new FakeHeadset();
  const surfaces = new FakeSurfaces();
  headset.planes.push(plane(0.45), plane(0));
  headset.run(surfaces);
  headset.room.shares = false;
  headset.run(surfaces);
  assert.isEmpty(surfaces.has);
  assert.equal(headset.room.counts.detected, 2, "they still hide cloth and take shadows");
  headset.room.shares = true;
  headset.run(surfaces);
  assert.equal(surfaces.has.size, 2);
  headset.room.end(surfaces as unknown as Surfaces);
  assert.isEmpty(surfaces.has);
  assert.deepEqual(headset.room.counts, { detected: 0, sent: 0 });
  headset.run(surfaces);
  assert.isEmpty(surfaces.has);
});

test("another client gets all surfaces, and the former one no more calls", () => {
  const headset = new FakeHeadset();
  const [first, second] = [new FakeSurfaces(), new FakeSurfaces()];
  headset.planes.push(plane(0.45));
  headset.run(first);
  first.take();
  headset.run(undefined);
  headset.run(second);
  assert.deepEqual(second.take(), ["set 1"]);
  headset.room.end(second as unknown as Surfaces);
  assert.isEmpty(first.take());
});

test("a refused permission, or no support, sends nothing", () => {
  for (const features of [[], ["hit-test"]]) {
    const headset = new FakeHeadset(features);
    const surfaces = new FakeSurfaces();
    headset.planes.push(plane(0.45));
    headset.run(surfaces);
    assert.isFalse(headset.room.detects);
    assert.isEmpty(surfaces.log);
  }
});

test("degenerate surfaces, NaN and huge coordinates are left out", () => {
  const headset = new FakeHeadset();
  const surfaces = new FakeSurfaces();
  const nowhere = plane(0.45);
  nowhere.matrix.elements[12] = NaN;
  const far = plane(0.45);
  far.matrix.setPosition(0, 1e6, 0);
  headset.planes.push(plane(0, new THREE.Euler(), { polygon: [{ x: 0, z: 0 }, { x: 1, z: 0 }, { x: NaN, z: 1 }] }), nowhere, far, plane(0, new THREE.Euler(), { polygon: [] }));
  headset.meshes.push({ ...scan(1), vertices: new Float32Array([0, 0, 0, 1, NaN, 0, 0, 0, 1]) }, { ...scan(1), indices: new Uint32Array([0, 1, 7]) });
  headset.run(surfaces);
  assert.isEmpty(surfaces.log);
});

// Scans of 60,000 triangles are sorted, which takes up to a second of one core in all.
test("of a scan that is too large, the nearest part is sent", { timeout: 60_000 }, () => {
  const headset = new FakeHeadset();
  const surfaces = new FakeSurfaces();
  headset.meshes.push(scan(60_000));
  headset.planes.push(plane(-1));
  headset.run(surfaces);
  assert.equal(surfaces.has.get(2)!.triangles.length / 3, 49_998); // all but the two of the plane
  assert.isTrue(surfaces.places(2).every(({ x }) => x < 49.999));
  surfaces.take();
  headset.run(surfaces, 2000);
  assert.isEmpty(surfaces.take());
});

test("a server without room gets less, until nothing sensible is left", { timeout: 60_000 }, () => {
  const headset = new FakeHeadset();
  const surfaces = new FakeSurfaces();
  headset.meshes.push(scan(60_000));
  for (let wanted = 50_000; wanted >= 500; wanted = Math.floor(wanted / 2)) {
    headset.run(surfaces);
    assert.equal(surfaces.has.get(1)!.triangles.length / 3, wanted);
    assert.equal(headset.room.refused(1), wanted / 2 >= 500);
  }
  assert.isEmpty(surfaces.has);
  surfaces.take();
  headset.run(surfaces, 2000);
  assert.isEmpty(surfaces.take());
});

test("a server that says only that it has no room gets half as much after ten seconds, and then nothing", () => {
  const headset = new FakeHeadset();
  const surfaces = new FakeSurfaces();
  for (let i = 0; i < 70; ++i) headset.planes.push(plane(0));
  headset.run(surfaces);
  for (let most = 32; most >= 1; most /= 2) {
    headset.room.tryLater(headset.now);
    surfaces.take();
    headset.run(surfaces, 9000);
    assert.isEmpty(surfaces.take());
    headset.run(surfaces, 2000);
    assert.equal(surfaces.has.size, most);
    assert.isAtLeast(surfaces.take().length, most, "those that are left are sent again");
  }
  assert.isTrue(headset.room.shares);
  headset.room.tryLater(headset.now);
  headset.run(surfaces, 11_000);
  assert.isFalse(headset.room.shares);
  assert.isEmpty(surfaces.has);
});

test("a server that takes fewer surfaces gets the nearest ones", () => {
  const headset = new FakeHeadset();
  const surfaces = new FakeSurfaces();
  for (let i = 0; i < 70; ++i) {
    headset.planes.push(plane(0));
    headset.planes[i]!.matrix.setPosition(0, 0, -i);
  }
  headset.run(surfaces);
  assert.equal(surfaces.has.size, 64);
  for (let id = 64; id > 32; --id) {
    assert.isTrue(headset.room.refused(id));
    surfaces.has.delete(id);
  }
  headset.run(surfaces);
  assert.deepEqual([...surfaces.has.keys()], Array.from({ length: 32 }, (_, index) => index + 1));
});
