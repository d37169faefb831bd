// SPDX-License-Identifier: MIT
// Light of the surroundings, computed: a soft window towards the key light, a cool one opposite, ceiling and floor.

import * as THREE from "three";

const kColumns = 256;
const kRows = 128;
const kProbeColumns = 48;
const kProbeRows = 24;

export interface SkyColours {
  above: number;
  level: number;
  below: number;
  key: number; // colour of the window towards the key light
  keyStrength: number; // its radiance
  rim: number;
  rimStrength: number;
}

export class Sky {
  private readonly above: THREE.Color;
  private readonly level: THREE.Color;
  private readonly below: THREE.Color;
  private readonly key: THREE.Color;
  private readonly rim: THREE.Color;

  // The directions have length 1.
  constructor(
    colours: SkyColours,
    private readonly keyDirection: THREE.Vector3,
    private readonly rimDirection: THREE.Vector3,
  ) {
    this.above = new THREE.Color(colours.above);
    this.level = new THREE.Color(colours.level);
    this.below = new THREE.Color(colours.below);
    this.key = new THREE.Color(colours.key).multiplyScalar(colours.keyStrength);
    this.rim = new THREE.Color(colours.rim).multiplyScalar(colours.rimStrength);
  }

  // Diffuse light on every surface, as spherical harmonics.
  probe(): THREE.SphericalHarmonics3 {
    const harmonics = new THREE.SphericalHarmonics3();
    const basis = new Array<number>(9).fill(0);
    const direction = new THREE.Vector3();
    const colour = new THREE.Color();
    for (let row = 0; row < kProbeRows; ++row) {
      for (let column = 0; column < kProbeColumns; ++column) {
        const latitude = towards(column, row, kProbeColumns, kProbeRows, direction);
        const solidAngle = Math.cos(latitude) * (Math.PI / kProbeRows) * ((2 * Math.PI) / kProbeColumns);
        this.radiance(direction, colour);
        THREE.SphericalHarmonics3.getBasisAt(direction, basis);
        const light = new THREE.Vector3(colour.r, colour.g, colour.b);
        harmonics.coefficients.forEach((coefficient, i) => coefficient.addScaledVector(light, basis[i]! * solidAngle));
      }
    }
    return harmonics;
  }

  // Map of reflections for physically based materials. The caller disposes of it.
  reflections(renderer: THREE.WebGLRenderer): THREE.WebGLRenderTarget {
    const texels = new Uint16Array(4 * kColumns * kRows);
    const direction = new THREE.Vector3();
    const colour = new THREE.Color();
    for (let row = 0; row < kRows; ++row) {
      for (let column = 0; column < kColumns; ++column) {
        towards(column, row, kColumns, kRows, direction);
        this.radiance(direction, colour);
        texels.set([colour.r, colour.g, colour.b, 1].map(THREE.DataUtils.toHalfFloat), 4 * (row * kColumns + column));
      }
    }
    const texture = new THREE.DataTexture(texels, kColumns, kRows, THREE.RGBAFormat, THREE.HalfFloatType);
    texture.mapping = THREE.EquirectangularReflectionMapping;
    texture.magFilter = texture.minFilter = THREE.LinearFilter;
    texture.needsUpdate = true;
    const generator = new THREE.PMREMGenerator(renderer);
    const target = generator.fromEquirectangular(texture);
    generator.dispose();
    texture.dispose();
    return target;
  }

  private radiance(direction: THREE.Vector3, out: THREE.Color): void {
    const up = direction.y;
    out.copy(this.level).lerp(up > 0 ? this.above : this.below, Math.min(1, Math.abs(up) * (up > 0 ? 1.3 : 3)));
    addLobe(out, this.key, direction.angleTo(this.keyDirection), 0.42);
    addLobe(out, this.rim, direction.angleTo(this.rimDirection), 0.5);
  }
}

// Direction of a texel of an equirectangular map, the inverse of equirectUv() of three.js. Returns the latitude.
function towards(column: number, row: number, columns: number, rows: number, out: THREE.Vector3): number {
  const latitude = ((row + 0.5) / rows - 0.5) * Math.PI;
  const longitude = ((column + 0.5) / columns - 0.5) * 2 * Math.PI;
  out.set(Math.cos(latitude) * Math.cos(longitude), Math.sin(latitude), Math.cos(latitude) * Math.sin(longitude));
  return latitude;
}

// A window: full inside a cone of the half-angle, with a soft edge.
function addLobe(sum: THREE.Color, colour: THREE.Color, angle: number, halfAngle: number): void {
  const part = 1 - THREE.MathUtils.smoothstep(angle, 0.75 * halfAngle, 1.25 * halfAngle);
  sum.r += part * colour.r;
  sum.g += part * colour.g;
  sum.b += part * colour.b;
}
