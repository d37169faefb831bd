# SPDX-License-Identifier: MIT
# The figure of the scenes `dress` and `gown`: its joints, its shape as a field of distances, and its walk.
# Metres, y upwards, the figure looks along -Z; its right side is at +X.
import math

ARM = math.radians(52)  # of the arms at rest, below the horizontal
SHOULDER = (0.165, 1.375, 0.008)
UPPER_ARM, LOWER_ARM = 0.28, 0.25
PERIOD, KEYS = 1.2, 36  # s of two steps, poses of them
STRIDE = 1.15  # m of two steps


def on_arm(distance):
    return (SHOULDER[0] + distance * math.cos(ARM), SHOULDER[1] - distance * math.sin(ARM), SHOULDER[2])


def mirrored(p):
    return (-p[0], p[1], p[2])


SIDES = (("right", lambda p: p), ("left", mirrored))
# Joints: name, parent, position at rest.
JOINTS = [("hips", None, (0, 0.96, 0.01)), ("spine", "hips", (0, 1.08, 0)), ("chest", "spine", (0, 1.22, 0)),
          ("neck", "chest", (0, 1.44, 0.015)), ("head", "neck", (0, 1.53, 0.0))]
for side, flip in SIDES:
    JOINTS += [(f"{side}-arm", "chest", flip(SHOULDER)),
               (f"{side}-forearm", f"{side}-arm", flip(on_arm(UPPER_ARM))),
               (f"{side}-hand", f"{side}-forearm", flip(on_arm(UPPER_ARM + LOWER_ARM))),
               (f"{side}-thigh", "hips", flip((0.088, 0.90, 0.005))),
               (f"{side}-shin", f"{side}-thigh", flip((0.085, 0.49, 0.0))),
               (f"{side}-foot", f"{side}-shin", flip((0.085, 0.075, 0.02)))]
NAMES = [name for name, _, _ in JOINTS]
PARENT = [NAMES.index(parent) if parent else None for _, parent, _ in JOINTS]
PLACE = [place for _, _, place in JOINTS]


class Profile:
    """Body of elliptic cross-sections. Rows are height, half-width, half-depth and the middle's z, from below."""

    def __init__(self, rows):
        self.low, self.high = rows[0][0], rows[-1][0]
        self.step = 0.005
        self.rows = [self.smooth(rows, self.low + self.step * i)
                     for i in range(int((self.high - self.low) / self.step + 1.5))]

    @staticmethod
    def smooth(rows, y):
        """Cubic Hermite curve through the rows, with the slope between the neighbours of a row."""
        i = max(0, min(len(rows) - 2, sum(row[0] <= y for row in rows) - 1))
        before, a, b, after = rows[max(i - 1, 0)], rows[i], rows[i + 1], rows[min(i + 2, len(rows) - 1)]
        width = b[0] - a[0]
        t = (y - a[0]) / width

        def value(column):
            start = (b[column] - before[column]) / (b[0] - before[0]) * width
            end = (after[column] - a[column]) / (after[0] - a[0]) * width
            return ((1 + 2 * t) * (1 - t) ** 2 * a[column] + t * (1 - t) ** 2 * start +
                    t * t * (3 - 2 * t) * b[column] + t * t * (t - 1) * end)

        return value(1), value(2), value(3)

    def at(self, y):
        place = min(max((y - self.low) / self.step, 0), len(self.rows) - 1.001)
        i = int(place)
        t = place - i
        return [u + t * (v - u) for u, v in zip(self.rows[i], self.rows[i + 1])]

    def distance(self, p):
        a, b, middle = self.at(p[1])
        x, z = p[0], p[2] - middle
        f = math.sqrt(x * x / (a * a) + z * z / (b * b))
        slope = math.sqrt(x * x / a ** 4 + z * z / b ** 4)
        d = (f - 1) * f / slope if slope > 1e-9 else -min(a, b)
        above = max(p[1] - self.high, self.low - p[1])
        return math.hypot(d, above) if d > 0 and above > 0 else max(d, above)


class Bone:
    """Ball swept along a segment, with a radius at each end, and its depth relative to its width."""

    def __init__(self, a, b, start, end, depth=1.0):
        self.a, self.start, self.depth = (a[0], a[1], a[2] / depth), start, depth
        self.ab = (b[0] - a[0], b[1] - a[1], (b[2] - a[2]) / depth)
        self.square = max(sum(c * c for c in self.ab), 1e-12)
        self.growth = end - start

    def distance(self, p):
        x, y, z = p[0] - self.a[0], p[1] - self.a[1], p[2] / self.depth - self.a[2]
        u, v, w = self.ab
        part = min(1.0, max(0.0, (x * u + y * v + z * w) / self.square))
        x, y, z = x - part * u, y - part * v, z - part * w
        return (math.sqrt(x * x + y * y + z * z) - self.start - part * self.growth) * min(1, self.depth)


TORSO = Profile([(0.83, 0.120, 0.085, 0.012), (0.87, 0.158, 0.106, 0.016), (0.91, 0.172, 0.115, 0.018),
                 (0.95, 0.170, 0.112, 0.014), (1.00, 0.154, 0.099, 0.008), (1.05, 0.132, 0.088, 0.002),
                 (1.10, 0.122, 0.084, -0.002), (1.16, 0.127, 0.088, -0.005), (1.22, 0.140, 0.098, -0.008),
                 (1.27, 0.148, 0.103, -0.008), (1.32, 0.148, 0.097, -0.002), (1.36, 0.130, 0.083, 0.004),
                 (1.40, 0.090, 0.066, 0.010), (1.44, 0.056, 0.053, 0.012)])
# Parts of the body: shape, and over which distance it flows into the parts before it.
PARTS = [(TORSO, 0.0), (Bone((0, 1.42, 0.014), (0, 1.55, 0.002), 0.050, 0.047), 0.035),
         (Bone((0, 1.575, -0.012), (0, 1.645, 0.004), 0.062, 0.078, 1.2), 0.035),
         (Bone((0, 1.68, 0.085), (0, 1.69, 0.085), 0.045, 0.045), 0.02)]
for side, flip in SIDES:
    PARTS += [(Bone(flip((0.062, 1.258, -0.062)), flip((0.064, 1.252, -0.066)), 0.052, 0.052), 0.05),
              (Bone(flip((0.07, 1.392, 0.01)), flip(on_arm(-0.01)), 0.044, 0.050), 0.05),
              (Bone(flip(on_arm(0)), flip(on_arm(0.27)), 0.047, 0.038), 0.035),
              (Bone(flip(on_arm(0.27)), flip(on_arm(0.51)), 0.038, 0.028), 0.02),
              (Bone(flip(on_arm(0.55)), flip(on_arm(0.64)), 0.033, 0.022), 0.03),
              (Bone(flip((0.086, 0.89, 0.008)), flip((0.085, 0.52, 0.0)), 0.084, 0.054), 0.03),
              (Bone(flip((0.085, 0.50, 0.002)), flip((0.085, 0.12, 0.018)), 0.050, 0.036), 0.03),
              (Bone(flip((0.086, 0.40, 0.020)), flip((0.086, 0.32, 0.024)), 0.048, 0.044), 0.03),
              (Bone(flip((0.086, 0.042, 0.03)), flip((0.096, 0.030, -0.12)), 0.040, 0.029), 0.03)]


def union(parts, p):
    """Smooth minimum of the distances of shapes."""
    result = 1e9
    for shape, blend in parts:
        d = shape.distance(p)
        share = max(0.0, blend - abs(d - result)) / blend if blend else 0.0
        result = min(d, result) - share * share * blend / 4
    return result


def body(p):
    return union(PARTS, p)


# Bones that give the weights: joint and shape.
HOLDERS = [("hips", Bone((-0.05, 0.94, 0.01), (0.05, 0.94, 0.01), 0.11, 0.11)),
           ("spine", Bone((-0.03, 1.10, 0), (0.03, 1.10, 0), 0.095, 0.095)),
           ("chest", Bone((-0.05, 1.26, 0), (0.05, 1.26, 0), 0.105, 0.105)),
           ("neck", Bone((0, 1.46, 0.014), (0, 1.50, 0.008), 0.05, 0.05)),
           ("head", Bone((0, 1.60, 0), (0, 1.66, 0), 0.08, 0.08))]
for side, flip in SIDES:
    HOLDERS += [("chest", Bone(flip((0.05, 1.385, 0.01)), flip((0.125, 1.385, 0.008)), 0.05, 0.05)),
                (f"{side}-arm", Bone(flip(on_arm(0.04)), flip(on_arm(0.25)), 0.045, 0.038)),
                (f"{side}-forearm", Bone(flip(on_arm(0.31)), flip(on_arm(0.50)), 0.038, 0.028)),
                (f"{side}-hand", Bone(flip(on_arm(0.56)), flip(on_arm(0.64)), 0.033, 0.022)),
                (f"{side}-thigh", Bone(flip((0.088, 0.80, 0.005)), flip((0.085, 0.54, 0.0)), 0.075, 0.054)),
                (f"{side}-shin", Bone(flip((0.085, 0.44, 0.002)), flip((0.085, 0.13, 0.018)), 0.050, 0.036)),
                (f"{side}-foot", Bone(flip((0.086, 0.042, 0.03)), flip((0.096, 0.030, -0.12)), 0.040, 0.029))]


def weights(points, triangles):
    """For each vertex of the body a dictionary of its joints, at most four, and weights that add up to 1."""
    result = []
    for p in points:
        near = {}
        for name, bone in HOLDERS:
            joint = NAMES.index(name)
            near[joint] = max(near.get(joint, 0), (max(bone.distance(p), 0) + 0.02) ** -4)
        total = sum(near.values())
        result.append({joint: weight / total for joint, weight in near.items()})
    around = [set() for _ in points]
    for a, b, c in triangles:
        around[a] |= {b, c}
        around[b] |= {a, c}
        around[c] |= {a, b}
    for _ in range(4):
        means = []
        for vertex, own in enumerate(result):
            mean = {joint: weight / 2 for joint, weight in own.items()}
            for other in sorted(around[vertex]):
                for joint, weight in result[other].items():
                    mean[joint] += weight / 2 / len(around[vertex])
            means.append(mean)
        result = means
    return [four(own) for own in result]


def four(own):
    """The four largest weights, without those below 1 %, in hundredths that add up to 1."""
    best = sorted(own.items(), key=lambda item: (-item[1], item[0]))[:4]
    best = [(joint, weight) for joint, weight in best if weight > 0.01]
    total = sum(weight for _, weight in best)
    rounded = {joint: round(weight / total, 3) for joint, weight in best[1:]}
    return {best[0][0]: round(1 - sum(rounded.values()), 3), **rounded}


# Rotations are quaternions (x, y, z, w).
def product(p, q):
    a, b, c, d = p
    e, f, g, h = q
    return (d * e + a * h + b * g - c * f, d * f - a * g + b * h + c * e, d * g + a * f - b * e + c * h,
            d * h - a * e - b * f - c * g)


def rotation(axis, degrees):
    half = math.radians(degrees) / 2
    return tuple(math.sin(half) * (i == axis) for i in range(3)) + (math.cos(half),)


def turns(x=0.0, y=0.0, z=0.0):
    """Rotation about X, then about Z, then about Y, in degrees."""
    return product(rotation(1, y), product(rotation(2, z), rotation(0, x)))


def rotated(q, p):
    x, y, z, _ = product(product(q, (*p, 0.0)), (-q[0], -q[1], -q[2], q[3]))
    return (x, y, z)


def relative(joint):
    origin = PLACE[PARENT[joint]] if PARENT[joint] is not None else (0, 0, 0)
    return tuple(PLACE[joint][i] - origin[i] for i in range(3))


def bump(phase, middle, width):
    away = abs((phase - middle + 0.5) % 1 - 0.5)
    return math.exp(-away * away / (2 * width * width))


def leg(phase):
    """Angles of hip, knee and foot in degrees, forwards and upwards; the heel strikes at phase 0."""
    hip = 3 + 19 * math.cos(2 * math.pi * (phase + 0.02)) + 4 * bump(phase, 0.84, 0.10)
    knee = 6 + 10 * bump(phase, 0.13, 0.07) + 48 * bump(phase, 0.72, 0.095)
    foot = 12 * bump(phase, 0.98, 0.05) - 42 * bump(phase, 0.60, 0.075)
    return hip, knee, foot


def orientations(phase):
    """Rotation of each joint relative to its parent."""
    wave = math.cos(2 * math.pi * phase)  # 1 while the right leg is in front
    roll = math.sin(2 * math.pi * (phase + 0.03))
    result = {"hips": turns(y=4 * wave, z=2.5 * roll), "spine": turns(x=-1, y=-3 * wave, z=-2 * roll),
              "chest": turns(y=-4 * wave, z=-1 * roll), "neck": turns(x=-4, y=1.5 * wave), "head": turns(x=4, y=1.5 * wave)}
    for side, sign, own in (("right", 1, phase), ("left", -1, phase + 0.5)):
        hip, knee, foot = leg(own % 1)
        swing = -math.cos(2 * math.pi * (own - 0.03))  # arms swing against the legs
        result[f"{side}-thigh"] = turns(x=hip)
        result[f"{side}-shin"] = turns(x=-knee)
        result[f"{side}-foot"] = turns(x=foot - hip + knee)
        result[f"{side}-arm"] = turns(x=2 + 17 * swing, z=-13 * sign)
        result[f"{side}-forearm"] = product(rotation(1, 0), turns(x=14 + 9 * swing))
        result[f"{side}-hand"] = turns(x=6)
    return [result[name] for name in NAMES]


def frames(phase, hips):
    """Orientation and place of every joint with the hips at this place."""
    result = []
    for joint, turn in enumerate(orientations(phase)):
        if PARENT[joint] is None:
            result.append((turn, hips))
        else:
            q, p = result[PARENT[joint]]
            away = rotated(q, relative(joint))
            result.append((product(q, turn), tuple(p[i] + away[i] for i in range(3))))
    return result


def lowest(phase):
    """Height of the lowest point of both soles while the hips are at their height of rest."""
    joints = frames(phase, PLACE[0])
    result = 1e9
    for side, flip in SIDES:
        q, p = joints[NAMES.index(f"{side}-foot")]
        ankle = PLACE[NAMES.index(f"{side}-foot")]
        for sole in ((0.086, 0.002, 0.045), (0.093, 0.001, -0.07), (0.097, 0.002, -0.14)):
            sole = flip(sole)
            result = min(result, p[1] + rotated(q, tuple(sole[i] - ankle[i] for i in range(3)))[1])
    return result


def walk():
    """Positions and orientations of all joints at KEYS + 1 phases. The hips rise and fall with two waves a step. The
    first phase is a quarter, where one leg passes the other one."""
    heights = [-lowest(key / KEYS) for key in range(KEYS)]
    mean = sum(heights) / KEYS

    def wave(number, phase):
        return 2 / KEYS * sum(h * math.cos(2 * math.pi * number * (key / KEYS - phase)) for key, h in enumerate(heights))

    result = []
    for key in range(KEYS + 1):
        phase = key / KEYS + 0.25
        sway = 0.014 * math.sin(2 * math.pi * (phase + 0.03))
        hips = (PLACE[0][0] + sway, PLACE[0][1] + mean + wave(2, phase) + wave(4, phase), PLACE[0][2])
        turn = orientations(phase)
        result.append([(hips if PARENT[joint] is None else relative(joint), turn[joint]) for joint in range(len(NAMES))])
    return result
