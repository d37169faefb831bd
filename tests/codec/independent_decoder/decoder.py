# SPDX-License-Identifier: MIT
"""Packets to integer positions, metres and normals."""
import math
import struct

from arithmetic import add, cross, dot, frame, reach, sat, sat16, shift, sub, subs, times, wrap
from entropy import Bits, DISTRIBUTIONS, SCALE_WEIGHTS, Symbols, unzigzag
from order import Cloths, EQUAL


def float32(x):
    return struct.unpack("<f", struct.pack("<f", x))[0]


class Decoder:
    """A decoder of whole packets or, if `coarse`, of coarse packets."""

    def __init__(self, stream, coarse=False):
        self.coarse = coarse
        self.cloths = Cloths(stream["cloths"])
        self.count = sum(cloth["vertexCount"] for cloth in stream["cloths"])
        self.max_error, self.qualities = stream["maxError"], stream.get("qualities", 1)
        self.origin = [float32(x) for x in stream.get("origin", (0, 0, 0))]
        self.has_normals = stream["normals"] == "octahedral"
        self.newest = None
        self.history = []  # reference of the current frame, reference of that frame, and so on

    def set_quality(self, quality):
        """Chooses the step bits and the unit of a quality."""
        assert quality < self.qualities
        error = float32(self.max_error * 2 ** quality) - 2.0 ** -19
        unit = lambda k: error / (2 ** (k - 1) + 2)
        self.k = 8
        while self.k > 4 and unit(self.k) * 2 ** 27 < 40:
            self.k -= 1
        self.unit = float32(unit(self.k))

    def read_weights(self, section, key):
        """The weights that the frame uses, and those that it leaves."""
        alone = lambda f, w: [[w if i == f and c < 6 else 0 for i in range(16)] for c in range(7)]
        left = alone(7, -192) if key else [row[:] for row in self.history[0]["weights"]]
        used = left
        if section:
            bits = Bits(section)
            if bits.get(1):
                used = [[0] * 16] * 7
            else:
                for weights in left[:6]:
                    if bits.get(1):
                        for f in (6, 7) if key else range(16):
                            weights[f] += unzigzag(bits.gamma(4))
                            assert abs(weights[f]) <= 2047
            bits.check_end()
        return used, alone(2, 700) if key else left

    def decode(self, packet):
        key, tick, reference, sections, quality = packet
        if self.coarse:
            sections = [b"" if i in (2, 4) else section for i, section in enumerate(sections)]
        self.history = []
        if not key:
            at = self.newest
            assert at["tick"] == reference and at["quality"] == quality
            self.history = [at, at["history"][0], at["history"][1]]
        self.set_quality(quality)
        weights, left = self.read_weights(sections[0], key)
        symbols, bits = Symbols(sections[1] + sections[2]), Bits(sections[3] + sections[4])
        if not self.coarse:
            reach("a packet with symbols of %s coarse vertices and %s others" % (
                "some" if len(sections[1]) > 16 else "no", "some" if sections[2] else "no"))
        now = {name: [None] * self.count for name in "RSGQEDMW"}
        now["rests"] = [False] * self.count
        for number, (weight_class, phase) in enumerate(self.cloths.phases):
            if number == self.cloths.coarse_phases:
                self.check_coarse(sections, symbols, bits)
                if self.coarse:
                    break
            quiet = bits.get(1)
            for start in range(0, len(phase), 64):
                group = phase[start:start + 64]
                predicted = [self.predict(now, v, weights[weight_class]) for v in group]
                residuals, stays = self.read_residuals(now, group, weight_class // 2 + (4 if key else 0), quiet, symbols, bits)
                for i, v in enumerate(group):
                    self.place(now, v, predicted[i], residuals[i], stays[i])
        if len(self.cloths.phases) == self.cloths.coarse_phases:
            self.check_coarse(sections, symbols, bits)
        has_normals = self.has_normals and not self.coarse
        now["normals"] = self.read_normals(now, symbols, bits) if has_normals else None
        if not self.coarse:
            symbols.check_end()
            bits.check_end()
        phases = self.cloths.phases
        decoded = phases[:self.cloths.coarse_phases] if self.coarse else phases
        now["C"] = [None] * self.count
        for _, phase in decoded:
            for v in phase:
                around = add(*(now["R"][n] for n in self.cloths.nearest[v]))
                now["C"][v] = sat(shift(sub(around, times(now["R"][v], 4)), self.k - 4))
        for _, phase in phases[len(decoded):]:
            for v in phase:
                now["R"][v] = self.guess(now, v)
        now.update(tick=tick, weights=left, quality=quality)
        now["history"] = self.history[:2] or [now, now]
        self.newest = now

    def check_coarse(self, sections, symbols, bits):
        assert 2 * symbols.at == len(sections[1]) and (bits.at + 7) // 8 == len(sections[3])

    def read_normals(self, now, symbols, bits):
        sums = [(0, 0, 0)] * self.count
        for face in self.cloths.faces:
            area = area_of([now["R"][v] for v in face])
            for v in face:
                sums[v] = add(sums[v], area)
        expected = [256, 256]
        normals = []
        for v, n in enumerate(sums):
            n = tuple(wrap(x, 64, "a sum of face normals beyond 64 bits") for x in n)
            top = max((2, 0, 1), key=lambda c: abs(n[c]))
            facing = top, n[top] < 0
            down = abs(n[top]).bit_length() - 15
            n = shift(n, down) if down > 0 else times(n, 1 << -down)
            octahedral = []
            size = sum(map(abs, n))
            for c in 0, 1:
                x = n[(top + 1 + c) % 3]
                guess = (254 * abs(x) + size) // (2 * size) * (-1 if x < 0 else 1) if size else 0
                o = max(4, min(16383, expected[c])).bit_length() - 1
                scale = 2 * (o - 2) + (max(4, min(16383, expected[c])) >> o - 1 & 1)
                b = 0 if scale < 16 else (scale - 14) // 2
                number = symbols.get((2 * v + c) % 4, DISTRIBUTIONS[scale])
                if number == 15:
                    number += bits.gamma(2)
                r = unzigzag(number << b | bits.get(b))
                expected[c] += 256 * min(abs(r), 31) - expected[c] >> 5
                octahedral.append((guess + r + 128) % 256 - 128)
            normals.append((*octahedral, facing))
        return normals

    def metres(self):
        """The decoded positions: float32 coordinates of all vertices, one after the other."""
        return [float32(float32(float32(x) * self.unit) + origin)
                for position in self.newest["R"] for x, origin in zip(position, self.origin)]

    def normals(self):
        """Unit normals of all vertices: as sent, or from the decoded positions."""
        return self.sent_normals() if self.has_normals else self.computed_normals()

    def sent_normals(self):
        normals = []
        for u, v, (top, down) in self.newest["normals"]:
            a, b = u / 127, v / 127
            c = 1 - abs(a) - abs(b)
            if c < 0:
                a, b = math.copysign(1 - abs(b), a), math.copysign(1 - abs(a), b)
            length = math.sqrt(a * a + b * b + c * c)
            normal = [0.0] * 3
            normal[(top + 1) % 3], normal[(top + 2) % 3] = a / length, b / length
            normal[top] = (-c if down else c) / length
            normals.append(normal)
        return normals

    def computed_normals(self):
        metres = self.metres()
        sums = [(0, 0, 0)] * self.count
        for face in self.cloths.faces:
            area = area_of([metres[3 * v:3 * v + 3] for v in face])
            for v in face:
                sums[v] = add(sums[v], area)
        lengths = [math.sqrt(dot(n, n)) for n in sums]
        return [times(n, 1 / length) if length >= 1e-15 else (0, 0, 1) for n, length in zip(sums, lengths)]

    def past(self, name, i, v):
        if not self.history:
            return (0, 0, 0)
        return self.history[i - 1][name][v]

    def surroundings(self, now, v):
        """The parents of a vertex, their weighted mean S, and the mean of its ring."""
        at = lambda n: (0, 0, 0) if n is None else now["R"][n]
        p = [at(n) for n in self.cloths.parents[v]]
        weights = self.cloths.weights[v]
        if weights == EQUAL:
            mean = shift(add(*p, (2, 2, 2)), 2)
        else:
            off = add(*(times(sub(p[i], p[0]), weights[i]) for i in (1, 2, 3)), (32, 32, 32))
            mean = add(p[0], tuple(wrap(x, 32, "a sum of S beyond 32 bits") >> 6 for x in off))
        return p, mean, shift(add(*(at(n) for n in self.cloths.ring[v]), (4, 4, 4)), 3)

    def guess(self, now, v):
        """The position of a vertex that a coarse packet does not hold."""
        _, s, ring = self.surroundings(now, v)
        return sub(s, shift(times(sub(ring, s), 3), 4))

    def predict(self, now, v, w):
        f = self.k - 4
        p, s, ring = self.surroundings(now, v)
        g = sat(shift(sub(ring, s), f))
        q = sat(shift(sub(add(p[0], p[1]), add(p[2], p[3])), 2 + f))
        u, v_, n = axes = frame(sub(p[1], p[0]), sub(p[3], p[2]))
        past = lambda name, i: self.past(name, i, v)
        e1, e2, e3 = (past("E", i) for i in (1, 2, 3))
        g1, g2, g3 = (past("G", i) for i in (1, 2, 3))
        s1 = past("S", 1)
        moved = sat(shift(sub(s, s1), f)) if self.history else (0, 0, 0)
        d1, d2 = past("D", 1), past("D", 2)
        pairs = (w[12], w[14]), (w[12], w[14]), (w[13], w[15])
        if any(abs(x - y) > 32767 and b for (_, b), x, y in zip(pairs, d1, d2)):
            reach("D1 - D2 beyond 16 bits")
        turned = [sat16(a * x + b * (x - y) + 128 >> 8) for (a, b), x, y in zip(pairs, d1, d2)]
        features = [e1, g1, subs(e1, e2), subs(g1, g2), subs(e2, e3), subs(g2, g3), subs(q, past("Q", 1)), subs(g, g1),
                    past("C", 1), past("C", 2), subs(moved, past("W", 1)), subs(past("W", 1), past("W", 2))]
        total = add(*(times(feature, weight) for feature, weight in zip(features, w)), (1 << 9 - f,) * 3,
                    shift(add(*map(times, axes, turned)), 6))
        r1 = past("R", 1)
        prediction = add(s, r1, times(s1, -1), shift(total, 10 - f))
        if self.history and self.history[0]["rests"][v]:
            prediction = r1
        now["S"][v], now["G"][v], now["Q"][v], now["W"][v] = s, g, q, moved
        return prediction, axes

    def read_residuals(self, now, group, scale_class, quiet, symbols, bits):
        residuals, stays = [[0, 0, 0] for _ in group], [False] * len(group)
        magnitude = lambda i, c: min(abs(residuals[i][c]), 31)
        if not quiet:
            for c in 2, 0, 1:
                w = SCALE_WEIGHTS[scale_class][c]
                for i, v in enumerate(group):
                    if stays[i]:
                        continue
                    m = lambda n: 0 if n is None else now["M"][n][c]
                    m1 = lambda n: self.history[0]["M"][n][c] if self.history else 0
                    e = w[0] * sum(map(m, self.cloths.parents[v])) + w[1] * sum(map(m, self.cloths.ring[v]))
                    e += w[2] * (4 * m1(v) + sum(map(m1, self.cloths.nearest[v]))) + w[5]
                    if c != 2:
                        e += w[3] * magnitude(i, 2)
                    if c == 1:
                        e += w[4] * magnitude(i, 0)
                    e = max(4, min(16383, e))
                    o = e.bit_length() - 1
                    scale = 2 * (o - 2) + (e >> o - 1 & 1)
                    b = 0 if scale < 16 else (scale - 14) // 2
                    number = symbols.get(i % 4, DISTRIBUTIONS[scale + (24 if c == 2 else 0)])
                    if number == 15:
                        beyond = bits.gamma(2)
                        if c == 2:
                            if beyond == 0:
                                stays[i] = True
                                continue
                            beyond -= 1
                        number += beyond
                    residuals[i][c] = unzigzag(number << b | bits.get(b))
        return residuals, stays

    def place(self, now, v, predicted, r, stays):
        position, (u, v_, n) = predicted
        r1 = self.past("R", 1, v)
        if max(map(abs, r)) > 32767:
            reach("a residual beyond 16 bits")
        if stays:
            reach("a vertex that stays")
            position = r1
        else:
            moved = add(times(u, r[0]), times(v_, r[1]), times(n, r[2]), (1 << 13 - self.k,) * 3)
            position = add(position, shift(moved, 14 - self.k))
        assert max(map(abs, position)) <= 1 << 27
        now["R"][v] = position
        now["rests"][v] = bool(self.history) and position == r1
        now["M"][v] = tuple(min(abs(x), 31) for x in r)
        e = now["E"][v] = sat(shift(sub(position, now["S"][v]), self.k - 4))
        now["D"][v] = tuple(sat16(dot(axis, e) >> 14) for axis in (u, v_, n))

    def hash(self):
        mask = 0xffffffff

        def mix(h):
            h = (h ^ h >> 16) * 0x7feb352d & mask
            h = (h ^ h >> 15) * 0x846ca68b & mask
            return h ^ h >> 16

        halves = []
        for seed in 0x85a308d3, 0x243f6a88:
            total = 0
            for i, position in enumerate(self.newest["R"]):
                h = mix(i + seed & mask)
                for x in position:
                    h = mix(h ^ x & mask)
                u, v = self.newest["normals"][i][:2] if self.has_normals else (0, 0)
                total += mix(h ^ (u & 255 | (v & 255) << 8))
            halves.append(total & mask)
        return "%08x%08x" % tuple(halves)


def area_of(corners):
    """The cross product that a face adds to its corners."""
    if len(corners) == 4:
        return cross(sub(corners[2], corners[0]), sub(corners[3], corners[1]))
    return cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]))


def parse(packet):
    """Kind, tick, reference, sections and quality."""
    at = 5

    def byte():
        nonlocal at
        at += 1
        return packet[at - 1]

    def varint():
        value = shift_ = 0
        while True:
            b = byte()
            value |= (b & 127) << shift_
            shift_ += 7
            if b < 128:
                return value

    assert packet[0] == 1 and packet[1] == 2 and packet[4] == 0
    varint()  # epoch
    tick = varint()
    references = [tick - varint() for _ in range(byte())]
    for _ in range(varint()):
        varint(), varint()
    sizes = [varint() for _ in range(byte())]
    assert at + sum(sizes) == len(packet) and len(sizes) == 5
    sections = []
    for size in sizes:
        sections.append(packet[at:at + size])
        at += size
    return packet[2] == 0, tick, references[0] if references else None, sections, packet[3]
