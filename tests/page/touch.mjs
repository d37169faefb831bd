// SPDX-License-Identifier: MIT
// Fingers on a page with a touch screen.

// down() and move() take the places of all fingers, [x, y] in CSS pixels; up() lifts those after the first `left`.
export async function fingersOn(page) {
  const session = await page.context().newCDPSession(page);
  let points = [];
  const send = (type) => session.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
  const frame = () => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => done())));
  return {
    async down(...places) {
      points = places;
      await send("touchStart");
      await frame();
    },
    async move(steps, ...places) {
      const start = points;
      for (let step = 1; step <= steps; ++step) {
        points = places.map((place, finger) => place.map((goal, axis) => start[finger][axis] + ((goal - start[finger][axis]) * step) / steps));
        await send("touchMove");
        await frame();
      }
    },
    async up(left = 0) {
      points = points.slice(0, left);
      await send("touchEnd");
      await frame();
    },
  };
}
