# SPDX-License-Identifier: MIT
"""Contents of the sections of a packet: bits, symbols, residuals."""
import struct

from arithmetic import reach

FORMAT = "proto/FRAME_FORMAT.md"


def read_tables():
    """The table of scale weights, by scale class and component, and the table of distributions, by row."""
    rows = [[cell.strip() for cell in line.strip(" |\n").split("|")] for line in open(FORMAT) if line.startswith("|")]
    weights = {(int(row[0]), row[1]): tuple(map(int, row[2:]))
               for row in rows if len(row) == 8 and row[1] in ("u", "v", "n")}
    frequencies = {(row[0], int(row[1])): tuple(map(int, row[2:]))
                   for row in rows if len(row) == 18 and row[1].isdigit()}
    assert len(weights) == 24 and len(frequencies) == 48 and all(sum(row) == 4096 for row in frequencies.values())
    return ([[weights[scale_class, component] for component in "uvn"] for scale_class in range(8)],
            [frequencies[component, scale] for component in ("u, v", "n") for scale in range(24)])


SCALE_WEIGHTS, DISTRIBUTIONS = read_tables()


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
    """The residual of a number, of which the lowest 32 bits count."""
    if z >> 32:
        reach("a number beyond 32 bits")
    z &= 0xffffffff
    return z >> 1 ^ -(z & 1)
