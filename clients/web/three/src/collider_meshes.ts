// SPDX-License-Identifier: MIT
// Colliders of the scene as three.js meshes, one per collider in the order of shownColliders(). Those of participants are
// drawn by People.

import * as THREE from "three";
import { Shape, type Client, type Collider } from "@clothstream/client";

export type ColliderMesh = THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>;

// Scale of drawn colliders. Slightly smaller, because triangles between nodes that touch a shape cut into it.
const kShrink = 0.985;
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

  // Sets the map that smooth colliders reflect.
  reflect(reflections: THREE.Texture): void {
    this.reflections = reflections;
    for (const { material } of this.meshes) material.envMap = reflections;
  }

  // Removes all meshes, because a new description brings new hulls.
  describe(): void {
    for (const mesh of this.meshes.splice(0)) this.remove(mesh);
  }

  // `shown` are all colliders that are shown.
  place(client: Client, shown: readonly Collider[]): void {
    const colliders = shown.filter(({ participantId }) => participantId === 0n);
    while (this.meshes.length > colliders.length) this.remove(this.meshes.pop()!);
    colliders.forEach((collider, index) => {
      const look = lookOf(collider);
      let mesh = this.meshes[index];
      if (mesh?.userData["look"] !== look) {
        if (mesh) this.remove(mesh);
        mesh = this.meshes[index] = makeMesh(client, collider, look);
        mesh.material.envMap = this.reflections;
        this.group.add(mesh);
      }
      mesh.name = collider.name;
      mesh.position.set(...collider.position);
      mesh.quaternion.set(...collider.orientation);
    });
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
      return collider.radius + collider.length / 2;
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

// Key of the mesh's geometry. The mesh is reused while the key stays the same.
function lookOf({ shape, name, radius, length, size }: Collider): string {
  return [shape, shape === Shape.hull ? name : "", radius, length, ...size].join(" ");
}

function makeMesh(client: Client, collider: Collider, look: string): ColliderMesh {
  const material = new THREE.MeshStandardMaterial(kLooks[collider.shape]);
  const mesh = new THREE.Mesh(geometryOf(client, collider), material);
  mesh.castShadow = collider.shape !== Shape.plane;
  mesh.receiveShadow = true;
  mesh.userData["look"] = look;
  return mesh;
}

function geometryOf(client: Client, collider: Collider): THREE.BufferGeometry {
  const { radius, length, size } = collider;
  switch (collider.shape) {
    case Shape.sphere:
      return new THREE.SphereGeometry(kShrink * radius, 64, 48);
    case Shape.capsule:
      return new THREE.CapsuleGeometry(kShrink * radius, length, 16, 48);
    case Shape.plane:
      // 2 mm lower, as other shapes are smaller. This also avoids flicker with a floor at the same height.
      return new THREE.PlaneGeometry(2 * kPlaneReach, 2 * kPlaneReach).rotateX(-Math.PI / 2).translate(0, -0.002, 0);
    case Shape.box:
      return new THREE.BoxGeometry(...size.map((edge) => kShrink * edge));
    case Shape.hull:
      return hullGeometry(client, collider);
  }
}

function hullGeometry(client: Client, collider: Collider): THREE.BufferGeometry {
  const { vertices, triangles } = client.frames.hull(collider);
  const indexed = new THREE.BufferGeometry();
  indexed.setAttribute("position", new THREE.BufferAttribute(vertices, 3));
  indexed.setIndex(new THREE.BufferAttribute(triangles, 1));
  // Faces do not share vertices, so that edges are sharp.
  const geometry = indexed.toNonIndexed().scale(kShrink, kShrink, kShrink);
  geometry.computeVertexNormals();
  return geometry;
}
