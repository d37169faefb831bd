# SPDX-License-Identifier: MIT
"""As follow.c, with the Python package."""
import pathlib
import sys

import clothstream

QUIET = 2.0  # seconds without a frame after which a paused scene has shown its last one


def fnv1a(data: bytes) -> int:
    value = 0xCBF29CE484222325
    for byte in data:
        value = (value ^ byte) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF
    return value


def main() -> None:
    address, fingerprint, token, name, out = sys.argv[1:]
    token = pathlib.Path(token).read_text().strip()
    with clothstream.join(address, fingerprint=fingerprint, token=token, name=name, timeout=60) as stream:
        last = b""
        while True:
            try:
                frame = stream.next_frame(QUIET)
            except TimeoutError:
                if "paused" in stream.notice:
                    break
                continue
            last = frame.positions.tobytes()
            print(f"frame {frame.tick} {fnv1a(last):016x}", flush=True)
        pathlib.Path(out).write_bytes(last)


main()
