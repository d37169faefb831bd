# SPDX-License-Identifier: MIT
"""Reads PNG files of 8-bit RGBA and compares them."""

import pathlib
import struct
import zlib

import numpy as np


def read(file):
    """Array of rows, columns and the four channels."""
    data = pathlib.Path(file).read_bytes()
    assert data.startswith(b"\x89PNG\r\n\x1a\n"), f"{file} is no PNG file"
    at, pixels = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colours, _, _, interlaced = struct.unpack(">IIBBBBB", body)
            assert (depth, colours, interlaced) == (8, 6, 0), f"{file} has no 8-bit RGBA"
        elif kind == b"IDAT":
            pixels += body
        at += 12 + length
    rows = np.frombuffer(zlib.decompress(pixels), np.uint8).reshape(height, 1 + 4 * width)
    return unfiltered(rows).reshape(height, width, 4)


def unfiltered(rows):
    """Reverses the filters of PNG (chapter 9 of the standard). The first byte of each row is its filter."""
    above = np.zeros(rows.shape[1] - 1, np.int32)
    result = np.empty((rows.shape[0], rows.shape[1] - 1), np.uint8)
    for y, row in enumerate(rows.astype(np.int32)):
        kind, now = row[0], row[1:].copy()
        if kind == 2:
            now = (now + above) & 255
        elif kind:
            for x in range(len(now)):
                left = now[x - 4] if x >= 4 else 0
                corner = above[x - 4] if x >= 4 else 0
                now[x] = (now[x] + predicted(kind, left, above[x], corner)) & 255
        result[y] = above = now
    return result


def predicted(kind, left, above, corner):
    if kind == 1:
        return left
    if kind == 3:
        return (left + above) // 2
    distances = [abs(above - corner), abs(left - corner), abs(left + above - 2 * corner)]
    return (left, above, corner)[distances.index(min(distances))]


def difference(one, other):
    """Mean difference of red, green and blue, 0 to 255."""
    one, other = read(one).astype(np.int32), read(other).astype(np.int32)
    assert one.shape == other.shape, f"the pictures have {one.shape} and {other.shape} numbers"
    return np.abs(one - other)[:, :, :3].mean()
