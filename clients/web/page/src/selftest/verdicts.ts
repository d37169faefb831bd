// SPDX-License-Identifier: MIT
// Verdicts on a report, in words that need no knowledge of the project.

import type { Report, Sides, Spread } from "./report";

export type Grade = "good" | "poor" | "unknown";

export interface Verdict {
  name: string;
  result: string;
  grade: Grade;
  text: string;
}

const kFullRate = 0.95; // of a nominal rate
const kShortGapMs = 50;
const kWorkerShare = 0.5; // of the time between two frames
const kMainShare = 0.35; // of the time between two pictures; the renderer takes the rest
const kDirectMs = 100;
const kSeen = 0.5; // of the pictures
const kHoldSeconds = 1;

export function verdictsOn(report: Report): Verdict[] {
  return [display(report), pauses(report), stream(report), frames(report), worker(report), main(report), latency(report),
    inputs(report), grabs(report)];
}

function display({ display: { rate, gapMs }, session }: Report): Verdict {
  const wanted = session.rate ?? (gapMs ? 1000 / gapMs.median : rate);
  const good = rate >= kFullRate * wanted;
  return {
    name: "Display",
    result: `${rate.toFixed(1)} pictures a second${session.rate === null ? "" : ` of ${Math.round(session.rate)}`}`,
    grade: good ? "good" : "poor",
    text: good ? "The picture keeps the rate of the display." : "Pictures are missing. Another program may take the processor, or graphics are too weak.",
  };
}

function pauses({ display: { gapMs, longGaps } }: Report): Verdict {
  if (!gapMs) return unknown("Longest pause", "No two pictures followed each other.");
  const good = gapMs.largest <= kShortGapMs;
  return {
    name: "Longest pause",
    result: `${gapMs.largest.toFixed(0)} ms, ${longGaps} long gaps`,
    grade: good ? "good" : "poor",
    text: good ? "No pause can be seen." : `The picture stood still for more than ${kShortGapMs} ms.`,
  };
}

function stream({ stream: { rate, nominalRate, reconnects } }: Report): Verdict {
  const good = rate >= kFullRate * nominalRate && reconnects === 0;
  const lost = reconnects > 0 ? `, ${reconnects} lost connections` : "";
  return {
    name: "Stream",
    result: `${rate.toFixed(1)} of ${nominalRate} frames a second${lost}`,
    grade: good ? "good" : "poor",
    text: good ? "The network and the server keep up." : "Frames are missing. The network or the server is too slow.",
  };
}

function frames({ stream: { dropped, decodeErrors, hashMismatches } }: Report): Verdict {
  const wrong = decodeErrors + hashMismatches;
  return {
    name: "Frames",
    result: `${dropped} dropped, ${wrong} wrong`,
    grade: dropped + wrong === 0 ? "good" : "poor",
    text: wrong > 0 ? "Frames were damaged. Please report this." : dropped > 0 ? "Some frames did not arrive." : "Every frame arrived and is right.",
  };
}

function worker({ threads: { decodeMs }, stream: { nominalRate } }: Report): Verdict {
  if (!decodeMs) return unknown("Decoding", "No frame was decoded.");
  const good = decodeMs.median <= (kWorkerShare * 1000) / nominalRate;
  return {
    name: "Decoding",
    result: times(decodeMs),
    grade: good ? "good" : "poor",
    text: good ? "The processor decodes fast enough." : "Decoding takes most of the time between two frames.",
  };
}

function main({ threads: { takeMs, inputMs, showMs }, display: { gapMs } }: Report): Verdict {
  if (!takeMs || !inputMs || !showMs || !gapMs) return unknown("Main thread", "No frame was shown.");
  const own = takeMs.median + inputMs.median + showMs.median;
  const good = own <= kMainShare * gapMs.median;
  return {
    name: "Main thread",
    result: `${own.toFixed(2)} ms for a picture, without drawing it`,
    grade: good ? "good" : "poor",
    text: good ? "Most of the time is left for drawing." : "Little time is left for drawing.",
  };
}

function latency({ poseToDisplayableMs }: Report): Verdict {
  if (!poseToDisplayableMs) return unknown("Response", "The time was not measured.");
  const good = poseToDisplayableMs.median <= kDirectMs;
  return {
    name: "Response",
    result: times(poseToDisplayableMs),
    grade: good ? "good" : "poor",
    text: good ? "The cloth answers a hand quickly." : `The cloth answers later than after ${kDirectMs} ms.`,
  };
}

function inputs({ hands, controllers }: Report): Verdict {
  if (!hands || !controllers) return unknown("Hands", "Without a headset there are none.");
  const seen = (sides: Sides, part: number) => sides.left >= part && sides.right >= part;
  const both = (sides: Sides) => `left ${percent(sides.left)}, right ${percent(sides.right)}`;
  const good = seen(hands, kSeen) || seen(controllers, kSeen);
  return {
    name: "Hands",
    result: `hands: ${both(hands)}; controllers: ${both(controllers)}`,
    grade: good ? "good" : "poor",
    text: good ? "The device sees both of them." : `One or both were seen in less than ${percent(kSeen)} of the pictures.`,
  };
}

function grabs({ grabs: made }: Report): Verdict {
  if (!made) return unknown("Grabs", "Without a headset there are none.");
  if (made.presses === 0) return unknown("Grabs", "Nothing was pinched or pressed.");
  const good = made.confirmed > 0 && made.longestSeconds >= kHoldSeconds;
  return {
    name: "Grabs",
    result: `${made.taken} of ${made.presses} presses took hold, ${made.slipped} slipped, longest ${made.longestSeconds.toFixed(1)} s`,
    grade: good ? "good" : "poor",
    text: good ? "The cloth can be held." : `No grab held for ${kHoldSeconds} s.`,
  };
}

function unknown(name: string, text: string): Verdict {
  return { name, result: "not measured", grade: "unknown", text };
}

function times({ median, p99 }: Spread): string {
  return `${median.toFixed(2)} ms, 99 % within ${p99.toFixed(2)} ms`;
}

function percent(part: number): string {
  return `${Math.round(100 * part)} %`;
}
