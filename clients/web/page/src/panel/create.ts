// SPDX-License-Identifier: MIT
// Form that makes a scene from a mesh file: file, name, size, material, mass, pins, and a figure that wears the cloth.

import { sceneBytes, type SkinLimitLists } from "@clothstream/client";
import { confirmed, element, make, write } from "./dom";
import { readFigure, type FileFigure } from "./figure_file";
import { kNoLimit } from "./limit_colours";
import { readMesh, type FileMesh } from "./mesh_file";
import { boundsOf, centred, kFittedSize, likelySize, meanEdge, misfitOf, nameFor, pinsOf, placeOf, sizeOf, type PinChoice } from "./pins";
import { Painter } from "./painter";
import { PinBoxRows } from "./pin_box";
import type { Requests } from "./requests";

const kBackstopEdges = 10; // mean edges of the mesh in the radius of a backstop

export class Create {
  private readonly form = element<HTMLFormElement>("create-form");
  private readonly file = element<HTMLInputElement>("create-file");
  private readonly name = element<HTMLInputElement>("create-name");
  private readonly size = element<HTMLInputElement>("create-size");
  private readonly material = element<HTMLSelectElement>("create-material");
  private readonly mass = element<HTMLInputElement>("create-mass");
  private readonly pins = element<HTMLSelectElement>("create-pins");
  private readonly button = element<HTMLButtonElement>("create-send");
  private readonly progress = element<HTMLProgressElement>("create-progress");
  private readonly painter = new Painter(() => this.describe());
  private readonly box = new PinBoxRows(() => this.choosePins());
  private mesh: FileMesh | undefined;
  private fileName = "";
  private figure: FileFigure | undefined;

  // `made` receives the name of the new scene, and what was repaired in its mesh.
  constructor(
    private readonly requests: Requests,
    private readonly made: (scene: string, repairs: string) => void,
  ) {
    this.file.addEventListener("change", () => {
      const [file] = this.file.files ?? [];
      if (file) void this.take(file);
    });
    element<HTMLInputElement>("create-figure").addEventListener("change", ({ target }) => void this.dress((target as HTMLInputElement).files?.[0]));
    this.listenToDrops();
    this.pins.addEventListener("input", () => this.choosePins());
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      void this.send();
    });
  }

  // Lists the materials of the server. Cotton, if there is one, comes first.
  offer(materials: string[]): void {
    const before = this.material.value;
    this.material.replaceChildren(...materials.map((name) => new Option(name.replaceAll("_", " "), name)), new Option("none", ""));
    this.material.value = materials.includes(before) ? before : (materials.find((name) => name.includes("cotton")) ?? materials[0] ?? "");
  }

  // Indices of the pinned vertices of the mesh in the form, ascending.
  get pinned(): Uint32Array {
    return this.painter.list();
  }

  // Limits of each vertex of the mesh in the form, metres; empty if none has one.
  get limits(): SkinLimitLists {
    const maxDistances = this.painter.listLimits("distance");
    const backstopDistances = this.painter.listLimits("backstop");
    return { ...(maxDistances ? { maxDistances } : {}), ...(backstopDistances ? { backstopDistances } : {}) };
  }

  // A file may be dropped anywhere on the page.
  private listenToDrops(): void {
    const drop = element("drop");
    window.addEventListener("dragover", (event) => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      drop.toggleAttribute("data-over", true);
    });
    window.addEventListener("dragleave", (event) => {
      if (event.relatedTarget === null) drop.removeAttribute("data-over");
    });
    window.addEventListener("drop", (event) => {
      const [file] = event.dataTransfer?.files ?? [];
      drop.removeAttribute("data-over");
      if (!file) return;
      event.preventDefault();
      element("tab-scene").click();
      void this.take(file);
    });
  }

  private async take(file: File): Promise<void> {
    element<HTMLDetailsElement>("create").open = true;
    this.fail("");
    try {
      this.mesh = await readMesh(file);
      this.undress();
      if (this.longest() === 0) throw new Error(`${file.name} has all vertices in one place.`);
      element("create-fields").hidden = false;
      this.painter.show(this.mesh.positions, this.mesh.triangles, this.chosenPins());
    } catch (error) {
      this.mesh = undefined;
      element("create-fields").hidden = true;
      this.fail(error instanceof Error ? error.message : String(error));
      return;
    }
    this.fileName = file.name;
    this.name.value = nameFor(file.name);
    this.describe();
    element("create-fields").scrollIntoView({ block: "nearest" });
    await this.chooseSize(this.mesh);
  }

  // Asks before it scales a file whose size does not fit the world. After a no, the user enters a size.
  private async chooseSize({ positions, triangles }: FileMesh): Promise<void> {
    const misfit = misfitOf(positions, triangles, 1);
    this.size.value = misfit ? "" : String(likelySize(this.longest()));
    if (!misfit) return;
    const scales = await confirmed(`If its unit is the metre, ${this.fileName} ${misfit} Scale it to ${kFittedSize} m?`, "Scale");
    if (scales) this.size.value = String(kFittedSize);
    else this.size.focus();
  }

  // Reads a figure. It has the frame and the unit of the cloth, and the cloth moves with it instead of its pins.
  private async dress(file: File | undefined): Promise<void> {
    if (!file || !this.mesh) return;
    this.fail("");
    try {
      this.figure = await readFigure(file);
    } catch (error) {
      this.undress();
      return this.fail(error instanceof Error ? error.message : String(error));
    }
    this.pins.value = "none";
    this.choosePins();
    this.size.value = String(Number(this.longest().toPrecision(6)));
    this.painter.dress(this.figure);
    const { joints, triangles, animation } = this.figure;
    write(
      element("create-figure-text"),
      `${file.name}: ${count(joints)} joints, ${count(triangles, 3)} triangles, ${animation || "no animation"}. Paint with Distance: 0 m follows the figure.`,
    );
    element("create-figure-text").hidden = false;
  }

  private undress(): void {
    this.figure = undefined;
    element<HTMLInputElement>("create-figure").value = "";
    element("create-figure-text").hidden = true;
    this.painter.dress(undefined);
  }

  private longest(): number {
    return this.mesh ? Math.max(...sizeOf(boundsOf(this.mesh.positions))) : 0;
  }

  private chosenPins(): number[] {
    const choice = this.pins.value as PinChoice;
    this.box.hidden = choice !== "box";
    return this.mesh ? pinsOf(this.mesh.positions, choice, this.box.value) : [];
  }

  private choosePins(): void {
    const pins = this.chosenPins();
    if (!this.mesh) return;
    this.painter.replace(pins);
    this.describe();
  }

  private describe(): void {
    if (!this.mesh) return;
    const pins = this.painter.count;
    write(
      element("create-mesh"),
      `${this.fileName}: ${count(this.mesh.positions, 3)} vertices, ${count(this.mesh.triangles, 3)} triangles, ` +
        `${pins === 0 ? "no pins" : `${pins.toLocaleString("en")} pinned`}.`,
    );
  }

  private async send(): Promise<void> {
    const { mesh } = this;
    if (!mesh) return;
    const longest = this.longest();
    const scale = this.size.valueAsNumber / longest;
    const misfit = misfitOf(mesh.positions, mesh.triangles, scale);
    if (misfit && this.figure) return this.fail(`With a longest side of ${this.size.value} m, ${this.fileName} ${misfit} A cloth on a figure keeps its place: enter another size.`);
    if (misfit && !(await confirmed(`With a longest side of ${this.size.value} m, ${this.fileName} ${misfit} Scale it to ${kFittedSize} m?`, "Scale")))
      return this.size.focus();
    const fit = misfit !== undefined;
    const scene = sceneBytes({
      name: this.name.value,
      description: `From ${this.fileName.replace(/[^ -~]/g, "").slice(0, 200) || "a file"}`,
      positions: mesh.positions,
      triangles: mesh.triangles,
      ...(mesh.uvs ? { uvs: mesh.uvs } : {}),
      scale,
      position: this.place(mesh, scale, fit),
      material: this.material.value,
      ...(this.mass.value ? { massPerArea: this.mass.valueAsNumber } : {}),
      pinned: this.fixed(),
      repair: element<HTMLInputElement>("create-repair").checked,
      fit,
      selfCollision: element<HTMLInputElement>("create-self").checked,
      floor: element<HTMLInputElement>("create-floor").checked,
      ...(this.figure ? { figure: this.figure, limits: this.wornLimits(mesh, scale) } : {}),
    });
    this.fail("");
    this.button.disabled = true;
    this.progress.hidden = false;
    this.progress.removeAttribute("value");
    const outcome = await this.requests.create(scene, this.name.value, (part) => (this.progress.value = part));
    this.button.disabled = false;
    this.progress.hidden = true;
    if (!outcome.ok) return this.fail(outcome.error);
    element<HTMLDetailsElement>("create").open = false;
    element("create-fields").hidden = true;
    this.form.reset();
    this.undress();
    this.mesh = undefined;
    this.made(outcome.answer.name, outcome.answer.repairs);
  }

  private place(mesh: FileMesh, scale: number, fit: boolean): [number, number, number] {
    if (this.figure) return [0, 0, 0];
    const bounds = boundsOf(mesh.positions);
    const isPinned = this.pinned.length > 0;
    return fit ? placeOf(centred(bounds), kFittedSize / this.longest(), isPinned) : placeOf(bounds, scale, isPinned);
  }

  // Pins of the scene. A vertex that follows the figure exactly is not pinned, too.
  private fixed(): Uint32Array {
    const { maxDistances } = this.limits;
    return this.figure && maxDistances ? this.pinned.filter((vertex) => maxDistances[vertex] !== 0) : this.pinned;
  }

  // Backstops are balls that are large compared with triangles.
  private wornLimits(mesh: FileMesh, scale: number): SkinLimitLists {
    const { limits } = this;
    if (!limits.backstopDistances) return limits;
    const radius = kBackstopEdges * scale * meanEdge(mesh.positions, mesh.triangles);
    return { ...limits, backstopRadii: limits.backstopDistances.map((distance) => (distance < 0 ? kNoLimit : radius)) };
  }

  private fail(text: string): void {
    const error = element("create-error");
    error.replaceChildren(make("span", {}, text));
    error.hidden = text === "";
  }
}

function count(values: { length: number }, each = 1): string {
  return (values.length / each).toLocaleString("en");
}
