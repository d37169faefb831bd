// SPDX-License-Identifier: MIT
// The room around the cloths, in metres: a floor of planks, walls, a window and a lamp. Walls are invisible from outside, so
// that they never hide the cloths. Light on walls is part of their colours, which costs nothing to draw.

import * as THREE from "three";
import { planks, plaster } from "./surfaces";

const kWidth = 8; // m; larger scenes get a larger room
const kHeight = 3.2;
const kFloorReach = 14; // radius of the floor in room widths; fog hides its edge

export interface RoomColours {
  wall: number;
  ceiling: number;
  trim: number;
  floor: number; // factor of the planks' colours
  sky: number;
  skyBelow: number;
  lamp: number;
  outside: number; // beyond the walls
}

export class Room {
  readonly group = new THREE.Group();
  private readonly floor: THREE.Mesh<THREE.PlaneGeometry, THREE.MeshLambertMaterial>;
  private readonly shell: THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial>;

  constructor() {
    this.floor = new THREE.Mesh(new THREE.PlaneGeometry(1, 1), new THREE.MeshLambertMaterial({ map: planks() }));
    this.floor.rotation.x = -Math.PI / 2;
    this.floor.receiveShadow = true;
    this.shell = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({ map: plaster(), vertexColors: true, fog: false }));
    this.group.add(this.floor, this.shell);
  }

  // Builds the room around the bounds. `key` points from the scene to the key light, where the lamp is. Returns the distance
  // between opposite corners of the floor.
  fit(bounds: THREE.Box3, floorHeight: number, key: THREE.Vector3, colours: RoomColours): number {
    const centre = bounds.getCenter(new THREE.Vector3());
    // A scene near the origin has the origin in the middle of the room.
    const middle = Math.hypot(centre.x, centre.z) > kWidth / 4 ? centre : new THREE.Vector3();
    const reach = (axis: "x" | "z") => Math.max(bounds.max[axis] - middle[axis], middle[axis] - bounds.min[axis]);
    const width = Math.max(kWidth, 2.6 * reach("x") + 3);
    const depth = Math.max(kWidth, 2.6 * reach("z") + 3);
    // High enough for the default view, which is farther away and higher for wide scenes.
    const height = Math.max(kHeight, 1.25 * (bounds.max.y - floorHeight) + 0.4, 0.3 * Math.max(width, depth));
    this.group.position.set(middle.x, floorHeight, middle.z);

    const size = kFloorReach * Math.max(width, depth);
    this.floor.geometry.dispose();
    this.floor.geometry = new THREE.PlaneGeometry(size, size);
    const uv = this.floor.geometry.getAttribute("uv");
    for (let i = 0; i < uv.count; ++i) uv.setXY(i, uv.getX(i) * size, uv.getY(i) * size);
    this.floor.material.color.set(colours.floor);

    const shell = new Shell();
    const wall = lit(colours.wall);
    const trim = new THREE.Color(colours.trim);
    const scale = height / kHeight;
    for (let side = 0; side < 4; ++side) {
      const [across, away] = side % 2 === 0 ? [width, depth / 2] : [depth, width / 2];
      const turn = new THREE.Matrix4().makeRotationY((side * Math.PI) / 2);
      // Facing inwards, at the distance of the wall less a little for what is in front of it.
      const at = (x: number, y: number, front: number) => turn.clone().multiply(new THREE.Matrix4().makeTranslation(x, y, front - away));
      shell.add(across, height, 16, 8, at(0, height / 2, 0), wall);
      shell.add(across, 0.09 * scale, 1, 1, at(0, 0.045 * scale, 0.012), () => trim);
      if (side === 1) addWindow(shell, scale, (x, y, front) => at(x + across / 2 - 1.25 * scale, y, front), colours, trim);
    }
    const downwards = new THREE.Matrix4().makeRotationX(Math.PI / 2).setPosition(0, height, 0);
    shell.add(width, depth, 12, 12, downwards, lit(colours.ceiling));
    const lampAt = key.clone().multiplyScalar((height - (centre.y - floorHeight)) / key.y);
    const lamp = Math.min(1.3 * scale, 0.3 * width);
    const place = (below: number) =>
      new THREE.Matrix4()
        .makeRotationX(Math.PI / 2)
        .setPosition(within(centre.x - middle.x + lampAt.x, width / 2 - lamp), height - below, within(centre.z - middle.z + lampAt.z, depth / 2 - lamp));
    shell.add(1.08 * lamp, 1.08 * lamp, 1, 1, place(0.01), () => trim);
    shell.add(lamp, lamp, 1, 1, place(0.02), () => new THREE.Color(colours.lamp));
    this.shell.geometry.dispose();
    this.shell.geometry = shell.geometry();
    return Math.hypot(width, depth);
  }
}

// Places a part at (x, y) of a wall, in front of it by some metres.
type OnWall = (x: number, y: number, front: number) => THREE.Matrix4;

function addWindow(shell: Shell, scale: number, at: OnWall, colours: RoomColours, trim: THREE.Color): void {
  const width = 1.35 * scale;
  const height = 1.75 * scale;
  const middle = 1.75 * scale;
  const bar = 0.045 * scale;
  const sky = [new THREE.Color(colours.skyBelow), new THREE.Color(colours.sky)] as const;
  shell.add(width, height, 1, 4, at(0, middle, 0.012), (_, v) => sky[0].clone().lerp(sky[1], v));
  for (const x of [-0.5, 0, 0.5]) shell.add(bar, height + bar, 1, 1, at(x * width, middle, 0.03), () => trim);
  for (const y of [-0.5, 0.18, 0.5]) shell.add(width + bar, bar, 1, 1, at(0, middle + y * height, 0.032), () => trim);
  shell.add(width + 4 * bar, 0.7 * bar, 1, 1, at(0, middle - 0.5 * height - bar, 0.036), () => trim);
}

// Colour of a lit surface: darker towards its edges, where less light arrives.
function lit(hex: number): (u: number, v: number) => THREE.Color {
  const edge = (t: number) => THREE.MathUtils.smoothstep(Math.min(t, 1 - t), -0.06, 0.3);
  return (u, v) => new THREE.Color(hex).multiplyScalar(0.62 + 0.38 * edge(u) * edge(v));
}

const within = (value: number, limit: number) => Math.max(-limit, Math.min(limit, value));

// Collects rectangles with colours at their vertices into one geometry.
class Shell {
  private readonly positions: number[] = [];
  private readonly uvs: number[] = [];
  private readonly colours: number[] = [];
  private readonly indices: number[] = [];

  // A rectangle that faces +Z before `place`, divided so that colours vary over it.
  add(width: number, height: number, columns: number, rows: number, place: THREE.Matrix4, colour: (u: number, v: number) => THREE.Color): void {
    const first = this.positions.length / 3;
    const point = new THREE.Vector3();
    for (let row = 0; row <= rows; ++row) {
      for (let column = 0; column <= columns; ++column) {
        const u = column / columns;
        const v = row / rows;
        point.set((u - 0.5) * width, (v - 0.5) * height, 0).applyMatrix4(place);
        this.positions.push(point.x, point.y, point.z);
        this.uvs.push(u * width, v * height);
        this.colours.push(...colour(u, v).toArray());
        if (row === rows || column === columns) continue;
        const corner = first + row * (columns + 1) + column;
        this.indices.push(corner, corner + 1, corner + columns + 2, corner, corner + columns + 2, corner + columns + 1);
      }
    }
  }

  geometry(): THREE.BufferGeometry {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(this.positions, 3));
    geometry.setAttribute("uv", new THREE.Float32BufferAttribute(this.uvs, 2));
    geometry.setAttribute("color", new THREE.Float32BufferAttribute(this.colours, 3));
    geometry.setIndex(this.indices);
    return geometry;
  }
}
