// SPDX-License-Identifier: MIT
// The pinned vertices of a mesh, changed in steps that can be undone.

const kMostSteps = 100;
// Changes of all steps that are kept. The newest step is always kept.
const kMostChanges = 8e6;

export class PinSet {
  private readonly mask: Uint8Array;
  private pinned = 0;
  private readonly steps: number[][] = []; // the vertices that each step has changed
  private changes = 0; // of all steps
  private open: number[] | undefined; // the step that is under way

  constructor(vertexCount: number, pinned: readonly number[] = []) {
    this.mask = new Uint8Array(vertexCount);
    for (const vertex of pinned) if (!this.mask[vertex]) this.set(vertex);
  }

  get count(): number {
    return this.pinned;
  }
  get canUndo(): boolean {
    return this.steps.length > 0;
  }

  // Indices of the pinned vertices, ascending.
  list(): Uint32Array {
    const list = new Uint32Array(this.pinned);
    let next = 0;
    this.mask.forEach((isPinned, vertex) => {
      if (isPinned) list[next++] = vertex;
    });
    return list;
  }

  // Pins exactly these vertices, as one step.
  replace(vertices: readonly number[]): void {
    const wanted = new Uint8Array(this.mask.length);
    for (const vertex of vertices) wanted[vertex] = 1;
    this.begin();
    wanted.forEach((isWanted, vertex) => {
      if (isWanted !== this.mask[vertex]) this.flip(vertex);
    });
    this.end();
  }

  // Starts a step. paint() adds to it until end() or cancel().
  begin(): void {
    this.end();
    this.open = [];
  }

  // Pins or frees vertices. Returns whether any has changed. Does nothing outside of a step.
  paint(vertices: readonly number[], pins: boolean): boolean {
    if (!this.open) return false;
    const before = this.open.length;
    for (const vertex of vertices) if (this.mask[vertex] !== Number(pins)) this.flip(vertex);
    return this.open.length > before;
  }

  end(): void {
    const step = this.open;
    this.open = undefined;
    if (!step || step.length === 0) return;
    this.steps.push(step);
    this.changes += step.length;
    while (this.steps.length > 1 && (this.steps.length > kMostSteps || this.changes > kMostChanges))
      this.changes -= this.steps.shift()!.length;
  }

  // Takes back the step that is under way.
  cancel(): void {
    const step = this.open;
    this.open = undefined;
    if (step) this.revert(step);
  }

  // Takes back the newest step.
  undo(): void {
    this.cancel();
    const step = this.steps.pop();
    if (!step) return;
    this.changes -= step.length;
    this.revert(step);
  }

  private flip(vertex: number): void {
    this.set(vertex);
    this.open!.push(vertex);
  }

  // A step may contain a vertex several times.
  private revert(step: readonly number[]): void {
    for (const vertex of step) this.set(vertex);
  }

  private set(vertex: number): void {
    this.mask[vertex] = this.mask[vertex] ? 0 : 1;
    this.pinned += this.mask[vertex] ? 1 : -1;
  }
}
