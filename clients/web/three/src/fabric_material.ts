// SPDX-License-Identifier: MIT
// Physically based material of a fabric, for both sides of a cloth.

import * as THREE from "three";
import type { Fabric } from "./fabrics";
import { gatherNormals, type NormalGathering } from "./normal_gathering";
import { kThreads, weave } from "./weave";

// full: everything. reduced: for phones and other weak graphics, without sheen, anisotropy and roughness maps.
export type Detail = "full" | "reduced";

const kTexels: Record<Detail, number> = { full: 400, reduced: 200 };
const kAnisotropy: Record<Detail, number> = { full: 2, reduced: 1 };
const kWhite = new THREE.Color(0xffffff);
// Texels of 200 leave the colour as it is (weave.ts). The material's colour makes up for them.
const kTexelFactor = 1 / Math.pow(200 / 255, 2.2);

// `colour` dyes fabrics that have none. `woven`: the geometry has texture coordinates in metres. With `gathering` the
// vertex shader computes the normals.
export function fabricMaterial(
  fabric: Fabric,
  colour: number,
  woven: boolean,
  detail: Detail,
  gathering: NormalGathering | undefined,
): THREE.MeshPhysicalMaterial {
  const base = new THREE.Color(fabric.colour ?? colour);
  const material = new THREE.MeshPhysicalMaterial({
    color: base,
    roughness: fabric.roughness,
    // Threads reflect in their own colour, besides the white reflection of their surface.
    specularColor: base.clone().lerp(kWhite, 0.4),
    side: THREE.DoubleSide,
    // Shadows of both sides: the shadow's offset prevents a cloth from shading itself.
    shadowSide: THREE.DoubleSide,
  });
  if (detail === "full" && fabric.sheen > 0) {
    material.sheen = fabric.sheen;
    material.sheenRoughness = fabric.sheenRoughness;
    material.sheenColor = base.clone().lerp(kWhite, 0.2);
  }
  if (woven) {
    const textures = texturesOf(fabric, detail);
    material.map = textures.colour;
    material.color = base.clone().multiplyScalar(kTexelFactor);
    material.normalMap = textures.relief;
    material.normalScale.setScalar(fabric.relief);
    if (detail === "full") {
      material.roughnessMap = textures.roughness;
      material.anisotropy = fabric.anisotropy;
    }
  }
  extend(material, fabric, gathering);
  return material;
}

// Adds light that shines through the cloth from behind, the colour of the back, and gathered normals.
function extend(material: THREE.MeshPhysicalMaterial, fabric: Fabric, gathering: NormalGathering | undefined): void {
  const uniforms = { clothTranslucency: { value: fabric.translucency }, clothReverse: { value: fabric.reverse } };
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms, gathering?.uniforms);
    if (gathering) shader.vertexShader = gatherNormals(shader.vertexShader);
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <lights_physical_pars_fragment>", `#include <lights_physical_pars_fragment>\n${kPassedLight}`)
      .replace("#include <map_fragment>", "#include <map_fragment>\nif (!gl_FrontFacing) diffuseColor.rgb *= clothReverse;");
  };
  // All fabrics share one program per set of features.
  material.customProgramCacheKey = () => (gathering ? "cloth with gathered normals" : "cloth");
}

const kPassedLight = /* glsl */ `
uniform float clothTranslucency;
uniform float clothReverse;
void RE_Direct_Cloth(const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal,
    const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material,
    inout ReflectedLight reflectedLight) {
  RE_Direct_Physical(directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight);
  float behind = saturate(-dot(geometryNormal, directLight.direction));
  reflectedLight.directDiffuse += clothTranslucency * behind * directLight.color * BRDF_Lambert(material.diffuseContribution);
}
#undef RE_Direct
#define RE_Direct RE_Direct_Cloth
`;

interface Textures {
  colour: THREE.DataTexture;
  relief: THREE.DataTexture;
  roughness: THREE.DataTexture;
}

// Textures are kept for the life of the page: one set per fabric.
const made = new Map<string, Textures>();

function texturesOf(fabric: Fabric, detail: Detail): Textures {
  const key = [fabric.pattern, fabric.pitch, fabric.weft, fabric.variation, detail].join(" ");
  let textures = made.get(key);
  if (!textures) {
    const surface = weave(fabric, kTexels[detail]);
    const texture = (texels: Uint8Array, colourSpace: THREE.ColorSpace) => tiled(texels, surface.size, kThreads * fabric.pitch, colourSpace, kAnisotropy[detail]);
    textures = {
      colour: texture(surface.colour, THREE.SRGBColorSpace),
      relief: texture(surface.relief, THREE.NoColorSpace),
      roughness: texture(surface.roughness, THREE.NoColorSpace),
    };
    made.set(key, textures);
  }
  return textures;
}

// Texture of RGBA texels that repeats after `metres`, for coordinates in metres. `anisotropy` is the largest number of
// samples for slanted surfaces.
export function tiled(
  texels: Uint8Array,
  size: number,
  metres: number,
  colourSpace: THREE.ColorSpace,
  anisotropy: number,
): THREE.DataTexture {
  const texture = new THREE.DataTexture(texels, size, size);
  texture.repeat.setScalar(1 / metres);
  texture.colorSpace = colourSpace;
  texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
  texture.magFilter = THREE.LinearFilter;
  texture.minFilter = THREE.LinearMipmapLinearFilter;
  texture.generateMipmaps = true;
  texture.anisotropy = anisotropy;
  texture.needsUpdate = true;
  return texture;
}
