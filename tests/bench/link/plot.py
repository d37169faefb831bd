#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws the age of frames over time at 2 % loss, from the rows of `./dev bench link --json`: one panel for each transport.
Needs python3-matplotlib.

  tests/bench/link/plot.py tests/bench/results/link.json docs/images/link.svg
"""
import json
import sys

import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot  # noqa: E402


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        rows = [row for row in json.load(file) if "frames" in row and row["round"] == 0]
    if not rows:
        sys.exit("no row has frames; measure the condition 2")
    figure, panels = pyplot.subplots(len(rows), 1, sharex=True, sharey=True, squeeze=False, layout="constrained",
                                     figsize=(9, 1 + 2.2 * len(rows)))
    for (panel,), row in zip(panels, rows):
        shown = [(seconds, displayable) for seconds, _, displayable in row["frames"] if displayable is not None]
        panel.plot([frame[0] for frame in row["frames"]], [frame[1] for frame in row["frames"]], ".", markersize=2,
                   color="C1", label="on arrival")
        panel.plot(*zip(*shown), color="C0", linewidth=1, label="when displayable")
        panel.set(title=row["transport"], ylabel="age of the frame, ms")
        panel.set_ylim(bottom=0)
        panel.grid(alpha=0.4)
    panels[0][0].legend(fontsize="small", loc="upper right")
    panels[-1][0].set(xlabel="s")
    figure.savefig(sys.argv[2], metadata={"Date": None})


if __name__ == "__main__":
    main()
