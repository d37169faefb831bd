#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Writes dress.json and gown.json: a figure that walks in a circle, in clothes that follow its joints. figure.py has the
# figure and its walk, garments.py the clothes. With `--check` it writes nothing and compares. It takes two minutes.
import json
import math
import pathlib
import sys

import figure
import garments
from surfaces import renumbered, runs, surface

RADIUS = 1.1  # m, of the circle
LAPS = round(2 * math.pi * RADIUS / figure.STRIDE)  # of two steps on the circle
HIPS = figure.NAMES.index("hips")
SPINE = figure.NAMES.index("spine")
CHEST = figure.NAMES.index("chest")
TIGHT = 0.93  # m, height above which the dress is tight
COLLAR = 1.35  # m, height above which the cape is tight

SHORT = figure.Profile([(0.45, 0.375, 0.350, 0.018), (0.80, 0.260, 0.225, 0.018), (0.88, 0.225, 0.180, 0.018),
                        (0.93, 0.202, 0.148, 0.016), (0.97, 0.184, 0.126, 0.012), (1.01, 0.160, 0.106, 0.008),
                        (1.04, 0.132, 0.088, 0.004)])
LONG = figure.Profile([(0.05, 0.470, 0.475, 0.030), (0.15, 0.445, 0.445, 0.028), (0.50, 0.330, 0.320, 0.022),
                       (0.80, 0.250, 0.210, 0.018), (0.88, 0.222, 0.176, 0.018), (0.93, 0.202, 0.148, 0.016),
                       (0.97, 0.184, 0.126, 0.012), (1.01, 0.160, 0.106, 0.008), (1.04, 0.132, 0.088, 0.004)])
MANTLE = figure.Profile([(0.10, 0.480, 0.520, 0.030), (0.50, 0.395, 0.385, 0.022), (0.95, 0.295, 0.215, 0.014),
                         (1.15, 0.265, 0.160, 0.006), (1.25, 0.258, 0.138, 0.004), (1.33, 0.240, 0.110, 0.004),
                         (1.38, 0.170, 0.075, 0.006)])


class Body:
    def __init__(self, length):
        self.points, self.triangles = surface(figure.body, (-0.66, -0.04, -0.24), (0.66, 1.80, 0.24), length)
        self.points = [[round(c, 4) for c in p] for p in self.points]
        self.weights = figure.weights(self.points, self.triangles)


def dress_weights(p):
    """The trunk's joints by height, each over so long a way that their turns stretch the bodice by little. The body's own
    weights change within few centimetres, and stretch it more."""
    hips, chest = 1 - garments.between(p[1], 0.93, 1.16), garments.between(p[1], 1.04, 1.32)
    total = hips + chest + (1 - hips) * (1 - chest)
    return figure.four({HIPS: hips / total, SPINE: (1 - hips) * (1 - chest) / total, CHEST: chest / total})


def distance_below(height, p):
    """Tight above this height; the limit grows to 10 cm over the next 10 cm, and the rest is unbounded."""
    if p[1] >= height:
        return 0
    if p[1] < height - 0.10:
        return -1  # unbounded
    return round(max(0.001, height - p[1]), 4)


def dress_distance(p):
    return distance_below(TIGHT, p)


def cape_distance(p):
    return distance_below(COLLAR, p)


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


def arranged(points, triangles, distance):
    """Nodes that neighbours in number can handle together: those that follow exactly last, each run of eight in one
    place. Processors take as many nodes at a time, and wait for the one that takes longest."""
    free = [n for n, p in enumerate(points) if distance(p) != 0]
    exact = [n for n, p in enumerate(points) if distance(p) == 0]
    return renumbered(points, triangles, runs(points, free) + runs(points, exact))


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


def dress(profile, hem, length, settings):
    points, triangles = arranged(*garments.dress(profile, hem, length), dress_distance)
    print(f"dress: {len(points)} nodes, {len(triangles)} triangles")
    return {"name": "dress", "mesh": mesh(points, triangles), **settings,
            "skin": {"collider": "avatar", **skin([dress_weights(p) for p in points]),
                     "maxDistances": [dress_distance(p) for p in points]}}


def cape(hem, length, settings):
    points, triangles = arranged(*garments.cape(MANTLE, hem, length), cape_distance)
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


def short_dress():
    settings = {"material": "cotton", "thickness": 0.006, "friction": 0.3, "damping": 0.5, "tethers": {},
                "solver": {"xpbd": {"iterations": 5}}}
    write("dress", "A figure in a dress walks in a circle. The bodice follows its joints, the skirt swings.",
          Body(0.042), [dress(SHORT, 0.52, 0.0325, settings)], {"substeps": 4})


def gown():
    length = 0.019  # m, sides of the triangles
    # Balls are as large as the shortest side permits. The cape is heavier than the dress, so that air lifts it less.
    settings = {"thickness": 0.006, "friction": 0.3, "damping": 0.5, "tethers": {},
                "solver": {"xpbd": {"iterations": 3}}, "selfCollision": {"radius": 0.0092}}
    write("gown", "A figure in a gown and a cape walks in a circle. For GPUs: more than nine thousand nodes.",
          Body(0.032), [dress(LONG, 0.15, length, {"material": "silk", **settings}),
                        cape(0.37, length, {"material": "cotton", **settings})], {"substeps": 16})


def main():
    short_dress()
    gown()


main()
