#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Plots the strain of the cloths of a recording over time. Usage: strain_over_time.py RECORDING.mcap OUT.png

The strain of an edge of the triangles is its length divided by its length at rest, minus 1. Needs matplotlib."""
import sys

import matplotlib
import numpy as np

import clothstream

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

if len(sys.argv) != 3:
    sys.exit(__doc__)


def edges(triangles):
    """Each edge of the triangles once: shape (edges, 2)."""
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def lengths(positions, ends):
    return np.linalg.norm(positions[ends[:, 0]] - positions[ends[:, 1]], axis=1)


with clothstream.open_recording(sys.argv[1]) as recording:
    recording.seek_tick(0)  # before the first frame, the positions are those at rest
    ends = edges(recording.triangles)
    rest = lengths(recording.positions, ends)
    seconds, mean, percentile = [], [], []
    for frame in recording:
        strain = np.abs(lengths(frame.positions, ends) / rest - 1)
        seconds.append(frame.tick / recording.simulation_rate)
        mean.append(100 * strain.mean())
        percentile.append(100 * np.percentile(strain, 99))
    title = f"{recording.scene}: {recording.vertex_count} vertices, {len(seconds)} frames"

pyplot.figure(figsize=(8, 4.5))
pyplot.plot(seconds, percentile, label="99th percentile")
pyplot.plot(seconds, mean, label="mean")
pyplot.xlabel("simulated time [s]")
pyplot.ylabel("absolute strain of edges [%]")
pyplot.title(title)
pyplot.legend()
pyplot.tight_layout()
pyplot.savefig(sys.argv[2], dpi=150)
print(f"{sys.argv[2]}: at most {max(percentile):.2f} % (99th percentile)")
