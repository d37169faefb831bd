// SPDX-License-Identifier: MIT
// Picture of a mesh from its largest side, in which a person paints pins.

import { boundsOf, sizeOf } from "./pins";

const kMargin = 18;
const kBrush = 9; // pixels of the canvas
const kMaxTriangles = 40_000; // drawn

export class Preview {
  private readonly context: CanvasRenderingContext2D;
  private points: Float32Array = new Float32Array(); // 2 per vertex, pixels
  private triangles: Uint32Array = new Uint32Array();
  readonly pinned = new Set<number>();

  // `painted` is called when a stroke has changed the pins.
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly painted: () => void,
  ) {
    this.context = canvas.getContext("2d")!;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.paint(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons & 1) this.paint(event);
    });
  }

  show(positions: Float32Array, triangles: Uint32Array): void {
    const { min, max } = boundsOf(positions);
    const size = sizeOf({ min, max });
    const thin = size.indexOf(Math.min(...size));
    // Depth along y shows the mesh from above, with -z up; along x from its side.
    const [u, v] = thin === 2 ? [0, 1] : thin === 0 ? [2, 1] : [0, 2];
    const upwards = v === 1 ? 1 : -1;
    const { width, height } = this.canvas;
    const scale = Math.min((width - 2 * kMargin) / (size[u]! || 1), (height - 2 * kMargin) / (size[v]! || 1));
    this.points = new Float32Array((2 * positions.length) / 3);
    for (let i = 0; i < positions.length / 3; ++i) {
      this.points[2 * i] = width / 2 + scale * (positions[3 * i + u]! - (min[u]! + max[u]!) / 2);
      this.points[2 * i + 1] = height / 2 - upwards * scale * (positions[3 * i + v]! - (min[v]! + max[v]!) / 2);
    }
    this.triangles = triangles;
    this.draw();
  }

  pin(vertices: readonly number[]): void {
    this.pinned.clear();
    for (const vertex of vertices) this.pinned.add(vertex);
    this.draw();
  }

  private draw(): void {
    const { context, points, triangles } = this;
    const style = getComputedStyle(this.canvas);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.strokeStyle = style.getPropertyValue("--edge");
    context.lineWidth = 1;
    context.beginPath();
    const step = 3 * Math.ceil(triangles.length / 3 / kMaxTriangles);
    for (let i = 0; i + 2 < triangles.length; i += step) {
      const [a, b, c] = [2 * triangles[i]!, 2 * triangles[i + 1]!, 2 * triangles[i + 2]!];
      context.moveTo(points[a]!, points[a + 1]!);
      context.lineTo(points[b]!, points[b + 1]!);
      context.lineTo(points[c]!, points[c + 1]!);
      context.closePath();
    }
    context.stroke();
    context.fillStyle = style.getPropertyValue("--accent");
    for (const vertex of this.pinned) {
      context.beginPath();
      context.arc(points[2 * vertex]!, points[2 * vertex + 1]!, 4, 0, 2 * Math.PI);
      context.fill();
    }
    const text = `Front of the mesh with ${this.pinned.size} pinned vertices. Paint to pin vertices; hold Shift to free them.`;
    if (this.canvas.getAttribute("aria-label") !== text) this.canvas.setAttribute("aria-label", text);
  }

  private paint(event: PointerEvent): void {
    const frame = this.canvas.getBoundingClientRect();
    const x = ((event.clientX - frame.left) * this.canvas.width) / frame.width;
    const y = ((event.clientY - frame.top) * this.canvas.height) / frame.height;
    const before = this.pinned.size;
    for (let vertex = 0; 2 * vertex < this.points.length; ++vertex) {
      if (Math.hypot(this.points[2 * vertex]! - x, this.points[2 * vertex + 1]! - y) > kBrush) continue;
      if (event.shiftKey) this.pinned.delete(vertex);
      else this.pinned.add(vertex);
    }
    if (this.pinned.size === before) return;
    this.draw();
    this.painted();
  }
}
