// SPDX-License-Identifier: MIT
// The pinned vertices of a mesh, changed in steps that can be undone.

import { VertexNumbers } from "./vertex_numbers";

export class PinSet {
  // 1 for pinned vertices, 0 for others.
  readonly numbers: VertexNumbers;
  private pinned = 0;

  constructor(vertexCount: number, pinned: readonly number[] = []) {
    this.numbers = new VertexNumbers(vertexCount, 0, (before, after) => (this.pinned += after - before));
    for (const vertex of pinned) this.numbers.set(vertex, 1);
  }

  get count(): number {
    return this.pinned;
  }
  get canUndo(): boolean {
    return this.numbers.canUndo;
  }

  // Indices of the pinned vertices, ascending.
  list(): Uint32Array {
    const list = new Uint32Array(this.pinned);
    let next = 0;
    this.numbers.values.forEach((isPinned, vertex) => {
      if (isPinned) list[next++] = vertex;
    });
    return list;
  }

  // Pins exactly these vertices, as one step. Returns whether any has changed.
  replace(vertices: readonly number[]): boolean {
    const wanted = new Uint8Array(this.numbers.values.length);
    for (const vertex of vertices) wanted[vertex] = 1;
    const differing = (value: 0 | 1) => [...wanted.keys()].filter((vertex) => wanted[vertex] === value && this.numbers.values[vertex] !== value);
    this.begin();
    this.paint(differing(1), true);
    this.paint(differing(0), false);
    return this.end();
  }

  begin(): void {
    this.numbers.begin();
  }

  // Pins or frees vertices. Returns whether any has changed. Does nothing outside of a step.
  paint(vertices: readonly number[], pins: boolean): boolean {
    return this.numbers.paint(vertices, Number(pins));
  }

  end(): boolean {
    return this.numbers.end();
  }

  cancel(): void {
    this.numbers.cancel();
  }

  undo(): void {
    this.numbers.undo();
  }
}
