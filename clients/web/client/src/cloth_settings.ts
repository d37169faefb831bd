// SPDX-License-Identifier: MIT
// Parameters of cloths and of the environment that can change while a scene runs.

import { CS_CLOTH_SETTINGS_VERSION, cs_cloth_settings } from "./layout";
import { kClothParameters } from "./tables";
import type { CoreHandle } from "./handle";

// Settings of the solver of a cloth. Undefined: the solver does not have it, or the server chooses it.
export interface SolverSettings {
  solver: number; // key of Solvers
  bendConstraints?: boolean;
  iterations?: number;
  tolerance?: number;
  compliance?: number; // m/N
  activation?: number; // fraction of the rest length
  assembled?: boolean;
}

export interface ClothSettings extends SolverSettings {
  // One for each row of kClothParameters. Undefined: the cloth does not have it.
  numbers: (number | undefined)[];
}

export interface ClothChange extends Partial<SolverSettings> {
  // Index in kClothParameters and new value.
  numbers?: readonly (readonly [number, number])[];
}

export interface AirChange {
  airDensity?: number; // kg/m^3
  wind?: readonly [number, number, number]; // m/s
  gravity?: readonly [number, number, number]; // m/s^2
}

const kReals = ["tolerance", "compliance", "activation"] as const;
const kFlags = { bendConstraints: cs_cloth_settings.bend_constraints, assembled: cs_cloth_settings.assembled } as const;

export class Settings {
  constructor(private readonly handle: CoreHandle) {}

  // Settings of a cloth by its index; undefined before the description.
  of(cloth: number): ClothSettings | undefined {
    const at = this.handle.prepared(CS_CLOTH_SETTINGS_VERSION);
    if (this.handle.core.exports.cs_get_cloth_settings(this.handle.pointer, cloth, at) === 0) return undefined;
    const view = this.handle.core.view();
    const real = (offset: number): number | undefined => {
      const value = view.getFloat32(this.handle.scratch + offset, true);
      return Number.isNaN(value) ? undefined : value;
    };
    const settings: ClothSettings = {
      numbers: kClothParameters.map(({ offset }) => real(offset)),
      solver: view.getUint32(this.handle.scratch + cs_cloth_settings.solver, true),
    };
    for (const name of kReals) {
      const value = real(cs_cloth_settings[name]);
      if (value !== undefined) settings[name] = value;
    }
    const iterations = view.getUint32(this.handle.scratch + cs_cloth_settings.iterations, true);
    if (iterations > 0) settings.iterations = iterations;
    for (const name of ["bendConstraints", "assembled"] as const) {
      const flag = view.getInt32(this.handle.scratch + kFlags[name], true);
      if (flag >= 0) settings[name] = flag !== 0;
    }
    return settings;
  }

  // Changes a cloth; an empty name means every cloth. Undefined members stay.
  change(cloth: string, change: ClothChange): void {
    this.handle.core.exports.cs_keep_cloth_settings(this.handle.scratch);
    const view = this.handle.core.view();
    const set = (offset: number, value: number) => view.setFloat32(this.handle.scratch + offset, value, true);
    for (const [index, value] of change.numbers ?? []) set(kClothParameters[index]!.offset, value);
    for (const name of kReals) if (change[name] !== undefined) set(cs_cloth_settings[name], change[name]);
    if (change.solver !== undefined) view.setUint32(this.handle.scratch + cs_cloth_settings.solver, change.solver, true);
    if (change.iterations !== undefined) view.setUint32(this.handle.scratch + cs_cloth_settings.iterations, change.iterations, true);
    for (const name of ["bendConstraints", "assembled"] as const)
      if (change[name] !== undefined) view.setInt32(this.handle.scratch + kFlags[name], change[name] ? 1 : 0, true);
    this.handle.core.with([cloth], (name) => this.handle.core.exports.cs_set_cloth(this.handle.pointer, name!, this.handle.scratch));
  }

  changeAir({ gravity, wind, airDensity }: AirChange): void {
    const density = airDensity === undefined ? undefined : [airDensity];
    this.handle.core.with([gravity, wind, density], (down, along, mass) =>
      this.handle.core.exports.cs_set_environment(this.handle.pointer, down!, along!, mass!),
    );
  }
}
