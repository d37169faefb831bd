// SPDX-License-Identifier: MIT
// Colliders of the scene as three.js meshes, one per collider in the order of shownColliders(). Those of participants are
// drawn by People.

import * as THREE from "three";
import { Shape, type Client, type Collider } from "@clothstream/client";

export type ColliderMesh = THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>;

// Scale of drawn colliders. Slightly smaller, because triangles between nodes that touch a shape cut into it.
const kShrink = 0.985;
// A hull has at most this number of corners. More are those of a mesh, which is drawn smooth and in its true size.
const kMostHullCorners = 128;
// Half the edge of the drawn part of a plane, metres.
const kPlaneReach = 4;

// Glazed ceramic, oiled wood, floor, plaster and stone.
const kLooks: Record<Shape, THREE.MeshStandardMaterialParameters> = {
  [Shape.sphere]: { color: 0xd5cdbd, roughness: 0.16, envMapIntensity: 0.5 },
  [Shape.capsule]: { color: 0x6e4a2f, roughness: 0.45, envMapIntensity: 0.4 },
  [Shape.plane]: { color: 0xb7b0a4, roughness: 0.8, envMapIntensity: 0 },
  [Shape.box]: { color: 0xcfc8bb, roughness: 0.8, envMapIntensity: 0 },
  [Shape.hull]: { color: 0x9a958c, roughness: 0.6, envMapIntensity: 0.2 },
};

export class ColliderMeshes {
  readonly group = new THREE.Group();
  readonly meshes: ColliderMesh[] = [];
  private reflections: THREE.Texture | null = null;
  private worn = ""; // name of the own body

  // Sets the map that smooth colliders reflect.
  reflect(reflections: THREE.Texture): void {
    this.reflections = reflections;
    for (const { material } of this.meshes) material.envMap = reflections;
  }

  // Hides what is above the neck of the own body, which would be before the eyes; "" for none. Mirrors and shadows show it.
  wear(name: string): void {
    this.worn = name;
  }

  // Whether the scene is drawn for a mirror.
  drawForMirror(on: boolean): void {
    for (const mesh of this.meshes) showHead(mesh, on || mesh.name !== this.worn);
  }

  // Removes all meshes, because a new description brings new hulls.
  describe(): void {
    for (const mesh of this.meshes.splice(0)) this.remove(mesh);
  }

  // `shown` are all colliders that are shown.
  place(client: Client, shown: readonly Collider[]): void {
    let count = 0;
    // A loop with "of" would allocate an iterator for each drawn frame.
    for (let index = 0; index < shown.length; ++index) {
      const collider = shown[index]!;
      if (collider.participantId !== 0n) continue;
      let mesh = this.meshes[count];
      if (!mesh || !looksLike(mesh.userData["look"] as Look, collider)) {
        if (mesh) this.remove(mesh);
        mesh = this.meshes[count] = makeMesh(client, collider);
        mesh.material.envMap = this.reflections;
        this.group.add(mesh);
      }
      mesh.name = collider.name;
      mesh.position.fromArray(collider.position);
      mesh.quaternion.fromArray(collider.orientation);
      if (collider.shape === Shape.hull) follow(mesh, client.frames.hullVertices(collider));
      const isOwn = this.worn !== "" && collider.name === this.worn;
      if (isOwn && mesh.userData["shown"] === undefined) sortByNeck(mesh, client, collider);
      showHead(mesh, !isOwn);
      ++count;
    }
    while (this.meshes.length > count) this.remove(this.meshes.pop()!);
  }

  private remove(mesh: ColliderMesh): void {
    this.group.remove(mesh);
    mesh.geometry.dispose();
    mesh.material.dispose();
  }
}

// Radius of a sphere around the shape, for the bounds of the view. 0 for a plane.
export function reachOf(client: Client, collider: Collider): number {
  switch (collider.shape) {
    case Shape.sphere:
      return collider.radius;
    case Shape.capsule:
      return Math.max(collider.radius, collider.topRadius) + collider.length / 2;
    case Shape.plane:
      return 0;
    case Shape.box:
      return Math.hypot(...collider.size) / 2;
    case Shape.hull: {
      const { vertices } = client.frames.hull(collider);
      let reach = 0;
      for (let i = 0; i < vertices.length; i += 3) reach = Math.max(reach, Math.hypot(...vertices.subarray(i, i + 3)));
      return reach;
    }
  }
}

// Members of a collider that its geometry depends on. The mesh is reused while it stays the same.
type Look = Pick<Collider, "shape" | "name" | "radius" | "topRadius" | "length" | "size">;

function looksLike(look: Look, { shape, name, radius, topRadius, length, size }: Collider): boolean {
  if (look.shape !== shape || look.radius !== radius || look.topRadius !== topRadius || look.length !== length) return false;
  if (look.size[0] !== size[0] || look.size[1] !== size[1] || look.size[2] !== size[2]) return false;
  return shape !== Shape.hull || look.name === name;
}

function makeMesh(client: Client, collider: Collider): ColliderMesh {
  const material = new THREE.MeshStandardMaterial(kLooks[collider.shape]);
  const mesh = new THREE.Mesh(geometryOf(client, collider), material);
  mesh.castShadow = collider.shape !== Shape.plane;
  mesh.receiveShadow = true;
  const { shape, name, radius, topRadius, length, size } = collider;
  mesh.userData["look"] = { shape, name, radius, topRadius, length, size: [size[0], size[1], size[2]] } satisfies Look;
  return mesh;
}

function geometryOf(client: Client, collider: Collider): THREE.BufferGeometry {
  const { radius, topRadius, length, size } = collider;
  switch (collider.shape) {
    case Shape.sphere:
      return new THREE.SphereGeometry(kShrink * radius, 64, 48);
    case Shape.capsule:
      if (topRadius === radius) return new THREE.CapsuleGeometry(kShrink * radius, length, 16, 48);
      return taperedCapsule(kShrink * radius, kShrink * topRadius, length);
    case Shape.plane:
      // 2 mm lower, as other shapes are smaller. This also avoids flicker with a floor at the same height.
      return new THREE.PlaneGeometry(2 * kPlaneReach, 2 * kPlaneReach).rotateX(-Math.PI / 2).translate(0, -0.002, 0);
    case Shape.box:
      return new THREE.BoxGeometry(...size.map((edge) => kShrink * edge));
    case Shape.hull:
      return hullGeometry(client, collider);
  }
}

// The convex hull of a ball at the lower end of a segment along Y and another one at its upper end.
function taperedCapsule(radius: number, topRadius: number, length: number): THREE.LatheGeometry {
  const kSteps = 16;
  // Latitude at which the cone touches both balls.
  const touching = -Math.asin(THREE.MathUtils.clamp((topRadius - radius) / length, -0.99, 0.99));
  const outline: THREE.Vector2[] = [];
  const addArc = (radius: number, y: number, from: number, to: number) => {
    for (let i = 0; i <= kSteps; ++i) {
      const latitude = from + ((to - from) * i) / kSteps;
      outline.push(new THREE.Vector2(Math.max(radius * Math.cos(latitude), 0), y + radius * Math.sin(latitude)));
    }
  };
  addArc(radius, -length / 2, -Math.PI / 2, touching);
  addArc(topRadius, length / 2, touching, Math.PI / 2);
  return new THREE.LatheGeometry(outline, 48);
}

// Puts the triangles below the neck first, so that the others can be left out. Hulls of few corners have no
// index, and are drawn whole.
function sortByNeck(mesh: ColliderMesh, client: Client, collider: Collider): void {
  const { geometry } = mesh;
  const below = client.wearing.belowNeck(collider.index);
  mesh.userData["shown"] = geometry.index ? below.length : 0;
  if (!geometry.index || below.length === 0) return;
  const key = (corners: ArrayLike<number>, i: number) => `${corners[i]} ${corners[i + 1]} ${corners[i + 2]}`;
  const known = new Set<string>();
  for (let i = 0; i < below.length; i += 3) known.add(key(below, i));
  const all = geometry.index.array;
  const sorted = new Uint32Array(all.length);
  sorted.set(below);
  for (let i = 0, at = below.length; i < all.length; i += 3)
    if (!known.has(key(all, i))) for (let k = 0; k < 3; ++k) sorted[at++] = all[i + k]!;
  geometry.setIndex(new THREE.BufferAttribute(sorted, 1));
  mesh.onBeforeShadow = () => geometry.setDrawRange(0, Infinity);
  mesh.onAfterShadow = () => showHead(mesh, mesh.userData["head"] !== false);
}

function showHead(mesh: ColliderMesh, shows: boolean): void {
  const below = mesh.userData["shown"] as number | undefined;
  if (!below) return;
  mesh.userData["head"] = shows;
  mesh.geometry.setDrawRange(0, shows ? Infinity : below);
}

// Moves the vertices of a mesh with joints to where they are now.
function follow({ geometry }: ColliderMesh, vertices: Float32Array): void {
  const position = geometry.getAttribute("position") as THREE.BufferAttribute;
  const corners = geometry.userData["corners"] as Uint32Array;
  const places = position.array as Float32Array;
  if (places.length !== (geometry.index ? vertices.length : 3 * corners.length)) return;
  let same = true;
  if (geometry.index) {
    for (let i = 0; same && i < vertices.length; ++i) same = vertices[i] === places[i];
    if (same) return;
    places.set(vertices);
  } else {
    for (let i = 0; i < places.length; ++i) {
      const place = Math.fround(kShrink * vertices[3 * corners[Math.floor(i / 3)]! + (i % 3)]!);
      same = same && place === places[i];
      places[i] = place;
    }
    if (same) return;
  }
  position.needsUpdate = true;
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
}

function hullGeometry(client: Client, collider: Collider): THREE.BufferGeometry {
  const { vertices, triangles } = client.frames.hull(collider);
  const indexed = new THREE.BufferGeometry();
  indexed.setAttribute("position", new THREE.BufferAttribute(vertices, 3));
  indexed.setIndex(new THREE.BufferAttribute(triangles, 1));
  if (vertices.length > 3 * kMostHullCorners) {
    indexed.computeVertexNormals();
    return indexed;
  }
  // Faces do not share vertices, so that edges are sharp.
  const geometry = indexed.toNonIndexed().scale(kShrink, kShrink, kShrink);
  geometry.userData["corners"] = triangles; // vertex of each corner
  geometry.computeVertexNormals();
  return geometry;
}
