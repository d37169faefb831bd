// SPDX-License-Identifier: MIT
// What a glTF or GLB file says about itself, checked before anything is decoded.

const kMagic = 0x46546c67; // "glTF"
const kHeaderBytes = 20; // of a GLB file with the header of its first part

interface Json {
  asset?: { version?: unknown };
  extensionsUsed?: unknown;
  accessors?: { count?: unknown }[];
  meshes?: { primitives?: { attributes?: Record<string, unknown>; indices?: unknown }[] }[];
}

// Throws an Error for people if the file is not glTF 2.0, is compressed with meshopt, or states more than `mostVertices`
// vertices or six times as many indices.
export function checkGltf(bytes: ArrayBuffer, name: string, mostVertices: number): void {
  const json = jsonOf(bytes, name);
  const version = json.asset?.version;
  if (version === undefined || /^1(\.|$)/.test(String(version))) throw old(name, "1.0");
  if (!/^2(\.|$)/.test(String(version))) throw old(name, String(version).slice(0, 10));
  const used = Array.isArray(json.extensionsUsed) ? json.extensionsUsed.map(String) : [];
  if (used.some((extension) => /meshopt/i.test(extension)))
    throw new Error(`${name} is compressed with meshopt, which is not supported. Export it without compression, or with Draco.`);
  const count = (accessor: unknown) => Number(json.accessors?.[Number(accessor)]?.count ?? 0);
  let [vertices, indices] = [0, 0];
  for (const mesh of json.meshes ?? []) {
    for (const { attributes, indices: index } of mesh.primitives ?? []) {
      vertices += count(attributes?.["POSITION"]);
      indices += index === undefined ? 0 : count(index);
    }
  }
  if (!(vertices <= mostVertices && indices <= 6 * mostVertices))
    throw new Error(`${name} has more than ${mostVertices.toLocaleString("en")} vertices. Simplify it.`);
}

function jsonOf(bytes: ArrayBuffer, name: string): Json {
  const view = new DataView(bytes);
  let text = new Uint8Array(bytes);
  if (bytes.byteLength >= kHeaderBytes && view.getUint32(0, true) === kMagic) {
    if (view.getUint32(4, true) === 1) throw old(name, "1.0");
    text = text.subarray(kHeaderBytes, kHeaderBytes + view.getUint32(12, true));
  }
  try {
    const json: unknown = JSON.parse(new TextDecoder().decode(text));
    if (typeof json === "object" && json !== null) return json as Json;
  } catch {
    // Explained below.
  }
  throw new Error(`${name} cannot be read: it is not glTF, or a part of it is missing.`);
}

function old(name: string, version: string): Error {
  return new Error(`${name} is glTF ${version}, which is not supported. Convert it to glTF 2.0, or export it again as glTF 2.0.`);
}
