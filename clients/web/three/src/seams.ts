// SPDX-License-Identifier: MIT
// Duplicates vertices at texture seams, because a drawn vertex has one texture coordinate.

export interface DrawnVertices {
  count: number;
  indices: Uint32Array; // three drawn vertices per triangle
  copies: Uint32Array; // original vertex of each duplicate
  uvs: Uint32Array; // texture coordinate of each drawn vertex; all 0 without coordinates
}

// `corners` holds one vertex per corner. `uvIndices` holds one texture coordinate per corner, or is empty.
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
