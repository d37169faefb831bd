// SPDX-License-Identifier: MIT
// Contrast of the text that a page shows (WCAG 2.2, 1.4.3).

// Returns a line for each visible text whose contrast with its background is below `least`. Text over the picture is
// compared with the colour of its card on black and on white.
export function poorContrast(page, least) {
  return page.evaluate((wanted) => {
    const parse = (colour) => {
      const probe = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
      probe.fillStyle = colour;
      probe.fillRect(0, 0, 1, 1);
      const [r, g, b, a] = probe.getImageData(0, 0, 1, 1).data;
      return [r, g, b, a / 255];
    };
    const over = (top, below) => [0, 1, 2].map((i) => top[i] * top[3] + below[i] * (1 - top[3]));
    const luminance = (colour) => {
      const [r, g, b] = colour.map((value) => (value <= 10.31475 ? value / 3294.6 : ((value / 255 + 0.055) / 1.055) ** 2.4));
      return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const contrast = (a, b) => {
      const [light, dark] = [luminance(a), luminance(b)].sort((x, y) => y - x);
      return (light + 0.05) / (dark + 0.05);
    };
    const backgroundOf = (element, beneath) => {
      const layers = [];
      for (let at = element; at; at = at.parentElement) layers.unshift(parse(getComputedStyle(at).backgroundColor));
      // The picture lies over the background of the page.
      return layers.reduce((below, layer, index) => (index < 2 ? below : over(layer, below)), beneath);
    };
    const poor = [];
    let seen = 0;
    for (const element of document.querySelectorAll("body *")) {
      const own = [...element.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && node.textContent.trim() !== "");
      if (!own || !element.checkVisibility() || element.closest("noscript, option")) continue;
      ++seen;
      const colour = parse(getComputedStyle(element).color);
      for (const beneath of [[0, 0, 0], [255, 255, 255]]) {
        const background = backgroundOf(element, beneath);
        const ratio = contrast(over(colour, background), background);
        if (ratio < wanted) poor.push(`${element.tagName} "${element.textContent.trim().slice(0, 30)}": ${ratio.toFixed(2)}`);
      }
    }
    if (seen === 0) poor.push("no text is visible");
    return poor;
  }, least);
}
