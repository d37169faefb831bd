// SPDX-License-Identifier: MIT
// Form that makes a scene from a mesh file: file, name, size, material, mass and pins.

import { sceneBytes } from "@clothstream/client";
import { confirmed, element, make, write } from "./dom";
import { readMesh, type FileMesh } from "./mesh_file";
import { boundsOf, centred, kFittedSize, likelySize, misfitOf, nameFor, pinsOf, placeOf, sizeOf, type PinChoice } from "./pins";
import { Painter } from "./painter";
import { PinBoxRows } from "./pin_box";
import type { Requests } from "./requests";

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

  // `made` receives the name of the new scene, and what was repaired in its mesh.
  constructor(
    private readonly requests: Requests,
    private readonly made: (scene: string, repairs: string) => void,
  ) {
    this.file.addEventListener("change", () => {
      const [file] = this.file.files ?? [];
      if (file) void this.take(file);
    });
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
    const count = (values: { length: number }) => (values.length / 3).toLocaleString("en");
    const pins = this.painter.count;
    write(
      element("create-mesh"),
      `${this.fileName}: ${count(this.mesh.positions)} vertices, ${count(this.mesh.triangles)} triangles, ` +
        `${pins === 0 ? "no pins" : `${pins.toLocaleString("en")} pinned`}.`,
    );
  }

  private async send(): Promise<void> {
    const { mesh } = this;
    if (!mesh) return;
    const longest = this.longest();
    const scale = this.size.valueAsNumber / longest;
    const misfit = misfitOf(mesh.positions, mesh.triangles, scale);
    if (misfit && !(await confirmed(`With a longest side of ${this.size.value} m, ${this.fileName} ${misfit} Scale it to ${kFittedSize} m?`, "Scale")))
      return this.size.focus();
    const fit = misfit !== undefined;
    const { pinned } = this;
    const bounds = boundsOf(mesh.positions);
    const scene = sceneBytes({
      name: this.name.value,
      description: `From ${this.fileName.replace(/[^ -~]/g, "").slice(0, 200) || "a file"}`,
      positions: mesh.positions,
      triangles: mesh.triangles,
      ...(mesh.uvs ? { uvs: mesh.uvs } : {}),
      scale,
      position: fit ? placeOf(centred(bounds), kFittedSize / longest, pinned.length > 0) : placeOf(bounds, scale, pinned.length > 0),
      material: this.material.value,
      ...(this.mass.value ? { massPerArea: this.mass.valueAsNumber } : {}),
      pinned,
      repair: element<HTMLInputElement>("create-repair").checked,
      fit,
      selfCollision: element<HTMLInputElement>("create-self").checked,
      floor: element<HTMLInputElement>("create-floor").checked,
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
    this.mesh = undefined;
    this.made(outcome.answer.name, outcome.answer.repairs);
  }

  private fail(text: string): void {
    const error = element("create-error");
    error.replaceChildren(make("span", {}, text));
    error.hidden = text === "";
  }
}
