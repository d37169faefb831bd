// SPDX-License-Identifier: MIT
// Places the scene on real surfaces (pass-through): a ring shows where the user points, a press puts the scene there, and
// an anchor of the device keeps it there.

import * as THREE from "three";

export class HitTest {
  // Ring on the surface, in room coordinates.
  readonly reticle: THREE.Mesh;
  private source: XRHitTestSource | undefined;
  private hit: XRHitTestResult | undefined;
  private anchor: XRAnchor | undefined;
  private readonly matrix = new THREE.Matrix4();
  private placings = 0; // counts places and ends: an answer for an earlier one comes too late

  constructor() {
    const geometry = new THREE.RingGeometry(0.09, 0.11, 48).rotateX(-Math.PI / 2);
    this.reticle = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: 0xffffff, depthTest: false }));
    this.reticle.matrixAutoUpdate = false;
    this.reticle.visible = false;
    this.reticle.renderOrder = 10;
  }

  // Starts to look for surfaces in front of the head. Does nothing if the device finds none.
  async begin(session: XRSession): Promise<void> {
    if (!session.requestHitTestSource || !session.enabledFeatures?.includes("hit-test")) return;
    const placing = this.placings;
    const space = await session.requestReferenceSpace("viewer");
    const source = await session.requestHitTestSource({ space });
    if (placing === this.placings) this.source = source;
    else source?.cancel();
  }

  // Whether a surface may be found.
  get looks(): boolean {
    return this.source !== undefined;
  }

  get isAnchored(): boolean {
    return this.anchor !== undefined;
  }

  // Looks for a surface; call once per frame while the user places the scene, before place().
  update(frame: XRFrame, space: XRReferenceSpace): void {
    this.hit = this.source && frame.getHitTestResults(this.source)[0];
    const pose = this.hit?.getPose(space);
    this.reticle.visible = pose !== undefined && pose !== null;
    if (pose) this.reticle.matrix.fromArray(pose.transform.matrix);
  }

  // Point of the surface that was found, and keeps it by an anchor. Undefined without a surface.
  place(): THREE.Vector3 | undefined {
    if (!this.reticle.visible || !this.hit) return undefined;
    const point = new THREE.Vector3().setFromMatrixPosition(this.reticle.matrix);
    this.dropAnchor();
    const placing = this.placings;
    // Without anchors the scene stays where it is in the reference space.
    void this.hit
      .createAnchor?.()
      ?.then((anchor) => {
        if (placing === this.placings) this.anchor = anchor;
        else anchor.delete();
      })
      .catch(() => undefined);
    return point;
  }

  // Where the anchored point is now; undefined without an anchor.
  anchored(frame: XRFrame, space: XRReferenceSpace): THREE.Vector3 | undefined {
    if (!this.anchor || !frame.trackedAnchors?.has(this.anchor)) return undefined;
    const pose = frame.getPose(this.anchor.anchorSpace, space);
    return pose ? new THREE.Vector3().setFromMatrixPosition(this.matrix.fromArray(pose.transform.matrix)) : undefined;
  }

  // The user has moved the scene by hand: the anchor no longer holds.
  dropAnchor(): void {
    ++this.placings;
    this.anchor?.delete();
    this.anchor = undefined;
  }

  hide(): void {
    this.reticle.visible = false;
    this.hit = undefined;
  }

  end(): void {
    this.source?.cancel();
    this.source = undefined;
    this.dropAnchor();
    this.hide();
  }
}
