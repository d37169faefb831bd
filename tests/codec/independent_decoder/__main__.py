# SPDX-License-Identifier: MIT
"""A decoder written from proto/FRAME_FORMAT.md alone: decodes the golden packets and compares the reconstruction hashes.

Run from the project's root. It is slow, simple, and checks little of what it reads.
"""
import json
import sys

from decoder import Decoder, parse

GOLDEN = "tests/golden/"


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
