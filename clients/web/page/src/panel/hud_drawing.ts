// SPDX-License-Identifier: MIT
// Draws the figures with small plots into any canvas, also into a texture. It touches no element of the page.

import { kStages, type Channel, type HudHistory } from "./hud_history";

export interface HudTheme {
  text: string;
  quiet: string;
  line: string;
  accent: string;
  bad: string;
  stages: readonly string[]; // one colour for each of kStages
  font: string; // family
}

// Size of the drawing in its own units. Scale the context to fill another size.
export const kHudWidth = 352;
export const kHudHeight = 272;

interface Cell {
  label: string;
  unit: string;
  channel: Channel;
  digits: number;
  shows?: "sum" | "largest"; // over the whole time, instead of the newest value
}

const kCells: readonly Cell[] = [
  { label: "display", unit: "/s", channel: "displayRate", digits: 0 },
  { label: "stream", unit: "/s", channel: "streamRate", digits: 0 },
  { label: "frame age", unit: "ms", channel: "frameAge", digits: 0 },
  { label: "round trip", unit: "ms", channel: "roundTrip", digits: 1 },
  { label: "network", unit: "kbit/s", channel: "kbit", digits: 0 },
  { label: "precision", unit: "bit/vertex", channel: "bitsPerVertex", digits: 1 },
  { label: "longest pause", unit: "ms", channel: "pause", digits: 0, shows: "largest" },
  { label: "dropped", unit: "/min", channel: "drops", digits: 0, shows: "sum" },
];
interface LinkCell {
  label: string;
  unit: string;
  digits: number;
  of(history: HudHistory): number;
}

const kLinkCells: readonly LinkCell[] = [
  { label: "loss", unit: "%", digits: 1, of: (history) => percent(history.sum("lostPackets"), history.sum("packets") + history.sum("lostPackets")) },
  { label: "repaired", unit: "/min", digits: 0, of: (history) => history.sum("repairedFrames") },
  { label: "requests", unit: "/min", digits: 0, of: (history) => history.sum("requests") },
  { label: "parity", unit: "%", digits: 1, of: (history) => percent(history.sum("parityPackets"), history.sum("packets")) },
];
const kStageLabels = ["up", "server", "down", "decode", "play-out"];

const kColumns = 4;
const kCellWidth = kHudWidth / kColumns;
const kCellHeight = 58;
const kGap = 8;
const kStagesHeight = 82;

// Draws over what is there: clear the canvas before.
export function drawHud(context: CanvasRenderingContext2D, history: HudHistory, theme: HudTheme): void {
  context.textBaseline = "alphabetic";
  context.lineJoin = "round";
  kCells.forEach((cell, index) => {
    const x = (index % kColumns) * kCellWidth;
    drawCell(context, history, theme, cell, x, Math.floor(index / kColumns) * (kCellHeight + kGap), kCellWidth - kGap);
  });
  const stagesAt = 2 * (kCellHeight + kGap);
  drawStages(context, history, theme, stagesAt);
  drawLink(context, history, theme, stagesAt + kStagesHeight + kGap);
}

// The figures as a sentence, for people who do not see the picture.
export function hudText(history: HudHistory): string {
  if (history.length === 0) return "No figures yet.";
  const figures = kCells.map((cell) => `${cell.label} ${textOf(history, cell)} ${cell.unit}`.trim());
  const stages = kStages.map((stage, index) => `${kStageLabels[index]} ${history.at(stage).toFixed(1)}`);
  return `${figures.join(", ")}; pose to picture ${history.latency().toFixed(1)} ms: ${stages.join(", ")}. ${linkText(history)}`;
}

function linkText(history: HudHistory): string {
  if (history.link.transport === "websocket") return `Frames by WebSocket: ${history.link.reason}`;
  const figures = kLinkCells.map(({ label, unit, digits, of }) => `${label} ${of(history).toFixed(digits)} ${unit}`);
  return `Frames by datagrams: ${figures.join(", ")}.`;
}

function percent(part: number, whole: number): number {
  return whole > 0 ? (100 * part) / whole : 0;
}

function textOf(history: HudHistory, { channel, digits, shows }: Cell): string {
  const value = shows === "sum" ? history.sum(channel) : shows === "largest" ? history.largest(channel) : history.at(channel);
  return value.toFixed(digits);
}

function drawCell(context: CanvasRenderingContext2D, history: HudHistory, theme: HudTheme, cell: Cell, x: number, y: number, width: number): void {
  const colour = cell.shows === "sum" && history.sum(cell.channel) > 0 ? theme.bad : theme.text;
  drawFigure(context, theme, cell.label, textOf(history, cell), cell.unit, x, y, colour);
  const most = Math.max(history.largest(cell.channel), 1e-6);
  const floor = y + kCellHeight;
  context.strokeStyle = theme.line;
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(x, floor - 0.5);
  context.lineTo(x + width, floor - 0.5);
  context.stroke();
  context.strokeStyle = theme.accent;
  context.lineWidth = 1.25;
  context.beginPath();
  for (let ago = 0; ago < history.length; ++ago) {
    const right = x + width * (1 - ago / (history.capacity - 1));
    const top = floor - 1 - ((kCellHeight - 34) * history.at(cell.channel, ago)) / most;
    if (ago === 0) context.moveTo(right, top);
    else context.lineTo(right, top);
  }
  context.stroke();
}

function drawFigure(context: CanvasRenderingContext2D, theme: HudTheme, label: string, text: string, unit: string, x: number, y: number, colour: string): void {
  context.font = `10px ${theme.font}`;
  context.fillStyle = theme.quiet;
  context.fillText(label, x, y + 10);
  context.font = `600 15px ${theme.font}`;
  context.fillStyle = colour;
  context.fillText(text, x, y + 27);
  const end = x + context.measureText(text).width + 4;
  context.font = `10px ${theme.font}`;
  context.fillStyle = theme.quiet;
  context.fillText(unit, end, y + 27);
}

// Draws a line of a label and its value.
function drawHeading(context: CanvasRenderingContext2D, theme: HudTheme, label: string, text: string, y: number): void {
  context.font = `10px ${theme.font}`;
  context.fillStyle = theme.quiet;
  context.fillText(label, 0, y + 11);
  const end = context.measureText(label).width + 6;
  context.font = `600 12px ${theme.font}`;
  context.fillStyle = theme.text;
  context.fillText(text, end, y + 11);
}

// How frames travel: figures of the datagrams, or why there are none.
function drawLink(context: CanvasRenderingContext2D, history: HudHistory, theme: HudTheme, y: number): void {
  const { transport, reason } = history.link;
  drawHeading(context, theme, "frames by", transport === "datagrams" ? "datagrams" : "WebSocket", y);
  if (transport === "datagrams") {
    kLinkCells.forEach(({ label, unit, digits, of }, index) =>
      drawFigure(context, theme, label, of(history).toFixed(digits), unit, index * kCellWidth, y + 18, theme.text),
    );
    return;
  }
  context.font = `10px ${theme.font}`;
  context.fillStyle = theme.quiet;
  context.fillText(reason, 0, y + 28, kHudWidth);
}

// Stages from a pose to its picture as areas on top of each other.
function drawStages(context: CanvasRenderingContext2D, history: HudHistory, theme: HudTheme, y: number): void {
  drawHeading(context, theme, "pose to picture", `${history.latency().toFixed(1)} ms`, y);
  context.font = `10px ${theme.font}`;
  let x = 0;
  kStages.forEach((stage, index) => {
    const label = `${kStageLabels[index]} ${history.at(stage).toFixed(0)}`;
    context.fillStyle = theme.stages[index]!;
    context.fillRect(x, y + 20, 7, 7);
    context.fillStyle = theme.quiet;
    context.fillText(label, x + 11, y + 27);
    x += context.measureText(label).width + 22;
  });
  let most = 1;
  for (let ago = 0; ago < history.length; ++ago) most = Math.max(most, history.latency(ago));
  const floor = y + kStagesHeight;
  const height = kStagesHeight - 34;
  // From the top layer down, so that each area covers the lower part of the one before it.
  for (let stage = kStages.length - 1; stage >= 0; --stage) {
    context.fillStyle = theme.stages[stage]!;
    context.beginPath();
    context.moveTo(kHudWidth, floor);
    for (let ago = 0; ago < history.length; ++ago) {
      let sum = 0;
      for (let lower = 0; lower <= stage; ++lower) sum += history.at(kStages[lower]!, ago);
      context.lineTo(kHudWidth * (1 - ago / (history.capacity - 1)), floor - (height * sum) / most);
    }
    context.lineTo(kHudWidth * (1 - Math.max(0, history.length - 1) / (history.capacity - 1)), floor);
    context.fill();
  }
}
