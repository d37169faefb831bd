#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws the rows of `./dev bench offload --json`: time of a frame on the client, and bits a second, by vertices.
Needs python3-matplotlib.

  tests/bench/offload/plot.py tests/bench/results/offload.json docs/images/offload.svg
"""
import json
import sys

import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot, ticker  # noqa: E402

FRAME_MS = 1000 / 72
# Key of the rows: name, colour, style.
CURVES = {"streamMs": ("stream", "C0", "-"),
          "massSpringMs": ("mass-spring, the server's substeps", "C1", "-"),
          "massSpringFewMs": ("mass-spring, 10 substeps", "C1", "--"),
          "xpbdMs": ("XPBD, the server's substeps", "C2", "-"),
          "xpbdFewMs": ("XPBD, 10 substeps", "C2", "--")}


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        rows = json.load(file)
    vertices = [row["vertices"] for row in rows]
    figure, (times, bits) = pyplot.subplots(1, 2, layout="constrained", figsize=(9.6, 4.2),
                                            gridspec_kw={"width_ratios": [2, 1]})
    for key, (name, colour, style) in CURVES.items():
        times.loglog(vertices, [row[key] for row in rows], color=colour, linestyle=style, marker=".", label=name)
    times.axhline(FRAME_MS, color="grey", linewidth=0.8)
    times.annotate("a frame at 72 Hz", (vertices[0], FRAME_MS), fontsize="small", va="bottom", color="grey")
    times.set(xlabel="vertices", ylabel="ms of the client's processor a frame")
    times.legend(fontsize="small")
    bits.loglog(vertices, [row["kbitPerSecond"] for row in rows], color="C0", marker=".")
    bits.set(xlabel="vertices", ylabel="kbit/s of the stream at 72 Hz", ylim=(100, 10000))
    for plot in (times, bits):
        plot.grid(alpha=0.4, which="both")
        plot.set_xticks(vertices, [f"{count:,}" for count in vertices], rotation=45, fontsize="small")
        plot.xaxis.set_minor_formatter(ticker.NullFormatter())
        plot.xaxis.set_minor_locator(ticker.NullLocator())
    figure.savefig(sys.argv[2], metadata={"Date": None})


if __name__ == "__main__":
    main()
