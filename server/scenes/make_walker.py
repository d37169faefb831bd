#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Writes walker.json: an avatar that walks in a circle, with joints, and its T-shirt. Both are surfaces of constant
# distance from a figure of bones, made by naive surface nets (Gibson, "Constrained Elastic Surface Nets", 1998).
import json
import math

STEP = 0.03  # m, edge of a cell
SHIRT = 0.022  # m, distance of the shirt from the body
BLEND = 0.04  # m, over which neighbouring limbs flow into each other
NECK, HEM, SLEEVE = 1.43, 0.90, 0.38  # m, heights of the shirt's openings, and half the distance between its sleeves
ARM = math.radians(42)  # of the upper arms at rest, below the horizontal
PERIOD, KEYS, RADIUS, LAPS = 1.2, 20, 1.1, 6  # s of two steps, poses of them, m of the circle, two steps of a lap

# Joints: name, parent, position at rest. Metres, y upwards, the figure looks along -Z.
SHOULDER = (0.17, 1.37, 0.0)


def on_arm(distance):
    return (SHOULDER[0] + distance * math.cos(ARM), SHOULDER[1] - distance * math.sin(ARM), 0.0)


def mirrored(p):
    return (-p[0], p[1], p[2])


JOINTS = [("hips", None, (0, 0.95, 0)), ("chest", "hips", (0, 1.15, 0)), ("head", "chest", (0, 1.50, 0))]
for side, flip in (("left", lambda p: p), ("right", mirrored)):
    JOINTS += [(f"{side}-arm", "chest", flip(SHOULDER)), (f"{side}-forearm", f"{side}-arm", flip(on_arm(0.29))),
               (f"{side}-thigh", "hips", flip((0.10, 0.90, 0))), (f"{side}-shin", f"{side}-thigh", flip((0.10, 0.49, 0))),
               (f"{side}-foot", f"{side}-shin", flip((0.10, 0.09, 0)))]
NAMES = [name for name, _, _ in JOINTS]
PLACE = {name: place for name, _, place in JOINTS}

# Bones: joint that moves it, ends, radii at the ends, and depth relative to width.
BONES = [("hips", (0, 0.95, 0), (0, 1.00, 0), 0.15, 0.15, 0.72), ("chest", (0, 1.12, 0), (0, 1.28, 0), 0.145, 0.165, 0.66),
         ("head", (0, 1.40, 0), (0, 1.52, 0), 0.055, 0.055, 1), ("head", (0, 1.60, 0), (0, 1.64, 0), 0.095, 0.095, 1.1)]
for side, flip in (("left", lambda p: p), ("right", mirrored)):
    BONES += [(f"{side}-arm", flip(on_arm(0)), flip(on_arm(0.27)), 0.062, 0.048, 1),
              (f"{side}-forearm", flip(on_arm(0.29)), flip(on_arm(0.60)), 0.047, 0.042, 1),
              (f"{side}-thigh", flip((0.10, 0.88, 0)), flip((0.10, 0.51, 0)), 0.09, 0.062, 1),
              (f"{side}-shin", flip((0.10, 0.47, 0)), flip((0.10, 0.11, 0)), 0.06, 0.045, 1),
              (f"{side}-foot", flip((0.10, 0.06, 0.02)), flip((0.10, 0.05, -0.15)), 0.047, 0.04, 1)]


def from_bone(p, bone):
    _, a, b, start, end, depth = bone
    p = (p[0], p[1], p[2] / depth)
    ab = [b[i] - a[i] for i in range(3)]
    part = sum((p[i] - a[i]) * ab[i] for i in range(3)) / sum(c * c for c in ab)
    part = min(1, max(0, part))
    away = [p[i] - a[i] - part * ab[i] for i in range(3)]
    return (math.hypot(*away) - start - part * (end - start)) * min(1, depth)


def distance(p):
    """Smooth minimum of the distances from all bones."""
    result = 1e9
    for bone in BONES:
        d = from_bone(p, bone)
        share = max(0, BLEND - abs(d - result)) / BLEND
        result = min(d, result) - share * share * BLEND / 4
    return result


LOW = (-0.84, -0.06, -0.30)
SIZE = (56, 62, 20)


def corner(i, j, k):
    return (LOW[0] + STEP * i, LOW[1] + STEP * j, LOW[2] + STEP * k)


FIELD = {(i, j, k): distance(corner(i, j, k)) for i in range(SIZE[0] + 1) for j in range(SIZE[1] + 1)
         for k in range(SIZE[2] + 1)}
EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if bin(a ^ b).count("1") == 1]


def at(cell, number):
    return (cell[0] + (number & 1), cell[1] + (number >> 1 & 1), cell[2] + (number >> 2 & 1))


def surface(level, keep):
    """Vertices and quads, counter-clockwise from outside, of the surface at this distance in the cells to keep."""
    vertices, numbers = [], {}

    def vertex(cell):
        if cell not in numbers:
            crossings = []
            for a, b in EDGES:
                p, q = at(cell, a), at(cell, b)
                f, g = FIELD[p] - level, FIELD[q] - level
                if (f < 0) != (g < 0):
                    part = f / (f - g)
                    crossings.append([u + part * (v - u) for u, v in zip(corner(*p), corner(*q))])
            numbers[cell] = len(vertices)
            vertices.append([sum(c[axis] for c in crossings) / len(crossings) for axis in range(3)])
        return numbers[cell]

    quads = []
    for here, f in FIELD.items():
        for axis in range(3):
            there = tuple(here[i] + (i == axis) for i in range(3))
            if there not in FIELD or (f < level) == (FIELD[there] < level):
                continue
            u, v = (axis + 1) % 3, (axis + 2) % 3
            cells = [tuple(here[i] - (i == u) * du - (i == v) * dv for i in range(3))
                     for du, dv in ((1, 1), (0, 1), (0, 0), (1, 0))]
            if not all(keep(cell) for cell in cells):
                continue
            if f >= level:
                cells.reverse()
            quads.append([vertex(cell) for cell in cells])
    return vertices, quads


def relaxed(vertices, quads, level, rounds):
    """Moves vertices towards the mean of their neighbours and back to the surface. Edges of the surface stay."""
    around = [set() for _ in vertices]
    sides = {}
    for quad in quads:
        for a, b in zip(quad, quad[1:] + quad[:1]):
            around[a].add(b)
            around[b].add(a)
            sides[frozenset((a, b))] = sides.get(frozenset((a, b)), 0) + 1
    fixed = {vertex for side, count in sides.items() if count == 1 for vertex in side}
    for _ in range(rounds):
        moved = []
        for number, p in enumerate(vertices):
            if number in fixed:
                moved.append(p)
                continue
            p = [(p[i] + sum(vertices[n][i] for n in around[number]) / len(around[number])) / 2 for i in range(3)]
            for _ in range(3):
                gradient = [(distance([p[i] + 1e-4 * (i == axis) for i in range(3)]) - distance(
                    [p[i] - 1e-4 * (i == axis) for i in range(3)])) / 2e-4 for axis in range(3)]
                off = (distance(p) - level) / max(sum(g * g for g in gradient), 1e-6)
                p = [p[i] - off * gradient[i] for i in range(3)]
            moved.append(p)
        vertices = moved
    return vertices


def shirt_cell(cell):
    x, y, z = (c + STEP / 2 for c in corner(*cell))
    along = (abs(x) - SHOULDER[0]) * math.cos(ARM) - (y - SHOULDER[1]) * math.sin(ARM)
    beside = (abs(x) - SHOULDER[0]) * math.sin(ARM) + (y - SHOULDER[1]) * math.cos(ARM)
    on_sleeve = abs(x) > SHOULDER[0] and abs(beside) < 0.13
    return HEM < y < NECK and (not on_sleeve or along < SLEEVE - SHOULDER[0])


def weights_of(p):
    """The joints of the four nearest bones, by the fourth power of their nearness."""
    near = {}
    for bone in BONES:
        d = max(from_bone(p, bone), 0) + 0.02
        near[bone[0]] = max(near.get(bone[0], 0), d ** -4)
    best = sorted(near.items(), key=lambda item: -item[1])[:4]
    best = [(name, weight) for name, weight in best if weight > 0.04 * best[0][1]]
    total = sum(weight for _, weight in best)
    numbers = [round(weight / total, 2) for _, weight in best]
    numbers[0] = round(1 - sum(numbers[1:]), 2)
    filler = 4 - len(best)
    return [NAMES.index(name) for name, _ in best] + [0] * filler, numbers + [0] * filler


def vector(p):
    return {axis: round(value, 5) for axis, value in zip("xyz", p) if round(value, 5)}


def turn(x=0.0, z=0.0):
    """Rotation about X, then about Z, in radians."""
    a, b, c, d = math.sin(x / 2), math.cos(x / 2), math.sin(z / 2), math.cos(z / 2)
    q = {"x": a * d, "y": a * c, "z": b * c, "w": b * d}
    return {axis: round(value, 7) for axis, value in q.items() if round(value, 7)}


def relative(name):
    parent = dict((n, up) for n, up, _ in JOINTS)[name]
    origin = PLACE[parent] if parent else (0, 0, 0)
    return [PLACE[name][i] - origin[i] for i in range(3)]


def step_at(phase):
    """Orientations and the position of the hips at a phase of two steps. At phase 0 the figure is at rest."""
    swing = math.sin(2 * math.pi * phase)
    lift = math.sin(2 * math.pi * phase) ** 2
    joints = []
    for name in NAMES:
        position, orientation = relative(name), {}
        sign = 1 if name.startswith("left") else -1
        if name == "hips":
            position[1] -= 0.02 * lift
        elif name.endswith("thigh"):
            orientation = turn(x=math.radians(24) * sign * swing)
        elif name.endswith("shin"):
            orientation = turn(x=-math.radians(38) * max(0, -sign * swing) ** 2)
        elif name.endswith("-arm"):
            orientation = turn(x=-math.radians(20) * sign * swing, z=-math.radians(10) * sign * lift)
        elif name.endswith("forearm"):
            orientation = turn(x=math.radians(12) * lift)
        joints.append({"position": vector(position), **({"orientation": orientation} if orientation else {})})
    return joints


def circle():
    keys = []
    for i in range(33):
        angle = 2 * math.pi * i / 32
        keys.append({"time": round(PERIOD * LAPS * i / 32, 4),
                     "position": vector((RADIUS * math.cos(angle), 0, -RADIUS * math.sin(angle))),
                     "orientation": {axis: round(value, 7) for axis, value in
                                     (("y", math.sin(angle / 2)), ("w", math.cos(angle / 2))) if round(value, 7)}})
    return keys


body, body_quads = surface(0, lambda cell: True)
body = relaxed(body, body_quads, 0, 3)
shirt, shirt_quads = surface(SHIRT, shirt_cell)
shirt = relaxed(shirt, shirt_quads, SHIRT, 8)
skin = [weights_of(p) for p in body]


def triangles(quads):
    return [corner for a, b, c, d in quads for corner in (a, b, c, a, c, d)]


def numbers(points, digits=4):
    return [round(value, digits) for point in points for value in point]


scene = {
    "name": "walker",
    "description": "An avatar in a T-shirt walks in a circle. Its joints can be moved.",
    "simulationRate": 72, "streamRate": 72, "substeps": 10,
    "cloths": [{
        "name": "shirt",
        "mesh": {"positions": numbers([(x + RADIUS, y, z) for x, y, z in shirt]), "triangles": triangles(shirt_quads),
                 "quads": list(range(0, 2 * len(shirt_quads), 2))},
        "material": "cotton", "thickness": 0.006, "friction": 0.4, "damping": 0.5}],
    "colliders": [
        {"name": "avatar", "friction": 0.8, "motion": {"keys": circle(), "steady": True},
         "mesh": {"positions": numbers(body), "triangles": triangles(body_quads),
                  "skin": {"joints": [{"name": name, **({"parent": NAMES.index(up)} if up else {}),
                                       "rest": {"position": vector(relative(name))}} for name, up, _ in JOINTS],
                           "vertexJoints": [j for joints, _ in skin for j in joints],
                           "vertexWeights": [w for _, weights in skin for w in weights],
                           "animation": {"keys": [{"time": round(PERIOD * i / KEYS, 4), "joints": step_at(i / KEYS)}
                                                  for i in range(KEYS + 1)]}}}},
        {"name": "floor", "plane": {}}]}
with open("walker.json", "w") as out:
    json.dump(scene, out, separators=(",", ":"))
    out.write("\n")
print(f"{len(body)} vertices and {2 * len(body_quads)} triangles of the body, {len(shirt)} nodes of the shirt")
