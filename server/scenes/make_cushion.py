#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# make_cushion.py FILE writes a mesh to FILE when the server is built: two square sheets of quads that share their rim and
# bulge away from each other.
import sys

SIDE, SIZE, BULGE = 20, 0.5, 0.05  # nodes along a side; metres; metres from the middle plane to the middle of a sheet

points = []
numbers = {}  # number of each node, from 1, by side (1 above, -1 below), row and column


def node(side, row, column):
    rim = row in (0, SIDE - 1) or column in (0, SIDE - 1)
    key = (0 if rim else side, row, column)
    if key not in numbers:
        u, v = 2 * column / (SIDE - 1) - 1, 2 * row / (SIDE - 1) - 1
        points.append((SIZE / 2 * u, key[0] * BULGE * (1 - u ** 4) * (1 - v ** 4), SIZE / 2 * v))
        numbers[key] = len(points)
    return numbers[key]


faces = []
for side in (1, -1):
    for row in range(SIDE - 1):
        for column in range(SIDE - 1):
            corners = [(row, column), (row + 1, column), (row + 1, column + 1), (row, column + 1)]
            faces.append([node(side, *corner) for corner in (corners if side > 0 else corners[::-1])])

with open(sys.argv[1], "w") as out:
    out.write("# made by make_cushion.py\no cushion\n")
    for x, y, z in points:
        out.write(f"v {x:.6f} {y:.6f} {z:.6f}\n")
    for face in faces:
        out.write("f " + " ".join(map(str, face)) + "\n")
