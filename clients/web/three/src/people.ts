// SPDX-License-Identifier: MIT
// Other participants as heads, hands and names, made of their colliders. Own colliders are drawn faintly. Colliders that
// yield are red.

import * as THREE from "three";
import { Shape, type Collider, type Participant } from "@clothstream/client";
import { NameLabel } from "./name_label";

const kOwnOpacity = 0.16;
// Colours that differ in hue and in brightness.
const kColours = [0x4f9bd9, 0xe08a4a, 0x6fb56a, 0xc779b8, 0xd9c04f, 0x5fc4bd, 0xd96a6a, 0x8f86dd].map(
  (colour) => new THREE.Color(colour),
);
const kVisorColour = new THREE.Color(0x15171c);
const kYieldColour = new THREE.Color(0xff3b1f);
const kTaperedBalls = 12; // of a tapered capsule, besides the one at its end
const kLabelHeight = 0.16; // m above the middle of the head, in addition to its radius

export class People {
  readonly group = new THREE.Group();
  // Whether a collider of this participant yields.
  ownYields = false;
  private readonly others = new Figures(1);
  private readonly own = new Figures(kOwnOpacity);
  private readonly participants = new Map<bigint, Participant>();
  private readonly labels = new Map<bigint, NameLabel>();

  constructor() {
    this.group.add(this.others.group, this.own.group);
  }

  // Takes the names. Call whenever the participants change.
  name(participants: readonly Participant[]): void {
    this.participants.clear();
    for (const participant of participants) this.participants.set(participant.id, participant);
    for (const [id, label] of this.labels) {
      if (this.participants.get(id)?.name === label.text) continue;
      label.dispose();
      this.labels.delete(id);
    }
  }

  // Places all figures. `eye` is the position of the camera. The own head is not drawn. A headset draws own hands itself, and
  // sets `showOwn` to false.
  place(colliders: readonly Collider[], eye: THREE.Vector3, showOwn: boolean): void {
    this.others.begin();
    this.own.begin();
    this.ownYields = false;
    if (this.labels.size > 0) for (const label of this.labels.values()) label.sprite.visible = false;
    for (let index = 0; index < colliders.length; ++index) {
      const collider = colliders[index]!;
      const id = collider.participantId;
      if (id === 0n) continue;
      const participant = this.participants.get(id);
      const self = participant?.self === true;
      this.ownYields ||= self && collider.yields;
      if (self && (collider.isHead || !showOwn)) continue;
      if (collider.isHead) this.placeLabel(id, collider, eye);
      // Head and hands are drawn as parts of the body.
      if (participant?.body) continue;
      const figures = self ? this.own : this.others;
      figures.add(collider, collider.yields ? kYieldColour : colourOf(id));
      if (collider.isHead && turned(collider)) figures.addVisor(collider);
    }
    this.others.end();
    this.own.end();
  }

  // Names that are shown, and the places of their labels.
  get shown(): { name: string; label: [number, number, number] }[] {
    return [...this.labels.values()].filter(({ sprite }) => sprite.visible).map(({ text, sprite }) => ({ name: text, label: sprite.position.toArray() }));
  }

  dispose(): void {
    this.name([]);
    this.others.dispose();
    this.own.dispose();
  }

  private placeLabel(id: bigint, head: Collider, eye: THREE.Vector3): void {
    const name = this.participants.get(id)?.name;
    if (name === undefined) return;
    let label = this.labels.get(id);
    if (!label) {
      label = new NameLabel(name, colourOf(id));
      this.labels.set(id, label);
      this.group.add(label.sprite);
    }
    const [x, y, z] = head.position;
    label.place(x, y + head.radius + kLabelHeight, z, eye);
  }
}

// Colour of a participant, the same for everyone.
export function colourOf(id: bigint): THREE.Color {
  return kColours[Number(id % BigInt(kColours.length))]!;
}

// Whether the orientation is known. Programs that do not know it send none, which is the identity.
function turned({ orientation: [x, y, z] }: Collider): boolean {
  return x !== 0 || y !== 0 || z !== 0;
}

// All shapes of several participants with the same opacity, in one draw call per kind of geometry.
class Figures {
  readonly group = new THREE.Group();
  private readonly balls: Instances;
  private readonly rods: Instances;
  private readonly boxes: Instances;
  private readonly place = new THREE.Object3D();
  private readonly end1 = new THREE.Vector3();

  constructor(opacity: number) {
    const material = new THREE.MeshStandardMaterial({ roughness: 0.55, transparent: opacity < 1, opacity, depthWrite: opacity === 1 });
    const shadow = opacity === 1;
    this.balls = new Instances(this.group, new THREE.SphereGeometry(1, 24, 16), material, shadow);
    this.rods = new Instances(this.group, new THREE.CylinderGeometry(1, 1, 1, 16, 1, true), material, shadow);
    this.boxes = new Instances(this.group, new THREE.BoxGeometry(1, 1, 1), material, shadow);
  }

  begin(): void {
    this.balls.count = this.rods.count = this.boxes.count = 0;
  }

  end(): void {
    this.balls.finish();
    this.rods.finish();
    this.boxes.finish();
  }

  dispose(): void {
    this.balls.dispose();
    this.rods.dispose();
    this.boxes.dispose();
  }

  add(collider: Collider, colour: THREE.Color): void {
    const { shape, radius, topRadius, length, size } = collider;
    this.place.position.set(...collider.position);
    this.place.quaternion.set(...collider.orientation);
    switch (shape) {
      case Shape.sphere:
        this.put(this.balls, colour, radius, radius, radius);
        return;
      case Shape.box:
        this.put(this.boxes, colour, ...size);
        return;
      case Shape.capsule:
        // A rod and two balls. Neighbouring bones share a joint, so the balls close the gap between them. A tapered
        // capsule has more balls instead of the rod.
        if (topRadius === radius) this.put(this.rods, colour, radius, length, radius);
        this.end1.set(0, length / 2, 0).applyQuaternion(this.place.quaternion);
        this.place.position.add(this.end1);
        for (let i = 0, last = topRadius === radius ? 1 : kTaperedBalls; i <= last; ++i) {
          const ball = topRadius + ((radius - topRadius) * i) / last;
          this.put(this.balls, colour, ball, ball, ball);
          this.place.position.addScaledVector(this.end1, -2 / last);
        }
        return;
      case Shape.plane:
      case Shape.hull:
        return; // Participants have none.
    }
  }

  // A dark visor on the front of a head, which looks along -Z of the collider's frame.
  addVisor(head: Collider): void {
    const { radius } = head;
    this.place.quaternion.set(...head.orientation);
    this.place.position.set(0, 0.12 * radius, -0.4 * radius).applyQuaternion(this.place.quaternion);
    this.place.position.add(this.end1.set(...head.position));
    this.put(this.balls, kVisorColour, radius, 0.4 * radius, 0.72 * radius);
  }

  private put(instances: Instances, colour: THREE.Color, x: number, y: number, z: number): void {
    this.place.scale.set(x, y, z);
    this.place.updateMatrix();
    instances.add(this.place.matrix, colour);
  }
}

// Instances of one geometry. Room grows as needed, and is kept.
class Instances {
  count = 0;
  private mesh: THREE.InstancedMesh | undefined;

  constructor(
    private readonly group: THREE.Group,
    private readonly geometry: THREE.BufferGeometry,
    private readonly material: THREE.Material,
    private readonly castShadow: boolean,
  ) {}

  add(matrix: THREE.Matrix4, colour: THREE.Color): void {
    const room = this.mesh?.instanceMatrix.count ?? 0;
    if (this.count >= room) this.grow(Math.max(32, 2 * room));
    this.mesh!.setMatrixAt(this.count, matrix);
    this.mesh!.setColorAt(this.count, colour);
    ++this.count;
  }

  finish(): void {
    if (!this.mesh) return;
    this.mesh.count = this.count;
    this.mesh.visible = this.count > 0;
    if (this.count === 0) return;
    this.mesh.instanceMatrix.needsUpdate = true;
    this.mesh.instanceColor!.needsUpdate = true;
  }

  dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
    this.mesh?.dispose();
  }

  private grow(room: number): void {
    const mesh = new THREE.InstancedMesh(this.geometry, this.material, room);
    mesh.castShadow = this.castShadow;
    mesh.receiveShadow = this.castShadow;
    // Instances move every frame, and their bounds are not kept.
    mesh.frustumCulled = false;
    mesh.setColorAt(0, new THREE.Color());
    if (this.mesh) {
      mesh.instanceMatrix.array.set(this.mesh.instanceMatrix.array);
      mesh.instanceColor!.array.set(this.mesh.instanceColor!.array);
      this.group.remove(this.mesh);
      this.mesh.dispose();
    }
    this.mesh = mesh;
    this.group.add(mesh);
  }
}
