# SPDX-License-Identifier: MIT
# Dresses and the cape of the figure, as surfaces of fields.
import math

import figure
from surfaces import surface

NEAR = 0.012  # m, of the bodice from the body
CAPE = 0.034  # m, of the cape's shoulders from the body
SHOULDERS = [figure.PARTS[0], figure.PARTS[1]] + [part for side in (0, 1) for part in
                                                 figure.PARTS[4 + 9 * side:7 + 9 * side]]
CAPE_SHOULDERS = [(shape, 0.05) for shape, _ in [figure.PARTS[0]] + [figure.PARTS[5 + 9 * side] for side in (0, 1)]]


def between(value, start, end):
    """0 below the start, 1 above the end, smooth in between."""
    t = min(1.0, max(0.0, (value - start) / (end - start)))
    return t * t * (3 - 2 * t)


def outside(p, middle, radii):
    """About the distance from an ellipsoid, times its curvature there; for both sides alike."""
    return min(radii) * (math.sqrt(sum(((abs(u) if axis == 0 else u) - v) ** 2 / (r * r) for axis, (u, v, r)
                                       in enumerate(zip(p, middle, radii)))) - 1)


def blended(a, b, blend):
    share = max(0.0, blend - abs(a - b)) / blend
    return min(a, b) - share * share * blend / 4


def dress(skirt, hem, length):
    """Vertices and triangles of a dress without sleeves. The skirt is a profile that begins inside the body."""
    def field(p):
        below = skirt.distance(p)
        return below if p[1] < 0.85 else blended(figure.union(SHOULDERS, p) - NEAR, below, 0.02)

    cuts = [lambda p: p[1] - hem,
            lambda p: outside(p, (0, 1.465, -0.03), (0.090, 0.150, 0.135)),
            lambda p: outside(p, (0.188, 1.345, 0.005), (0.075, 0.125, 0.11))]
    return surface(field, (-0.5, hem - 0.05, -0.5), (0.5, 1.50, 0.5), length, cuts)


def cape(profile, hem, length):
    """Vertices and triangles of a cape that hangs behind the arms, from shoulders and neck."""
    def field(p):
        below = profile.distance(p)
        return below if p[1] < 1.1 else blended(figure.union(CAPE_SHOULDERS, p) - CAPE, below, 0.05)

    cuts = [lambda p: p[1] - hem,
            lambda p: outside(p, (0, 1.475, 0.0), (0.105, 0.075, 0.12)),
            lambda p: p[2] - 0.070 + 0.070 * between(p[1], 1.28, 1.42)]
    return surface(field, (-0.5, hem - 0.05, -0.1), (0.5, 1.50, 0.55), length, cuts)
