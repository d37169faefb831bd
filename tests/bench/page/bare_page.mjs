// SPDX-License-Identifier: MIT
// A page without the work of the software renderer: calls that draw do nothing, so that frames come as on a device with a
// graphics processor. All other calls of WebGL are made.

// Runs in the page before its own scripts.
export function drawNothing() {
  for (const name of ["drawArrays", "drawElements", "drawArraysInstanced", "drawElementsInstanced"])
    WebGL2RenderingContext.prototype[name] = () => undefined;
}

// Waits for a number of drawn frames in all, and fails if they do not come.
export async function untilDrawn(page, count) {
  const kMs = 30_000 + 200 * count;
  await page.waitForFunction((wanted) => window.clothstream.drawnFrames >= wanted, count, { timeout: kMs, polling: 200 });
}
