// SPDX-License-Identifier: MIT
// Paints pins and limits on the mesh of the preview by mouse, pen and finger, with a brush that is a ball on the mesh.

import * as THREE from "three";
import { element, write } from "./dom";
import { kNoLimit, legendOf } from "./limit_colours";
import { PinSet } from "./pin_set";
import { boundsOf, sizeOf, within } from "./pins";
import { Preview } from "./preview";
import { VertexNumbers } from "./vertex_numbers";

// Limits are those of a cloth on a figure: the distance from the place on the figure, and the one behind it.
type LimitTool = "distance" | "backstop";
type Tool = "pin" | "free" | "turn" | LimitTool;

const kNone: Record<LimitTool, string> = { distance: "unbounded", backstop: "no backstop" };
const kFirstLimits: Record<LimitTool, string> = { distance: "0", backstop: "0" };

const kMostBalls = 24; // of one motion of the pointer
// Triangles times balls of one motion, so that painting on large meshes stays fluent.
const kMostWork = 2e6;
const kLargestStep = 6; // pixels between two balls, or else half of the ball

export class Painter {
  private pins = new PinSet(0);
  private limits = { distance: new VertexNumbers(0, kNoLimit), backstop: new VertexNumbers(0, kNoLimit) };
  private order: { undo(): void; readonly canUndo: boolean }[] = []; // what each step has changed, newest last
  private readonly chosen = { ...kFirstLimits }; // text of the field for each tool
  private positions: Float32Array = new Float32Array();
  private triangles = 0;
  private longest = 1; // side of the mesh, units of the file
  private preview: Preview | undefined;
  private tool: Tool = "pin";
  private stroke: { pointer: number; x: number; y: number; on: VertexNumbers; value: number } | undefined;
  private readonly touches = new Set<number>();
  private readonly canvas = element<HTMLCanvasElement>("preview");
  private readonly size = element<HTMLInputElement>("pin-brush");
  private readonly undoButton = element<HTMLButtonElement>("pin-undo");
  private readonly limit = element<HTMLInputElement>("limit-value");
  private readonly noLimit = element<HTMLInputElement>("limit-none");

  // `painted` is called when the pins have changed by painting or undoing.
  constructor(private readonly painted: () => void) {
    for (const tool of document.querySelectorAll<HTMLInputElement>('input[name="pin-tool"]'))
      tool.addEventListener("change", () => this.choose(tool.value as Tool));
    this.size.addEventListener("input", () => this.showSize());
    this.undoButton.addEventListener("click", () => this.undo());
    this.limit.addEventListener("input", () => {
      if (isLimit(this.tool)) this.chosen[this.tool] = this.limit.value;
      this.noLimit.checked = false;
    });
    this.canvas.addEventListener("pointerdown", (event) => this.press(event));
    this.canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel"] as const) this.canvas.addEventListener(end, (event) => this.release(event));
    this.canvas.addEventListener("pointerleave", () => this.preview?.showBrush(undefined, 0));
    this.canvas.addEventListener("keydown", (event) => this.key(event));
    this.showSize();
  }

  get count(): number {
    return this.pins.count;
  }
  // Indices of the pinned vertices, ascending.
  list(): Uint32Array {
    return this.pins.list();
  }

  // Limits of each vertex, metres, kNoLimit for none. Undefined if no vertex has one.
  listLimits(tool: LimitTool): Float32Array | undefined {
    const { values } = this.limits[tool];
    return values.some((value) => value >= 0) ? values : undefined;
  }

  // Shows who wears the cloth, and offers the tools for its limits. Undefined: the cloth has no figure.
  dress(figure: { positions: Float32Array; triangles: Uint32Array } | undefined): void {
    for (const tool of document.querySelectorAll<HTMLElement>("#pin-tools [data-limit]")) tool.hidden = figure === undefined;
    this.preview?.showFigure(figure);
    if (figure || !isLimit(this.tool)) return;
    element("pin-tools").querySelector<HTMLInputElement>('[value="pin"]')!.checked = true;
    this.choose("pin");
  }

  // Shows a mesh with its first pins. Throws if the browser refuses another WebGL context.
  show(positions: Float32Array, triangles: Uint32Array, pinned: readonly number[]): void {
    if (!this.preview) {
      this.preview = new Preview(this.canvas);
      this.choose(this.tool);
    }
    this.positions = positions;
    this.triangles = triangles.length / 3;
    this.longest = Math.max(...sizeOf(boundsOf(positions)));
    const vertices = positions.length / 3;
    this.pins = new PinSet(vertices, pinned);
    this.limits = { distance: new VertexNumbers(vertices, kNoLimit), backstop: new VertexNumbers(vertices, kNoLimit) };
    this.order = [];
    this.preview.show(positions, triangles);
    this.update();
  }

  // Pins exactly these vertices.
  replace(vertices: readonly number[]): void {
    this.stroke = undefined;
    if (this.pins.replace(vertices)) this.order.push(this.pins);
    this.update();
  }

  // Mouse: the left button works with the tool, the right one turns. Fingers: one works, two turn and zoom.
  private choose(tool: Tool): void {
    this.tool = tool;
    this.canvas.dataset["tool"] = tool;
    const limit = isLimit(tool) ? tool : undefined;
    element("limit-row").hidden = limit === undefined;
    this.limit.disabled = limit === undefined; // so that the form does not check it
    if (limit) {
      write(element("limit-name"), limit === "distance" ? "Largest distance" : "Distance behind");
      write(element("limit-none-name"), limit === "distance" ? "Unbounded" : "No backstop");
      this.limit.value = this.chosen[limit];
      this.noLimit.checked = false;
    }
    this.showLimits();
    if (!this.preview) return;
    const { orbit } = this.preview;
    const first = tool === "turn" ? THREE.MOUSE.ROTATE : null;
    orbit.mouseButtons = { LEFT: first, MIDDLE: THREE.MOUSE.PAN, RIGHT: THREE.MOUSE.ROTATE };
    orbit.touches = { ONE: tool === "turn" ? THREE.TOUCH.ROTATE : null, TWO: THREE.TOUCH.DOLLY_ROTATE };
  }

  // Radius of the brush, units of the file.
  private get radius(): number {
    return (this.size.valueAsNumber / 200) * this.longest;
  }

  private showSize(): void {
    write(element("pin-brush-value"), `${this.size.value} % of the mesh`);
  }

  private press(event: PointerEvent): void {
    if (event.pointerType === "touch") this.touches.add(event.pointerId);
    // The second finger turns the mesh; what the first one has painted meanwhile was not meant.
    if (this.touches.size > 1) return this.abandon();
    if (event.button !== 0 || this.tool === "turn" || this.stroke) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.focus();
    this.stroke = { pointer: event.pointerId, x: event.offsetX, y: event.offsetY, on: this.painting, value: this.paintedValue(event.shiftKey) };
    this.stroke.on.begin();
    this.paint(event.offsetX, event.offsetY);
  }

  private move(event: PointerEvent): void {
    const { stroke } = this;
    if (!stroke) {
      if (event.pointerType === "mouse" && event.buttons === 0 && this.tool !== "turn") this.hover(event);
      return;
    }
    if (event.pointerId !== stroke.pointer) return;
    const [dx, dy] = [event.offsetX - stroke.x, event.offsetY - stroke.y];
    const step = Math.max(kLargestStep, (this.preview?.pixelsOf(this.radius) ?? 0) / 2);
    const most = Math.max(1, Math.min(kMostBalls, Math.floor(kMostWork / Math.max(this.triangles, 1))));
    const balls = Math.min(most, Math.max(1, Math.ceil(Math.hypot(dx, dy) / step)));
    for (let ball = 1; ball <= balls; ++ball) this.paint(stroke.x + (dx * ball) / balls, stroke.y + (dy * ball) / balls);
    stroke.x = event.offsetX;
    stroke.y = event.offsetY;
  }

  private release(event: PointerEvent): void {
    this.touches.delete(event.pointerId);
    if (event.pointerId !== this.stroke?.pointer) return;
    const { on } = this.stroke;
    this.stroke = undefined;
    if (on.end()) this.order.push(on);
    this.update();
    this.painted();
    if (event.pointerType === "touch") this.preview?.showBrush(undefined, 0);
  }

  private abandon(): void {
    if (!this.stroke) return;
    this.stroke.on.cancel();
    this.stroke = undefined;
    this.preview?.showBrush(undefined, 0);
    this.update();
    this.painted();
  }

  private hover(event: PointerEvent): void {
    const touched = this.preview?.touch(event.offsetX, event.offsetY, this.radius);
    this.preview?.showBrush(touched?.point, this.radius);
  }

  private paint(x: number, y: number): void {
    const touched = this.preview?.touch(x, y, this.radius);
    this.preview?.showBrush(touched?.point, this.radius);
    if (!touched || !this.stroke) return;
    const vertices = within(this.positions, [touched.point.x, touched.point.y, touched.point.z], this.radius);
    if (!this.stroke.on.paint(vertices.concat(touched.corner), this.stroke.value)) return;
    this.preview?.showPins(this.pins.list());
    this.showLimits();
    this.painted();
  }

  // What the tool paints on.
  private get painting(): VertexNumbers {
    return isLimit(this.tool) ? this.limits[this.tool] : this.pins.numbers;
  }

  private paintedValue(erases: boolean): number {
    if (!isLimit(this.tool)) return Number(this.tool === "pin" && !erases);
    const value = this.limit.valueAsNumber;
    return erases || this.noLimit.checked || !(value >= 0) ? kNoLimit : value;
  }

  private showLimits(): void {
    const limits = isLimit(this.tool) ? this.limits[this.tool].values : undefined;
    this.preview?.showLimits(limits);
    if (limits) write(element("limit-legend"), legendOf(limits, kNone[this.tool as LimitTool]));
  }

  // Each set keeps a bounded number of steps, so the oldest ones may be gone.
  private undo(): void {
    this.stroke?.on.cancel();
    this.stroke = undefined;
    this.order.pop()?.undo();
    this.update();
    this.painted();
  }

  private key(event: KeyboardEvent): void {
    if (event.altKey) return;
    const isUndo = (event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z" && !event.shiftKey;
    if (!isUndo && (event.ctrlKey || event.metaKey)) return;
    const actions: Record<string, () => void> = {
      ArrowLeft: () => this.preview?.turn(-1, 0),
      ArrowRight: () => this.preview?.turn(1, 0),
      ArrowUp: () => this.preview?.turn(0, 1),
      ArrowDown: () => this.preview?.turn(0, -1),
      "+": () => this.preview?.zoom(1),
      "=": () => this.preview?.zoom(1),
      "-": () => this.preview?.zoom(-1),
    };
    const action = isUndo ? () => this.undo() : actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  // Shows the pins and whether there is something to undo.
  private update(): void {
    this.preview?.showPins(this.pins.list());
    this.showLimits();
    this.undoButton.disabled = !this.order.at(-1)?.canUndo;
    const text = `The mesh with ${this.pins.count} pinned vertices. Arrow keys turn it, plus and minus zoom. Choose "a box" to pin with the keyboard.`;
    if (this.canvas.getAttribute("aria-label") !== text) this.canvas.setAttribute("aria-label", text);
  }
}

function isLimit(tool: Tool): tool is LimitTool {
  return tool === "distance" || tool === "backstop";
}
