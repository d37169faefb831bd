// SPDX-License-Identifier: MIT
// Environment, materials, solvers and reports of the cloths.

import { CS_CLOTH_REPORT_VERSION, CS_CLOTH_SETTINGS_VERSION, CS_ENVIRONMENT_VERSION, cs_cloth_report, cs_cloth_settings, cs_collider_change, cs_environment } from "./layout";
import { nowUs, spring, vec3, writeFloats, type CoreHandle } from "./handle";
import type { ClothParameters, ClothReport, ColliderChange, Environment, Vec3 } from "./types";

export class Parameters {
  constructor(private readonly handle: CoreHandle) {}

  // Current environment; undefined before the description.
  environment(): Environment | undefined {
    if (this.handle.core.exports.cs_get_environment(this.handle.pointer, this.handle.prepared(CS_ENVIRONMENT_VERSION)) === 0) return undefined;
    const view = this.handle.core.view();
    return {
      gravity: vec3(view, this.handle.scratch + cs_environment.gravity),
      wind: vec3(view, this.handle.scratch + cs_environment.wind),
      airDensity: view.getFloat32(this.handle.scratch + cs_environment.air_density, true),
      gustStrength: view.getFloat32(this.handle.scratch + cs_environment.gust_strength, true),
      gustSeconds: view.getFloat32(this.handle.scratch + cs_environment.gust_seconds, true),
    };
  }

  // Current parameters of each cloth.
  clothParameters(): ClothParameters[] {
    const count = this.handle.core.exports.cs_cloth_count(this.handle.pointer);
    return this.handle.list(count, CS_CLOTH_SETTINGS_VERSION, this.handle.core.exports.cs_get_cloth_settings, (view, at) => ({
      structural: spring(view, at + cs_cloth_settings.structural),
      shear: spring(view, at + cs_cloth_settings.shear),
      bend: spring(view, at + cs_cloth_settings.bend),
      damping: view.getFloat32(at + cs_cloth_settings.damping, true),
    }));
  }

  // Solver of a cloth as a cs_solver.
  solver(cloth: number): number {
    const at = this.handle.prepared(CS_CLOTH_SETTINGS_VERSION);
    if (this.handle.core.exports.cs_get_cloth_settings(this.handle.pointer, cloth, at) === 0) return 0;
    return this.handle.core.view().getUint32(this.handle.scratch + cs_cloth_settings.solver, true);
  }

  // Selects a solver. The cloth keeps the settings that it last had for this solver, or the defaults.
  setSolver(cloth: string, solver: number): void {
    this.handle.core.exports.cs_keep_cloth_settings(this.handle.scratch);
    this.handle.core.view().setUint32(this.handle.scratch + cs_cloth_settings.solver, solver, true);
    this.handle.core.with([cloth], (name) => this.handle.core.exports.cs_set_cloth(this.handle.pointer, name!, this.handle.scratch));
  }

  // Names of the available materials. material() is the material of a cloth, or "".
  materials(): string[] {
    const count = this.handle.core.exports.cs_material_count(this.handle.pointer);
    return Array.from({ length: count }, (_, index) => this.handle.core.text(this.handle.core.exports.cs_material(this.handle.pointer, index)));
  }

  material(cloth: number): string {
    return this.handle.core.text(this.handle.core.exports.cs_cloth_material(this.handle.pointer, cloth));
  }

  setMaterial(cloth: string, material: string): void {
    this.handle.core.with([cloth, material], (name, chosen) => this.handle.core.exports.cs_set_material(this.handle.pointer, name!, chosen!));
  }

  setGust(strength: number, seconds: number): void {
    this.handle.core.exports.cs_set_gust(this.handle.pointer, strength, seconds);
  }

  // Newest report of a cloth; undefined before the first.
  report(cloth: number): ClothReport | undefined {
    const at = this.handle.prepared(CS_CLOTH_REPORT_VERSION);
    if (this.handle.core.exports.cs_get_cloth_report(this.handle.pointer, cloth, at) === 0) return undefined;
    const view = this.handle.core.view();
    const real = (offset: number) => view.getFloat32(this.handle.scratch + offset, true);
    return {
      activeConstraints: view.getUint32(this.handle.scratch + cs_cloth_report.active_constraints, true),
      iterations: view.getUint32(this.handle.scratch + cs_cloth_report.iterations, true),
      residual: real(cs_cloth_report.residual),
      strainMax: real(cs_cloth_report.strain_max),
      strainP99: real(cs_cloth_report.strain_p99),
      strainMean: real(cs_cloth_report.strain_mean),
      kineticEnergy: real(cs_cloth_report.kinetic_energy),
      elasticEnergy: real(cs_cloth_report.elastic_energy),
      gravityEnergy: real(cs_cloth_report.gravity_energy),
      penetration: real(cs_cloth_report.penetration),
      deviceMs: real(cs_cloth_report.device_ms),
      tick: Number(view.getBigUint64(this.handle.scratch + cs_cloth_report.tick, true)),
    };
  }

  // Asks for reports that name the active constraints, or for such reports to end. Default: no names.
  wantConstraints(wants: boolean): void {
    this.handle.core.exports.cs_want_constraints(this.handle.pointer, wants ? 1 : 0, nowUs());
  }

  // Ends of the active constraints of a cloth with ACAD in the newest report: two vertices for each, numbered from the
  // cloth's first vertex. At most 16,384 constraints. A view, valid until the next call.
  constraintEnds(cloth: number): Uint32Array {
    const { core, pointer, scratch } = this.handle;
    const ends = core.exports.cs_constraint_ends(pointer, cloth, scratch);
    return core.indices(ends, 2 * core.view().getUint32(scratch, true));
  }

  setEnvironment(change: { gravity?: Vec3; wind?: Vec3 }): void {
    this.handle.core.with([change.gravity, change.wind], (gravity, wind) =>
      this.handle.core.exports.cs_set_environment(this.handle.pointer, gravity!, wind!, 0),
    );
  }

  // Changes a cloth. An empty name means every cloth.
  setCloth(cloth: string, change: Partial<ClothParameters>): void {
    const { scratch } = this.handle;
    this.handle.core.exports.cs_keep_cloth_settings(scratch);
    const view = this.handle.core.view();
    for (const name of ["structural", "shear", "bend"] as const)
      if (change[name]) writeFloats(view, scratch + cs_cloth_settings[name], change[name]);
    if (change.damping !== undefined) view.setFloat32(scratch + cs_cloth_settings.damping, change.damping, true);
    this.handle.core.with([cloth], (name) => this.handle.core.exports.cs_set_cloth(this.handle.pointer, name!, scratch));
  }

  // Changes the mass per area of a cloth, kg/m^2. An empty name means every cloth.
  setArealMass(cloth: string, arealMass: number): void {
    this.handle.core.with([cloth], (name) => this.handle.core.exports.cs_set_areal_mass(this.handle.pointer, name!, arealMass));
  }

  // Changes a collider of the scene. Undefined members stay. The server refuses numbers that the shape does not have.
  setCollider(collider: string, change: ColliderChange): void {
    this.handle.core.exports.cs_keep_collider(this.handle.scratch);
    const view = this.handle.core.view();
    const set = (offset: number, values: readonly number[]) => writeFloats(view, this.handle.scratch + offset, values);
    const { position, orientation, radius, length, size, friction } = change;
    if (position) set(cs_collider_change.position, position);
    if (orientation) set(cs_collider_change.orientation, orientation);
    if (radius !== undefined) set(cs_collider_change.radius, [radius]);
    if (length !== undefined) set(cs_collider_change.length, [length]);
    if (size) set(cs_collider_change.size, size);
    if (friction !== undefined) set(cs_collider_change.friction, [friction]);
    this.handle.core.with([collider], (name) => this.handle.core.exports.cs_set_collider(this.handle.pointer, name!, this.handle.scratch));
  }
}
