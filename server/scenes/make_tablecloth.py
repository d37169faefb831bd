#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# make_tablecloth.py FILE writes a mesh to FILE when the server is built: a disc of rings with a hem, in the XZ plane.
# Each ring is rotated against its neighbours.
import sys
from math import cos, pi, sin

RINGS, RADIUS, HEM = 22, 0.8, 2  # number of rings; metres; number of outer rings that form the hem

points = [(0.0, 0.0)]
rings = [[1]]  # vertex numbers of each ring, from 1
for ring in range(1, RINGS + 1):
    rings.append([])
    for i in range(6 * ring):
        angle = 2 * pi * (i / (6 * ring)) + 0.013 * (RINGS - ring)
        points.append((RADIUS * ring / RINGS * cos(angle), -RADIUS * ring / RINGS * sin(angle)))
        rings[-1].append(len(points))


def strip(ring):
    inner, outer = rings[ring - 1], rings[ring]
    for sector in range(6):
        for i in range(ring):
            k, j = sector * ring + i, sector * (ring - 1) + i
            a, b = outer[k], outer[(k + 1) % len(outer)]
            c, d = inner[j % len(inner)], inner[(j + 1) % len(inner)]
            yield a, b, c
            if i + 1 < ring:
                yield c, b, d


with open(sys.argv[1], "w") as out:
    out.write("# made by make_tablecloth.py\no tablecloth\n")
    for x, z in points:
        out.write(f"v {x:.6f} 0 {z:.6f}\n")
    for x, z in points:
        out.write(f"vt {0.5 + x / (2 * RADIUS):.5f} {0.5 - z / (2 * RADIUS):.5f}\n")
    for ring in range(1, RINGS + 1):
        if ring == 1:
            out.write("usemtl linen\n")
        if ring == RINGS - HEM + 1:
            out.write("usemtl hem\n")
        for face in strip(ring):
            out.write("f " + " ".join(f"{v}/{v}" for v in face) + "\n")
