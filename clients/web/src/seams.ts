// SPDX-License-Identifier: MIT
// Vertices as a graphics card wants them: one texture coordinate each, so that those at a seam are there several times.

export interface DrawnVertices {
  count: number;
  indices: Uint32Array; // of drawn vertices, three a triangle
  copies: Uint32Array; // whose vertex each of the drawn ones beyond the cloth's own repeats
  uvs: Uint32Array; // which texture coordinate each drawn vertex has; all 0 where there are none
}

// `corners` are the cloth's vertices, `uvIndices` as many texture coordinates or none.
export function separateSeams(vertexCount: number, corners: Uint32Array, uvIndices: Uint32Array): DrawnVertices {
  const kUnused = 0xffffffff;
  const uvs = new Array<number>(vertexCount).fill(kUnused);
  const copies: number[] = [];
  const copyOf = new Map<string, number>();
  const indices = corners.map((vertex, k) => {
    const uv = uvIndices[k] ?? 0;
    if (uvs[vertex] === kUnused) uvs[vertex] = uv;
    if (uvs[vertex] === uv) return vertex;
    const key = `${vertex} ${uv}`;
    let copy = copyOf.get(key);
    if (copy === undefined) {
      copy = vertexCount + copies.length;
      copyOf.set(key, copy);
      copies.push(vertex);
      uvs[copy] = uv;
    }
    return copy;
  });
  const known = uvs.map((uv) => (uv === kUnused ? 0 : uv));
  return { count: known.length, indices, copies: Uint32Array.from(copies), uvs: Uint32Array.from(known) };
}
