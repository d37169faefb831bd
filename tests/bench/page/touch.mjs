// SPDX-License-Identifier: MIT
// A scripted hand in an emulated headset: how deep the cloth is drawn inside it, and whether pinches hold the cloth.
import { drawNothing, untilFrames, untilState } from "../../page/browser.mjs";
import { deepest, enter, openHeadset, pinch, reach, vertex } from "../../page/headset.mjs";

const kDepthGoal = 5; // mm
const kHeldGoal = 95; // %
const kStep = 0.02; // m, way of the hand between two drawn frames
const kHoldFrames = 36; // of the stream

const holds = (page) => page.evaluate(() => window.clothstream.headset.limbs.some((limb) => limb.holds));

export async function touchRows(browser, url, { size, grabs }) {
  const page = await openHeadset(browser, url, { viewport: { width: 160, height: 90 }, prepare: drawNothing });
  try {
    await untilState(page, "live");
    await untilFrames(page, 10);
    await enter(page, "vr");
    const placeOf = (row, column) => Math.floor(row * (size - 1)) * size + Math.floor(column * (size - 1));
    const middle = await vertex(page, placeOf(0.6, 0.5));
    await reach(page, "right", middle, [0, 0, 0.25]);
    await untilFrames(page, 5);
    const depths = await reach(page, "right", middle, [0, 0, -0.15], kStep, deepest);
    // The server's answer may come late. The hand stays.
    const isPushed = ([index, z]) => window.clothstream.positions[3 * index + 2] < z;
    await page.waitForFunction(isPushed, [placeOf(0.6, 0.5), middle[2] - 0.05], { polling: 100 }).catch(() => {
      throw new Error("the hand did not push the cloth");
    });
    await reach(page, "right", middle, [0, 0, 0.3], kStep);

    let taken = 0;
    let held = 0;
    for (let grab = 0; grab < grabs; ++grab) {
      const place = placeOf(0.55 + 0.3 * (grab / grabs), 0.35 + 0.3 * ((grab * 0.618) % 1));
      const [x, y] = await vertex(page, place);
      await reach(page, "right", [x, y, middle[2]], [0, 0, 0.25], kStep);
      await reach(page, "right", await vertex(page, place), [0, 0, 0.02], kStep);
      await pinch(page, 1);
      if (await holds(page)) ++taken;
      await untilFrames(page, kHoldFrames);
      if (await holds(page)) ++held;
      await pinch(page, 0);
      await reach(page, "right", [x, y, middle[2]], [0, 0, 0.3], kStep);
    }
    if (page.errors.length > 0) throw new Error(`the page failed: ${page.errors[0]}`);
    return [
      { figure: "deepest vertex drawn inside the local hand", value: 1000 * Math.max(...depths), unit: "mm", goal: kDepthGoal, most: true },
      { figure: `pinches that took hold, of ${grabs}`, value: (100 * taken) / grabs, unit: "%" },
      { figure: `  and held for ${kHoldFrames} frames`, value: (100 * held) / grabs, unit: "%", goal: kHeldGoal, most: false },
    ];
  } finally {
    await page.context().close();
  }
}
