// SPDX-License-Identifier: MIT
// Vertices and colliders of a page's newest frame.

export const vertexOf = (values, index) => Array.from(values.slice(3 * index, 3 * index + 3));
export const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

// Copies vertices, colliders and statistics of one frame.
export function look(page) {
  return page.evaluate(() => {
    const { positions, restPositions, colliders, statistics } = window.clothstream;
    return {
      positions: Array.from(positions),
      rest: Array.from(restPositions),
      spheres: colliders.map(({ name, position, radius }) => ({ name, position: [...position], radius })),
      statistics,
    };
  });
}

// Waits until the sphere has not moved for three frames.
export function untilAtRest(page) {
  return page.waitForFunction(() => {
    const { colliders, statistics } = window.clothstream;
    const seen = window.seenSphere;
    if (seen && statistics.frames < seen.frames + 3) return false;
    window.seenSphere = { frames: statistics.frames, position: colliders[0].position.join() };
    return window.seenSphere.position === seen?.position;
  });
}
