#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# make_balloon.py FILE writes a mesh to FILE when the server is built: a sphere, an icosahedron with divided faces.
import sys
from math import sqrt

PARTS, RADIUS = 6, 0.25  # parts of an edge of the icosahedron; metres

GOLDEN = (1 + sqrt(5)) / 2
CORNERS = [(-1, GOLDEN, 0), (1, GOLDEN, 0), (-1, -GOLDEN, 0), (1, -GOLDEN, 0), (0, -1, GOLDEN), (0, 1, GOLDEN),
           (0, -1, -GOLDEN), (0, 1, -GOLDEN), (GOLDEN, 0, -1), (GOLDEN, 0, 1), (-GOLDEN, 0, -1), (-GOLDEN, 0, 1)]
FACES = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
         (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7),
         (9, 8, 1)]

nodes = {}  # number of each node, from 1, by its corners with their weights
points = []


def node(face, i, k):
    """Node of a face: i parts from its first corner to its second one, and k to its third one."""
    weights = {face[0]: PARTS - i - k, face[1]: i, face[2]: k}
    key = tuple(sorted((corner, weight) for corner, weight in weights.items() if weight > 0))
    if key not in nodes:
        place = [sum(CORNERS[corner][axis] * weight for corner, weight in key) for axis in range(3)]
        length = sqrt(sum(x * x for x in place))
        points.append([RADIUS * x / length for x in place])
        nodes[key] = len(points)
    return nodes[key]


triangles = []
for face in FACES:
    for i in range(PARTS):
        for k in range(PARTS - i):
            triangles.append((node(face, i, k), node(face, i + 1, k), node(face, i, k + 1)))
            if i + k + 1 < PARTS:
                triangles.append((node(face, i + 1, k), node(face, i + 1, k + 1), node(face, i, k + 1)))

with open(sys.argv[1], "w") as out:
    out.write("# made by make_balloon.py\no balloon\n")
    for x, y, z in points:
        out.write(f"v {x:.6f} {y:.6f} {z:.6f}\n")
    for triangle in triangles:
        out.write("f " + " ".join(map(str, triangle)) + "\n")
