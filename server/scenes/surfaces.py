# SPDX-License-Identifier: MIT
# Surfaces of a field of distances as triangles of nearly equal sides, with smooth edges where they are cut: marching
# tetrahedra (Doi and Koide, 1991), then remeshing (Botsch and Kobbelt, "A Remeshing Approach to Multiresolution
# Modeling", 2004).
import itertools
import math


def marched(field, low, high, step):
    """Vertices and triangles, counter-clockwise from outside, of the surface on which the field is 0."""
    size = [int((high[i] - low[i]) / step + 1) for i in range(3)]

    def place(node):
        return [low[i] + step * node[i] for i in range(3)]

    nodes = [(i, j, k) for i in range(size[0] + 1) for j in range(size[1] + 1) for k in range(size[2] + 1)]
    values = {node: field(place(node)) for node in nodes}
    ways = [[tuple(sum(axis == along for along in order[:count]) for axis in range(3)) for count in range(4)]
            for order in itertools.permutations(range(3))]
    points, numbers = [], {}

    def vertex(inside, outside):
        if (inside, outside) not in numbers:
            f, g = values[inside], values[outside]
            part = min(0.95, max(0.05, f / (f - g)))  # triangles of no area would have no front
            numbers[inside, outside] = len(points)
            points.append([u + part * (v - u) for u, v in zip(place(inside), place(outside))])
        return numbers[inside, outside]

    triangles = []
    for cell in nodes:
        if max(a - b for a, b in zip(cell, size)) == 0:
            continue
        corners = [(cell[0] + (n & 1), cell[1] + (n >> 1 & 1), cell[2] + (n >> 2)) for n in range(8)]
        if sum(values[corner] < 0 for corner in corners) in (0, 8):
            continue
        for way in ways:
            tetrahedron = [tuple(map(sum, zip(cell, corner))) for corner in way]
            inside = [node for node in tetrahedron if values[node] < 0]
            outside = [node for node in tetrahedron if values[node] >= 0]
            if len(inside) == 2 and len(outside) == 2:
                rim = [(inside[0], outside[0]), (inside[0], outside[1]), (inside[1], outside[1]), (inside[1], outside[0])]
            else:
                rim = [(a, b) for a in inside for b in outside]
            if not rim:
                continue
            p, q, r = [[u + v for u, v in zip(*pair)] for pair in rim[:3]]
            normal = cross([u - v for u, v in zip(q, p)], [u - v for u, v in zip(r, p)])
            if sum(n * (u - v) for n, u, v in zip(normal, outside[0], inside[0])) < 0:
                rim.reverse()
            corners = [vertex(*pair) for pair in rim]
            triangles += [(corners[0], b, c) for b, c in zip(corners[1:], corners[2:])]
    return points, triangles


def cross(u, v):
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def clipped(points, triangles, cut):
    """The part of a surface where the cut is not negative."""
    values = [cut(p) for p in points]
    points, numbers = list(points), {}

    def crossing(a, b):
        key = (min(a, b), max(a, b))
        if key not in numbers:
            f, g = values[key[0]], values[key[1]]
            numbers[key] = len(points)
            points.append([u + f / (f - g) * (v - u) for u, v in zip(points[key[0]], points[key[1]])])
        return numbers[key]

    result = []
    for triangle in triangles:
        polygon = []
        for a, b in zip(triangle, triangle[1:] + triangle[:1]):
            if values[a] >= 0:
                polygon.append(a)
            if (values[a] >= 0) != (values[b] >= 0):
                polygon.append(crossing(a, b))
        result += [(polygon[0], b, c) for b, c in zip(polygon[1:], polygon[2:])]
    return points, result


def largest(points, triangles):
    """The connected part with the most triangles, without unused vertices."""
    leader = list(range(len(points)))

    def find(a):
        while leader[a] != a:
            leader[a] = leader[leader[a]]
            a = leader[a]
        return a

    for a, b, c in triangles:
        leader[find(a)] = leader[find(b)] = find(c)
    count = {}
    for triangle in triangles:
        count[find(triangle[0])] = count.get(find(triangle[0]), 0) + 1
    best = max(count, key=lambda root: (count[root], root))
    return compact(points, [triangle for triangle in triangles if find(triangle[0]) == best])


def compact(points, triangles):
    used = sorted({corner for triangle in triangles for corner in triangle})
    number = {old: new for new, old in enumerate(used)}
    return [points[old] for old in used], [tuple(number[corner] for corner in triangle) for triangle in triangles]


def onto(p, functions, limit):
    """Moves a point to where all functions are 0, within 20 um, by Newton's method; `limit` bounds each move."""
    for _ in range(6):
        done = True
        for function in functions:
            value = function(p)
            if abs(value) < 2e-5:
                continue
            done = False
            slope = [(function([p[i] + 1e-5 * (i == axis) for i in range(3)]) - value) / 1e-5 for axis in range(3)]
            way = value / max(sum(s * s for s in slope), 1e-2)
            way *= min(1.0, limit / max(abs(way) * math.sqrt(sum(s * s for s in slope)), 1e-12))
            p = [p[i] - way * slope[i] for i in range(3)]
        if done:
            break
    return p


class Surface:
    """Triangles that are split, joined and turned until their sides are about as long as asked."""

    def __init__(self, points, triangles, field, cuts):
        self.points = [list(p) for p in points]
        self.field, self.cuts = field, cuts
        self.triangles = dict(enumerate(triangles))
        self.next = len(triangles)
        self.fans = [set() for _ in points]
        for number, triangle in self.triangles.items():
            for corner in triangle:
                self.fans[corner].add(number)

    def length(self, a, b):
        return math.dist(self.points[a], self.points[b])

    def edges(self):
        return sorted({(min(a, b), max(a, b)) for t in self.triangles.values() for a, b in zip(t, t[1:] + t[:1])})

    def sides(self, a, b):
        return sorted(self.fans[a] & self.fans[b])

    def around(self, a):
        return {corner for number in self.fans[a] for corner in self.triangles[number]} - {a}

    def on_edge(self, a):
        return len(self.around(a)) != len(self.fans[a])

    def rim(self, a):
        """Neighbours along the edge of the surface."""
        return sorted(b for b in self.around(a) if len(self.fans[a] & self.fans[b]) == 1)

    def borders(self, p):
        """The cuts through a point of the edge: one, or two at a corner."""
        values = sorted((abs(cut(p)), number) for number, cut in enumerate(self.cuts))
        return [number for value, number in values[:2] if value < 1e-3] or [values[0][1]]

    def is_corner(self, a):
        return self.on_edge(a) and len(self.borders(self.points[a])) > 1

    def replace(self, number, triangle):
        for corner in self.triangles.get(number, ()):
            self.fans[corner].discard(number)
        if triangle is None:
            del self.triangles[number]
            return
        self.triangles[number] = triangle
        for corner in triangle:
            self.fans[corner].add(number)

    def normal(self, a, b, c):
        p, q, r = self.points[a], self.points[b], self.points[c]
        u, v = [q[i] - p[i] for i in range(3)], [r[i] - p[i] for i in range(3)]
        return cross(u, v)

    def split(self, longest):
        for a, b in self.edges():
            if self.length(a, b) <= longest:
                continue
            middle = len(self.points)
            self.points.append([(u + v) / 2 for u, v in zip(self.points[a], self.points[b])])
            self.fans.append(set())
            for number in self.sides(a, b):
                triangle = self.triangles[number]
                other = tuple(middle if corner == b else corner for corner in triangle)
                self.replace(number, tuple(middle if corner == a else corner for corner in triangle))
                self.replace(self.next, other)
                self.next += 1

    def join(self, shortest, longest):
        for a, b in self.edges():
            if not self.fans[a] or not self.fans[b] or b not in self.around(a) or self.length(a, b) >= shortest:
                continue
            sides = self.sides(a, b)
            rims = self.on_edge(a), self.on_edge(b)
            if all(rims) and len(sides) != 1 or len(self.around(a) & self.around(b)) != len(sides):
                continue
            corners = self.is_corner(a), self.is_corner(b)
            if rims[1] > rims[0] or corners[1] > corners[0]:
                a, b = b, a
            # b joins a, in the middle if both are inside the surface, or both on a smooth edge.
            place = self.points[a]
            if rims[0] == rims[1] and not any(corners):
                place = [(u + v) / 2 for u, v in zip(self.points[a], self.points[b])]
            if any(math.dist(place, self.points[c]) > longest for c in self.around(a) | self.around(b) - {a, b}):
                continue
            if not self.keeps_front(a, b, place):
                continue
            self.points[a] = place
            for number in sorted(self.fans[b]):
                triangle = self.triangles[number]
                self.replace(number, None if a in triangle else tuple(a if c == b else c for c in triangle))

    def keeps_front(self, a, b, place):
        for vertex in (a, b):
            for number in self.fans[vertex]:
                triangle = self.triangles[number]
                if a in triangle and b in triangle:
                    continue
                before = self.normal(*triangle)
                kept, self.points[vertex] = self.points[vertex], place
                after = self.normal(*triangle)
                self.points[vertex] = kept
                if sum(u * v for u, v in zip(before, after)) <= 0.3 * math.hypot(*before) * math.hypot(*after):
                    return False
        return True

    def turn(self):
        """Turns edges so that vertices have six neighbours, or four on the edge of the surface."""
        for a, b in self.edges():
            sides = self.sides(a, b)
            if len(sides) != 2:
                continue
            first = self.triangles[sides[0]]
            c, d = [next(corner for corner in self.triangles[number] if corner not in (a, b)) for number in sides]
            if d in self.around(c):
                continue
            if first[(first.index(a) + 1) % 3] != b:
                c, d = d, c  # the triangle a, b, c then has the front of the surface
            missing = {v: len(self.around(v)) - (4 if self.on_edge(v) else 6) for v in (a, b, c, d)}
            before = sum(value * value for value in missing.values())
            after = sum((missing[v] + change) ** 2 for v, change in ((a, -1), (b, -1), (c, 1), (d, 1)))
            if after >= before:
                continue
            old, one, two = self.normal(a, b, c), self.normal(a, d, c), self.normal(d, b, c)
            if any(sum(u * v for u, v in zip(old, new)) <= 0.2 * math.hypot(*old) * math.hypot(*new)
                   for new in (one, two)):
                continue
            self.replace(sides[0], (a, d, c))
            self.replace(sides[1], (d, b, c))

    def relax(self, length):
        """Moves vertices towards the mean of their neighbours, on the surface and along its edges."""
        places = list(self.points)
        for a in range(len(self.points)):
            if not self.fans[a]:
                continue
            rim = self.on_edge(a)
            if rim and self.is_corner(a):
                places[a] = onto(self.points[a], [self.field] + [self.cuts[n] for n in self.borders(self.points[a])], length)
                continue
            near = self.rim(a) if rim else sorted(self.around(a))
            ways = [1 if rim else self.length(a, n) for n in near]  # long sides pull more than short ones
            p = [(self.points[a][i] + sum(way * self.points[n][i] for way, n in zip(ways, near)) / sum(ways)) / 2
                 for i in range(3)]
            functions = [self.field] + ([self.cuts[self.borders(self.points[a])[0]]] if rim else [])
            places[a] = onto(p, functions, length / 2)
        self.points = places


def surface(field, low, high, length, cuts=(), rounds=6, step=0.024):
    """The largest connected part of the surface where the field is 0 and no cut is negative, with sides of about
    this length."""
    points, triangles = marched(field, low, high, step)
    for cut in cuts:
        points, triangles = clipped(points, triangles, cut)
    result = Surface(*largest(points, triangles), field, cuts)
    for _ in range(rounds):
        result.split(4 / 3 * length)
        result.join(4 / 5 * length, 4 / 3 * length)
        result.turn()
        result.relax(length)
    return compact(result.points, [result.triangles[number] for number in sorted(result.triangles)])


def runs(points, numbers):
    """Numbers of points so that each eight in a row are near each other: halves along the widest axis."""
    if len(numbers) <= 8:
        return numbers
    extents = [max(points[n][axis] for n in numbers) - min(points[n][axis] for n in numbers) for axis in range(3)]
    axis = extents.index(max(extents))
    numbers = sorted(numbers, key=lambda n: (points[n][axis], n))
    half = (len(numbers) // 2 + 7) // 8 * 8
    return runs(points, numbers[:half]) + runs(points, numbers[half:])


def renumbered(points, triangles, order):
    number = {old: new for new, old in enumerate(order)}
    moved = [tuple(number[corner] for corner in triangle) for triangle in triangles]
    return [points[old] for old in order], sorted(moved, key=lambda triangle: (min(triangle), triangle))
