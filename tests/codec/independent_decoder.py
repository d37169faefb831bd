#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Codec 2 written from proto/FRAME_FORMAT.md alone: decodes the golden packets and compares the reconstruction hashes.

Run from the project's root. It is slow, simple, and checks little of what it reads.
"""
import json
import re
import struct
import sys

GOLDEN = "tests/golden/"
TABLES = "proto/codec/hierarchical/residual_tables.cpp"


def read_tables():
    text = open(TABLES).read()
    rows = lambda part, n: [tuple(map(int, re.findall(r"-?\d+", row)))
                            for row in re.findall(r"\{(-?\d+(?:, -?\d+){%d})\}" % (n - 1), part)]
    scales, distributions = text.split("kDistributions{{")
    weights = rows(scales, 6)
    return [weights[3 * i:3 * i + 3] for i in range(8)], rows(distributions, 16)


SCALE_WEIGHTS, DISTRIBUTIONS = read_tables()


def sat16(x):
    return max(-32768, min(32767, x))


def add(*vectors):
    return tuple(map(sum, zip(*vectors)))


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def subs(a, b):
    return tuple(sat16(x - y) for x, y in zip(a, b))


def shift(a, bits):
    return tuple(x >> bits for x in a)


def sat(a):
    return tuple(map(sat16, a))


def times(a, k):
    return tuple(x * k for x in a)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def scaled(a):
    m = (abs(a[0]) | abs(a[1]) | abs(a[2])).bit_length()
    if m == 0:
        return None
    return shift(a, m - 13) if m > 13 else times(a, 1 << 13 - m)


ROOTS = {}


def root(i):
    if i not in ROOTS:
        low, high = 0, 1 << 16
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if middle * middle * (2 * i + 1) <= 1 << 41 else (low, middle)
        ROOTS[i] = low
    return ROOTS[i]


def unit(a):
    q = dot(a, a)
    h = 28 - q.bit_length() & ~1
    r = root(q << h >> 16)
    d = 14 - h // 2
    return tuple(x * r + (1 << d - 1) >> d for x in a)


def frame(a, b):
    a, b = scaled(a), scaled(b)
    if a and b:
        u = unit(a)
        n = scaled(cross(u, b))
        if n:
            n = unit(n)
            return u, tuple(x + 8192 >> 14 for x in cross(n, u)), n
    return (16384, 0, 0), (0, 16384, 0), (0, 0, 16384)


class Bits:
    def __init__(self, data):
        self.value, self.at, self.size = int.from_bytes(data, "little"), 0, 8 * len(data)

    def get(self, n):
        self.at += n
        return self.value >> self.at - n & (1 << n) - 1

    def gamma(self, j):
        z = 0
        while not self.get(1):
            z += 1
            assert z + j <= 30
        return self.get(z + j) + (1 << z + j) - (1 << j)

    def check_end(self):
        assert 0 <= self.size - self.at < 8 and self.value >> self.at == 0


class Symbols:
    def __init__(self, data):
        self.words = struct.unpack("<%dH" % (len(data) // 2), data)
        self.states = [self.words[2 * i] | self.words[2 * i + 1] << 16 for i in range(4)] if data else [1 << 16] * 4
        self.at = 8 if data else 0

    def get(self, coder, frequencies):
        state = self.states[coder]
        x, start, symbol = state & 4095, 0, 0
        while start + frequencies[symbol] <= x:
            start += frequencies[symbol]
            symbol += 1
        state = frequencies[symbol] * (state >> 12) + x - start
        if state < 1 << 16:
            state = state << 16 | self.words[self.at]
            self.at += 1
        self.states[coder] = state
        return symbol

    def check_end(self):
        assert self.at == len(self.words) and self.states == [1 << 16] * 4


def unzigzag(z):
    return z >> 1 ^ -(z & 1)


class Cloths:
    """Order and neighbours of grids."""

    def __init__(self, cloths):
        self.phases, self.parents, self.ring, self.nearest = [], {}, {}, {}
        first = 0
        for cloth in cloths:
            rows, columns = (cloth["rows"], cloth["columns"]) if cloth["rows"] else (1, cloth["vertexCount"])
            self.add(first, rows, columns)
            first += rows * columns

    def set(self, v, near, far):
        pick = {0: None, 1: (0, 0, 0, 0), 2: (0, 1, 0, 1), 3: (0, 1, 0, 2), 4: (0, 1, 2, 3)}[len(near)]
        self.parents[v] = [near[i] for i in pick] if pick else [None] * 4
        far = far if len(far) >= 3 else self.parents[v]
        self.ring[v] = [far[i % len(far)] for i in range(8)]

    def add(self, first, rows, columns):
        at = lambda c, r: first + r * columns + c
        known = []
        for c, r in (0, 0), (columns - 1, rows - 1), (columns - 1, 0), (0, rows - 1):
            if at(c, r) in known:
                continue
            self.set(at(c, r), known[:], known[:])
            known.append(at(c, r))
            self.phases.append((6, [at(c, r)]))
        done = set(known)
        stride = 1
        while 2 * stride < max(rows, columns):
            stride *= 2
        while stride:
            level = [list(range(0, n - 1, stride)) + [n - 1] for n in (columns, rows)]
            new = [[i % 2 == 1 and x != axis[-1] for i, x in enumerate(axis)] for axis in level]
            for part in 0, 1:
                near = (((-1, -1), (1, 1), (-1, 1), (1, -1)), ((-1, 0), (1, 0), (0, -1), (0, 1)))[part]
                far = (((-3, -1), (3, -1), (-3, 1), (3, 1), (-1, -3), (1, -3), (-1, 3), (1, 3)),
                       ((-2, -1), (2, -1), (-2, 1), (2, 1), (-1, -2), (1, -2), (-1, 2), (1, 2)))[part]
                phase = []
                for r in range(len(level[1])):
                    for c in range(len(level[0])):
                        if new[0][c] + new[1][r] != 2 - part:
                            continue

                        def collect(offsets):
                            places = [(c + dc, r + dr) for dc, dr in offsets]
                            inside = [at(level[0][x], level[1][y]) for x, y in places
                                      if 0 <= x < len(level[0]) and 0 <= y < len(level[1])]
                            return [v for v in inside if v in done]

                        v = at(level[0][c], level[1][r])
                        self.set(v, collect(near), collect(far))
                        phase.append(v)
                done.update(phase)
                if phase:
                    self.phases.append((2 * min(stride.bit_length() - 1, 2) + part, phase))
            stride //= 2
        for r in range(rows):
            for c in range(columns):
                self.nearest[at(c, r)] = [at(x, y) if 0 <= x < columns and 0 <= y < rows else at(c, r)
                                          for x, y in ((c - 1, r), (c + 1, r), (c, r - 1), (c, r + 1))]


class Decoder:
    def __init__(self, stream):
        self.cloths = Cloths(stream["cloths"])
        self.count = sum(cloth["vertexCount"] for cloth in stream["cloths"])
        error = stream["maxError"] - 2.0 ** -19
        self.k = 8
        while self.k > 4 and error / (2 ** (self.k - 1) + 2) * 2 ** 27 < 40:
            self.k -= 1
        self.layers = stream.get("temporalLayers", 1)
        self.held = {}  # the newest frame of each layer, by layer
        self.history = []  # what the frame that is decoded refers to, what that one does, and so on

    def read_weights(self, section, key, layer):
        """The weights that the frame uses; those that it leaves, by layer."""
        alone = lambda f, w: [[w if i == f and c < 6 else 0 for i in range(16)] for c in range(7)]
        if key:
            left = [alone(7, -192)] * 3
        else:
            left = self.history[0]["weights"]
        left = [[row[:] for row in weights] for weights in left]
        used = left[layer]
        if section:
            bits = Bits(section)
            if bits.get(1):
                used = [[0] * 16] * 7
            else:
                for weights in left[layer:1 if key else self.layers]:
                    for c in range(6):
                        if bits.get(1):
                            for f in (6, 7) if key else range(16):
                                weights[c][f] += unzigzag(bits.gamma(4))
            bits.check_end()
        return used, [alone(2, 700)] * 3 if key else left

    def decode(self, packet):
        key, layer, tick, reference, sections = packet
        self.history = []
        if key:
            self.held = {}
        else:
            at = next(frame for frame in self.held.values() if frame["tick"] == reference)
            assert at["layer"] <= layer < self.layers
            self.history = [at, at["history"][0], at["history"][1]]
        weights, left = self.read_weights(sections[0], key, layer)
        symbols, bits = Symbols(sections[1]), Bits(sections[2])
        now = {name: [None] * self.count for name in "RSGQEDMW"}
        now["rests"] = [False] * self.count
        for weight_class, phase in self.cloths.phases:
            quiet = bits.get(1)
            for start in range(0, len(phase), 64):
                group = phase[start:start + 64]
                predicted = [self.predict(now, v, weights[weight_class]) for v in group]
                residuals, stays = self.read_residuals(now, group, weight_class // 2 + (4 if key else 0), quiet, symbols, bits)
                for i, v in enumerate(group):
                    self.place(now, v, predicted[i], residuals[i], stays[i])
        symbols.check_end()
        bits.check_end()
        now["C"] = []
        for v in range(self.count):
            around = add(*(now["R"][n] for n in self.cloths.nearest[v]))
            now["C"].append(sat(shift(sub(around, times(now["R"][v], 4)), self.k - 4)))
        now.update(tick=tick, layer=layer, weights=left)
        now["history"] = self.history[:2] or [now, now]
        self.newest = self.held[layer] = now

    def past(self, name, i, v):
        if not self.history:
            return (0, 0, 0)
        return self.history[i - 1][name][v]

    def predict(self, now, v, w):
        f = self.k - 4
        at = lambda n: (0, 0, 0) if n is None else now["R"][n]
        p = [at(n) for n in self.cloths.parents[v]]
        s = shift(add(*p, (2, 2, 2)), 2)
        ring = shift(add(*(at(n) for n in self.cloths.ring[v]), (4, 4, 4)), 3)
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
        if stays:
            position = r1
        else:
            moved = add(times(u, r[0]), times(v_, r[1]), times(n, r[2]), (1 << 13 - self.k,) * 3)
            position = add(position, shift(moved, 14 - self.k))
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
                total += mix(h)
            halves.append(total & mask)
        return "%08x%08x" % tuple(halves)


def parse(packet):
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

    assert packet[0] == 1 and packet[1] == 2
    varint()  # epoch
    tick = varint()
    references = [tick - varint() for _ in range(byte())]
    for _ in range(varint()):
        varint(), varint()
    sizes = [varint() for _ in range(byte())]
    assert at + sum(sizes) == len(packet) and len(sizes) == 3
    sections = []
    for size in sizes:
        sections.append(packet[at:at + size])
        at += size
    return packet[2] == 0, packet[4], tick, references[0] if references else None, sections


def main():
    packets = 0
    for stream in json.load(open(GOLDEN + "streams.json")):
        if stream["codec"] != 2 or any("triangles" in cloth for cloth in stream["cloths"]):
            continue
        decoder = Decoder(stream)
        for packet in stream["packets"]:
            decoder.decode(parse(open(GOLDEN + packet["file"], "rb").read()))
            if decoder.hash() != packet["reconstructionHash"]:
                sys.exit("%s: %s, not %s" % (packet["file"], decoder.hash(), packet["reconstructionHash"]))
            packets += 1
    assert packets > 0
    print("%d packets are decoded alike" % packets)


if __name__ == "__main__":
    main()
