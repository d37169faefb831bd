#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A decoder written from proto/FRAME_FORMAT.md alone: decodes the golden packets and compares the reconstruction hashes.

Run from the project's root. It is slow, simple, and checks little of what it reads.
"""
import heapq
import json
import math
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


class Groups:
    """Of codec 3: the residuals of vertices that follow each other, in components."""

    def __init__(self, data):
        self.bits = Bits(data)

    def number(self, low, reserved=0):
        """None where it stands for something else."""
        q = 0
        while q < 15 and self.bits.get(1):
            q += 1
        if q == 15:
            beyond = self.bits.gamma(2)
            if beyond < reserved:
                return None
            q += beyond - reserved
        return q << low | self.bits.get(low)

    def read(self, vertices, components):
        """A list for each vertex; None in the place of one along n where the vertex stays."""
        residuals = []
        for start in range(0, vertices, 2048):
            residuals += self.read_group(min(2048, vertices - start), components)
        return residuals

    def read_group(self, vertices, components):
        residuals = [[0] * components for _ in range(vertices)]
        modes = [0] * components
        if not self.bits.get(1):
            for start in range(0, vertices, 32):
                for c in range(components):
                    modes[c] += unzigzag(self.number(0))
                    assert 0 <= modes[c] < 32
                    self.read_block(residuals[start:start + 32], c, modes[c], 1 if components == 3 and c == 0 else 0)
        while self.bits.at % 8:
            assert self.bits.get(1) == 0
        return residuals

    def read_block(self, residuals, c, mode, reserved):
        size = 4 if mode == 1 else 32
        for start in range(0, len(residuals), size):
            if mode == 0 or mode == 1 and self.bits.get(1):
                continue
            for residual in residuals[start:start + size]:
                number = self.number(max(mode - 2, 0), reserved)
                residual[c] = None if number is None else unzigzag(number)


NO_VERTEX = None
EQUAL = (16, 16, 16, 16)


class Order:
    """Of one cloth: ranks, parents and their weights, rings, nearest."""

    def __init__(self, count):
        self.rank, self.parents, self.weights, self.ring, self.nearest = ([None] * count for _ in range(5))

    def set(self, v, rank, parents, ring):
        pick = {0: None, 1: (0, 0, 0, 0), 2: (0, 1, 0, 1), 3: (0, 1, 0, 2), 4: (0, 1, 2, 3)}[len(parents)]
        self.rank[v], self.weights[v] = rank, EQUAL
        self.parents[v] = [parents[i] for i in pick] if pick else [NO_VERTEX] * 4
        ring = ring or self.parents[v]
        self.ring[v] = [ring[i % len(ring)] for i in range(8)]


def corner(i):
    return 256 + 15 - i


class GridOrder(Order):
    def __init__(self, rows, columns):
        super().__init__(rows * columns)
        at = lambda c, r: r * columns + c
        known = []
        for c, r in (0, 0), (columns - 1, rows - 1), (columns - 1, 0), (0, rows - 1):
            if at(c, r) not in known:
                self.set(at(c, r), corner(len(known)), known[:], known[:])
                known.append(at(c, r))
        level = 0
        while 2 << level < max(rows, columns):
            level += 1
        while level >= 0:
            if 1 << level < max(rows, columns):
                self.add_level(level, rows, columns)
            level -= 1
        for v in range(rows * columns):
            axes = self.axes(4 if self.rank[v] >= 16 else 1, rows, columns)
            c, r = axes[0].index(v % columns), axes[1].index(v // columns)
            self.nearest[v] = [at(axes[0][x], axes[1][y]) if 0 <= x < len(axes[0]) and 0 <= y < len(axes[1]) else v
                               for x, y in ((c - 1, r), (c + 1, r), (c, r - 1), (c, r + 1))]

    def axes(self, stride, rows, columns):
        return [list(range(0, n - 1, stride)) + [n - 1] for n in (columns, rows)]

    def add_level(self, level, rows, columns):
        axes = self.axes(1 << level, rows, columns)
        new = [[i % 2 == 1 and x != axis[-1] for i, x in enumerate(axis)] for axis in axes]
        for part in 0, 1:
            rank = 8 * level + (7, 3)[part]
            near = (((-1, -1), (1, 1), (-1, 1), (1, -1)), ((-1, 0), (1, 0), (0, -1), (0, 1)))[part]
            far = (((-3, -1), (-3, 1), (-1, -3), (1, -3)), ((-2, -1), (2, -1), (-1, -2), (1, -2)))[part]
            for r in range(len(axes[1])):
                for c in range(len(axes[0])):
                    if new[0][c] + new[1][r] != 2 - part:
                        continue

                    def known(dc, dr):
                        x, y = c + dc, r + dr
                        if not (0 <= x < len(axes[0]) and 0 <= y < len(axes[1])):
                            return None
                        v = axes[1][y] * columns + axes[0][x]
                        return v if self.rank[v] is not None and self.rank[v] > rank else None

                    v = axes[1][r] * columns + axes[0][c]
                    parents = [n for n in (known(*offset) for offset in near) if n is not None]
                    weights = EQUAL
                    opposite = far
                    if len(parents) == 3:
                        weights, opposite = ((32, 32, 0, 0), ((-3, 0),)) if new[0][c] else ((0, 32, 0, 32), ((0, -3),))
                    ring = []
                    for dc, dr in opposite:
                        pair = [known(dc, dr), known(-dc, -dr)]
                        ring += pair if None not in pair else []
                    self.set(v, rank, parents, ring)
                    self.weights[v] = weights


class MeshOrder(Order):
    def __init__(self, count, triangles, rest):
        super().__init__(count)
        self.place = [tuple(rest[3 * v:3 * v + 3]) if rest else (0.0, 0.0, 0.0) for v in range(count)]
        near = [set() for _ in range(count)]
        sides = {}
        for i in range(0, len(triangles), 3):
            for c in range(3):
                a, b = triangles[i + c], triangles[i + (c + 1) % 3]
                if a != b:
                    near[a].add(b), near[b].add(a)
                    sides[min(a, b), max(a, b)] = sides.get((min(a, b), max(a, b)), 0) + 1
        self.border = {v for side, times in sides.items() if times == 1 for v in side}
        levels = [(list(range(count)), {v: self.sorted(v, near[v]) for v in range(count)})]
        while len(levels) < 62 and len(levels[-1][0]) > 16:
            vertices, graph = levels[-1]
            order = self.from_the_first(*levels[-1])
            order.sort(key=lambda v: v not in self.border)
            taken = self.apart(graph, order)
            if len(taken) == len(vertices):
                break
            coarse = sorted(taken)
            levels.append((coarse, {v: self.sorted(v, self.search(graph, v, taken)) for v in coarse}))
        coarsest = levels[-1][0]
        before = []
        for v in coarsest:
            self.set(v, corner(len(before)), before[:4], before[:])
            if len(coarsest) <= 16:
                before.append(v)
        known = set(coarsest)
        for number in range(len(levels) - 2, -1, -1):
            vertices, graph = levels[number]
            left = [v for v in self.from_the_first(vertices, graph) if v not in known]
            part = 0
            while left:
                now = self.apart(graph, left) if part < 2 else set(left)
                for v in left:
                    if v in now:
                        self.choose(v, self.sorted(v, self.search(graph, v, known), None))
                        self.rank[v] = 8 * (number // 2) + 4 * (number % 2) + 3 - part
                known |= now
                left = [v for v in left if v not in now]
                part += 1
        for v in range(count):
            graph = levels[min(4, len(levels) - 1) if self.rank[v] >= 16 else 0][1]
            self.nearest[v] = ([n for _, n in graph[v]] + [v] * 4)[:4]

    def off(self, v, *others):
        """The sum of where the others are, seen from v."""
        sums = [0.0, 0.0, 0.0]
        for n, other in enumerate(others):
            d = [self.place[other][c] - self.place[v][c] for c in range(3)]
            sums = d if n == 0 else [x + y for x, y in zip(sums, d)]
        return sums

    def distance(self, a, b):
        d = [x - y for x, y in zip(self.place[a], self.place[b])]
        return math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])

    def sorted(self, v, others, most=16):
        return sorted((self.distance(v, other), other) for other in others)[:most]

    def search(self, graph, start, wanted):
        visited, seen = [start], {start}
        for v in visited:
            for _, other in graph[v]:
                if other in seen:
                    continue
                if len(visited) == 64:
                    return [n for n in visited[1:] if n in wanted]
                seen.add(other)
                visited.append(other)
        return [n for n in visited[1:] if n in wanted]

    def from_the_first(self, vertices, graph):
        done, order = set(), []
        for start in vertices:
            front = [(0.0, start)] if start not in done else []
            while front:
                far, v = heapq.heappop(front)
                if v in done:
                    continue
                done.add(v)
                order.append(v)
                for distance, other in graph[v]:
                    if other not in done:
                        heapq.heappush(front, (far + distance, other))
        return order

    def apart(self, graph, order):
        taken, excluded = set(), set()
        for v in order:
            four = [distance for distance, _ in graph[v][:4]]
            total = 0.0
            for distance in four:
                total += distance
            near = 1.2 * (total / len(four)) if four else 0.0
            around = [n for distance, n in graph[v] if distance <= near]
            if v in excluded or any(n in taken for n in around):
                continue
            taken.add(v)
            excluded.update(around)
        return taken

    def choose(self, v, near):
        near = [n for _, n in near]
        chosen = []
        dot = lambda a, b: a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
        squared = lambda a: dot(a, a)

        def take(cost):
            best = min(near[:8], key=cost)
            near.remove(best)
            chosen.append(best)
            return best

        if len(near) >= 4:
            first = take(lambda n: squared(self.off(v, n)))
            take(lambda n: squared(self.off(v, first, n)))

            def aside(n):
                d, f = self.off(v, n), self.off(v, first)
                along, size = dot(d, f), squared(d)
                side = size * squared(f) - along * along
                return size * size / side if side > 0 else math.inf

            second = take(aside)
            take(lambda n: squared(self.off(v, second, n)))
        else:
            chosen, near = near, []
        pairs, near = [], near[:24]
        while len(near) > 1 and len(pairs) < 8:
            head = near.pop(0)
            cost = lambda n: squared(self.off(v, head, n))
            best = min(near, key=cost)
            if cost(best) <= 0.35 * 0.35 * squared(self.off(v, head)):
                near.remove(best)
                pairs += [head, best]
        self.set(v, None, chosen, pairs)
        if chosen:
            self.weights[v] = self.weights_of(v, chosen)

    def weights_of(self, v, parents):
        n = len(parents)
        d = [self.off(v, p) for p in parents]
        m = [[a[0] * b[0] + a[1] * b[1] + a[2] * b[2] for b in d] for a in d]
        size = 0.0
        for i in range(n):
            size += m[i][i]
        if not size > 0:
            return EQUAL
        x = [1.0] * n
        for i in range(n):
            m[i][i] += 0.05 * size / n
        for k in range(n):
            for i in range(k + 1, n):
                factor = m[i][k] / m[k][k]
                for j in range(k, n):
                    m[i][j] -= factor * m[k][j]
                x[i] -= factor * x[k]
        total = 0.0
        for i in range(n - 1, -1, -1):
            for j in range(i + 1, n):
                x[i] -= m[i][j] * x[j]
            x[i] /= m[i][i]
            total += x[i]
        weights = [0] * 4
        for i in range(1, n):
            weights[{3: (0, 1, 3)}.get(n, (0, 1, 2, 3))[i]] = math.floor(max(-128.0, min(128.0, 64 * (x[i] / total))) + 0.5)
        weights[0] = 64 - sum(weights)
        return tuple(weights)


class Cloths:
    """Order and neighbours of all vertices."""

    def __init__(self, cloths):
        self.parents, self.weights, self.ring, self.nearest = {}, {}, {}, {}
        self.faces = []
        phases = {}
        first = 0
        for cloth in cloths:
            count, rows, columns = cloth["vertexCount"], cloth["rows"], cloth["columns"]
            triangles = cloth.get("triangles", [])
            if triangles:
                order = MeshOrder(count, triangles, cloth.get("restPositions", []))
            else:
                order = GridOrder(rows or 1, columns or count)
            move = lambda vertices: [n if n is NO_VERTEX else first + n for n in vertices]
            for v in range(count):
                phases.setdefault(order.rank[v], []).append(first + v)
                self.parents[first + v], self.ring[first + v] = move(order.parents[v]), move(order.ring[v])
                self.nearest[first + v], self.weights[first + v] = move(order.nearest[v]), order.weights[v]
            self.faces += [move(triangles[i:i + 3]) for i in range(0, len(triangles), 3)]
            for r in range(rows - 1):
                for c in range(columns - 1):
                    p = r * columns + c
                    self.faces.append(move((p, p + columns, p + columns + 1, p + 1)))
            first += count
        self.phases = []
        self.coarse_phases = 0
        for rank in sorted(phases, reverse=True):
            self.phases.append((6 if rank >= 256 else 2 * min(rank // 8, 2) + (rank % 8 < 4), phases[rank]))
            self.coarse_phases += rank >= 16


class Decoder:
    def __init__(self, stream):
        self.cloths = Cloths(stream["cloths"])
        self.count = sum(cloth["vertexCount"] for cloth in stream["cloths"])
        error = stream["maxError"] - 2.0 ** -19
        self.k = 8
        while self.k > 4 and error / (2 ** (self.k - 1) + 2) * 2 ** 27 < 40:
            self.k -= 1
        self.layers = stream.get("temporalLayers", 1)
        self.packed = stream["codec"] == 3
        self.has_normals = stream["normals"] == "octahedral"
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
        if self.packed:
            symbols, bits = self.read_packed(sections), Bits(b"")
        else:
            symbols, bits = Symbols(sections[1] + sections[2]), Bits(sections[3] + sections[4])
        now = {name: [None] * self.count for name in "RSGQEDMW"}
        now["rests"] = [False] * self.count
        for number, (weight_class, phase) in enumerate(self.cloths.phases):
            if number == self.cloths.coarse_phases:
                self.check_coarse(sections, symbols, bits)
            quiet = not self.packed and bits.get(1)
            for start in range(0, len(phase), 64):
                group = phase[start:start + 64]
                predicted = [self.predict(now, v, weights[weight_class]) for v in group]
                residuals, stays = self.read_residuals(now, group, weight_class // 2 + (4 if key else 0), quiet, symbols, bits)
                for i, v in enumerate(group):
                    self.place(now, v, predicted[i], residuals[i], stays[i])
        if len(self.cloths.phases) == self.cloths.coarse_phases:
            self.check_coarse(sections, symbols, bits)
        now["normals"] = self.read_normals(now, symbols, bits) if self.has_normals else None
        if not self.packed:
            symbols.check_end()
            bits.check_end()
        now["C"] = []
        for v in range(self.count):
            around = add(*(now["R"][n] for n in self.cloths.nearest[v]))
            now["C"].append(sat(shift(sub(around, times(now["R"][v], 4)), self.k - 4)))
        now.update(tick=tick, layer=layer, weights=left)
        now["history"] = self.history[:2] or [now, now]
        self.newest = self.held[layer] = now

    def read_packed(self, sections):
        """Residuals of all vertices along u, v, n, None for n where it stays; those of normals behind."""
        order = [v for _, phase in self.cloths.phases for v in phase]
        coarse = sum(len(phase) for _, phase in self.cloths.phases[:self.cloths.coarse_phases])
        first, second = Groups(sections[1]), Groups(sections[2])
        residuals = first.read(coarse, 3) + second.read(self.count - coarse, 3)
        normals = second.read(self.count, 2) if self.has_normals else []
        first.bits.check_end()
        second.bits.check_end()
        return {v: (u, w, n) for v, (n, u, w) in zip(order, residuals)}, normals

    def check_coarse(self, sections, symbols, bits):
        if self.packed:
            return
        assert 2 * symbols.at == len(sections[1]) and (bits.at + 7) // 8 == len(sections[3])

    def read_normals(self, now, symbols, bits):
        sums = [(0, 0, 0)] * self.count
        for face in self.cloths.faces:
            p = [now["R"][v] for v in face]
            area = cross(sub(p[2], p[0]), sub(p[3], p[1])) if len(p) == 4 else cross(sub(p[1], p[0]), sub(p[2], p[0]))
            for v in face:
                sums[v] = add(sums[v], area)
        expected = [256, 256]
        normals = []
        for v, n in enumerate(sums):
            top = max((2, 0, 1), key=lambda c: abs(n[c]))
            down = abs(n[top]).bit_length() - 15
            n = shift(n, down) if down > 0 else times(n, 1 << -down)
            octahedral = []
            size = sum(map(abs, n))
            for c in 0, 1:
                x = n[(top + 1 + c) % 3]
                guess = (254 * abs(x) + size) // (2 * size) * (-1 if x < 0 else 1) if size else 0
                if self.packed:
                    octahedral.append((guess + symbols[1][v][c] + 128) % 256 - 128)
                    continue
                o = max(4, min(16383, expected[c])).bit_length() - 1
                scale = 2 * (o - 2) + (max(4, min(16383, expected[c])) >> o - 1 & 1)
                b = 0 if scale < 16 else (scale - 14) // 2
                number = symbols.get((2 * v + c) % 4, DISTRIBUTIONS[scale])
                if number == 15:
                    number += bits.gamma(2)
                r = unzigzag(number << b | bits.get(b))
                expected[c] += 256 * min(abs(r), 31) - expected[c] >> 5
                octahedral.append((guess + r + 128) % 256 - 128)
            normals.append(octahedral)
        return normals

    def past(self, name, i, v):
        if not self.history:
            return (0, 0, 0)
        return self.history[i - 1][name][v]

    def predict(self, now, v, w):
        f = self.k - 4
        at = lambda n: (0, 0, 0) if n is None else now["R"][n]
        p = [at(n) for n in self.cloths.parents[v]]
        w1, w2, w3 = self.cloths.weights[v][1:]
        off = add(times(sub(p[1], p[0]), w1), times(sub(p[2], p[0]), w2), times(sub(p[3], p[0]), w3), (32, 32, 32))
        s = add(p[0], shift(off, 6))
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
        if self.packed:
            for i, v in enumerate(group):
                stays[i] = symbols[0][v][2] is None
                if not stays[i]:
                    residuals[i] = list(symbols[0][v])
        elif not quiet:
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
                u, v = self.newest["normals"][i] if self.has_normals else (0, 0)
                total += mix(h ^ (u & 255 | (v & 255) << 8))
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

    assert packet[0] == 1
    varint()  # epoch
    tick = varint()
    references = [tick - varint() for _ in range(byte())]
    for _ in range(varint()):
        varint(), varint()
    sizes = [varint() for _ in range(byte())]
    assert at + sum(sizes) == len(packet) and len(sizes) == {2: 5, 3: 3}[packet[1]]
    sections = []
    for size in sizes:
        sections.append(packet[at:at + size])
        at += size
    return packet[2] == 0, packet[4], tick, references[0] if references else None, sections


def main():
    packets = 0
    for stream in json.load(open(GOLDEN + "streams.json")):
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
