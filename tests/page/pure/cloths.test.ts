// SPDX-License-Identifier: MIT
// The cloths of a client as three.js meshes.

import * as THREE from "three";
import { assert, test } from "vitest";
import type { Client, ClothLayout, Drawing } from "@clothstream/client";
import { Cloths } from "@clothstream/three";

// A client with a grid of 2 x 2 vertices, and two triangles whose common first corner has two texture coordinates.
class FakeFrames {
  vertexCount = 8;
  shownAt = 0;
  private readonly layouts: ClothLayout[] = [
    { name: "grid", firstVertex: 0, vertexCount: 4, rows: 2, columns: 2, firstIndex: 0, indexCount: 6 },
    { name: "mesh", firstVertex: 4, vertexCount: 4, rows: 0, columns: 0, firstIndex: 6, indexCount: 6 },
  ];
  cloths(): ClothLayout[] {
    return this.layouts;
  }
  drawing(cloth: number): Drawing {
    if (cloth === 0) return { uvs: new Float32Array(), uvIndices: new Uint32Array(), submeshes: [] };
    return {
      uvs: Float32Array.of(0, 0, 1, 0, 0, 1, 1, 1, 0.5, 0.5),
      uvIndices: Uint32Array.of(0, 2, 1, 4, 2, 3),
      submeshes: [
        { name: "front", firstIndex: 6, indexCount: 3 },
        { name: "back", firstIndex: 9, indexCount: 3 },
      ],
    };
  }
  // Both cloths are squares of 2 m.
  positions(): Float32Array {
    return Float32Array.of(0, 2, 0, 2, 2, 0, 0, 0, 0, 2, 0, 0, 5, 2, 0, 7, 2, 0, 5, 0, 0, 7, 0, 0);
  }
  triangles(): Uint32Array {
    return Uint32Array.of(0, 2, 1, 1, 2, 3, 4, 6, 5, 4, 6, 7);
  }
  showAt(time: number): void {
    this.shownAt = time;
  }
  shownPositions(): Float32Array {
    return this.positions().map((value) => value + this.shownAt);
  }
  shownNormals(): Float32Array {
    return new Float32Array(24).fill(1);
  }
}

function described(): { cloths: Cloths; frames: FakeFrames; client: Client } {
  const frames = new FakeFrames();
  const client = { frames, parameters: { material: () => "cotton" } } as unknown as Client;
  const cloths = new Cloths("reduced");
  cloths.describe(client);
  return { cloths, frames, client };
}

const attribute = (mesh: THREE.Mesh, name: string) => [...mesh.geometry.getAttribute(name).array];

test("there is a mesh for each cloth, with a group for each submesh", () => {
  const { cloths, client } = described();
  assert.deepEqual(cloths.meshes.map(({ geometry }) => geometry.groups.length), [1, 2]);
  assert.deepEqual(cloths.meshes.map(({ geometry }) => [...geometry.index!.array]), [[0, 2, 1, 1, 2, 3], [0, 2, 1, 4, 2, 3]]);
  cloths.describe(client);
  assert.deepEqual(cloths.group.children, cloths.meshes);
  assert.lengthOf(cloths.meshes, 2);
  cloths.dispose();
  assert.lengthOf(cloths.group.children, 0);
});

test("texture coordinates are metres", () => {
  const [grid, mesh] = described().cloths.meshes;
  assert.deepEqual(attribute(grid!, "uv").map(Math.abs), [0, 0, 2, 0, 0, 2, 2, 2]);
  // The triangles have 4 m^2, and an area of 3/4 in the texture.
  const uv = attribute(mesh!, "uv");
  assert.closeTo(uv[2]!, Math.sqrt(4 / 0.75), 1e-5);
});

test("vertices follow the shown frame, also the copies at seams", () => {
  const { cloths, client } = described();
  assert.isTrue(cloths.show(client, 100));
  const [grid, mesh] = cloths.meshes;
  assert.deepEqual(attribute(grid!, "position").slice(0, 3), [100, 102, 100]);
  const positions = attribute(mesh!, "position");
  assert.lengthOf(positions, 15);
  assert.deepEqual(positions.slice(12), positions.slice(0, 3));
  assert.deepEqual(positions.slice(0, 3), [105, 102, 100]);
});

test("a client that is joining and has no cloths changes nothing", () => {
  const { cloths, client, frames } = described();
  cloths.show(client, 100);
  frames.vertexCount = 0;
  assert.isFalse(cloths.show(client, 200));
  assert.equal(frames.shownAt, 100);
});

test("the reach holds all cloths", () => {
  const { min, max } = described().cloths.reach();
  assert.isTrue(min.x <= 0 && max.x >= 7 && min.y < 0 && max.y >= 2);
});

// A compiler that ends when the test says so.
class FakeCompiler {
  readonly objects: THREE.Mesh[] = [];
  private readonly ends: (() => void)[] = [];
  readonly compile = (object: THREE.Object3D): Promise<void> => {
    this.objects.push(object as THREE.Mesh);
    return new Promise((end) => this.ends.push(end));
  };
  end(): void {
    for (const end of this.ends.splice(0)) end();
  }
}

const materials = (cloths: Cloths) => cloths.meshes.flatMap((mesh) => mesh.material as THREE.MeshPhysicalMaterial[]);
const haveSheen = (cloths: Cloths) => materials(cloths).map((material) => material.sheen > 0);
function disposed(list: THREE.Material[]): () => number {
  let count = 0;
  for (const material of list) material.addEventListener("dispose", () => ++count);
  return () => count;
}

test("detail is shown as soon as its materials are compiled, and not before", async () => {
  const { cloths } = described();
  const compiler = new FakeCompiler();
  const old = disposed(materials(cloths));
  const refined = cloths.refine("full", compiler.compile);
  assert.deepEqual(haveSheen(cloths), [false, false, false]);
  assert.deepEqual(compiler.objects.map(({ geometry }) => geometry), cloths.meshes.map(({ geometry }) => geometry));
  assert.isTrue(compiler.objects.every(({ receiveShadow }) => receiveShadow));
  assert.equal(old(), 0);
  compiler.end();
  await refined;
  assert.deepEqual(haveSheen(cloths), [true, true, true]);
  assert.equal(old(), 3);
});

test("a material that is chosen while another detail is compiled stays", async () => {
  const { cloths, client } = described();
  const compiler = new FakeCompiler();
  const refined = cloths.refine("full", compiler.compile);
  client.parameters.material = () => "silk";
  cloths.dress(client);
  const chosen = materials(cloths);
  const kept = disposed(chosen);
  const compiled = disposed(compiler.objects.flatMap(({ material }) => material));
  compiler.end();
  await refined;
  assert.deepEqual(materials(cloths), chosen);
  assert.deepEqual(haveSheen(cloths), [true, true, true]);
  assert.deepEqual([kept(), compiled()], [0, 3]);
});

test("cloths of a new description have the detail, and compiled materials of the old ones are disposed of", async () => {
  const { cloths, client } = described();
  const compiler = new FakeCompiler();
  const refined = cloths.refine("full", compiler.compile);
  cloths.describe(client);
  const compiled = disposed(compiler.objects.flatMap(({ material }) => material));
  compiler.end();
  await refined;
  assert.deepEqual(haveSheen(cloths), [true, true, true]);
  assert.equal(compiled(), 3);
});
