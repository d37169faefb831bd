// SPDX-License-Identifier: MIT
// Surfaces of the real room that the headset detects: its planes and meshes (WebXR plane-detection and mesh-detection).

import * as THREE from "three";
import { checkedMesh, cornersOf, isSameMesh, polygonMesh, withoutFlatParts, type FlatPart, type RoomMesh } from "./room_mesh";

export const kDetections = ["plane-detection", "mesh-detection"] as const;

export interface DetectedSurface {
  readonly id: number;
  // From its frame to the room.
  readonly pose: THREE.Matrix4;
  // Undefined if nothing of it is usable, for example because flat parts of the room replace it.
  mesh: RoomMesh | undefined;
  version: number; // changes with the mesh
}

interface Kept extends DetectedSurface {
  changedTime: number; // of the device
  raw: RoomMesh | undefined; // of a mesh: before flat parts of the room replace triangles
  replaced: string; // of a mesh: the flat parts that have replaced triangles, and their places
  corners: THREE.Vector2[] | undefined; // of a plane
  facesDown: boolean | undefined; // of a plane; undefined: not seen yet
}

export class DetectedSurfaces {
  private readonly kept = new Map<XRPlane | XRMesh, Kept>();
  private newest = 0; // id

  get all(): readonly DetectedSurface[] {
    return [...this.kept.values()];
  }

  // Whether a session detects surfaces. A device may refuse, or have no such feature.
  static detects({ enabledFeatures }: XRSession): boolean {
    return kDetections.some((name) => enabledFeatures?.includes(name) ?? true);
  }

  // Reads the surfaces of a frame. Call at most a few times per second: it compares meshes.
  read(frame: XRFrame, space: XRReferenceSpace): void {
    const { enabledFeatures } = frame.session;
    const has = (name: (typeof kDetections)[number]) => enabledFeatures?.includes(name) ?? true;
    const planes = (has("plane-detection") && frame.detectedPlanes) || new Set<XRPlane>();
    const meshes = (has("mesh-detection") && frame.detectedMeshes) || new Set<XRMesh>();
    for (const one of this.kept.keys()) if (!planes.has(one as XRPlane) && !meshes.has(one as XRMesh)) this.kept.delete(one);
    const eye = frame.getViewerPose(space)?.transform.position;
    for (const plane of planes) {
      const kept = this.keep(plane);
      if (follow(kept.pose, frame, plane.planeSpace, space)) this.readPlane(kept, plane, eye);
    }
    const flatParts = [...this.kept.values()].flatMap(flatPart);
    for (const mesh of meshes) {
      const kept = this.keep(mesh);
      if (!follow(kept.pose, frame, mesh.meshSpace, space)) continue;
      if (kept.changedTime !== mesh.lastChangedTime) {
        kept.changedTime = mesh.lastChangedTime;
        const raw = checkedMesh(mesh.vertices, mesh.indices);
        if (!isSame(raw, kept.raw)) [kept.raw, kept.replaced] = [raw, ""];
      }
      const replaced = ["by", ...flatParts.map(({ name, fromRoom }) => `${name} ${placeIn(fromRoom, kept.pose)}`)].join();
      if (replaced === kept.replaced) continue;
      kept.replaced = replaced;
      change(kept, kept.raw && withoutFlatParts(kept.raw, kept.pose, flatParts));
    }
  }

  forget(): void {
    this.kept.clear();
  }

  private keep(detected: XRPlane | XRMesh): Kept {
    let kept = this.kept.get(detected);
    if (!kept) {
      kept = { id: ++this.newest, pose: new THREE.Matrix4(), mesh: undefined, version: 0, changedTime: -1, raw: undefined, replaced: "", corners: undefined, facesDown: undefined };
      this.kept.set(detected, kept);
    }
    return kept;
  }

  private readPlane(kept: Kept, plane: XRPlane, eye: DOMPointReadOnly | undefined): void {
    const hadSide = kept.facesDown !== undefined;
    if (!hadSide && eye) kept.facesDown = facesDown(kept.pose, plane, eye);
    if (kept.changedTime === plane.lastChangedTime && hadSide) return;
    kept.changedTime = plane.lastChangedTime;
    kept.corners = cornersOf(plane.polygon);
    change(kept, polygonMesh(kept.corners, kept.facesDown ?? false));
  }
}

// Whether the front of a plane is in the direction of -y of its frame. Devices differ in where y points. The front of what
// is horizontal is above, except of a ceiling; of anything else, where the user is.
function facesDown(pose: THREE.Matrix4, plane: XRPlane & { semanticLabel?: string | null }, eye: DOMPointReadOnly): boolean {
  const normal = new THREE.Vector3().setFromMatrixColumn(pose, 1);
  const centre = new THREE.Vector3().setFromMatrixPosition(pose);
  if (Math.abs(normal.y) < Math.SQRT1_2) return normal.dot(centre.sub(eye)) > 0;
  const isCeiling = plane.semanticLabel ? plane.semanticLabel === "ceiling" : centre.y > eye.y;
  return normal.y < 0 !== isCeiling;
}

// Reads a pose. Returns false, and keeps the last one, while the device does not know it.
function follow(pose: THREE.Matrix4, frame: XRFrame, of: XRSpace, space: XRReferenceSpace): boolean {
  const matrix = frame.getPose(of, space)?.transform.matrix;
  if (!matrix || !matrix.every(Number.isFinite)) return false;
  pose.fromArray(matrix);
  return true;
}

function flatPart({ id, version, corners, mesh, pose }: Kept): (FlatPart & { name: string })[] {
  return corners && mesh ? [{ name: `${id}.${version}`, corners, fromRoom: pose.clone().invert() }] : [];
}

// Where a mesh is in the frame of a flat part, in whole centimetres and hundredths of a turn's cosine.
function placeIn(fromRoom: THREE.Matrix4, pose: THREE.Matrix4): string {
  return new THREE.Matrix4().multiplyMatrices(fromRoom, pose).elements.map((value) => Math.round(100 * value)).join(" ");
}

const isSame = (a: RoomMesh | undefined, b: RoomMesh | undefined) => (a && b ? isSameMesh(a, b) : a === b);

function change(kept: Kept, mesh: RoomMesh | undefined): void {
  if (isSame(kept.mesh, mesh)) return;
  kept.mesh = mesh;
  ++kept.version;
}
