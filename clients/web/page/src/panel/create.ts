// SPDX-License-Identifier: MIT
// Form that makes a scene from a mesh file: file, name, size, material, mass and pins.

import { sceneBytes } from "@clothstream/client";
import { element, make, write } from "./dom";
import { readMesh, type FileMesh } from "./mesh_file";
import { boundsOf, likelySize, nameFor, pinsOf, placeOf, sizeOf, type PinChoice } from "./pins";
import { Preview } from "./preview";
import type { Requests } from "./requests";

export class Create {
  private readonly form = element<HTMLFormElement>("create-form");
  private readonly file = element<HTMLInputElement>("create-file");
  private readonly name = element<HTMLInputElement>("create-name");
  private readonly size = element<HTMLInputElement>("create-size");
  private readonly material = element<HTMLSelectElement>("create-material");
  private readonly mass = element<HTMLInputElement>("create-mass");
  private readonly pins = element<HTMLSelectElement>("create-pins");
  private readonly part = element<HTMLInputElement>("create-part");
  private readonly button = element<HTMLButtonElement>("create-send");
  private readonly progress = element<HTMLProgressElement>("create-progress");
  private readonly preview = new Preview(element<HTMLCanvasElement>("preview"), () => this.describe());
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
    for (const input of [this.pins, this.part]) input.addEventListener("input", () => this.choosePins());
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
    } catch (error) {
      this.mesh = undefined;
      element("create-fields").hidden = true;
      this.fail(error instanceof Error ? error.message : String(error));
      return;
    }
    this.fileName = file.name;
    element("create-fields").hidden = false;
    this.name.value = nameFor(file.name);
    this.size.value = String(likelySize(this.longest()));
    this.preview.show(this.mesh.positions, this.mesh.triangles);
    this.choosePins();
    element("create-fields").scrollIntoView({ block: "nearest" });
  }

  private longest(): number {
    return this.mesh ? Math.max(...sizeOf(boundsOf(this.mesh.positions))) : 0;
  }

  private choosePins(): void {
    const choice = this.pins.value as PinChoice;
    element("create-part-row").hidden = choice !== "part";
    if (!this.mesh) return;
    this.preview.pin(pinsOf(this.mesh.positions, choice, this.part.valueAsNumber / 100));
    this.describe();
  }

  private describe(): void {
    if (!this.mesh) return;
    const count = (values: { length: number }) => (values.length / 3).toLocaleString("en");
    const pins = this.preview.pinned.size;
    write(
      element("create-mesh"),
      `${this.fileName}: ${count(this.mesh.positions)} vertices, ${count(this.mesh.triangles)} triangles, ` +
        `${pins === 0 ? "no pins" : `${pins.toLocaleString("en")} pinned`}. Paint in the picture to pin more, with Shift to free.`,
    );
  }

  private async send(): Promise<void> {
    if (!this.mesh) return;
    const longest = this.longest();
    if (!(longest > 0)) return this.fail("The mesh has no size.");
    const scale = this.size.valueAsNumber / longest;
    const pinned = [...this.preview.pinned].sort((a, b) => a - b);
    const scene = sceneBytes({
      name: this.name.value,
      description: `From ${this.fileName.replace(/[^ -~]/g, "").slice(0, 200) || "a file"}`,
      positions: this.mesh.positions,
      triangles: this.mesh.triangles,
      ...(this.mesh.uvs ? { uvs: this.mesh.uvs } : {}),
      scale,
      position: placeOf(boundsOf(this.mesh.positions), scale, pinned.length > 0),
      material: this.material.value,
      ...(this.mass.value ? { massPerArea: this.mass.valueAsNumber } : {}),
      pinned,
      repair: element<HTMLInputElement>("create-repair").checked,
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
