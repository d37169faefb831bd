# SPDX-License-Identifier: MIT
"""A decoder written from proto/FRAME_FORMAT.md alone. It decodes the golden packets and compares what they must give.

Run it from the project's root. It is slow and simple, and checks little of what it reads.
"""
import json
import struct
import sys

from arithmetic import REACHED
from decoder import Decoder, parse
from examples import check_mesh, check_packets

GOLDEN = "tests/golden/"
# Corners of the format that the golden packets must reach, so that every decoder is tested there.
CORNERS = [
    "D1 - D2 beyond 16 bits",
    "a number beyond 32 bits",
    "a packet with symbols of no coarse vertices and no others",
    "a packet with symbols of no coarse vertices and some others",
    "a packet with symbols of some coarse vertices and no others",
    "a packet with symbols of some coarse vertices and some others",
    "a residual beyond 16 bits",
    "a sum of S beyond 32 bits",
    "a sum of face normals beyond 64 bits",
    "a triangle with two equal corners",
    "a vertex that stays",
]


def fnv(floats):
    """FNV-1a (64 bits) of little-endian float32 numbers, in hexadecimal."""
    value = 0xcbf29ce484222325
    for byte in struct.pack("<%df" % len(floats), *floats):
        value = (value ^ byte) * 0x100000001b3 & 0xffffffffffffffff
    return "%016x" % value


def expect(what, packet, found, expected):
    if found != expected:
        sys.exit("%s: %s is %s instead of %s" % (packet["file"], what, found, expected))


def main():
    print("the page's examples are right: %d packets, a mesh of %d vertices" % (check_packets(), check_mesh()))
    packets = refused = normals = 0
    for stream in json.load(open(GOLDEN + "streams.json")):
        decoder, coarse = Decoder(stream), Decoder(stream, coarse=True)
        for packet in stream["packets"]:
            parsed = parse(open(GOLDEN + packet["file"], "rb").read())
            decoder.decode(parsed)
            coarse.decode(parsed)
            expect("the reconstruction hash", packet, decoder.hash(), packet["reconstructionHash"])
            expect("the hash of the positions", packet, fnv(decoder.metres()), packet["positionsHash"])
            expect("the hash of the coarse positions", packet, fnv(coarse.metres()), packet["coarsePositionsHash"])
            packets += 1
        for file in stream.get("refused", []):
            try:
                decoder.decode(parse(open(GOLDEN + file, "rb").read()))
            except AssertionError:
                expect("the reconstruction hash", {"file": file}, decoder.hash(), packet["reconstructionHash"])
            else:
                sys.exit("%s is not refused" % file)
            refused += 1
        decoded = decoder.normals()
        for sample in stream["normalSamples"]:
            normal = decoded[sample["vertex"]]
            if max(abs(x - y) for x, y in zip(normal, sample["normal"])) > 2e-6:
                sys.exit("%s: the normal of vertex %d is %s instead of %s" % (
                    stream["name"], sample["vertex"], normal, sample["normal"]))
            normals += 1
    assert packets > 0 and refused > 0 and normals > 0
    missed = [corner for corner in CORNERS if corner not in REACHED]
    if missed:
        sys.exit("the golden packets do not reach: " + "; ".join(missed))
    print("%d packets give the expected positions, whole and coarse, and %d normals; %d are refused" % (
        packets, normals, refused))


if __name__ == "__main__":
    main()
