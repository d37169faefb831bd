# SPDX-License-Identifier: MIT
"""Plays a recording to a program that uses libclothstream, and compares what the program makes of each frame with what is
committed. LIBCLOTHSTREAM names libclothstream.so if the loader does not find it; UPDATE_EXPECTED=1 writes what
is compared."""

import ctypes as c
import os
from pathlib import Path

FOLDER = Path(__file__).parent.parent
RECORDING = FOLDER / "cloth.mcap"
EXPECTED = FOLDER / "cloth.frames"

EVENT_FRAME = 1


class Statistics(c.Structure):
    _fields_ = [("version", c.c_uint32), ("tick", c.c_uint64), ("rest", c.c_byte * 128)]


class Playback(c.Structure):
    _fields_ = [("version", c.c_uint32)]
    _fields_ += [(name, c.c_double) for name in ("length", "position", "speed")]
    _fields_ += [("loop", c.c_int32), ("paused", c.c_int32)]


def load_library() -> c.CDLL:
    library = c.CDLL(os.environ.get("LIBCLOTHSTREAM", "libclothstream.so.0.3"))
    library.clothstream_now_us.restype = library.cs_reconstruction_hash.restype = c.c_uint64
    library.clothstream_acquire.restype = c.c_void_p
    library.clothstream_error_text.restype = c.c_char_p
    library.cs_positions.restype = c.POINTER(c.c_float)
    for name in ("cs_reconstruction_hash", "cs_positions", "cs_vertex_count"):
        getattr(library, name).argtypes = [c.c_void_p]
    for name in ("cs_get_statistics", "cs_get_playback"):
        getattr(library, name).argtypes = [c.c_void_p, c.c_uint64, c.c_void_p]
    return library


def describe_frames(address: str) -> str:
    """The program under test: follows a stream to the end of the recording, and describes each frame in a line."""
    library = load_library()
    stream, events = c.c_void_p(), c.c_uint32()
    if library.clothstream_open(address.encode(), None, c.byref(stream)) != 0:
        raise ConnectionError(library.clothstream_error_text().decode())
    statistics, playback = Statistics(version=1), Playback(version=1)
    lines = []
    while not playback.paused and library.clothstream_wait(stream, 10_000, c.byref(events)) == 0 and events.value:
        client = library.clothstream_acquire(stream)
        if events.value & EVENT_FRAME:
            library.cs_get_statistics(client, library.clothstream_now_us(), c.byref(statistics))
            positions = library.cs_positions(client)[: 3 * library.cs_vertex_count(client)]
            lines.append(f"{statistics.tick} {library.cs_reconstruction_hash(client):016x} {min(positions[1::3]):.9g}\n")
        library.cs_get_playback(client, library.clothstream_now_us(), c.byref(playback))
        library.clothstream_release(stream)
    library.clothstream_close(stream)
    return "".join(lines)


def test_every_frame_is_the_same(clothstream_play):
    lines = describe_frames(clothstream_play(RECORDING).address)
    if "UPDATE_EXPECTED" in os.environ:
        EXPECTED.write_text(lines)
    assert lines == EXPECTED.read_text()


def test_the_same_faults_give_the_same_frames(clothstream_play):
    once = describe_frames(clothstream_play(RECORDING, faults=4).address)
    assert describe_frames(clothstream_play(RECORDING, faults=4).address) == once
    assert len(once) < len(EXPECTED.read_text())
