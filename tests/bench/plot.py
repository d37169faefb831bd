#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws rows of a benchmark as curves over two logarithmic axes. Needs python3-matplotlib.

  clothstream-bench work_precision --json | tests/bench/plot.py DIRECTORY      work_precision.svg
  clothstream-bench-peers codec_curves --json | tests/bench/plot.py DIRECTORY  codec_distance.png, codec_normals.png
                                                                               and codec_flicker.png
"""
import json
import pathlib
import sys

import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot  # noqa: E402

BITS = ("bitsPerVertex", "bits a vertex and frame")
# By suite: key of a panel, key of a curve, axis across; then file and axis up of each picture.
PICTURES = {
    "work_precision": ("scene", "method", ("secondsPerSecond", "s of computing a simulated second"),
                       {"work_precision.svg": ("error", "error, m")}),
    "codec": ("motion", "codec", BITS,
              {"codec_distance.png": ("measuredMaxErrorMm", "largest distance, mm"),
               "codec_normals.png": ("normalErrorDegMean", "error of normals, mean, degrees"),
               "codec_flicker.png": ("normalFlickerDegRms", "flicker of normals, RMS, degrees")})}


def draw(rows, file, panel, curve, across, up):
    panels = list(dict.fromkeys(row[panel] for row in rows))
    curves = list(dict.fromkeys(row[curve] for row in rows))
    figure, axes = pyplot.subplots(1, len(panels), sharex=True, sharey=True, squeeze=False, layout="constrained",
                                   figsize=(3.4 * len(panels), 3.8))
    for name, plot in zip(panels, axes[0]):
        for line in curves:
            points = [(row[across[0]], row[up[0]]) for row in rows if (row[panel], row[curve]) == (name, line)]
            plot.loglog(*zip(*points), marker=".", label=line)
        plot.set(title=name, xlabel=across[1])
        plot.grid(alpha=0.4, which="both")
    axes[0][0].set_ylabel(up[1])
    axes[0][-1].legend(fontsize="small")
    figure.savefig(file, dpi=144)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    rows = json.load(sys.stdin)
    panel, curve, across, files = PICTURES[rows[0]["suite"]]
    for file, up in files.items():
        draw(rows, pathlib.Path(sys.argv[1]) / file, panel, curve, across, up)


if __name__ == "__main__":
    main()
