# SPDX-License-Identifier: MIT
"""Integers and vectors of three of them."""


# Number of times that decoding reached a corner of the format.
REACHED = {}


def reach(corner, times=1):
    REACHED[corner] = REACHED.get(corner, 0) + times


def wrap(x, bits, what):
    """The number in two's complement that has the lowest bits of x."""
    half = 1 << bits - 1
    if not -half <= x < half:
        reach(what)
    return (x + half) % (2 * half) - half


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
