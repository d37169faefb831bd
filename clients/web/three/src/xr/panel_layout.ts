// SPDX-License-Identifier: MIT
// Rows of a panel on a canvas: where their buttons are, and how they are drawn. Lengths are pixels of the canvas.

export interface PanelButton {
  text: string;
  detail?: string; // smaller, at the right edge
  isChosen?: boolean;
  action?: () => void; // without one, the button is disabled
}

export interface PanelDrawing {
  rows: number; // height
  version: number; // changes with what is drawn
  draw(context: CanvasRenderingContext2D, width: number, height: number): void;
}

// A text, buttons with an optional text on their left, or a drawing.
export interface PanelRow {
  text?: string;
  detail?: string; // smaller, at the right edge
  buttons?: readonly PanelButton[];
  drawing?: PanelDrawing;
}

// Place of a button.
export interface PanelArea {
  left: number;
  top: number;
  width: number;
  height: number;
  button: PanelButton;
}

const kLabelPart = 0.26; // of the width, for the text on the left of buttons
const kMostLines = 5; // of a text
const kLineHeight = 0.6; // of the second line of a text and later ones, in rows
const kGap = 6;
const kFont = "system-ui, sans-serif";

export class PanelLayout {
  readonly areas: PanelArea[] = [];
  readonly bottom: number;
  // Text lines and drawings with their upper ends.
  private readonly lines: { top: number; text: string; detail: string; isLabel: boolean }[] = [];
  private readonly drawings: { top: number; drawing: PanelDrawing }[] = [];

  // `row` is the height of a row. Rows below `height` are left out.
  constructor(
    context: CanvasRenderingContext2D,
    private readonly title: string,
    rows: readonly PanelRow[],
    private readonly width: number,
    height: number,
    private readonly row: number,
    private readonly margin: number,
  ) {
    let top = margin + row;
    for (const { text = "", detail = "", buttons, drawing } of rows) {
      if (drawing) {
        if (top + drawing.rows * row > height - margin) break;
        this.drawings.push({ top, drawing });
        top += drawing.rows * row;
        continue;
      }
      context.font = this.font(0.4);
      const lines = buttons ? [text] : wrapped(context, text, this.inner - (detail ? 0.3 * this.inner : 0));
      if (top + row * (1 + (lines.length - 1) * kLineHeight) > height - margin) break;
      lines.forEach((line, index) => {
        if (line || !buttons) this.lines.push({ top: top + index * row * kLineHeight, text: line, detail: index === 0 ? detail : "", isLabel: buttons !== undefined });
      });
      if (buttons) this.place(buttons, text ? margin + kLabelPart * this.inner : margin, top);
      top += row * (1 + (lines.length - 1) * kLineHeight);
    }
    this.bottom = top + margin;
  }

  get texts(): string[] {
    return this.lines.map(({ text }) => text);
  }

  // Index of the button at a point, or -1.
  at(x: number, y: number): number {
    return this.areas.findIndex(({ left, top, width, height }) => x >= left && x <= left + width && y >= top && y <= top + height);
  }

  draw(context: CanvasRenderingContext2D, hovered: number): void {
    const { row, margin } = this;
    context.fillStyle = "rgba(22, 23, 27, 0.94)";
    round(context, 0, 0, this.width, this.bottom, margin);
    context.textBaseline = "middle";
    this.write(context, this.title, margin, margin + row / 2, 0.5, "#ffffff", "left", this.inner, "600 ");
    for (const { top, text, detail, isLabel } of this.lines) {
      const width = isLabel ? kLabelPart * this.inner - margin / 2 : this.inner;
      this.write(context, text, margin, top + row / 2, 0.4, "#d6d9e0", "left", width);
      if (detail) this.write(context, detail, this.width - margin, top + row / 2, 0.34, "#b4b8c2", "right", 0.3 * this.inner);
    }
    this.areas.forEach((area, index) => this.drawButton(context, area, index === hovered));
    for (const { top, drawing } of this.drawings) {
      context.save();
      context.translate(margin, top);
      drawing.draw(context, this.inner, drawing.rows * row);
      context.restore();
    }
  }

  private get inner(): number {
    return this.width - 2 * this.margin;
  }

  private place(buttons: readonly PanelButton[], left: number, top: number): void {
    const width = (this.width - this.margin - left + kGap) / buttons.length;
    buttons.forEach((button, index) =>
      this.areas.push({ button, left: left + index * width, top: top + kGap / 2, width: width - kGap, height: this.row - kGap }),
    );
  }

  private drawButton(context: CanvasRenderingContext2D, { left, top, width, height, button }: PanelArea, isHovered: boolean): void {
    const { text, detail, isChosen, action } = button;
    context.fillStyle = !action ? "#1d1f24" : isHovered ? "#3d5a80" : isChosen ? "#35527a" : "#2a2c33";
    round(context, left, top, width, height, 10);
    if (isChosen) {
      context.strokeStyle = "#8fb4e8";
      context.lineWidth = 3;
      context.stroke();
    }
    const inset = Math.min(this.margin, 0.06 * width);
    const middle = top + height / 2;
    const colour = action ? "#ffffff" : "#8b8f99";
    const isWide = width > 0.6 * this.inner;
    if (isWide) this.write(context, text, left + inset, middle, 0.4, colour, "left", width * (detail ? 0.65 : 1) - 2 * inset);
    else this.write(context, text, left + width / 2, middle, 0.36, colour, "center", width - 2 * inset);
    if (detail) this.write(context, detail, left + width - inset, middle, 0.34, "#b4b8c2", "right", 0.3 * width);
  }

  private font(size: number): string {
    return `${Math.round(size * this.row)}px ${kFont}`;
  }

  // `size` is a fraction of the height of a row.
  private write(context: CanvasRenderingContext2D, text: string, x: number, y: number, size: number, colour: string, align: CanvasTextAlign, most: number, weight = ""): void {
    context.font = weight + this.font(size);
    context.fillStyle = colour;
    context.textAlign = align;
    context.fillText(text, x, y, most);
    context.textAlign = "left";
  }
}

function round(context: CanvasRenderingContext2D, x: number, y: number, width: number, height: number, radius: number): void {
  context.beginPath();
  context.roundRect(x, y, width, height, radius);
  context.fill();
}

// Lines of a text. What does not fit stays in the last one.
function wrapped(context: CanvasRenderingContext2D, text: string, width: number): string[] {
  const lines = [""];
  for (const word of text.split(" ")) {
    const line = lines.at(-1)!;
    const longer = line ? `${line} ${word}` : word;
    if (line && lines.length < kMostLines && context.measureText(longer).width > width) lines.push(word);
    else lines[lines.length - 1] = longer;
  }
  return lines;
}
