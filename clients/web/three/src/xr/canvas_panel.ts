// SPDX-License-Identifier: MIT
// A panel in space, drawn on one canvas: texts, buttons and drawings. Rays and fingers press its buttons.

import * as THREE from "three";
import type { Body } from "./body";
import type { Limb } from "./limb";
import { PanelLayout, type PanelRow } from "./panel_layout";
import { kIndexTip } from "./tracked_hand";

const kPixelsPerMetre = 1400;
const kWidth = 0.46; // m
const kRow = 0.05; // m
const kMargin = 0.018; // m
const kMostRows = 15; // with the title
const kHeight = kMargin * 2 + kRow * kMostRows; // m
const kPokeDepth = 0.03; // m behind the panel at which a finger no longer presses

const kMisses = -2; // the ray misses the panel
const kNoButton = -1;

export class CanvasPanel {
  readonly mesh: THREE.Mesh<THREE.PlaneGeometry, THREE.MeshBasicMaterial>;
  readonly canvas = document.createElement("canvas");
  private readonly context: CanvasRenderingContext2D;
  private readonly texture: THREE.CanvasTexture;
  private layout: PanelLayout;
  private shown = ""; // what the rows say
  private hovered = kNoButton;
  private readonly tipWasInFront = new WeakMap<Limb, boolean>();
  private readonly point = new THREE.Vector3();
  private readonly direction = new THREE.Vector3();
  private readonly toPanel = new THREE.Matrix4();

  constructor() {
    this.canvas.width = Math.round(kWidth * kPixelsPerMetre);
    this.canvas.height = Math.round(kHeight * kPixelsPerMetre);
    this.context = this.canvas.getContext("2d")!;
    this.layout = this.lay("", []);
    this.texture = new THREE.CanvasTexture(this.canvas);
    this.texture.colorSpace = THREE.SRGBColorSpace;
    const material = new THREE.MeshBasicMaterial({ map: this.texture, transparent: true, toneMapped: false });
    this.mesh = new THREE.Mesh(new THREE.PlaneGeometry(kWidth, kHeight), material);
  }

  // Shows a title and rows. Draws only if something has changed.
  show(title: string, rows: readonly PanelRow[]): void {
    this.layout = this.lay(title, rows);
    // JSON leaves out functions, so a button that gets or loses its action is marked.
    const shown = JSON.stringify([title, rows, this.layout.areas.map(({ button }) => button.action !== undefined)]);
    if (shown === this.shown) return;
    this.shown = shown;
    this.draw();
  }

  // The texts that are not on buttons, line by line.
  get texts(): string[] {
    return this.layout.texts;
  }

  // The buttons with the places of their middles in the world.
  get buttons(): { text: string; isChosen: boolean; isEnabled: boolean; place: THREE.Vector3 }[] {
    this.mesh.updateWorldMatrix(true, false);
    return this.layout.areas.map(({ button, left, top, width, height }) => ({
      text: button.text,
      isChosen: button.isChosen === true,
      isEnabled: button.action !== undefined,
      place: this.mesh.localToWorld(
        new THREE.Vector3((left + width / 2) / kPixelsPerMetre - kWidth / 2, kHeight / 2 - (top + height / 2) / kPixelsPerMetre, 0),
      ),
    }));
  }

  // Follows rays and fingers, and presses buttons that a finger goes through. `toWorld` leads from the scene, in which
  // the limbs are, to the world.
  update(body: Body, toWorld: THREE.Matrix4): void {
    this.toPanel.copy(this.mesh.matrixWorld).invert().multiply(toWorld);
    let hovered = kNoButton;
    for (const limb of body.present()) {
      hovered = Math.max(hovered, this.buttonUnder(limb));
      if (limb.isHand) this.poke(limb);
    }
    if (hovered === this.hovered) return;
    this.hovered = hovered;
    this.draw();
  }

  // Presses the button that the limb points at. Returns whether it points at the panel.
  press(limb: Limb): boolean {
    const button = this.buttonUnder(limb);
    this.layout.areas[button]?.button.action?.();
    return button !== kMisses;
  }

  // Presses the button with this text.
  pressText(text: string): void {
    this.layout.areas.find(({ button }) => button.text === text)?.button.action?.();
  }

  dispose(): void {
    this.texture.dispose();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }

  private lay(title: string, rows: readonly PanelRow[]): PanelLayout {
    const { width, height } = this.canvas;
    return new PanelLayout(this.context, title, rows, width, height, kRow * kPixelsPerMetre, kMargin * kPixelsPerMetre);
  }

  // Index of the button that the ray of a limb meets; else kNoButton or kMisses.
  private buttonUnder(limb: Limb): number {
    if (!this.mesh.visible || !limb.pose.ray) return kMisses;
    this.point.copy(limb.pose.ray.origin).applyMatrix4(this.toPanel);
    this.direction.copy(limb.pose.ray.direction).transformDirection(this.toPanel);
    if (this.point.z <= 0 || this.direction.z >= 0) return kMisses;
    this.point.addScaledVector(this.direction, -this.point.z / this.direction.z);
    return this.buttonAt(this.point);
  }

  private buttonAt({ x, y }: THREE.Vector3): number {
    const [right, down] = [(x + kWidth / 2) * kPixelsPerMetre, (kHeight / 2 - y) * kPixelsPerMetre];
    if (right < 0 || right > this.canvas.width || down < 0 || down > this.layout.bottom) return kMisses;
    return this.layout.at(right, down);
  }

  private poke(limb: Limb): void {
    limb.hand.joint(kIndexTip, this.point).applyMatrix4(this.toPanel);
    const isInFront = this.point.z > 0;
    const wasInFront = this.tipWasInFront.get(limb) ?? isInFront;
    this.tipWasInFront.set(limb, isInFront);
    if (!this.mesh.visible || isInFront || !wasInFront || this.point.z < -kPokeDepth) return;
    this.layout.areas[this.buttonAt(this.point)]?.button.action?.();
  }

  private draw(): void {
    this.context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.layout.draw(this.context, this.hovered);
    this.texture.needsUpdate = true;
  }
}
