// SPDX-License-Identifier: MIT
// A panel in space, drawn on one canvas: text and buttons, pressed by rays or fingers.

import * as THREE from "three";
import type { Body } from "./body";
import type { Limb } from "./limb";
import { kIndexTip } from "./tracked_hand";

export interface PanelRow {
  text: string;
  detail?: string; // smaller, at the right edge
  // Makes the row a button.
  action?: () => void;
  isChosen?: boolean;
}

const kPixelsPerMetre = 1400;
const kWidth = 0.46; // m
const kRow = 0.05; // m
const kMargin = 0.018; // m
const kMostRows = 14;
const kPokeDepth = 0.03; // m behind the panel at which a finger no longer presses

export class CanvasPanel {
  readonly mesh: THREE.Mesh<THREE.PlaneGeometry, THREE.MeshBasicMaterial>;
  private readonly canvas = document.createElement("canvas");
  private readonly context: CanvasRenderingContext2D;
  private readonly texture: THREE.CanvasTexture;
  private rows: PanelRow[] = [];
  private title = "";
  private drawn = ""; // what the canvas shows
  private hovered = -1;
  private readonly tipWasInFront = new Map<Limb, boolean>();
  private readonly point = new THREE.Vector3();
  private readonly direction = new THREE.Vector3();
  private readonly toPanel = new THREE.Matrix4();

  constructor() {
    const height = kMargin * 2 + kRow * (kMostRows + 1);
    this.canvas.width = Math.round(kWidth * kPixelsPerMetre);
    this.canvas.height = Math.round(height * kPixelsPerMetre);
    this.context = this.canvas.getContext("2d")!;
    this.texture = new THREE.CanvasTexture(this.canvas);
    this.texture.colorSpace = THREE.SRGBColorSpace;
    const material = new THREE.MeshBasicMaterial({ map: this.texture, transparent: true, toneMapped: false });
    this.mesh = new THREE.Mesh(new THREE.PlaneGeometry(kWidth, height), material);
  }

  // Shows a title and rows; draws only if something has changed.
  show(title: string, rows: PanelRow[]): void {
    this.title = title;
    this.rows = rows.slice(0, kMostRows);
    this.draw();
  }

  // Title and texts of the rows, one a line.
  get text(): string {
    return [this.title, ...this.rows.map(({ text }) => text)].join("\n");
  }

  // Follows rays and fingers, and presses buttons that a finger goes through. `toWorld` leads from the scene, in which
  // the limbs are, to the world.
  update(body: Body, toWorld: THREE.Matrix4): void {
    this.toPanel.copy(this.mesh.matrixWorld).invert().multiply(toWorld);
    let hovered = -1;
    for (const limb of body.present()) {
      const row = this.rowUnder(limb);
      if (row >= 0) hovered = row;
      if (limb.isHand) this.poke(limb);
    }
    if (hovered === this.hovered) return;
    this.hovered = hovered;
    this.draw();
  }

  // Presses the button that the limb points at. Returns whether it points at the panel.
  press(limb: Limb): boolean {
    const row = this.rowUnder(limb);
    if (row === -1) return false;
    this.rows[row]?.action?.();
    return true;
  }

  dispose(): void {
    this.texture.dispose();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }

  // Index of the row that the ray of a limb meets. The number of rows if it meets the panel but no row, and -1 if it misses
  // the panel.
  private rowUnder(limb: Limb): number {
    if (!this.mesh.visible || !limb.pose.ray) return -1;
    this.point.copy(limb.pose.ray.origin).applyMatrix4(this.toPanel);
    this.direction.copy(limb.pose.ray.direction).transformDirection(this.toPanel);
    if (this.point.z <= 0 || this.direction.z >= 0) return -1;
    this.point.addScaledVector(this.direction, -this.point.z / this.direction.z);
    return this.rowAt(this.point);
  }

  private rowAt({ x, y }: THREE.Vector3): number {
    const { height } = this.mesh.geometry.parameters;
    const top = height / 2 - y - kMargin - kRow;
    const bottom = kMargin * 2 + kRow * (this.rows.length + 1);
    if (Math.abs(x) > kWidth / 2 || height / 2 - y < 0 || height / 2 - y > bottom) return -1;
    const row = Math.floor(top / kRow);
    return row >= 0 && row < this.rows.length ? row : this.rows.length;
  }

  private poke(limb: Limb): void {
    limb.hand.joint(kIndexTip, this.point).applyMatrix4(this.toPanel);
    const isInFront = this.point.z > 0;
    const wasInFront = this.tipWasInFront.get(limb) ?? isInFront;
    this.tipWasInFront.set(limb, isInFront);
    if (!this.mesh.visible || isInFront || !wasInFront || this.point.z < -kPokeDepth) return;
    const row = this.rowAt(this.point);
    if (row >= 0) this.rows[row]?.action?.();
  }

  private draw(): void {
    const state = JSON.stringify([this.title, this.hovered, this.rows, this.rows.map(({ action }) => action !== undefined)]);
    if (state === this.drawn) return;
    this.drawn = state;
    const { context, canvas } = this;
    const pixels = (metres: number) => metres * kPixelsPerMetre;
    const [row, margin] = [pixels(kRow), pixels(kMargin)];
    const bottom = 2 * margin + row * (this.rows.length + 1);
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.fillStyle = "rgba(22, 23, 27, 0.92)";
    context.beginPath();
    context.roundRect(0, 0, canvas.width, bottom, margin);
    context.fill();
    context.textBaseline = "middle";
    this.write(this.title, margin, margin + row / 2, `600 ${row * 0.5}px system-ui, sans-serif`, "#ffffff", "left");
    this.rows.forEach(({ text, detail, action, isChosen }, index) => {
      const top = margin + row * (index + 1);
      if (action) {
        context.fillStyle = index === this.hovered ? "#3d5a80" : isChosen ? "#2c3e57" : "#2a2c33";
        context.beginPath();
        context.roundRect(margin, top + 3, canvas.width - 2 * margin, row - 6, 10);
        context.fill();
      }
      const left = margin * (action ? 2 : 1);
      this.write(text, left, top + row / 2, `${row * 0.4}px system-ui, sans-serif`, action ? "#ffffff" : "#c9ccd3", "left");
      if (detail) this.write(detail, canvas.width - 2 * margin, top + row / 2, `${row * 0.34}px system-ui, sans-serif`, "#b4b8c2", "right");
    });
    this.texture.needsUpdate = true;
  }

  private write(text: string, x: number, y: number, font: string, colour: string, align: CanvasTextAlign): void {
    this.context.font = font;
    this.context.fillStyle = colour;
    this.context.textAlign = align;
    this.context.fillText(text, x, y, this.canvas.width - 2 * kMargin * kPixelsPerMetre);
  }
}
