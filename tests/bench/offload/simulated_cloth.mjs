// SPDX-License-Identifier: MIT
// A client that simulates the cloth itself (client_cloth.cpp).
import { copyIn } from "./case.mjs";

export class SimulatedCloth {
  constructor(module, of, solver) {
    this.module = module;
    this.of = of;
    const settings = copyIn(module, Float32Array.from(of.settings));
    this.cloth = module.cloth_create(solver === "xpbd" ? 1 : 0, of.rows, of.columns, settings);
    module.free(settings);
    this.masses = copyIn(module, of.floats(of.inverseMasses));
    this.poses = module.malloc(24);
    this.ball = of.floats(of.ball);
    this.setState(of.floats(of.start));
  }

  destroy() {
    this.module.cloth_destroy(this.cloth);
    this.module.free(this.masses);
    this.module.free(this.poses);
  }

  setState(state) {
    const pointer = copyIn(this.module, state);
    this.module.cloth_set(this.cloth, pointer, this.masses);
    this.module.free(pointer);
  }

  // Simulates one frame and makes its positions and normals.
  frame(tick) {
    new Float32Array(this.module.memory.buffer, this.poses, 6).set(this.ball.subarray(3 * tick, 3 * tick + 6));
    this.module.cloth_tick(this.cloth, this.of.substeps, this.poses, this.poses + 12);
    this.module.cloth_present(this.cloth);
  }

  // The part of frame() that does not depend on the number of substeps.
  present() {
    this.module.cloth_present(this.cloth);
  }

  positions() {
    return new Float32Array(this.module.memory.buffer, this.module.cloth_positions(this.cloth), 3 * this.of.vertices);
  }
  normals() {
    return new Float32Array(this.module.memory.buffer, this.module.cloth_normals(this.cloth), 3 * this.of.vertices);
  }
}

// Largest distance between the vectors of two arrays.
export function largestDistance(a, b) {
  let largest = 0;
  for (let at = 0; at < a.length; at += 3) {
    const distance = Math.hypot(a[at] - b[at], a[at + 1] - b[at + 1], a[at + 2] - b[at + 2]);
    if (!(distance <= largest)) largest = distance;
  }
  return largest;
}

// Simulates one tick in which the ball pushes the cloth, and compares it with the double-precision reference.
// Throws if it differs by more than the rounding of floats explains.
export function checkSimulation(module, of, solver) {
  const cloth = new SimulatedCloth(module, of, solver);
  cloth.setState(of.floats(of.check.start));
  cloth.frame(of.check.tick);
  const expected = of.check[solver];
  const distance = largestDistance(cloth.positions(), of.floats(expected.positions));
  // A normal follows from differences across a cell, whose ends have this tolerance each.
  const turn = largestDistance(cloth.normals(), of.floats(expected.normals));
  const most = (8 * of.tolerance) / of.settings[0];
  cloth.destroy();
  if (!(distance <= of.tolerance))
    throw new Error(`${solver}: a node is ${distance} m from its place in the reference; at most ${of.tolerance} m are allowed`);
  if (!(turn <= most)) throw new Error(`${solver}: a normal differs by ${turn} from the reference; at most ${most} is allowed`);
  return { distance, turn };
}
