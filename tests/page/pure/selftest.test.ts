// SPDX-License-Identifier: MIT
// Figures and verdicts of the self-test.

import { expect, test } from "vitest";
import { Samples } from "../../../clients/web/page/src/samples";
import { stepText } from "../../../clients/web/page/src/selftest/guide";
import { spread, type Report } from "../../../clients/web/page/src/selftest/report";
import { verdictsOn } from "../../../clients/web/page/src/selftest/verdicts";

test("samples keep the newest values, and sort them", () => {
  const samples = new Samples(4);
  expect(samples.count).toBe(0);
  expect(samples.quantile(0.5)).toBeUndefined();
  expect(spread(samples)).toBeNull();
  for (const value of [9, 8, 3, 1, 2, 4]) samples.add(value);
  expect(samples.count).toBe(4);
  expect([...samples.sorted()]).toEqual([1, 2, 3, 4]);
  expect([samples.quantile(0), samples.quantile(1)]).toEqual([1, 4]);
  expect(spread(samples)).toEqual({ median: 3, p99: 4, largest: 4 });
});

test("each step of a test is shown at its time", () => {
  expect(stepText(true, 0)).toMatch(/both hands/);
  expect(stepText(true, 0.4)).toMatch(/Push/);
  expect(stepText(true, 0.8)).toMatch(/Pinch/);
  expect(stepText(true, 1)).toBe(stepText(true, 0.95));
  expect(stepText(false, 0.5)).toMatch(/window/);
});

const kTimes = { median: 1, p99: 2, largest: 3 };
const kGood: Report = {
  schema: "clothstream-selftest",
  version: 1,
  date: "2026-11-25T00:00:00.000Z",
  requestedSeconds: 120,
  seconds: 120,
  complete: true,
  device: { userAgent: "test", processors: 8, graphics: null },
  page: { secure: true, isolated: true },
  session: { mode: "immersive-vr", features: null, rates: null, rate: 72, interruptions: 0 },
  display: { frames: 8640, rate: 71.9, gapMs: { median: 13.9, p99: 14.5, largest: 30 }, longGaps: 2 },
  stream: {
    scene: "veil", vertices: 1764, nominalRate: 72, frames: 8630, rate: 71.9, dropped: 0, decodeErrors: 0, hashMismatches: 0, reconnects: 0,
    kbitPerSecond: 300, roundTripMs: 4,
  },
  threads: { decodeMs: kTimes, takeMs: kTimes, inputMs: kTimes, showMs: kTimes, renderMs: kTimes },
  poseToDisplayableMs: { median: 40, p99: 60, largest: 90 },
  hands: { left: 0.8, right: 0.9 },
  controllers: { left: 0, right: 0 },
  touch: { share: 0.2, largestCorrectionMm: 12 },
  grabs: { presses: 5, taken: 4, confirmed: 4, slipped: 1, longestSeconds: 3.5 },
};

const gradesOf = (report: Report) => Object.fromEntries(verdictsOn(report).map(({ name, grade }) => [name, grade]));

test("a report without faults is good in every figure", () => {
  expect(Object.values(gradesOf(kGood))).toEqual(Array(9).fill("good"));
});

test.each<[string, Partial<Report>]>([
  ["Display", { display: { ...kGood.display, rate: 60 } }],
  ["Longest pause", { display: { ...kGood.display, gapMs: { median: 13.9, p99: 14.5, largest: 51 } } }],
  ["Stream", { stream: { ...kGood.stream, rate: 60 } }],
  ["Stream", { stream: { ...kGood.stream, reconnects: 1 } }],
  ["Frames", { stream: { ...kGood.stream, dropped: 1 } }],
  ["Frames", { stream: { ...kGood.stream, hashMismatches: 1 } }],
  ["Decoding", { threads: { ...kGood.threads, decodeMs: { median: 8, p99: 9, largest: 9 } } }],
  ["Main thread", { threads: { ...kGood.threads, showMs: { median: 5, p99: 6, largest: 9 } } }],
  ["Response", { poseToDisplayableMs: { median: 101, p99: 110, largest: 120 } }],
  ["Hands", { hands: { left: 0.4, right: 1 } }],
  ["Grabs", { grabs: { ...kGood.grabs!, confirmed: 0 } }],
  ["Grabs", { grabs: { ...kGood.grabs!, longestSeconds: 0.9 } }],
])("a fault is found in %s, and only there", (name, change) => {
  const poor = Object.entries(gradesOf({ ...kGood, ...change })).filter(([, grade]) => grade === "poor");
  expect(poor).toEqual([[name, "poor"]]);
});

test("controllers take the part of hands, and figures that are missing are not measured", () => {
  expect(gradesOf({ ...kGood, hands: { left: 0, right: 0 }, controllers: { left: 1, right: 1 } })["Hands"]).toBe("good");
  const window = { hands: null, controllers: null, grabs: null, touch: null };
  const grades = gradesOf({ ...kGood, ...window });
  expect([grades["Hands"], grades["Grabs"], grades["Display"]]).toEqual(["unknown", "unknown", "good"]);
});
