// SPDX-License-Identifier: MIT
// Two fingers always move the camera, also when the first one has taken cloth or a collider.

export class Fingers {
  private readonly down = new Map<number, PointerEvent>();

  // Create it before other listeners to `canvas`, so that they find `areTwo` up to date.
  constructor(canvas: HTMLCanvasElement) {
    canvas.addEventListener("pointerdown", (event) => this.press(canvas, event), { capture: true });
    canvas.addEventListener("pointermove", (event) => {
      if (this.down.has(event.pointerId)) this.down.set(event.pointerId, event);
    });
    for (const end of ["pointerup", "pointercancel"] as const)
      canvas.addEventListener(end, (event) => {
        if (event.isTrusted) this.down.delete(event.pointerId);
      });
  }

  // While it is true, presses belong to the camera.
  get areTwo(): boolean {
    return this.down.size > 1;
  }

  // The first finger lets go of what it has, and starts again for the camera.
  private press(canvas: HTMLCanvasElement, event: PointerEvent): void {
    if (event.pointerType !== "touch" || !event.isTrusted) return;
    const [first] = this.down.values();
    this.down.set(event.pointerId, event);
    if (!first || this.down.size !== 2) return;
    const { pointerId, pointerType, clientX, clientY } = first;
    for (const kind of ["pointercancel", "pointerdown"])
      canvas.dispatchEvent(new PointerEvent(kind, { pointerId, pointerType, clientX, clientY, button: 0, buttons: 1, bubbles: true }));
  }
}
