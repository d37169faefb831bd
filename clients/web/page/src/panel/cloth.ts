// SPDX-License-Identifier: MIT
// One cloth: material, solver and its settings, every number that can change, and the simulation's report.

import { kClothParameters, kSettings, Solvers, type Client, type ClothChange, type ClothReport, type NumberRange } from "@clothstream/client";
import { element, make, write } from "./dom";
import { NumberRow } from "./number_row";

const kFigures = ["nodes", "strain max", "strain p99", "strain mean", "constraints", "iterations", "residual", "energy", "penetration"] as const;
type Figure = (typeof kFigures)[number];

// Settings of solvers that are numbers.
const kXpbd = 4;
const kSolverNumbers = [
  ["iterations", "Iterations", "Most iterations of the solver in a substep"],
  ["tolerance", "Tolerance", "Relative residual at which the solver stops"],
  ["compliance", "Compliance", "Stretch of the constraints under force"],
  ["activation", "Activation", "Stretch at which a spring becomes a constraint, as a fraction of its length"],
] as const;

export class ClothPanel {
  private readonly cloth = element<HTMLSelectElement>("cloth");
  private readonly material = element<HTMLSelectElement>("material");
  private readonly solver = element<HTMLSelectElement>("solver");
  private readonly deviceMs = element("device-ms");
  private readonly constraints = element<HTMLInputElement>("draw-constraints");
  private readonly figures = new Map<Figure, HTMLElement>();
  private readonly rows = kClothParameters.map(
    (row) => new NumberRow(`number-${row.option}`, row.option.replaceAll("-", " "), row.help, row),
  );
  private solverRows = new Map<(typeof kSolverNumbers)[number][0], NumberRow>();
  private readonly solverPart = make("details", { open: true }, make("summary", {}, "Solver"));
  private shownSolver = 0;
  private readonly chosen: ((client: Client) => void)[] = [];
  private isTouched = false; // a person has used a number since the last apply()

  constructor() {
    const parameters = element("parameters");
    for (const event of ["input", "change"]) parameters.addEventListener(event, () => (this.isTouched = true));
    parameters.append(this.solverPart);
    for (const group of new Set(kClothParameters.map((row) => row.group))) {
      const rows = this.rows.filter((_, index) => kClothParameters[index]!.group === group).map((row) => row.root);
      parameters.append(make("details", {}, make("summary", {}, group), ...rows));
    }
    for (const figure of kFigures) {
      const value = make("dd", {}, "–");
      value.dataset["figure"] = figure;
      element("report").append(make("div", {}, make("dt", {}, figure), value));
      this.figures.set(figure, value);
    }
    this.solver.append(...Array.from(Solvers, ([kind, label]) => new Option(label, String(kind))));
    this.cloth.addEventListener("change", () => this.chosen.push((client) => this.show(client)));
    this.material.addEventListener("change", () => {
      const { value } = this.material;
      this.chosen.push((client) => client.parameters.setMaterial(this.name, value));
    });
    this.constraints.addEventListener("change", () => {
      const { checked } = this.constraints;
      this.chosen.push((client) => client.parameters.wantConstraints(checked));
    });
    this.solver.addEventListener("change", () => {
      const solver = Number(this.solver.value);
      this.chosen.push((client) => client.settings.change(this.name, { solver }));
    });
  }

  // Lists the cloths of a new description.
  describe(client: Client): void {
    this.chosen.length = 0;
    const cloths = client.frames.cloths();
    this.cloth.replaceChildren(...cloths.map(({ name }) => new Option(name)));
    element("cloth-row").hidden = cloths.length < 2;
    const none = new Option("no material", "");
    none.disabled = true;
    this.material.replaceChildren(none, ...client.parameters.materials().map((name) => new Option(name.replaceAll("_", " "), name)));
    if (this.drawsConstraints) client.parameters.wantConstraints(true);
    this.show(client);
  }

  get drawsConstraints(): boolean {
    return this.constraints.checked;
  }

  // Shows the current parameters of the chosen cloth.
  show(client: Client): void {
    const index = this.cloth.selectedIndex;
    const settings = index < 0 ? undefined : client.settings.of(index);
    if (!settings) return;
    this.material.value = client.parameters.material(index);
    if (!Solvers.has(settings.solver) && !this.solver.querySelector(`option[value="${settings.solver}"]`))
      this.solver.append(new Option(`solver ${settings.solver}`, String(settings.solver)));
    this.solver.value = String(settings.solver);
    this.rows.forEach((row, number) => row.show(settings.numbers[number]));
    if (settings.solver !== this.shownSolver) this.buildSolverRows(settings.solver);
    for (const [name, row] of this.solverRows) row.show(settings[name]);
    this.solverPart.hidden = ![...this.solverRows.keys()].some((name) => settings[name] !== undefined);
    write(this.figures.get("nodes")!, client.frames.cloths()[index]!.vertexCount.toLocaleString("en"));
  }

  // Shows the newest report.
  showReport(client: Client): void {
    const report = client.parameters.report(this.cloth.selectedIndex);
    if (!report) return;
    for (const [figure, text] of texts(report)) write(this.figures.get(figure)!, text);
    write(this.deviceMs, `${report.deviceMs.toFixed(1)} ms per tick`);
  }

  // Sends changes to the client. Call once per drawn frame.
  apply(client: Client): void {
    if (this.chosen.length > 0) for (const change of this.chosen.splice(0)) change(client);
    if (this.isTouched) this.sendNumbers(client);
  }

  private sendNumbers(client: Client): void {
    this.isTouched = false;
    const change: ClothChange = {};
    const numbers: [number, number][] = [];
    this.rows.forEach((row, index) => {
      const value = row.takeChange();
      if (value !== undefined) numbers.push([index, value]);
    });
    for (const [name, row] of this.solverRows) {
      const value = row.takeChange();
      if (value !== undefined) change[name] = value;
    }
    if (numbers.length > 0) change.numbers = numbers;
    if (Object.keys(change).length > 0) client.settings.change(this.name, change);
  }

  // Ranges depend on the solver.
  private buildSolverRows(solver: number): void {
    this.shownSolver = solver;
    for (const row of this.solverRows.values()) row.root.remove();
    this.solverRows = new Map(
      kSolverNumbers.map(([name, label, help]) => {
        const range: NumberRange = name === "iterations" && solver === kXpbd ? kSettings.xpbdIterations : kSettings[name];
        return [name, new NumberRow(`solver-${name}`, label, help, range, name === "iterations")];
      }),
    );
    this.solverPart.append(...[...this.solverRows.values()].map((row) => row.root));
  }

  private get name(): string {
    return this.cloth.value;
  }
}

function texts(report: ClothReport): [Figure, string][] {
  const percent = (part: number) => `${(100 * part).toFixed(2)} %`;
  const solved = report.iterations > 0 || report.activeConstraints > 0;
  return [
    ["strain max", percent(report.strainMax)],
    ["strain p99", percent(report.strainP99)],
    ["strain mean", percent(report.strainMean)],
    ["constraints", solved ? report.activeConstraints.toLocaleString("en") : "none"],
    ["iterations", solved ? String(report.iterations) : "none"],
    ["residual", solved ? report.residual.toPrecision(2) : "none"],
    ["energy", `${(report.kineticEnergy + report.elasticEnergy + report.gravityEnergy).toFixed(3)} J`],
    ["penetration", report.penetration > 0 ? `${(1000 * report.penetration).toPrecision(2)} mm` : "none"],
  ];
}
