// SPDX-License-Identifier: MIT
// New scenes from files on a real server: pins, sizes, repairs, compressed files, and what is refused.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { after, before, test } from "node:test";
import { kChromium, launchBrowser, openPage, takePicture, untilScene, untilState, untilText } from "./browser.mjs";
import { dracoGlb, dropFile, figureGlb, fineObj, sheetGlb } from "./mesh_files.mjs";
import { startServer } from "./server.mjs";
import { fingersOn } from "./touch.mjs";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

const kSheet = 56; // vertices along a side; the scene is larger than one message

let server;
let browser;
before(async () => {
  server = await startServer(0, ["--scene", "sphere_drop"]);
  browser = await launchBrowser();
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

async function withPage(query, options, use) {
  const page = await openPage(browser, server.url + query, options);
  try {
    await untilState(page, "live");
    await use(page);
    assert.deepEqual(page.errors, []);
  } finally {
    await page.close();
  }
}

test("a file dropped on the picture becomes a scene whose pins hold; it is paused, reset and deleted", () =>
  withPage("?name=Ada", { viewport: { width: 1000, height: 900 } }, async (page) => {
    await dropFile(page, "Grandma's Tablecloth.GLB", sheetGlb(kSheet));
    await page.waitForSelector("#create-fields:not([hidden])");
    assert.equal(await page.inputValue("#create-name"), "grandma_s_tablecloth");
    assert.equal(await page.inputValue("#create-size"), "1");
    assert.match(await page.textContent("#create-mesh"), /3,136 vertices, 6,050 triangles, 56 pinned/);
    await page.selectOption("#create-pins", "topCorners");
    assert.match(await page.textContent("#create-mesh"), /, 2 pinned/);
    assert.notEqual(await page.inputValue("#create-material"), "");
    await page.fill("#create-size", "1.5");
    await page.uncheck("#create-self");
    await takePicture(page, "panel_create");
    await page.click("#create-send");
    await untilScene(page, "grandma_s_tablecloth");
    assert.match(page.url(), /scene=grandma_s_tablecloth/);

    // The middle of the upper edge falls by 5 cm; the two corners stay within the error of the stream.
    const look = () =>
      page.evaluate((size) => {
        const { positions, restPositions: rest } = window.clothstream;
        const top = Math.max(...Array.from({ length: rest.length / 3 }, (_, i) => rest[3 * i + 1]));
        let corners = 0;
        let middle = 0;
        const count = rest.length / 3;
        for (let i = 0; i < count; ++i) {
          if (rest[3 * i + 1] < top - 0.001) continue;
          const moved = Math.hypot(...[0, 1, 2].map((axis) => positions[3 * i + axis] - rest[3 * i + axis]));
          if (Math.abs(Math.abs(rest[3 * i]) - 0.75) < 0.001) corners = Math.max(corners, moved);
          else middle = Math.max(middle, moved);
        }
        return { count, top, corners, middle, expected: size * size };
      }, kSheet);
    await page.waitForFunction(() => {
      const { positions, restPositions: rest } = window.clothstream;
      let most = 0;
      for (let i = 0; i < rest.length; ++i) most = Math.max(most, Math.abs(positions[i] - rest[i]));
      return most > 0.1;
    });
    const fallen = await look();
    assert.equal(fallen.count, fallen.expected);
    assert.ok(Math.abs(fallen.top - 2) < 0.001, `the upper edge starts at ${fallen.top} m`);
    assert.ok(fallen.corners < 0.004, `a pinned corner moved ${fallen.corners} m`);
    assert.ok(fallen.middle > 0.05, `the upper edge moved ${fallen.middle} m`);

    await page.click("#scene-pause");
    await untilText(page, "#scene-pause", /^Continue$/);
    await untilText(page, '[data-scene="grandma_s_tablecloth"] .badge', /^paused$/);
    assert.match(await page.textContent("#scene-result"), /Paused for everyone/);
    // A paused scene runs until the first frame after its reset.
    await page.click("#scene-reset");
    await page.waitForFunction(() => {
      const { positions, restPositions: rest } = window.clothstream;
      let most = 0;
      for (let i = 0; i < rest.length; ++i) most = Math.max(most, Math.abs(positions[i] - rest[i]));
      return most < 0.02;
    });
    await page.click("#scene-pause");
    await untilText(page, "#scene-pause", /^Pause$/);

    await page.click("#scene-delete");
    assert.match(await page.textContent("#confirm-text"), /Delete the scene grandma_s_tablecloth\? This cannot be undone/);
    await page.click("#confirm button[value=no]");
    assert.equal(await page.evaluate(() => document.getElementById("confirm").open), false);
    await page.click("#scene-delete");
    await page.click("#confirm-yes");
    await untilScene(page, "sphere_drop");
    await untilText(page, "#scene-result", /^grandma_s_tablecloth is deleted\.$/);
    await page.waitForFunction(() => !document.querySelector('[data-scene="grandma_s_tablecloth"]'));
  }));

// The places of the canvas of the preview, as fractions of its size.
async function previewOf(page) {
  const frame = await page.locator("#preview").boundingBox();
  return { frame, at: (x, y) => [frame.x + x * frame.width, frame.y + y * frame.height] };
}

const pinned = (page) => page.evaluate(() => Array.from(window.clothstream.pinned));

// A flat sheet of 41 x 41 vertices, 2.5 cm apart, falls from 2 m where it is not pinned.
test("a scene holds its cloth where pins are painted, and nowhere else", () =>
  withPage("", { viewport: { width: 1000, height: 1000 } }, async (page) => {
    const size = 41;
    const placeOf = (vertex) => [(vertex % size) / (size - 1) - 0.5, 2, Math.floor(vertex / size) / (size - 1) - 0.5];
    await dropFile(page, "painted.glb", sheetGlb(size, { flat: true }));
    await page.waitForSelector("#create-fields:not([hidden])");
    await page.selectOption("#create-pins", "none");
    assert.match(await page.textContent("#create-mesh"), /no pins/);

    // A click in the middle pins a disc of half the brush.
    await page.fill("#pin-brush", "20");
    const { at } = await previewOf(page);
    await page.mouse.click(...at(0.5, 0.5));
    const disc = await pinned(page);
    assert.ok(disc.length > 35 && disc.length < 60, `${disc.length} vertices`);
    for (const vertex of disc) {
      const [x, , z] = placeOf(vertex);
      assert.ok(Math.hypot(x, z) < 0.115, `${x}, ${z} is pinned`);
    }
    // A stroke to the right leaves no gap. A stroke with Shift, or the tool Free, frees.
    await page.mouse.move(...at(0.5, 0.5));
    await page.mouse.down();
    await page.mouse.move(...at(0.7, 0.5), { steps: 2 });
    await page.mouse.up();
    const stroke = await pinned(page);
    const end = Math.max(...stroke.map((vertex) => placeOf(vertex)[0]));
    assert.ok(end > 0.2, `the stroke ends at x = ${end}`);
    for (let column = 20; placeOf(column)[0] < end - 0.1; ++column) assert.ok(stroke.includes(20 * size + column), `column ${column}`);
    await page.keyboard.down("Shift");
    await page.mouse.click(...at(0.5, 0.5));
    await page.keyboard.up("Shift");
    assert.ok(!(await pinned(page)).includes(20 * size + 20));
    await page.click("#pin-undo");
    assert.deepEqual(await pinned(page), stroke);
    await page.check('input[name="pin-tool"][value="free"]', { force: true });
    await page.mouse.click(...at(0.5, 0.5));
    assert.ok((await pinned(page)).length < stroke.length);
    await page.focus("#preview");
    await page.keyboard.press("Control+z");
    assert.deepEqual(await pinned(page), stroke);
    await page.click("#pin-undo");
    assert.deepEqual(await pinned(page), disc);

    // The right button turns the mesh. The middle of the picture is still the middle of the mesh.
    const before = await page.locator("#preview").screenshot();
    await page.mouse.move(...at(0.5, 0.5));
    await page.mouse.down({ button: "right" });
    await page.mouse.move(...at(0.6, 0.35), { steps: 3 });
    await page.mouse.up({ button: "right" });
    assert.notDeepEqual(await page.locator("#preview").screenshot(), before);
    assert.deepEqual(await pinned(page), disc);
    await page.check('input[name="pin-tool"][value="pin"]', { force: true });
    await page.fill("#pin-brush", "16");
    await page.mouse.click(...at(0.5, 0.5));
    assert.ok((await pinned(page)).length - disc.length < 12, "the same place is pinned again");
    // The corner nearest to the viewer, in the turned picture.
    await page.mouse.move(...at(0.62, 0.62));
    await page.mouse.down();
    await page.mouse.up();
    const pins = await pinned(page);
    const second = pins.filter((vertex) => !disc.includes(vertex) && Math.hypot(placeOf(vertex)[0], placeOf(vertex)[2]) > 0.12);
    assert.ok(second.length > 5, `${second.length} vertices in the second place`);
    await takePicture(page, "panel_painted");

    await page.selectOption("#create-material", "denim");
    await page.click("#create-send");
    await untilScene(page, "painted");
    assert.equal(await page.inputValue("#material"), "denim");
    // The server changes the order of vertices, so they are found by their places. Next to pins and
    // between them, stiff cloth bends little.
    const look = (places) => {
      const { positions, restPositions: rest } = window.clothstream;
      const away = (a, i, b, j) => Math.hypot(a[i] - b[j], a[i + 1] - b[j + 1], a[i + 2] - b[j + 2]);
      const seen = { vertices: rest.length / 3, held: 0, heldMost: 0, freeLeast: Infinity, near: 0, nearMoved: 0 };
      for (let i = 0; i < rest.length; i += 3) {
        let nearest = Infinity;
        for (let pin = 0; pin < places.length; pin += 3) nearest = Math.min(nearest, away(rest, i, places, pin));
        const moved = away(positions, i, rest, i);
        if (nearest < 1e-3) {
          ++seen.held;
          seen.heldMost = Math.max(seen.heldMost, moved);
        } else if (nearest > 0.15) {
          seen.freeLeast = Math.min(seen.freeLeast, moved);
        } else if (nearest > 0.06) {
          ++seen.near;
          if (moved > 0.005) ++seen.nearMoved;
        }
      }
      return seen;
    };
    const places = pins.flatMap(placeOf);
    await page.waitForFunction(
      ([source, all]) => {
        const { freeLeast, near, nearMoved } = eval(`(${source})`)(all);
        return freeLeast > 0.01 && nearMoved > 0.8 * near;
      },
      [String(look), places],
    );
    const { vertices, held, heldMost } = await page.evaluate(look, places);
    assert.equal(vertices, size * size);
    assert.equal(held, pins.length);
    assert.ok(heldMost < 0.004, `a pinned vertex moved ${heldMost} m`);
    await page.click("#scene-delete");
    await page.click("#confirm-yes");
    await untilScene(page, "sphere_drop");
  }));

test("pins are chosen by a box with the keyboard, and by fingers", () =>
  withPage("", { viewport: { width: 1000, height: 1000 }, touch: true }, async (page) => {
    await dropFile(page, "sheet.glb", sheetGlb(8));
    await page.waitForSelector("#create-fields:not([hidden])");
    await page.focus("#create-pins");
    await page.keyboard.type("a box");
    await page.waitForSelector("#create-box:not([hidden])");
    assert.equal((await pinned(page)).length, 8, "the upper tenth");
    await page.getByLabel("Bottom to top, from, percent").fill("50");
    await page.getByLabel("Left to right, to, percent").fill("50");
    assert.deepEqual(await pinned(page), [0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19, 24, 25, 26, 27]);

    await page.selectOption("#create-pins", "none");
    await page.locator("#preview").scrollIntoViewIfNeeded();
    const { at } = await previewOf(page);
    const fingers = await fingersOn(page);
    await fingers.down(at(0.5, 0.5));
    await fingers.move(4, at(0.65, 0.5));
    await fingers.up();
    const painted = await pinned(page);
    assert.ok(painted.length >= 2, `${painted.length} vertices`);
    // Two fingers turn and zoom. What the first one has begun to paint goes.
    const before = await page.locator("#preview").screenshot();
    await fingers.down(at(0.4, 0.7));
    await fingers.down(at(0.4, 0.7), at(0.6, 0.7));
    await fingers.move(4, at(0.3, 0.6), at(0.8, 0.6));
    await fingers.up(1);
    await fingers.up();
    assert.deepEqual(await pinned(page), painted);
    assert.notDeepEqual(await page.locator("#preview").screenshot(), before);
  }));

// Gives the form a figure.
const dress = (page, name, bytes) => page.setInputFiles("#create-figure", { name, mimeType: "model/gltf-binary", buffer: Buffer.from(bytes) });
const limits = (page) => page.evaluate(() => Object.fromEntries(Object.entries(window.clothstream.limits).map(([name, values]) => [name, Array.from(values)])));
const choose = (page, tool) => page.check(`input[name="pin-tool"][value="${tool}"]`, { force: true });

// A hanging sheet of 21 x 21 vertices, 5 cm apart, in front of a figure that sways by 0.4 m.
test("a cloth follows a figure where the distance 0 is painted, and hangs freely elsewhere", () =>
  withPage("", { viewport: { width: 1000, height: 1000 } }, async (page) => {
    const size = 21;
    await dropFile(page, "apron.glb", sheetGlb(size));
    await page.waitForSelector("#create-fields:not([hidden])");
    assert.ok(await page.isHidden('input[name="pin-tool"][value="distance"]'), "limits need a figure");
    await dress(page, "rigid.glb", sheetGlb(4));
    await untilText(page, "#create-error", /rigid\.glb has no mesh with a skin\. Export the figure together with its skeleton\./);
    await dress(page, "figure.glb", figureGlb());
    await untilText(page, "#create-figure-text", /figure\.glb: 2 joints, 12 triangles, sway\./);
    assert.match(await page.textContent("#create-mesh"), /no pins/);
    assert.equal(await page.inputValue("#create-size"), "1");

    // The upper edge follows; a stroke below it may leave by 0.25 m. Shift removes limits again.
    await choose(page, "distance");
    await page.fill("#pin-brush", "12");
    assert.match(await page.textContent("#limit-legend"), /unbounded everywhere/);
    const { at } = await previewOf(page);
    // The sheet is 1 m wide and has a margin: its corners are at 4 and 96 % of the height of the picture.
    const stroke = async (y, from = 0.1, to = 0.9) => {
      await page.mouse.move(...at(from, y));
      await page.mouse.down();
      await page.mouse.move(...at(to, y), { steps: 8 });
      await page.mouse.up();
    };
    await stroke(0.05);
    await page.fill("#limit-value", "0.25");
    await stroke(0.5);
    const painted = await limits(page);
    assert.deepEqual(Object.keys(painted), ["maxDistances"]);
    const row = (index) => painted.maxDistances.slice(size * index, size * (index + 1));
    assert.deepEqual([...new Set(row(0))], [0]);
    assert.deepEqual([...new Set(row(10))], [0.25]);
    assert.deepEqual([...new Set(row(20))], [-1]);
    assert.match(await page.textContent("#limit-legend"), /^Red: 0 m, blue: 0\.25 m, grey: unbounded\.$/);
    await takePicture(page, "panel_figure");
    await page.keyboard.down("Shift");
    await page.mouse.click(...at(0.5, 0.5));
    await page.keyboard.up("Shift");
    assert.equal((await limits(page)).maxDistances[10 * size + 10], -1);
    await page.click("#pin-undo");
    assert.deepEqual(await limits(page), painted);

    // Backstops are painted in the same way, and undone before what was painted earlier.
    await choose(page, "backstop");
    await page.fill("#limit-value", "0.02");
    await stroke(0.5);
    const both = await limits(page);
    assert.ok(Math.abs(both.backstopDistances[10 * size + 10] - 0.02) < 1e-6);
    assert.equal(both.backstopDistances[0], -1);
    await page.focus("#preview");
    await page.keyboard.press("Control+z");
    assert.deepEqual(await limits(page), painted);
    await page.click("#pin-undo");
    assert.equal((await limits(page)).maxDistances[10 * size + 10], -1);
    await choose(page, "distance");
    await page.fill("#limit-value", "0.25");
    await stroke(0.5);
    await choose(page, "backstop");
    await stroke(0.5);
    await page.uncheck("#create-self");
    await page.uncheck("#create-floor");
    await page.click("#create-send");
    await untilScene(page, "apron");

    // In the course of the animation the upper edge goes along with the figure as a whole.
    const look = () => {
      const { positions, restPositions: rest } = window.clothstream;
      const top = [];
      for (let i = 0; i < rest.length; i += 3) if (rest[i + 1] > 0.999) top.push([0, 1, 2].map((axis) => positions[i + axis] - rest[i + axis]));
      const along = top.map(([x]) => x);
      return { count: top.length, least: Math.min(...along), most: Math.max(...along), off: Math.max(...top.map(([, y, z]) => Math.hypot(y, z))) };
    };
    for (const isThere of ["most < 0.1", "least > 0.3"])
      await page.waitForFunction(([source, condition]) => {
        const { most, least } = eval(`(${source})`)();
        return eval(`((most, least) => ${condition})`)(most, least);
      }, [String(look), isThere]);
    for (let i = 0; i < 5; ++i) {
      const { count, least, most, off } = await page.evaluate(look);
      assert.equal(count, size);
      // The error of the stream is below 0.5 mm.
      assert.ok(most - least < 0.002 && off < 0.002, `the upper edge is stretched by ${most - least} m, and off by ${off} m`);
    }
    assert.deepEqual(await page.evaluate(() => window.clothstream.colliders.map(({ name }) => name)), ["figure"]);
    await takePicture(page, "figure_scene");
    await page.click("#scene-delete");
    await page.click("#confirm-yes");
    await untilScene(page, "sphere_drop");
  }));

test("a mesh that does not fit the world is scaled after a question", () =>
  withPage("", { viewport: { width: 1000, height: 900 } }, async (page) => {
    await dropFile(page, "map.obj", Buffer.from("v 0 0 0\nv 25400 0 0\nv 0 12000 0\nf 1 2 3\n"));
    await untilText(page, "#confirm-text", /map\.obj is 25,400 x 12,000 x 0 m large and reaches 25,400 m from the origin; .*Scale it to 2 m\?$/);
    await page.click("#confirm button[value=no]");
    assert.equal(await page.inputValue("#create-size"), "", "the user gives a size");
    await page.click("#create-send");
    assert.equal(await page.evaluate(() => document.getElementById("create-size").validity.valueMissing), true);
    await dropFile(page, "map.obj", Buffer.from("v 0 0 0\nv 25400 0 0\nv 0 12000 0\nf 1 2 3\n"));
    await page.click("#confirm-yes");
    await page.waitForFunction(() => document.getElementById("create-size").value === "2");

    // The server scales what is too small, and says so.
    await dropFile(page, "lace.obj", fineObj(400));
    await page.waitForFunction(() => document.getElementById("create-name").value === "lace");
    await page.fill("#create-size", "0.02");
    await page.click("#create-send");
    await untilText(page, "#confirm-text", /With a longest side of 0\.02 m, lace\.obj has edges with a mean length of 0\.0\d+ mm; .*Scale it to 2 m\?$/);
    await page.click("#confirm button[value=no]");
    assert.ok(await page.isVisible("#create-fields"), "nothing is sent");
    await page.click("#create-send");
    await page.click("#confirm-yes");
    await untilScene(page, "lace");
    assert.match(await page.textContent("#scene-result"), /^lace is ready\. .*scaled by 100 to 2 x 1\.5 x 0 m/);
    const size = await page.evaluate(() => {
      const xs = Array.from(window.clothstream.restPositions).filter((_, i) => i % 3 === 0);
      return Math.max(...xs) - Math.min(...xs);
    });
    assert.ok(Math.abs(size - 2) < 0.001, `it is ${size} m wide`);
  }));

test("a file that is compressed with Draco is read, with a decoder that the server has", () =>
  withPage("", { viewport: { width: 1000, height: 900 } }, async (page) => {
    const asked = [];
    page.on("request", (request) => asked.push(new URL(request.url()).pathname));
    await dropFile(page, "plain.glb", sheetGlb(8));
    await untilText(page, "#create-mesh", /plain\.glb: 64 vertices/);
    assert.deepEqual(asked, [], "the decoder is loaded only when it is needed");
    await dropFile(page, "small.glb", await dracoGlb(20));
    await untilText(page, "#create-mesh", /small\.glb: 400 vertices, 722 triangles, 20 pinned/);
    assert.deepEqual(asked.filter((path) => /draco/.test(path)).sort(), ["/draco_decoder.js", "/draco_decoder.wasm"]);
    // Bytes that are not what they seem.
    const broken = await dracoGlb(20);
    broken.fill(0, broken.indexOf("DRACO"), broken.indexOf("DRACO") + 5);
    await dropFile(page, "broken.glb", broken);
    await untilText(page, "#create-error", /broken\.glb is compressed with Draco, but cannot be decoded: /);
    await dropFile(page, "packed.gltf", Buffer.from('{"asset": {"version": "2.0"}, "extensionsUsed": ["EXT_meshopt_compression"]}'));
    await untilText(page, "#create-error", /packed\.gltf is compressed with meshopt, which is not supported/);
    await dropFile(page, "old.gltf", Buffer.from('{"asset": {"version": "1.0"}}'));
    await untilText(page, "#create-error", /old\.gltf is glTF 1\.0, which is not supported/);
  }));

test("files and names that do not work are explained", () =>
  withPage("", { viewport: { width: 1000, height: 900 } }, async (page) => {
    await dropFile(page, "notes.txt", Buffer.from("hello"));
    await untilText(page, "#create-error", /notes\.txt is not an OBJ, GLB or glTF file/);
    await dropFile(page, "empty.obj", Buffer.from("v 0 0 0\n"));
    await untilText(page, "#create-error", /empty\.obj has no triangles/);
    await dropFile(page, "broken.glb", Buffer.from("glTF, but not really"));
    await untilText(page, "#create-error", /broken\.glb/);
    assert.ok(await page.isHidden("#create-fields"));
    await dropFile(page, "sphere_drop.obj", Buffer.from("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
    await page.waitForSelector("#create-fields:not([hidden])");
    await page.click("#create-send");
    await untilText(page, "#create-error", /sphere_drop/);
    assert.ok(await page.isEnabled("#create-send"));

    // A mesh that cannot be cloth, as three faces share an edge, is repaired on request, and the panel says how.
    await dropFile(page, "book.obj", Buffer.from("v 0 0 0\nv 0 1 0\nv 1 0 0\nv -1 0 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 2 5\n"));
    await page.waitForFunction(() => document.getElementById("create-name").value === "book");
    await page.click("#create-send");
    await untilText(page, "#create-error", /edge/);
    await page.check("#create-repair");
    await page.click("#create-send");
    await untilScene(page, "book");
    assert.match(await page.textContent("#scene-result"), /^book is ready\. .*edge/);
  }));
