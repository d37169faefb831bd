// SPDX-License-Identifier: MIT
// Draws the cloth that each client has received, side by side.

import { mkdir } from "node:fs/promises";
import path from "node:path";

const kColumns = 4;
const kPanel = { width: 300, height: 280 };

// `panels` have the name of a client, its positions and their hash; all show the same tick. Writes a PNG file.
export async function drawClients(browser, { panels, triangles, tick }, file) {
  const rows = Math.ceil(panels.length / kColumns);
  const page = await browser.newPage({ viewport: { width: kColumns * kPanel.width, height: rows * kPanel.height } });
  await page.setContent(`<body style="margin:0;display:flex;flex-wrap:wrap;font:14px sans-serif;background:#fff">`);
  await page.evaluate(draw, { panels, triangles, tick, size: kPanel });
  await mkdir(path.dirname(file), { recursive: true });
  await page.screenshot({ path: file });
  await page.close();
}

// Runs in the page.
function draw({ panels, triangles, tick, size }) {
  // Seen from the front, a little from above and from the right.
  const view = ([x, y, z]) => [x * 0.94 - z * 0.34, y * 0.97 - (x * 0.34 + z * 0.94) * 0.24, x * 0.34 + z * 0.94];
  const corners = (positions) => Array.from({ length: positions.length / 3 }, (_, i) => view(positions.slice(3 * i, 3 * i + 3)));
  const first = corners(panels[0].positions);
  const bounds = [0, 1].map((axis) => [Math.min(...first.map((p) => p[axis])), Math.max(...first.map((p) => p[axis]))]);
  const span = Math.max(bounds[0][1] - bounds[0][0], bounds[1][1] - bounds[1][0]);
  const scale = (0.75 * size.height) / span;
  for (const { name, positions, hash } of panels) {
    const canvas = document.body.appendChild(document.createElement("canvas"));
    Object.assign(canvas, size);
    const context = canvas.getContext("2d");
    const points = corners(positions);
    const faces = [];
    for (let i = 0; i < triangles.length; i += 3) {
      const [a, b, c] = [0, 1, 2].map((k) => points[triangles[i + k]]);
      const [u, v] = [b, c].map((p) => p.map((value, axis) => value - a[axis]));
      const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      const light = Math.abs(0.3 * normal[0] + 0.5 * normal[1] + 0.8 * normal[2]) / (Math.hypot(...normal) || 1);
      faces.push({ corners: [a, b, c], depth: a[2] + b[2] + c[2], light });
    }
    faces.sort((one, other) => one.depth - other.depth);
    const place = ([x, y]) => [
      size.width / 2 + (x - (bounds[0][0] + bounds[0][1]) / 2) * scale,
      size.height / 2 + 14 - (y - (bounds[1][0] + bounds[1][1]) / 2) * scale,
    ];
    for (const { corners: face, light } of faces) {
      context.fillStyle = context.strokeStyle = `hsl(205 60% ${Math.round(25 + 50 * light)}%)`;
      context.beginPath();
      for (const corner of face) context.lineTo(...place(corner));
      context.closePath();
      context.fill();
      context.stroke();
    }
    context.fillStyle = "#111";
    context.font = "bold 15px sans-serif";
    context.fillText(name, 10, 20);
    context.font = "12px monospace";
    context.fillText(`tick ${tick}  ${hash}`, 10, size.height - 8);
  }
}
