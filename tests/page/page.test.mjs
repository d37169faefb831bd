// SPDX-License-Identifier: MIT
// The page in a browser, with a real server: picture, controls, participants, lost connections.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { networkInterfaces, tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { kChromium, kPicture, launchBrowser, luminance, openPage, takePicture, takePixels, untilFrames, untilState } from "./browser.mjs";
import { distance, look, untilAtRest, vertexOf } from "./frames.mjs";
import { makeLink } from "./link.mjs";
import { startServer } from "./server.mjs";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

// Default error limit of the codec, metres along each of three axes.
const kMaxError = 0.0005;
// Largest distance of a decoded vertex from its true position. A busy page receives coarser qualities; the third has four
// times the error.
const kPromise = Math.sqrt(3) * 4 * kMaxError;
// z to which the sphere is dragged: behind the curtain, which hangs at z = 0 and is pushed along.
const kGoal = -0.3;

const scene = JSON.parse(await readFile(new URL("../../server/scenes/curtain.json", import.meta.url), "utf8"));
const { rows, columns } = scene.cloths[0].grid;

function pinnedNodes() {
  const nodes = new Set();
  for (const pin of scene.cloths[0].pins) {
    for (let row = pin.firstRow ?? 0; row <= (pin.lastRow ?? pin.firstRow ?? 0); row += pin.rowStep ?? 1) {
      for (let column = pin.firstColumn ?? 0; column <= (pin.lastColumn ?? pin.firstColumn ?? 0); column += pin.columnStep ?? 1)
        nodes.add(row * columns + column);
    }
  }
  return nodes;
}

// The largest distance between vertices of two frames, metres.
function furthest(before, after) {
  if (!before) return Infinity;
  let far = 0;
  for (let i = 0; i < before.length / 3; ++i) far = Math.max(far, distance(vertexOf(before, i), vertexOf(after, i)));
  return far;
}

let server;
let browser;
before(async () => {
  server = await startServer();
  browser = await launchBrowser();
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

async function withPage(options, use) {
  const page = await openPage(browser, server.url + (options.query ?? ""), options);
  try {
    await use(page);
    assert.deepEqual(page.errors, []);
  } finally {
    await page.close();
  }
}

test("the cloth moves, and every packet decodes to the state of the server", () =>
  withPage({}, async (page) => {
    await untilState(page, "live");
    await untilFrames(page, 5);
    const first = await look(page);
    await untilFrames(page, 60);
    const second = await look(page);
    assert.equal(first.positions.length, 3 * rows * columns);
    const moved = furthest(first.positions, second.positions);
    assert.ok(moved > 10 * kMaxError, `the furthest vertex moved ${moved} m`);
    assert.equal(second.statistics.decodeErrors, 0);
    assert.equal(second.statistics.hashMismatches, 0);
    assert.ok(second.statistics.framesPerSecond > 0 && second.statistics.kbitPerSecond > 0);
    await takePicture(page, "curtain");
  }));

test("play-out shows positions between frames", () =>
  withPage({ query: "?smooth" }, async (page) => {
    await untilState(page, "live");
    await untilFrames(page, 60);
    // The last vertex and the sphere, as drawn and as in the newest frame, for each displayed frame.
    const seen = await page.evaluate(
      () =>
        new Promise((done) => {
          const seen = [];
          const look = () => {
            const { drawn, positions, drawnColliders, colliders } = window.clothstream;
            seen.push({
              drawn: [...drawn[0].slice(-3)],
              newest: [...positions.slice(-3)],
              drawnSphere: drawnColliders[0],
              newestSphere: colliders[0].position,
            });
            if (seen.length < 40) requestAnimationFrame(look);
            else done(seen);
          };
          requestAnimationFrame(look);
        }),
    );
    // Without play-out, drawn positions would equal those of the newest frame.
    const frames = new Set(seen.map(({ newest }) => newest.join()));
    const between = seen.filter(({ drawn }) => !frames.has(drawn.join()));
    assert.ok(between.length > seen.length / 2, `${between.length} of ${seen.length} lie between frames`);
    assert.ok(seen.every(({ drawn }) => drawn.every(Number.isFinite)));
    const spheres = new Set(seen.map(({ newestSphere }) => newestSphere.join()));
    const spheresBetween = seen.filter(({ drawnSphere }) => !spheres.has(drawnSphere.join()));
    assert.ok(spheresBetween.length > seen.length / 2, `${spheresBetween.length} of ${seen.length} spheres lie between frames`);
    assert.ok(new Set(between.map(({ drawn }) => drawn.join())).size > 5);
    await takePicture(page, "smooth");
  }));

test("the cloth hangs from its pins, which do not move", () =>
  withPage({}, async (page) => {
    await untilState(page, "live");
    const pins = pinnedNodes();
    assert.ok(pins.size > 1);
    let seen;
    // Pins may move within the codec's error, also between key frames.
    for (let i = 0; i < 2; ++i) {
      await untilFrames(page, 30);
      seen = await look(page);
      for (const node of pins) {
        const off = distance(vertexOf(seen.positions, node), vertexOf(seen.rest, node));
        assert.ok(off <= kPromise, `pin ${node}: ${off} m off`);
      }
    }
    const height = (node) => seen.positions[3 * node + 1];
    for (let column = 0; column < columns; ++column) {
      if (!pins.has(column)) assert.ok(height(column) < seen.rest[1], `node ${column} hangs lower than the pins`);
    }
    // The sphere lifts parts of the cloth, but on average the lower edge is below the middle, and the middle below the top.
    const meanHeight = (row) => {
      let sum = 0;
      for (let column = 0; column < columns; ++column) sum += height(row * columns + column);
      return sum / columns;
    };
    assert.ok(meanHeight(rows - 1) < meanHeight(rows >> 1) && meanHeight(rows >> 1) < meanHeight(0));
  }));

// Uses a scene whose cloth comes to rest, so that the screenshot agrees with the positions.
test("the cloth is lit and casts a shadow", () =>
  withPage({ query: "?scene=sphere_drop", viewport: kPicture }, async (page) => {
    await untilState(page, "live");
    await page.addStyleTag({ content: ".card { display: none !important; }" });
    for (let before, after; furthest(before, after) > 2 * kMaxError; ) {
      before = (await look(page)).positions;
      await untilFrames(page, 30);
      after = (await look(page)).positions;
    }
    const points = await page.evaluate(() => {
      const { positions, canvas, project, shadowOf } = window.clothstream;
      const vertices = Array.from({ length: positions.length / 3 }, (_, i) => Array.from(positions.slice(3 * i, 3 * i + 3)));
      const open = ([x, y]) => document.elementFromPoint(x, y) === canvas;
      const shades = vertices.map(shadowOf);
      // Pairs each shadowed point with its mirror point towards the light, if no shadow reaches that point.
      const end = Math.max(...shades.map(([x]) => x));
      const pairs = shades.filter(([x]) => -x > end).map(([x, y, z]) => [project([x, y, z]), project([-x, y, z])]);
      return { cloth: vertices.map(project).filter(open), floor: pairs.filter((pair) => pair.every(open)) };
    });
    const picture = await takePixels(page, "sphere_drop");

    // The cloth is red, the planks of the floor are yellow.
    const isCloth = ([red, green]) => red > 1.5 * green;
    const cloth = points.cloth.map(([x, y]) => picture.colourAt(x, y)).filter(isCloth).map(luminance);
    assert.ok(cloth.length > 0.8 * points.cloth.length, `${cloth.length} of ${points.cloth.length} vertices show as cloth`);
    const mean = cloth.reduce((sum, value) => sum + value, 0) / cloth.length;
    const deviation = Math.sqrt(cloth.reduce((sum, value) => sum + (value - mean) ** 2, 0) / cloth.length);
    assert.ok(mean > 30 && mean < 220, `mean luminance ${mean}`);
    assert.ok(deviation > 4, `light and dark differ by ${deviation}`);

    const floor = points.floor.map((pair) => pair.map(([x, y]) => picture.colourAt(x, y))).filter((pair) => !pair.some(isCloth));
    const ratios = floor.map(([shade, light]) => luminance(shade) / luminance(light)).sort((a, b) => a - b);
    assert.ok(ratios.length > 50, `${ratios.length} points of the floor to compare`);
    const median = ratios[ratios.length >> 1];
    assert.ok(median < 0.85, `the shadowed floor has ${median} of the lit floor's luminance`);
  }));

// The hem of the round cloth is a separate submesh in a colour with more green. The front hides the back of the cloth.
test("a mesh falls and has the colours of its submeshes", () =>
  withPage({ query: "?scene=tablecloth", viewport: kPicture }, async (page) => {
    await untilState(page, "live");
    await untilFrames(page, 60);
    const seen = await look(page);
    assert.equal(seen.positions.length, 3 * 1519);
    // On a slow machine this card would cover the hem.
    await page.evaluate(() => (document.getElementById("failure").style.display = "none"));
    assert.ok(furthest(seen.rest, seen.positions) > 0.1, "the cloth falls");
    assert.equal(seen.statistics.decodeErrors + seen.statistics.hashMismatches, 0);
    const placesNow = () =>
      page.evaluate(() => {
        const { positions, restPositions, canvas, project } = window.clothstream;
        const open = ([x, y]) => document.elementFromPoint(x, y) === canvas;
        const places = { linen: [], hem: [] };
        for (let i = 0; i < positions.length; i += 3) {
          const front = restPositions[i + 2];
          const radius = Math.hypot(restPositions[i], front);
          const part = radius < 0.6 ? places.linen : radius > 0.75 && radius < 0.79 && front > 0.4 ? places.hem : [];
          const place = project(Array.from(positions.slice(i, i + 3)));
          part.push(open(place) ? place : null);
        }
        return places;
      });
    // Points that have the same place before and after the screenshot are valid for it.
    const still = (first, second) =>
      first.filter((place, i) => place && second[i] && Math.hypot(place[0] - second[i][0], place[1] - second[i][1]) < 2);
    let points, picture;
    let pictures = 0;
    do {
      assert.ok(++pictures < 100, "the cloth comes to rest");
      const first = await placesNow();
      picture = await takePixels(page, "tablecloth");
      const second = await placesNow();
      points = { linen: still(first.linen, second.linen), hem: still(first.hem, second.hem) };
    } while (points.linen.length < 100 || points.hem.length < 20);
    const greens = (places) => {
      const cloth = places.map(([x, y]) => picture.colourAt(x, y)).filter(([red, , blue]) => red > blue + 20);
      assert.ok(cloth.length > 0.7 * places.length, `${cloth.length} of ${places.length} vertices show as cloth`);
      return cloth.map(([red, green]) => green / red).sort((a, b) => a - b)[cloth.length >> 1];
    };
    const linen = greens(points.linen);
    const hem = greens(points.hem);
    assert.ok(hem > 1.2 * linen, `green over red is ${hem} at the hem, ${linen} inside`);
  }));

// The lower half of the sheet lies on the floor in several layers: self-collision keeps nodes 12.5 mm apart.
test("a sheet falls into folds and lies on itself", () =>
  withPage({ query: "?scene=folds" }, async (page) => {
    await untilState(page, "live");
    await untilFrames(page, 200);
    const seen = await look(page);
    assert.equal(seen.positions.length, 3 * 44 * 28);
    assert.equal(seen.statistics.decodeErrors + seen.statistics.hashMismatches, 0);
    const heights = seen.positions.filter((_, i) => i % 3 === 1);
    const above = heights.filter((height) => height > 0.01 + 0.0125).length;
    assert.ok(above > 0.2 * heights.length, `${above} of ${heights.length} vertices lie above others`);
    assert.ok(Math.max(...heights) < 0.5, `the highest is ${Math.max(...heights)} m up`);
    await takePicture(page, "folds");
  }));

test("the sphere can be dragged through the cloth", () =>
  withPage({ viewport: kPicture }, async (page) => {
    await untilState(page, "live");
    // View from the side, so that the drag crosses the cloth: 13 steps of 5 degrees in addition to the default view.
    await page.focus("#canvas");
    for (let i = 0; i < 13; ++i) await page.keyboard.press("ArrowRight");
    const project = (point) => page.evaluate((at) => window.clothstream.project(at), point);
    // The sphere swings while the mouse approaches. It is grabbed near its turning point, if necessary with a second try.
    let grab;
    for (let grabbed = false; !grabbed; grabbed = await page.evaluate(() => window.clothstream.canvas.style.cursor === "grabbing")) {
      await page.mouse.up();
      await page.waitForFunction(() => window.clothstream.colliders[0].position[2] > 0.65);
      grab = await project((await look(page)).spheres[0].position);
      await page.mouse.move(...grab);
      await page.mouse.down();
    }
    await untilAtRest(page);
    const held = (await look(page)).spheres[0].position;
    const [heldX, heldY] = await project(held);
    const [goalX, goalY] = await project([held[0], held[1], kGoal]);
    await page.mouse.move(grab[0] + goalX - heldX, grab[1] + goalY - heldY, { steps: 20 });
    await page.waitForFunction((goal) => Math.abs(window.clothstream.colliders[0].position[2] - goal) < 0.05, kGoal);
    await untilAtRest(page);
    await untilFrames(page, 20);
    const pushed = await look(page);
    await takePicture(page, "dragged");

    const { position, radius } = pushed.spheres[0];
    assert.ok(Math.abs(position[2] - kGoal) < 0.05, `the sphere is at z = ${position[2]}`);
    // Contact keeps nodes at the radius plus the cloth's thickness. The codec rounds positions.
    const keep = radius + scene.cloths[0].thickness - kPromise - 1e-5;
    let nearest = Infinity;
    let reach = 0;
    for (let i = 0; i < rows * columns; ++i) {
      nearest = Math.min(nearest, distance(vertexOf(pushed.positions, i), position));
      reach = Math.min(reach, pushed.positions[3 * i + 2]);
    }
    assert.ok(nearest >= keep, `a vertex is ${nearest} m from the centre of the sphere, less than ${keep} m`);
    assert.ok(nearest < radius + 0.1, "the cloth touches the sphere");
    assert.ok(reach < position[2], `the cloth is pushed to z = ${reach}`);

    await page.mouse.up();
    await untilAtRest(page);
    const left = (await look(page)).spheres[0].position;
    assert.ok(distance(left, position) < 0.01, "the sphere stays where it was released");
  }));

test("a slider works by keyboard, and other pages follow", () =>
  withPage({}, (first) =>
    withPage({}, async (second) => {
      await untilState(first, "live");
      await untilState(second, "live");
      await first.click("#tab-air");
      await first.focus("#wind");
      for (let i = 0; i < 20; ++i) await first.keyboard.press("ArrowRight");
      await second.waitForFunction(() => document.getElementById("wind-value").textContent === "2.0 m/s");
      await first.focus("#gravity");
      await first.keyboard.press("End");
      await second.waitForFunction(() => document.getElementById("gravity-value").textContent === "20.00 m/s²");
    }),
  ));

// The flag stretches at its pole. The constraint solver reduces the stretch, and the server's report shows this.
test("the panel changes the solver of a cloth and shows its report", () =>
  withPage({ query: "?scene=flag", viewport: { width: 660, height: 600 } }, (first) =>
    withPage({ query: "?scene=flag" }, async (second) => {
      await untilState(first, "live");
      await untilState(second, "live");
      assert.match(await first.textContent("#server"), /^clothstream-server \d+\.\d+\.\d+$/);
      await first.click("#tab-cloth");
      const figure = (page, name) => page.textContent(`#report [data-figure="${name}"]`);
      // The panel updates four times per second.
      const untilFigure = (page, name, pattern) =>
        page.waitForFunction(
          ([key, source]) => RegExp(source).test(document.querySelector(`#report [data-figure="${key}"]`)?.textContent),
          [name, pattern.source],
        );
      await untilFigure(first, "constraints", /^none$/);
      const nodes = await first.evaluate(() => window.clothstream.cloths[0].vertexCount.toLocaleString("en"));
      assert.equal(await figure(first, "nodes"), nodes);
      await first.waitForFunction(() => /^\d+\.\d ms per tick$/.test(document.getElementById("device-ms").textContent));
      const before = await first.evaluate(() => window.clothstream.reports[0]);
      assert.ok(before.strainMax >= before.strainP99 && before.strainP99 > 0 && before.strainMean > 0);
      assert.ok(before.kineticEnergy >= 0 && before.elasticEnergy > 0 && before.deviceMs > 0);
      assert.equal(before.activeConstraints, 0);

      await first.selectOption("#solver", "2");
      await second.waitForFunction(() => document.getElementById("solver").value === "2");
      await first.waitForFunction(() => window.clothstream.reports[0].activeConstraints > 0);
      await first.waitForFunction((p99) => window.clothstream.reports[0].strainP99 < p99, before.strainP99);
      const after = await first.evaluate(() => window.clothstream.reports[0]);
      assert.ok(after.iterations > 0 && after.residual > 0);
      await untilFigure(first, "constraints", /^[\d,]+$/);
      assert.match(await figure(first, "strain max"), /^-?\d+\.\d\d %$/);
      await first.locator("#report").scrollIntoViewIfNeeded();
      await takePicture(first, "report");

      // ACAD holds springs that are too long; all others are forces. The lines are between vertices of the cloth.
      await first.selectOption("#solver", "3");
      await first.fill("#solver-activation", "0.01");
      await first.press("#solver-activation", "Enter");
      await first.check("#draw-constraints");
      await first.waitForFunction(() => {
        const { constraintEnds, drawn, reports } = window.clothstream;
        if (constraintEnds.length === 0 || constraintEnds.length !== 6 * reports[0].activeConstraints) return false;
        const places = (numbers) => Array.from({ length: numbers.length / 3 }, (_, i) => numbers.slice(3 * i, 3 * i + 3).join());
        const vertices = new Set(places(drawn[0]));
        return places(constraintEnds).every((end) => vertices.has(end));
      });
      await first.locator("#draw-constraints").scrollIntoViewIfNeeded();
      await takePicture(first, "constraints");
      await first.uncheck("#draw-constraints");
      await first.waitForFunction(() => window.clothstream.constraintEnds.length === 0);
      await second.click("#tab-cloth");
      await second.selectOption("#solver", "1");
      await first.waitForFunction(() => document.getElementById("solver").value === "1");
    }),
  ));

test("an unknown scene shows the server's error, and a button joins the default scene", () =>
  withPage({ query: "?scene=no_such_scene" }, async (page) => {
    await untilState(page, "failed");
    await page.waitForSelector('#failure[data-kind="not-found"]:not([hidden])');
    assert.match(await page.textContent("#failure-said"), /no_such_scene/);
    await takePicture(page, "unknown_scene");
    await page.click('#failure [data-action="default"]');
    await untilState(page, "live");
    await page.waitForSelector("#failure", { state: "hidden" });
  }));

test("the list of scenes joins another scene", () =>
  withPage({}, async (page) => {
    await untilState(page, "live");
    await page.click('[data-scene="flag"]');
    await page.waitForFunction(() => document.getElementById("scene-name").textContent === "flag");
    await untilState(page, "live");
    assert.match(page.url(), /\?scene=flag$/);
    await untilFrames(page, 60);
    await takePicture(page, "flag");
  }));

test("the page shows a lost server, and reconnects when it returns", () =>
  withPage({}, async (page) => {
    await untilState(page, "live");
    await server.stop();
    await untilState(page, "reconnecting");
    await page.waitForFunction(() => /^No connection for \d+ s\. Trying again (now|in \d+ s)\.$/.test(document.getElementById("failure-wait").textContent));
    await takePicture(page, "reconnecting");
    server = await startServer(server.port);
    await untilState(page, "live");
    await untilFrames(page, 10);
    await page.waitForSelector("#failure", { state: "hidden" });
  }));

test("participants are listed, and a disconnected one returns with its id", async () => {
  const link = await makeLink(server.port);
  const here = () => window.clothstream.participants.map(({ name, role, away }) => `${name} ${role}${away ? " away" : ""}`);
  const ada = await openPage(browser, `${server.url}?name=Ada`);
  try {
    await untilState(ada, "live");
    const ben = await openPage(browser, `${link.url}?name=Ben&role=viewer`);
    try {
      await untilState(ben, "live");
      await untilFrames(ben, 5);
      await ada.waitForFunction(() => window.clothstream.participants.length === 2);
      assert.deepEqual(await ada.evaluate(here), ["Ada 3", "Ben 1"]);
      assert.deepEqual(await ben.evaluate(here), ["Ada 3", "Ben 1"]);
      assert.deepEqual(await ben.locator("#participants .who").allTextContents(), ["Ada", "Ben (you)"]);
      assert.deepEqual(await ben.locator("#participants select").evaluateAll((all) => all.map(({ value }) => value)), ["3", "1"]);
      await ada.click("#tab-people");
      await takePicture(ada, "participants");
      const id = await ben.evaluate(() => String(window.clothstream.participants[1].id));

      link.cut();
      await untilState(ben, "reconnecting");
      await ada.waitForFunction(() => window.clothstream.participants[1]?.away);
      await takePicture(ada, "cut_off");
      const frames = await ben.evaluate(() => {
        window.returned = new Promise((resolve) => {
          const { frames } = window.clothstream.statistics;
          const wait = () => (window.clothstream.statistics.frames > frames ? resolve(Date.now()) : setTimeout(wait, 1));
          wait();
        });
        return window.clothstream.statistics.frames;
      });
      await new Promise((resolve) => setTimeout(resolve, 1000));
      const restored = Date.now();
      link.restore();
      const returned = await ben.evaluate(() => window.returned);
      console.log(`the page's first frame came ${returned - restored} ms after the link's return`);
      await untilState(ben, "live");
      assert.ok((await ben.evaluate(() => window.clothstream.statistics.frames)) > frames);
      assert.equal(await ben.evaluate(() => String(window.clothstream.participants[1].id)), id);
      await ada.waitForFunction(() => !window.clothstream.participants[1].away);
      assert.deepEqual(ben.errors, []);
    } finally {
      await ben.close();
    }
    await ada.waitForFunction(() => window.clothstream.participants.length === 1);
  } finally {
    await ada.close();
    link.close();
  }
});

test("a reload keeps the participant and its role; a duplicated tab is another one", async () => {
  const kept = await startServer(0, ["--scene", "curtain", "--hold-page", "60"]);
  const own = (page) => page.evaluate(() => window.clothstream.participants.map(({ id, name, role }) => `${id} ${name} ${role}`));
  const ada = await openPage(browser, `${kept.url}?name=Ada`, { draws: false });
  await untilState(ada, "live"); // before Ben, so that she owns the scene
  const ben = await openPage(browser, `${kept.url}?name=Ben`, { draws: false });
  try {
    await untilState(ben, "live");
    await ben.waitForFunction(() => window.clothstream.participants.length === 2);
    const before = await own(ben);
    assert.match(before[0], /Ada 3$/, "the first to come owns the scene");
    await ben.evaluate(() => {
      window.roles = new Set();
      setInterval(() => window.roles.add(window.clothstream.participants.map(({ name, role }) => `${name} ${role}`).join()), 1);
    });
    for (let i = 0; i < 2; ++i) {
      await ada.reload();
      await untilState(ada, "live");
      await untilFrames(ada, 10);
      await ben.waitForFunction(() => window.clothstream.participants.every(({ away }) => !away));
      assert.deepEqual(await own(ada), before);
      assert.deepEqual(await own(ben), before);
    }
    assert.deepEqual(await ben.evaluate(() => [...window.roles]), ["Ada 3,Ben 2"], "nobody else owned the scene meanwhile");

    // The store of a tab is copied when it is duplicated.
    const [twin] = await Promise.all([ada.context().waitForEvent("page"), ada.evaluate(() => void window.open(window.location.href))]);
    await untilState(twin, "live");
    await ben.waitForFunction(() => window.clothstream.participants.length === 3);
    await untilState(ada, "live");

    // A page with another name is another participant.
    await ada.goto(`${kept.url}?name=Eve`);
    await untilState(ada, "live");
    await ben.waitForFunction(() => window.clothstream.participants.some(({ name, role }) => name === "Eve" && role === 2));
    assert.deepEqual([...ada.errors, ...ben.errors], []);
  } finally {
    await ada.context().close();
    await ben.context().close();
    await kept.stop();
  }
});

test("the page shows its address for other devices", async (t) => {
  const outside = Object.values(networkInterfaces())
    .flat()
    .some(({ family, internal }) => family === "IPv4" && !internal);
  if (!outside) return t.skip("this machine has no address in a network");
  const folder = await mkdtemp(join(tmpdir(), "clothstream-"));
  const home = await startServer(0, ["--scene", "curtain", "--host", "0.0.0.0", "--insecure", "--tls", "self", "--announce", "off", "--state-dir", folder]);
  try {
    const context = await browser.newContext({ ignoreHTTPSErrors: true, viewport: { width: 900, height: 900 } });
    const page = await context.newPage();
    await page.goto(home.url.replace("http:", "https:"));
    await untilState(page, "live");
    await page.click("#tab-people");
    await page.waitForFunction(() => document.getElementById("share-code").naturalWidth > 0);
    assert.match(await page.textContent("#share-address"), new RegExp(`^https://[0-9.]+:${home.port}/$`));
    const { address, fingerprint } = await (await page.request.get(`${home.url.replace("http:", "https:")}address.json`)).json();
    assert.equal(await page.getAttribute("#share-address", "href"), address);
    assert.match(fingerprint, /^[0-9A-F]{2}(:[0-9A-F]{2}){31}$/);
    assert.ok((await page.textContent("#share-key")).endsWith(fingerprint));
    await takePicture(page, "share");
    await context.close();
  } finally {
    await home.stop();
    await rm(folder, { recursive: true });
  }
});

test("the page asks for a pairing code, keeps its token, and shows a code to owners", async () => {
  const folder = await mkdtemp(join(tmpdir(), "clothstream-"));
  const paired = await startServer(0, ["--scene", "curtain", "--pairing", "--state-dir", folder]);
  try {
    const [, code] = await paired.line(/^pair +(\d{6})/);
    const page = await openPage(browser, paired.url, { viewport: { width: 900, height: 600 } });
    await untilState(page, "asking");
    assert.match(await page.textContent("#failure-said"), /requires a token or a pairing code/);
    await takePicture(page, "asking");
    await page.fill("#proof-input", code === "000000" ? "000001" : "000000");
    await page.press("#proof-input", "Enter");
    await page.waitForFunction(() => /is wrong/.test(document.getElementById("failure-said").textContent));
    await page.fill("#proof-input", `${code.slice(0, 3)} ${code.slice(3)}`);
    await page.click("#proof-send");
    await untilState(page, "live");
    assert.ok(await page.isHidden("#proof"));
    await page.click("#tab-people");
    await page.click("#pairing");
    await page.waitForSelector("#pairing-code:not([hidden])");
    await takePicture(page, "pairing");
    const shown = /^(\d{3}) (\d{3}) makes a participant, for 5 minutes$/.exec(await page.textContent("#pairing-code"));
    assert.ok(shown, await page.textContent("#pairing-code"));

    // A token of the server works after the page is loaded again.
    await page.reload();
    await untilState(page, "live");

    const guest = await openPage(browser, paired.url);
    await untilState(guest, "asking");
    await guest.fill("#proof-input", shown[1] + shown[2]);
    await guest.press("#proof-input", "Enter");
    await untilState(guest, "live");
    await guest.click("#tab-people");
    assert.ok(await guest.isHidden("#pairing"), "participants make no codes");

    // A ban lasts until an owner lifts it.
    await page.click("#tab-people");
    await page.getByRole("button", { name: /^Ban / }).click();
    assert.match(await page.textContent("#confirm-text"), /^Ban .+\? Until an owner lifts the ban/);
    await page.click("#confirm-yes");
    await untilState(guest, "failed");
    assert.match(await guest.textContent("#failure-title"), /banned/);
    const lift = page.getByRole("button", { name: /^Lift the ban of / });
    await lift.waitFor();
    await takePicture(page, "banned");
    await guest.reload();
    await untilState(guest, "failed");
    await lift.click();
    await page.waitForSelector("#bans-row", { state: "hidden" });
    await guest.reload();
    await untilState(guest, "live");
    await guest.close();
    await page.close();
  } finally {
    await paired.stop();
    await rm(folder, { recursive: true });
  }
});

// Another web server delivers the page, and answers unknown files with a page.
function answerAddressWithPage() {
  const own = window.fetch;
  window.fetch = (resource, ...rest) =>
    String(resource).endsWith("address.json") ? Promise.resolve(new Response("<html></html>")) : own(resource, ...rest);
}

test("an address that is not JSON is not shown", () =>
  withPage({ prepare: answerAddressWithPage }, async (page) => {
    await untilState(page, "live");
    await page.click("#tab-people");
    assert.ok(await page.isHidden("#share"));
    assert.ok(await page.isVisible("#share-none"));
  }));

test("a browser without WebGL shows what is missing", () =>
  withPage({ prepare: () => (HTMLCanvasElement.prototype.getContext = () => null) }, async (page) => {
    await page.waitForSelector('#failure[data-kind="no-webgl"]:not([hidden])');
    assert.match(await page.textContent("#failure-text"), /WebGL 2/);
  }));

test("the page fits a small screen", () =>
  withPage({ viewport: { width: 360, height: 640 } }, async (page) => {
    await untilState(page, "live");
    await untilFrames(page, 10);
    await takePicture(page, "small");
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth));
    const covered = await page.evaluate(() => {
      const { positions } = window.clothstream;
      let inside = 0;
      for (let i = 0; i < positions.length; i += 3) {
        const [x, y] = window.clothstream.project([positions[i], positions[i + 1], positions[i + 2]]);
        if (x >= 0 && x <= window.innerWidth && y >= 0 && y <= window.innerHeight) ++inside;
      }
      return (3 * inside) / positions.length;
    });
    assert.ok(covered > 0.99, `${covered} of the cloth is in the picture`);
  }));
