#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws the rows of `./dev bench crowd --json`: time of the device in a tick, cores by stage, and frames/s, by scenes.
Needs python3-matplotlib.

  tests/bench/crowd/plot.py tests/bench/results/crowd.json docs/images/crowd.svg
"""
import json
import sys

import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot, ticker  # noqa: E402

FRAME_MS, RATE = 1000 / 72, 72
STAGES = ("device", "publisher", "network", "other")


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        rows = json.load(file)
    scenes = [row["scenes"] for row in rows]
    figure, (device, cores, frames) = pyplot.subplots(1, 3, layout="constrained", figsize=(12, 3.8))

    device.loglog(scenes, [row["deviceMs"] for row in rows], color="C0", marker=".")
    device.axhline(FRAME_MS, color="grey", linewidth=0.8)
    device.annotate("a tick at 72 Hz", (scenes[0], FRAME_MS), fontsize="small", va="bottom", color="grey")
    device.set(ylabel="ms of the device in a tick of all scenes")

    for stage in STAGES:
        cores.semilogx(scenes, [row[f"{stage}Cores"] for row in rows], marker=".", label=stage)
    cores.set(ylabel="cores of the server")
    cores.legend(fontsize="small")

    for key, name, style in (("medianFramesPerSecond", "median", "-"), ("slowestFramesPerSecond", "slowest", "--")):
        frames.semilogx(scenes, [row[key] for row in rows], color="C0", linestyle=style, marker=".", label=name)
    frames.set(ylabel="frames/s of a viewer", ylim=(0, 1.1 * RATE))
    frames.legend(fontsize="small")

    for plot in (device, cores, frames):
        plot.set(xlabel="scenes")
        plot.grid(alpha=0.4, which="both")
        plot.set_xticks(scenes, [f"{count:,}" for count in scenes], fontsize="small")
        plot.xaxis.set_minor_formatter(ticker.NullFormatter())
        plot.xaxis.set_minor_locator(ticker.NullLocator())
    figure.savefig(sys.argv[2], metadata={"Date": None})


if __name__ == "__main__":
    main()
