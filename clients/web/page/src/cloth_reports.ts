// SPDX-License-Identifier: MIT
// The cloths in the panel: material, solver and simulation report of each.

import { Solvers, type Client, type ClothReport } from "@clothstream/client";
import { element, write } from "./hud";

const kFigures = ["nodes", "strain max", "strain p99", "strain mean", "constraints", "iterations", "residual", "energy", "penetration"] as const;
type Figure = (typeof kFigures)[number];

interface Card {
  material: HTMLSelectElement;
  solver: HTMLSelectElement;
  figures: Map<Figure, HTMLElement>;
}

const kImplicitEuler = 5; // CS_SOLVER_IMPLICIT_EULER

export class ClothReports {
  private readonly list = element("cloths");
  private readonly deviceMs = element("device-ms");
  private cards: Card[] = [];
  // Choices of the user that are not yet sent, by cloth.
  private readonly chosen = new Map<string, number>();
  private readonly chosenMaterials = new Map<string, string>();

  // Rebuilds the list for the cloths of a new description.
  describe(client: Client): void {
    this.chosen.clear();
    this.chosenMaterials.clear();
    this.list.replaceChildren();
    this.cards = client.frames.cloths().map(({ name, vertexCount }, index) => {
      const card = this.addCard(name, index, client.parameters.materials());
      write(card.figures.get("nodes")!, vertexCount.toLocaleString("en"));
      return card;
    });
    this.showSolvers(client);
  }

  // Shows the current material and solver of each cloth.
  showSolvers(client: Client): void {
    this.cards.forEach(({ material, solver }, index) => {
      material.value = client.parameters.material(index);
      const kind = client.parameters.solver(index);
      if (!Solvers.has(kind) && solver.querySelector(`option[value="${kind}"]`) === null)
        solver.append(new Option(`solver ${kind}`, String(kind)));
      solver.value = String(kind);
    });
  }

  // Shows the newest report of each cloth.
  showReports(client: Client): void {
    this.cards.forEach(({ figures }, index) => {
      const report = client.parameters.report(index);
      if (!report) return;
      for (const [figure, text] of texts(report)) write(figures.get(figure)!, text);
      write(this.deviceMs, `${report.deviceMs.toFixed(1)} ms per tick`);
    });
  }

  // Sends choices to the client. Call once per drawn frame.
  apply(client: Client): void {
    for (const [cloth, material] of this.chosenMaterials) {
      const solver = client.parameters.solver(client.frames.cloths().findIndex(({ name }) => name === cloth));
      client.parameters.setMaterial(cloth, material);
      // A material selects XPBD. Implicit Euler holds any material with fewer substeps, so a cloth that has it keeps it.
      if (solver === kImplicitEuler) client.parameters.setSolver(cloth, solver);
    }
    for (const [cloth, solver] of this.chosen) client.parameters.setSolver(cloth, solver);
    this.chosenMaterials.clear();
    this.chosen.clear();
  }

  private addCard(name: string, index: number, materials: string[]): Card {
    const card = document.createElement("section");
    card.className = "cloth";
    const solver = document.createElement("select");
    solver.id = `solver-${index}`;
    solver.append(...Array.from(Solvers, ([kind, label]) => new Option(label, String(kind))));
    solver.addEventListener("change", () => this.chosen.set(name, Number(solver.value)));
    const label = document.createElement("label");
    label.className = "row";
    label.htmlFor = solver.id;
    label.textContent = name;
    const material = document.createElement("select");
    material.id = `material-${index}`;
    material.setAttribute("aria-label", `Material of ${name}`);
    const none = new Option("no material", "");
    none.disabled = true;
    material.append(none, ...materials.map((one) => new Option(one.replace("_", " "), one)));
    material.addEventListener("change", () => this.chosenMaterials.set(name, material.value));
    const terms = document.createElement("dl");
    const figures = new Map<Figure, HTMLElement>();
    for (const figure of kFigures) {
      const entry = document.createElement("div");
      const term = document.createElement("dt");
      const value = document.createElement("dd");
      term.textContent = figure;
      value.textContent = "–";
      value.dataset["figure"] = figure;
      entry.append(term, value);
      terms.append(entry);
      figures.set(figure, value);
    }
    card.append(label, material, solver, terms);
    this.list.append(card);
    return { material, solver, figures };
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
