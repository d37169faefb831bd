# SPDX-License-Identifier: MIT
"""Orders and neighbours of vertices."""
import heapq
import math

from arithmetic import reach

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
                else:
                    reach("a triangle with two equal corners")
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
