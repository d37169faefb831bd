#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Writes gown.json and dress.json: a figure that walks in a circle, in clothes that follow its joints. figure.py has the
# figure and its walk, garments.py the clothes. With `--check` it writes nothing and compares. It takes a minute.
import json
import math
import pathlib
import sys

import figure
import garments
from surfaces import cross, surface

RADIUS = 1.1  # m, of the circle
LAPS = round(2 * math.pi * RADIUS / figure.STRIDE)  # of two steps on the circle
HIPS = figure.NAMES.index("hips")
CHEST = figure.NAMES.index("chest")
TIGHT = 0.93  # m, height above which the dress is tight

LONG = figure.Profile([(-0.05, 0.455, 0.460, 0.030), (0.05, 0.430, 0.430, 0.030), (0.50, 0.310, 0.295, 0.022),
                       (0.80, 0.240, 0.200, 0.018), (0.88, 0.216, 0.170, 0.018), (0.93, 0.200, 0.146, 0.016),
                       (0.97, 0.184, 0.126, 0.012), (1.01, 0.160, 0.106, 0.008), (1.04, 0.132, 0.088, 0.004)])
SHORT = figure.Profile([(0.45, 0.375, 0.350, 0.018), (0.80, 0.260, 0.225, 0.018), (0.88, 0.225, 0.180, 0.018),
                        (0.93, 0.202, 0.148, 0.016), (0.97, 0.184, 0.126, 0.012), (1.01, 0.160, 0.106, 0.008),
                        (1.04, 0.132, 0.088, 0.004)])
MANTLE = figure.Profile([(0.10, 0.460, 0.520, 0.030), (0.50, 0.370, 0.385, 0.022), (0.95, 0.250, 0.215, 0.014),
                         (1.15, 0.205, 0.155, 0.006), (1.25, 0.180, 0.135, 0.004), (1.33, 0.140, 0.100, 0.004),
                         (1.37, 0.090, 0.060, 0.006)])


def nearest_on(p, a, b, c):
    """Square of the distance of p from a triangle, and weights of the corners of the nearest point (Ericson)."""
    def dot(u, v):
        return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]

    def minus(u, v):
        return (u[0] - v[0], u[1] - v[1], u[2] - v[2])

    def result(u, v, w):
        away = [p[i] - u * a[i] - v * b[i] - w * c[i] for i in range(3)]
        return dot(away, away), (u, v, w)

    ab, ac, ap, bp, cp = minus(b, a), minus(c, a), minus(p, a), minus(p, b), minus(p, c)
    d1, d2, d3, d4, d5, d6 = dot(ab, ap), dot(ac, ap), dot(ab, bp), dot(ac, bp), dot(ab, cp), dot(ac, cp)
    if d1 <= 0 and d2 <= 0:
        return result(1, 0, 0)
    if d3 >= 0 and d4 <= d3:
        return result(0, 1, 0)
    if d6 >= 0 and d5 <= d6:
        return result(0, 0, 1)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if vc <= 0 and d1 >= 0 >= d3:
        return result(1 - d1 / (d1 - d3), d1 / (d1 - d3), 0)
    if vb <= 0 and d2 >= 0 >= d6:
        return result(1 - d2 / (d2 - d6), 0, d2 / (d2 - d6))
    if va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        part = (d4 - d3) / (d4 - d3 + d5 - d6)
        return result(0, 1 - part, part)
    total = va + vb + vc
    return result(va / total, vb / total, vc / total)


class Body:
    def __init__(self, length):
        self.points, self.triangles = surface(figure.body, (-0.66, -0.04, -0.24), (0.66, 1.80, 0.24), length)
        self.points = [[round(c, 4) for c in p] for p in self.points]
        self.weights = figure.weights(self.points, self.triangles)
        self.cells = {}
        for triangle in self.triangles:
            corners = [self.points[corner] for corner in triangle]
            low, high = ([int(math.floor(part(c[i] for c in corners) / 0.05)) for i in range(3)] for part in (min, max))
            for i in range(low[0] - 1, high[0] + 2):
                for j in range(low[1] - 1, high[1] + 2):
                    for k in range(low[2] - 1, high[2] + 2):
                        self.cells.setdefault((i, j, k), []).append(triangle)

    def weights_at(self, p):
        """Weights of the nearest point of the body, which is at most 5 cm away."""
        near = self.cells[tuple(int(math.floor(c / 0.05)) for c in p)]
        _, parts, triangle = min((*nearest_on(p, *(self.points[corner] for corner in triangle)), triangle)
                                 for triangle in near)
        result = {}
        for part, corner in zip(parts, triangle):
            for joint, weight in self.weights[corner].items():
                result[joint] = result.get(joint, 0) + part * weight
        return result


def dress_weights(body, p):
    """The bodice follows the body, except its arms, the skirt the hips."""
    share = garments.between(p[1], 0.97, 1.05)
    result = {HIPS: 1 - share}
    for joint, weight in body.weights_at(p).items() if share > 0 else ():
        kept = CHEST if figure.NAMES[joint].endswith("arm") else joint
        result[kept] = result.get(kept, 0) + share * weight
    return figure.four(result)


def dress_distance(p):
    if p[1] >= TIGHT:
        return 0
    if p[1] < TIGHT - 0.10:
        return -1  # unbounded
    return round(max(0.001, 0.10 * ((TIGHT - p[1]) / 0.10)), 4)


def cape_distance(p):
    if p[1] >= 1.37:
        return 0
    if p[1] < 0.90:
        return -1
    return round(max(0.001, 0.25 * ((1.37 - p[1]) / 0.47) ** 1.5), 4)


def vector(p):
    return {axis: round(value, 5) for axis, value in zip("xyz", p) if round(value, 5)}


def quaternion(q):
    return {axis: round(value, 6) for axis, value in zip("xyzw", q) if round(value, 6)}


def pose(place, turn):
    q = quaternion(turn)
    return {"position": vector(place), **({"orientation": q} if q != {"w": 1} else {})}


def circle():
    seconds = figure.PERIOD * LAPS
    return [{"time": round(seconds * i / 32, 4),
             **pose((RADIUS * math.cos(angle), 0, -RADIUS * math.sin(angle)), figure.rotation(1, math.degrees(angle)))}
            for i, angle in ((i, 2 * math.pi * i / 32) for i in range(33))]


def numbers(points):
    return [value if value else 0 for point in points for value in (round(c, 4) for c in point)]


def skin(weights):
    joints, values = [], []
    for own in weights:
        pairs = list(own.items()) + [(0, 0)] * (4 - len(own))
        joints += [joint for joint, _ in pairs]
        values += [weight for _, weight in pairs]
    return {"vertexJoints": joints, "vertexWeights": values}


def mesh(points, triangles):
    return {"positions": numbers(points), "triangles": [corner for triangle in triangles for corner in triangle]}


def avatar(body):
    walk = [{"time": round(figure.PERIOD * key / figure.KEYS, 5), "joints": [pose(*joint) for joint in joints]}
            for key, joints in enumerate(figure.walk())]
    joints = [{"name": name, **({"parent": parent} if parent is not None else {}),
               "rest": {"position": vector(figure.relative(joint))}}
              for joint, (name, parent) in enumerate(zip(figure.NAMES, figure.PARENT))]
    return {"name": "avatar", "friction": 0.6, "motion": {"keys": circle(), "steady": True},
            "mesh": {**mesh(body.points, body.triangles),
                     "skin": {"joints": joints, **skin(body.weights), "animation": {"keys": walk}}}}


def dress_cloth(body, skirt, hem, length, settings):
    points, triangles = garments.dress(skirt, hem, length)
    print(f"dress: {len(points)} nodes, {len(triangles)} triangles")
    return {"name": "dress", "mesh": mesh(points, triangles), **settings,
            "skin": {"collider": "avatar", **skin([dress_weights(body, p) for p in points]),
                     "maxDistances": [dress_distance(p) for p in points]}}


def cape_cloth(hem, length, settings):
    points, triangles = garments.cape(MANTLE, hem, length)
    print(f"cape: {len(points)} nodes, {len(triangles)} triangles")
    return {"name": "cape", "mesh": mesh(points, triangles), **settings,
            "skin": {"collider": "avatar", **skin([{CHEST: 1}] * len(points)),
                     "maxDistances": [cape_distance(p) for p in points],
                     "backstopDistances": [0.02 if p[1] > 0.95 else 0 for p in points],
                     "backstopRadii": [0.3 if p[1] > 0.95 else 0 for p in points]}}


def write(name, description, body, cloths, settings):
    scene = {"name": name, "description": description, "simulationRate": 72, "streamRate": 72, **settings,
             "cloths": cloths, "colliders": [avatar(body), {"name": "floor", "plane": {}}]}
    text = json.dumps(scene, separators=(",", ":")) + "\n"
    path = pathlib.Path(__file__).parent / f"{name}.json"
    if "--check" not in sys.argv[1:]:
        path.write_text(text)
    elif path.read_text() != text:
        sys.exit(f"{path} is not what {__file__} makes; run it without --check")
    print(f"{name}: {len(body.points)} vertices and {len(body.triangles)} triangles of the body, {len(text)} bytes")


def main():
    body = Body(0.042)
    settings = {"material": "cotton", "thickness": 0.006, "friction": 0.3, "damping": 0.5, "tethers": {},
                "solver": {"xpbd": {"iterations": 2}}}
    write("dress", "A figure in a dress walks in a circle. The bodice follows its joints, the skirt swings.", body,
          [dress_cloth(body, SHORT, 0.52, 0.026, settings)], {"substeps": 5})
    body = Body(0.032)
    length = 0.0195
    settings = {"material": "silk", "thickness": 0.006, "friction": 0.3, "damping": 0.5, "tethers": {},
                "selfCollision": {"radius": 0.0097}}
    write("gown", "A figure in a gown and a cape walks in a circle. For GPUs: about nine thousand nodes.", body,
          [dress_cloth(body, LONG, 0.09, length, settings), cape_cloth(0.30, length, settings)], {"substeps": 16})


main()
