#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws the CSV file of clothstream-soak: memory, descriptors and threads, and frames of honest viewers over time.
Needs python3-matplotlib.

  tests/soak/plot.py soak.csv docs/images/soak.svg
"""
import csv
import sys

import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot  # noqa: E402

POINTS = 600  # of a curve at most; each is the mean of its samples


def means(values):
    size = -(-len(values) // POINTS)
    return [sum(values[at:at + size]) / len(values[at:at + size]) for at in range(0, len(values), size)]


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], newline="", encoding="utf-8") as file:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    column = {key: means([row[key] for row in rows]) for key in rows[0]}
    minutes = [seconds / 60 for seconds in column["seconds"]]
    share = [100 * received / expected if expected else 100
             for received, expected in zip(column["received"], column["expected"])]

    figure, axes = pyplot.subplots(4, 1, sharex=True, layout="constrained", figsize=(8, 8))
    for plot, label, curves in (
            (axes[0], "resident memory, MB", {"": column["megabytes"]}),
            (axes[1], "number", {"descriptors": column["descriptors"], "threads": column["threads"]}),
            (axes[2], "number", {"participants": column["participants"], "scenes": column["scenes"]}),
            (axes[3], "frames received, %", {"": share})):
        for name, values in curves.items():
            plot.plot(minutes, values, label=name or None, linewidth=0.8)
        plot.set_ylabel(label)
        plot.set_ylim(bottom=0)
        plot.grid(alpha=0.4)
        if len(curves) > 1:
            plot.legend(fontsize="small")
    axes[-1].set_xlabel("minutes")
    figure.savefig(sys.argv[2], metadata={"Date": None})


if __name__ == "__main__":
    main()
