# SPDX-License-Identifier: MIT
# Test program in Python: follows a stream with the package clothstream. CLOTHSTREAM_LIBRARY names libclothstream.so.
# Usage: follow.py ADDRESS. Prints "frame TICK HASH" for each decoded frame.
import sys
import time

import numpy as np

import clothstream


def fnv1a(data):
    value = 0xCBF29CE484222325
    for byte in data:
        value = (value ^ byte) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF
    return value


try:
    clothstream.join("127.0.0.1:1", timeout=3)
    sys.exit("joined a server that does not exist")
except clothstream.ConnectionFailed as error:
    assert "127.0.0.1:1" in str(error)

with clothstream.join(sys.argv[1], "small", role="participant", name="Py") as stream:
    stream.set_colliders([(-0.5, 3.25, 0.125, 0.25)])
    assert stream.triangles.max() == stream.vertex_count - 1 and stream.triangles.min() == 0
    address, kept, shared, ticks, seen = None, None, 0, set(), False
    end = time.monotonic() + 60
    for frame in stream:
        view = frame.positions
        # The view points into the library's memory: usually the same as that of the frame before.
        assert not view.flags.owndata and view.dtype == np.float32
        if view.__array_interface__["data"][0] == address and not np.array_equal(view, kept):
            shared += 1
        address, kept = view.__array_interface__["data"][0], view.copy()
        assert np.isfinite(view).all() and np.abs(view).max() < 5
        if frame.tick not in ticks:
            ticks.add(frame.tick)
            print(f"frame {frame.tick} {fnv1a(view.tobytes()):016x}")
        own = [one for one in frame.colliders if one.participant_id == stream.participant_id]
        seen = seen or [(one.position, one.radius) for one in own] == [((-0.5, 3.25, 0.125), 0.25)]
        if len(ticks) >= 60 and seen:
            break
        assert time.monotonic() < end, (len(ticks), seen)
    assert shared > 0 and stream.statistics.hash_mismatches == 0 and stream.statistics.decode_errors == 0
