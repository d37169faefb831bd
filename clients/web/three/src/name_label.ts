// SPDX-License-Identifier: MIT
// A name over a head. It faces the camera, stays legible at a distance, and fades when the camera comes near.

import * as THREE from "three";

const kFont = "600 44px system-ui, sans-serif";
const kPixels = { height: 72, padding: 26, largest: 640 };
const kLetters = 40; // longer names are cut
const kHeight = 0.075; // m
const kAngle = 0.026; // smallest height as an angle from the camera, radians
const kFadeFrom = 0.6; // m
const kFadeTo = 0.3;

export class NameLabel {
  readonly sprite: THREE.Sprite;
  private readonly aspect: number;

  constructor(
    readonly text: string,
    colour: THREE.Color,
  ) {
    const picture = draw(text, colour);
    this.aspect = picture.width / picture.height;
    const texture = new THREE.CanvasTexture(picture);
    texture.colorSpace = THREE.SRGBColorSpace;
    texture.anisotropy = 4;
    const material = new THREE.SpriteMaterial({ map: texture, transparent: true, depthWrite: false, toneMapped: false, fog: false });
    this.sprite = new THREE.Sprite(material);
    this.sprite.name = text;
  }

  place(x: number, y: number, z: number, eye: THREE.Vector3): void {
    this.sprite.position.set(x, y, z);
    const distance = this.sprite.position.distanceTo(eye);
    const height = Math.max(kHeight, kAngle * distance);
    this.sprite.scale.set(this.aspect * height, height, 1);
    this.sprite.material.opacity = THREE.MathUtils.clamp((distance - kFadeTo) / (kFadeFrom - kFadeTo), 0, 1);
    this.sprite.visible = distance > kFadeTo;
  }

  dispose(): void {
    this.sprite.removeFromParent();
    this.sprite.material.map?.dispose();
    this.sprite.material.dispose();
  }
}

function draw(text: string, colour: THREE.Color): HTMLCanvasElement {
  const canvas = document.createElement("canvas");
  const pen = canvas.getContext("2d");
  if (!pen) throw new Error("The browser has no 2D canvas");
  const letters = [...text];
  const shown = letters.length > kLetters ? `${letters.slice(0, kLetters - 1).join("")}…` : text;
  pen.font = kFont;
  canvas.width = Math.min(kPixels.largest, Math.ceil(pen.measureText(shown).width) + 2 * kPixels.padding);
  canvas.height = kPixels.height;
  pen.font = kFont; // A new size resets the context.
  pen.fillStyle = "#14161bd8";
  pen.beginPath();
  pen.roundRect(0, 0, canvas.width, canvas.height, canvas.height / 2);
  pen.fill();
  pen.strokeStyle = `#${colour.getHexString()}`;
  pen.lineWidth = 4;
  pen.beginPath();
  pen.roundRect(2, 2, canvas.width - 4, canvas.height - 4, canvas.height / 2 - 2);
  pen.stroke();
  pen.fillStyle = "#f4f2ee";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(shown, canvas.width / 2, canvas.height / 2 + 2, canvas.width - 2 * kPixels.padding);
  return canvas;
}
