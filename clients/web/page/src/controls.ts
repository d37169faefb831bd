// SPDX-License-Identifier: MIT
// Air, gravity, stiffness of all springs, and the collider. Changes are sent once per drawn frame.

import { Shape, type Client, type ClothParameters, type Environment, type Spring, type Vec3 } from "@clothstream/client";
import { element } from "./panel/dom";
import { vectorOf, windOf } from "./panel/wind";

const kStill: Vec3 = [0, 0, 0];
// Direction for scenes without gravity.
const kDown: Vec3 = [0, -1, 0];

export class Controls {
  private readonly choice = element<HTMLSelectElement>("collider");
  private readonly wind = new Slider("wind", (value) => `${value.toFixed(1)} m/s`);
  private readonly heading = new Slider("wind-heading", (value) => `${value.toFixed(0)}°`);
  private readonly rise = new Slider("wind-rise", (value) => `${value.toFixed(0)}°`);
  private readonly gust = new Slider("gust", (value) => `${value.toFixed(1)} m/s`);
  private readonly gustSeconds = new Slider("gust-seconds", (value) => `${value.toFixed(1)} s`);
  private readonly density = new Slider("density", (value) => `${value.toFixed(2)} kg/m³`);
  private readonly gravity = new Slider("gravity", (value) => `${value.toFixed(2)} m/s²`);
  // The slider holds the binary logarithm of the factor.
  private readonly stiffness = new Slider("stiffness", (value) => `× ${(2 ** value).toFixed(2)}`);
  private readonly radius = new Slider("radius", (value) => `${value.toFixed(2)} m`);
  private readonly windSliders = [this.wind, this.heading, this.rise];
  private readonly sliders = [...this.windSliders, this.gust, this.gustSeconds, this.density, this.gravity, this.stiffness, this.radius];
  private gravityDirection = kDown;
  // Parameters that the stiffness factor multiplies: from the description, or from a change of material.
  private base: ClothParameters[] = [];
  private materials: string[] = [];

  constructor() {
    this.choice.addEventListener("change", () => this.radius.forget());
  }

  // Name of the collider that keys and the radius act on; "" without colliders.
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
    const environment = client.parameters.environment();
    this.gravityDirection = direction(environment?.gravity ?? kStill, kDown);
    const names = client.frames.colliders().filter(({ participantId }) => participantId === 0n).map(({ name }) => name);
    this.choice.replaceChildren(...names.map((name) => new Option(name)));
    element("collider-row").hidden = names.length < 2;
    this.show(client);
  }

  // Resets the sliders to the current parameters after the server refused a change.
  refused(client: Client): void {
    for (const slider of this.sliders) slider.forget();
    this.show(client);
  }

  // Shows the current parameters.
  show(client: Client): void {
    const environment = client.parameters.environment();
    if (environment) this.showEnvironment(environment);
    if (this.materialsOf(client).some((material, index) => material !== this.materials[index])) this.rebase(client);
    const cloth = client.parameters.clothParameters()[0];
    const base = this.base[0];
    if (cloth && base) {
      const factor = base.structural[0] > 0 ? cloth.structural[0] / base.structural[0] : 1;
      this.stiffness.show(factor > 0 ? Math.log2(factor) : 0);
    }
    this.showRadius(client);
  }

  // Sends changes to the client. Call once per drawn frame.
  apply(client: Client): void {
    const wind = this.takeWind();
    const gust = this.gust.take();
    const gustSeconds = this.gustSeconds.take();
    const airDensity = this.density.take();
    const gravity = this.gravity.take();
    const stiffness = this.stiffness.take();
    const radius = this.radius.take();
    if (wind) client.parameters.setEnvironment({ wind });
    if (gust !== undefined || gustSeconds !== undefined) client.parameters.setGust(this.gust.value, this.gustSeconds.value);
    if (airDensity !== undefined) client.settings.changeAir({ airDensity });
    if (gravity !== undefined) client.parameters.setEnvironment({ gravity: scaled(this.gravityDirection, gravity) });
    if (stiffness !== undefined) this.stiffen(client, 2 ** stiffness);
    if (radius !== undefined && this.collider) client.parameters.setCollider(this.collider, { radius });
  }

  private stiffen(client: Client, factor: number): void {
    client.frames.cloths().forEach(({ name }, index) => {
      const base = this.base[index];
      if (base) client.parameters.setCloth(name, stiffened(base, factor));
    });
  }

  // Shows the radius of the chosen collider, which frames have. Call a few times per second while it can be seen.
  showRadius(client: Client): void {
    const collider = client.frames.colliders().find(({ name, participantId }) => participantId === 0n && name === this.collider);
    const round = collider?.shape === Shape.sphere || collider?.shape === Shape.capsule;
    element("radius-row").hidden = !round;
    if (collider && round) this.radius.show(collider.radius);
  }

  private rebase(client: Client): void {
    this.base = client.parameters.clothParameters();
    this.materials = this.materialsOf(client);
  }

  private materialsOf(client: Client): string[] {
    return client.frames.cloths().map((_, index) => client.parameters.material(index));
  }

  // The direction of a wind that is switched off is kept, to be used when it is switched on.
  private takeWind(): Vec3 | undefined {
    const speed = this.wind.take();
    const heading = this.heading.take();
    const rise = this.rise.take();
    if (speed === undefined && heading === undefined && rise === undefined) return undefined;
    return vectorOf({ speed: this.wind.value, heading: this.heading.value, rise: this.rise.value });
  }

  private showEnvironment(environment: Environment): void {
    const wind = windOf(environment.wind);
    this.wind.show(wind.speed);
    if (wind.speed > 0) {
      this.heading.show(wind.heading);
      this.rise.show(wind.rise);
    } else {
      this.heading.forget();
      this.rise.forget();
      this.heading.writeValue();
      this.rise.writeValue();
    }
    this.gust.show(environment.gustStrength);
    this.gustSeconds.show(environment.gustSeconds);
    this.density.show(environment.airDensity);
    this.gravity.show(Math.hypot(...environment.gravity));
  }
}

// A labelled range input with its value as text.
class Slider {
  private readonly input: HTMLInputElement;
  private readonly output: HTMLElement;
  private changed = false;
  // Value that was sent and that the server has not confirmed yet.
  private sent: number | undefined;

  constructor(
    id: string,
    private readonly format: (value: number) => string,
  ) {
    this.input = element<HTMLInputElement>(id);
    this.output = element(`${id}-value`);
    this.input.addEventListener("input", () => {
      this.changed = true;
      this.writeValue();
    });
  }

  get value(): number {
    return this.input.valueAsNumber;
  }

  // Returns the value to send if the user changed it since the last call.
  take(): number | undefined {
    if (!this.changed) return undefined;
    this.changed = false;
    this.sent = this.input.valueAsNumber;
    return this.sent;
  }

  // Shows the server's value. Ignores older values that arrive while the user moves the slider.
  show(value: number): void {
    const step = Number(this.input.step);
    if (this.sent !== undefined && Math.abs(value - this.sent) < step / 2) this.sent = undefined;
    if (this.changed || this.sent !== undefined) return;
    if (value > Number(this.input.max)) this.input.max = String(Math.ceil(value));
    if (Math.abs(this.input.valueAsNumber - value) < step / 2 && this.output.textContent) return;
    this.input.valueAsNumber = value;
    this.writeValue();
  }

  // Forgets unsent and unconfirmed values, because the slider now controls something else or a change was refused.
  forget(): void {
    this.changed = false;
    this.sent = undefined;
  }

  writeValue(): void {
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
