// SPDX-License-Identifier: MIT
// A number for each vertex of a mesh, changed in steps that can be undone.

const kMostSteps = 100;
// Changes of all steps that are kept. The newest step is always kept.
const kMostChanges = 8e6;

interface Step {
  vertices: number[]; // may contain a vertex several times
  before: number[]; // its number before each change
}

export class VertexNumbers {
  readonly values: Float32Array;
  private readonly steps: Step[] = [];
  private changes = 0; // of all steps
  private open: Step | undefined; // the step that is under way

  // `changed` is called for each change.
  constructor(
    vertexCount: number,
    initial: number,
    private readonly changed: (before: number, after: number) => void = () => undefined,
  ) {
    this.values = new Float32Array(vertexCount).fill(initial);
  }

  get canUndo(): boolean {
    return this.steps.length > 0;
  }

  // Starts a step. paint() adds to it until end() or cancel().
  begin(): void {
    this.end();
    this.open = { vertices: [], before: [] };
  }

  // Gives vertices a number. Returns whether any has changed. Does nothing outside of a step.
  paint(vertices: readonly number[], value: number): boolean {
    if (!this.open) return false;
    const before = this.open.vertices.length;
    const rounded = Math.fround(value);
    for (const vertex of vertices) {
      if (this.values[vertex] === rounded) continue;
      this.open.vertices.push(vertex);
      this.open.before.push(this.values[vertex]!);
      this.set(vertex, rounded);
    }
    return this.open.vertices.length > before;
  }

  // Returns whether the step has changed anything, so that undo() takes it back.
  end(): boolean {
    const step = this.open;
    this.open = undefined;
    if (!step || step.vertices.length === 0) return false;
    this.steps.push(step);
    this.changes += step.vertices.length;
    while (this.steps.length > 1 && (this.steps.length > kMostSteps || this.changes > kMostChanges))
      this.changes -= this.steps.shift()!.vertices.length;
    return true;
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
    this.changes -= step.vertices.length;
    this.revert(step);
  }

  // Sets a number outside of all steps.
  set(vertex: number, value: number): void {
    const before = this.values[vertex]!;
    this.values[vertex] = value;
    this.changed(before, value);
  }

  private revert({ vertices, before }: Step): void {
    for (let i = vertices.length - 1; i >= 0; --i) this.set(vertices[i]!, before[i]!);
  }
}
