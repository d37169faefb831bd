// SPDX-License-Identifier: MIT
// Paints pins on the mesh of the preview by mouse, pen and finger, with a brush that is a ball on the mesh.

import * as THREE from "three";
import { element, write } from "./dom";
import { PinSet } from "./pin_set";
import { boundsOf, sizeOf, within } from "./pins";
import { Preview } from "./preview";

type Tool = "pin" | "free" | "turn";

const kMostBalls = 24; // of one motion of the pointer
// Triangles times balls of one motion, so that painting on large meshes stays fluent.
const kMostWork = 2e6;
const kLargestStep = 6; // pixels between two balls, or else half of the ball

export class Painter {
  private pins = new PinSet(0);
  private positions: Float32Array = new Float32Array();
  private triangles = 0;
  private longest = 1; // side of the mesh, units of the file
  private preview: Preview | undefined;
  private tool: Tool = "pin";
  private stroke: { pointer: number; x: number; y: number; pins: boolean } | undefined;
  private readonly touches = new Set<number>();
  private readonly canvas = element<HTMLCanvasElement>("preview");
  private readonly size = element<HTMLInputElement>("pin-brush");
  private readonly undoButton = element<HTMLButtonElement>("pin-undo");

  // `painted` is called when the pins have changed by painting or undoing.
  constructor(private readonly painted: () => void) {
    for (const tool of document.querySelectorAll<HTMLInputElement>('input[name="pin-tool"]'))
      tool.addEventListener("change", () => this.choose(tool.value as Tool));
    this.size.addEventListener("input", () => this.showSize());
    this.undoButton.addEventListener("click", () => this.undo());
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

  // Shows a mesh with its first pins. Throws if the browser refuses another WebGL context.
  show(positions: Float32Array, triangles: Uint32Array, pinned: readonly number[]): void {
    if (!this.preview) {
      this.preview = new Preview(this.canvas);
      this.choose(this.tool);
    }
    this.positions = positions;
    this.triangles = triangles.length / 3;
    this.longest = Math.max(...sizeOf(boundsOf(positions)));
    this.pins = new PinSet(positions.length / 3, pinned);
    this.preview.show(positions, triangles);
    this.update();
  }

  // Pins exactly these vertices.
  replace(vertices: readonly number[]): void {
    this.stroke = undefined;
    this.pins.replace(vertices);
    this.update();
  }

  // Mouse: the left button works with the tool, the right one turns. Fingers: one works, two turn and zoom.
  private choose(tool: Tool): void {
    this.tool = tool;
    this.canvas.dataset["tool"] = tool;
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
    this.stroke = { pointer: event.pointerId, x: event.offsetX, y: event.offsetY, pins: this.tool === "pin" && !event.shiftKey };
    this.pins.begin();
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
    this.stroke = undefined;
    this.pins.end();
    this.update();
    this.painted();
    if (event.pointerType === "touch") this.preview?.showBrush(undefined, 0);
  }

  private abandon(): void {
    if (!this.stroke) return;
    this.stroke = undefined;
    this.pins.cancel();
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
    if (!this.pins.paint(vertices.concat(touched.corner), this.stroke.pins)) return;
    this.preview?.showPins(this.pins.list());
    this.painted();
  }

  private undo(): void {
    this.pins.undo();
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
    this.undoButton.disabled = !this.pins.canUndo;
    const text = `The mesh with ${this.pins.count} pinned vertices. Arrow keys turn it, plus and minus zoom. Choose "a box" to pin with the keyboard.`;
    if (this.canvas.getAttribute("aria-label") !== text) this.canvas.setAttribute("aria-label", text);
  }
}
