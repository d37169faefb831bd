// SPDX-License-Identifier: MIT
// The panel: scene, wind, gusts, gravity, stiffness, damping, collider. What people change goes out once a drawn frame.

import { Shape, type Client, type ClothParameters, type Environment, type Spring, type Vec3 } from "./client";
import { element } from "./hud";

const kStill: Vec3 = [0, 0, 0];
// Where the scene itself has none: from the viewer's side, and down.
const kDefaultWind: Vec3 = [0, 0, -1];
const kDown: Vec3 = [0, -1, 0];
const kGustSeconds = 2; // as scene.proto has it

export interface ControlsListener {
  sceneChosen(scene: string): void;
  viewReset(): void;
}

export class Controls {
  private readonly scenes = element<HTMLSelectElement>("scene");
  private readonly choice = element<HTMLSelectElement>("collider");
  private readonly wind = new Slider("wind", (value) => `${value.toFixed(1)} m/s`);
  private readonly gust = new Slider("gust", (value) => `${value.toFixed(1)} m/s`);
  private readonly gravity = new Slider("gravity", (value) => `${value.toFixed(2)} m/s²`);
  // On a scale of powers of two.
  private readonly stiffness = new Slider("stiffness", (value) => `× ${(2 ** value).toFixed(2)}`);
  private readonly damping = new Slider("damping", (value) => `${value.toFixed(2)} /s`);
  private readonly radius = new Slider("radius", (value) => `${value.toFixed(2)} m`);
  private readonly sliders = [this.wind, this.gust, this.gravity, this.stiffness, this.damping, this.radius];
  private windDirection = kDefaultWind;
  private gravityDirection = kDown;
  // The cloths as the description found them, or as their material made them: what stiffness multiplies.
  private base: ClothParameters[] = [];
  private materials: string[] = [];

  constructor(listener: ControlsListener) {
    this.scenes.addEventListener("change", () => listener.sceneChosen(this.scenes.value));
    this.choice.addEventListener("change", () => this.radius.forget());
    element("reset").addEventListener("click", () => listener.viewReset());
    if (window.matchMedia("(max-width: 640px)").matches) element<HTMLDetailsElement>("panel").open = false;
  }

  listScenes(scenes: string[], current: string): void {
    this.scenes.replaceChildren(...scenes.map((scene) => new Option(scene, scene, false, scene === current)));
  }

  // Name of the collider that the keys and the radius belong to; "" if there is none.
  get collider(): string {
    return this.choice.value;
  }
  set collider(name: string) {
    if (this.choice.value === name) return;
    this.choice.value = name;
    this.radius.forget();
  }

  describe(client: Client): void {
    for (const slider of this.sliders) slider.forget();
    this.rebase(client);
    const environment = client.environment();
    this.windDirection = direction(environment?.wind ?? kStill, kDefaultWind);
    this.gravityDirection = direction(environment?.gravity ?? kStill, kDown);
    const names = client.colliders().filter(({ participantId }) => participantId === 0n).map(({ name }) => name);
    this.choice.replaceChildren(...names.map((name) => new Option(name)));
    element("collider-row").hidden = names.length < 2;
    this.scenes.value = client.sceneName;
    this.show(client);
  }

  // The server refused a change: the sliders go back to what holds.
  refused(client: Client): void {
    for (const slider of this.sliders) slider.forget();
    this.show(client);
  }

  // Shows the parameters as they stand.
  show(client: Client): void {
    const environment = client.environment();
    if (environment) this.showEnvironment(environment);
    if (this.materialsOf(client).some((material, index) => material !== this.materials[index])) this.rebase(client);
    const cloth = client.clothParameters()[0];
    const base = this.base[0];
    if (cloth && base) {
      const factor = base.structural[0] > 0 ? cloth.structural[0] / base.structural[0] : 1;
      this.stiffness.show(factor > 0 ? Math.log2(factor) : 0);
      this.damping.show(cloth.damping);
    }
    this.showRadius(client);
  }

  // Hands changes to the client; to be called once a drawn frame.
  apply(client: Client): void {
    const wind = this.wind.take();
    const gust = this.gust.take();
    const gravity = this.gravity.take();
    const stiffness = this.stiffness.take();
    const damping = this.damping.take();
    const radius = this.radius.take();
    if (wind !== undefined) client.setEnvironment({ wind: scaled(this.windDirection, wind) });
    if (gust !== undefined) client.setGust(gust, client.environment()?.gustSeconds ?? kGustSeconds);
    if (gravity !== undefined) client.setEnvironment({ gravity: scaled(this.gravityDirection, gravity) });
    if (stiffness !== undefined) {
      client.cloths().forEach(({ name }, index) => {
        const base = this.base[index];
        if (base) client.setCloth(name, stiffened(base, 2 ** stiffness));
      });
    }
    if (damping !== undefined) client.setCloth("", { damping });
    if (radius !== undefined && this.collider) client.setCollider(this.collider, { radius });
    this.showRadius(client);
  }

  private rebase(client: Client): void {
    this.base = client.clothParameters();
    this.materials = this.materialsOf(client);
  }

  private materialsOf(client: Client): string[] {
    return client.cloths().map((_, index) => client.material(index));
  }

  private showEnvironment(environment: Environment): void {
    this.wind.show(Math.hypot(...environment.wind));
    this.gust.show(environment.gustStrength);
    this.gravity.show(Math.hypot(...environment.gravity));
  }

  private showRadius(client: Client): void {
    const collider = client.colliders().find(({ name, participantId }) => participantId === 0n && name === this.collider);
    const round = collider?.shape === Shape.sphere || collider?.shape === Shape.capsule;
    element("radius-row").hidden = !round;
    if (collider && round) this.radius.show(collider.radius);
  }
}

// A labelled range input with its value beside it.
class Slider {
  private readonly input: HTMLInputElement;
  private readonly output: HTMLElement;
  private changed = false;
  // What went to the server and has not come back yet.
  private sent: number | undefined;

  constructor(
    id: string,
    private readonly format: (value: number) => string,
  ) {
    this.input = element<HTMLInputElement>(id);
    this.output = element(`${id}-value`);
    this.input.addEventListener("input", () => {
      this.changed = true;
      this.write();
    });
  }

  // The value to send, if it was changed since the last call.
  take(): number | undefined {
    if (!this.changed) return undefined;
    this.changed = false;
    this.sent = this.input.valueAsNumber;
    return this.sent;
  }

  // The server's value. Older ones, on their way while a hand moves the slider, do not move it back.
  show(value: number): void {
    const step = Number(this.input.step);
    if (this.sent !== undefined && Math.abs(value - this.sent) < step / 2) this.sent = undefined;
    if (this.changed || this.sent !== undefined) return;
    if (value > Number(this.input.max)) this.input.max = String(Math.ceil(value));
    if (Math.abs(this.input.valueAsNumber - value) < step / 2 && this.output.textContent) return;
    this.input.valueAsNumber = value;
    this.write();
  }

  // It now stands for something else, or what was sent will not come back.
  forget(): void {
    this.changed = false;
    this.sent = undefined;
  }

  private write(): void {
    const text = this.format(this.input.valueAsNumber);
    this.output.textContent = text;
    this.input.setAttribute("aria-valuetext", text);
  }
}

function direction(vector: Vec3, otherwise: Vec3): Vec3 {
  const length = Math.hypot(...vector);
  return length > 0 ? scaled(vector, 1 / length) : otherwise;
}

function scaled([x, y, z]: Vec3, factor: number): Vec3 {
  return [factor * x, factor * y, factor * z];
}

function stiffened(base: ClothParameters, factor: number): Pick<ClothParameters, "structural" | "shear" | "bend"> {
  const times = ([stiffness, damping]: Spring): Spring => [factor * stiffness, damping];
  return { structural: times(base.structural), shear: times(base.shear), bend: times(base.bend) };
}
