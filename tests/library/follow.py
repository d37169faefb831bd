# SPDX-License-Identifier: MIT
# Test program in Python: follows a stream through libclothstream and numpy. Usage: follow.py LIBRARY ADDRESS
# Prints "frame TICK HASH" for each decoded frame.
import ctypes as c
import sys
import time

import numpy as np

PARTICIPANT = 2
OK, INVALID, UNREACHABLE = 0, 1, 2
EVENT_FRAME = 1


class Options(c.Structure):
    _fields_ = [("version", c.c_uint32), ("role", c.c_uint32), ("quality", c.c_uint32),
                ("temporal_layers", c.c_uint32), ("scene", c.c_char_p), ("client_name", c.c_char_p),
                ("display_name", c.c_char_p), ("join_timeout_ms", c.c_uint32), ("reconnect_for_ms", c.c_uint32)]


class Statistics(c.Structure):
    _fields_ = [(name, c.c_uint64) for name in ("tick", "frames", "key_frames", "dropped", "decode_errors", "bytes",
                                                "hash_mismatches")]
    _fields_ += [(name, c.c_double) for name in ("frames_per_second", "kbit_per_second", "bits_per_vertex", "round_trip_ms",
                                                 "clock_offset_us", "decode_ms")]


class Collider(c.Structure):
    _fields_ = [("name", c.c_char_p), ("shape", c.c_uint32), ("position", c.c_float * 3), ("orientation", c.c_float * 4),
                ("radius", c.c_float), ("length", c.c_float), ("size", c.c_float * 3), ("participant_id", c.c_uint64)]


def declared(library, name, result, *arguments):
    function = getattr(library, name)
    function.restype, function.argtypes = result, arguments
    return function


library = c.CDLL(sys.argv[1])
open_ = declared(library, "clothstream_open", c.c_int, c.c_char_p, c.POINTER(Options), c.POINTER(c.c_void_p))
default_options = declared(library, "clothstream_default_options", None, c.POINTER(Options))
close = declared(library, "clothstream_close", None, c.c_void_p)
wait = declared(library, "clothstream_wait", c.c_int, c.c_void_p, c.c_uint32, c.POINTER(c.c_uint32))
acquire = declared(library, "clothstream_acquire", c.c_void_p, c.c_void_p)
release = declared(library, "clothstream_release", None, c.c_void_p)
now_us = declared(library, "clothstream_now_us", c.c_uint64)
error_text = declared(library, "clothstream_error_text", c.c_char_p)
vertex_count = declared(library, "cs_vertex_count", c.c_uint32, c.c_void_p)
positions = declared(library, "cs_positions", c.POINTER(c.c_float), c.c_void_p)
triangles = declared(library, "cs_triangles", c.POINTER(c.c_uint32), c.c_void_p, c.POINTER(c.c_uint32))
get_statistics = declared(library, "cs_get_statistics", None, c.c_void_p, c.c_uint64, c.POINTER(Statistics))
get_collider = declared(library, "cs_get_collider", c.c_int, c.c_void_p, c.c_uint32, c.POINTER(Collider))
participant_id = declared(library, "cs_participant_id", c.c_uint64, c.c_void_p)
set_colliders = declared(library, "cs_set_colliders", None, c.c_void_p, c.POINTER(c.c_float), c.c_uint32, c.c_uint64)


def fnv1a(data):
    value = 0xCBF29CE484222325
    for byte in data:
        value = (value ^ byte) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF
    return value


def own_colliders(client):
    collider, index, found = Collider(), 0, []
    while get_collider(client, index, c.byref(collider)):
        if collider.participant_id == participant_id(client):
            found.append((tuple(collider.position), collider.radius))
        index += 1
    return found


options, stream = Options(), c.c_void_p()
default_options(c.byref(options))
options.join_timeout_ms = 3000
assert open_(b"127.0.0.1:1", c.byref(options), c.byref(stream)) == UNREACHABLE
assert stream.value is None and b"127.0.0.1:1" in error_text()
assert open_(b"", None, c.byref(stream)) == INVALID and b"HOST" in error_text()

default_options(c.byref(options))
options.scene, options.display_name, options.role = b"small", b"Py", PARTICIPANT
assert open_(sys.argv[2].encode(), c.byref(options), c.byref(stream)) == OK, error_text()

client = acquire(stream)
sphere = (c.c_float * 4)(-0.5, 3.25, 0.125, 0.25)
set_colliders(client, sphere, 1, now_us())
indices = c.c_uint32()
pointer = triangles(client, c.byref(indices))
faces = np.ctypeslib.as_array(pointer, shape=(indices.value // 3, 3))
assert faces.max() == vertex_count(client) - 1 and faces.min() == 0
release(stream)

statistics, events = Statistics(), c.c_uint32()
kept, kept_copy, shared, ticks, seen = None, None, 0, set(), False
end = time.monotonic() + 60
while len(ticks) < 60 or not seen:
    assert time.monotonic() < end, (len(ticks), seen)
    assert wait(stream, 1000, c.byref(events)) == OK, error_text()
    if not events.value & EVENT_FRAME:
        continue
    client = acquire(stream)
    get_statistics(client, now_us(), c.byref(statistics))
    pointer = positions(client)
    view = np.ctypeslib.as_array(pointer, shape=(vertex_count(client), 3))
    # The view points into the library's memory. A view of the previous frame now shows the new frame too.
    assert view.__array_interface__["data"][0] == c.addressof(pointer.contents)
    assert not view.flags.owndata and view.dtype == np.float32
    if kept is not None and kept.__array_interface__["data"] == view.__array_interface__["data"]:
        assert np.shares_memory(kept, view) and np.array_equal(kept, view) and not np.array_equal(kept_copy, kept)
        shared += 1
    kept, kept_copy = view, view.copy()
    assert np.isfinite(view).all() and np.abs(view).max() < 5
    if statistics.tick not in ticks:
        ticks.add(statistics.tick)
        print(f"frame {statistics.tick} {fnv1a(view.tobytes()):016x}")
    seen = seen or ((-0.5, 3.25, 0.125), 0.25) in own_colliders(client)
    release(stream)
assert shared > 0 and statistics.hash_mismatches == 0 and statistics.decode_errors == 0
close(stream)
