# SPDX-License-Identifier: MIT
"""Recordings without a server."""
from __future__ import annotations

import contextlib
import ctypes as c
import dataclasses
import enum
import os
from typing import Iterator

import numpy as np

from . import _bindings as b
from ._library import Error, array, lib, new, text, to
from .client_state import ClientState, Frame
from .types import Event, Quaternion, Vec3


class RecordingError(Error):
    """A recording cannot be read, or a part of it is damaged."""


class Recorded(enum.IntFlag):
    """Kinds of messages."""

    FRAME = b.CS_RECORDED_FRAME
    PARAMETERS = b.CS_RECORDED_PARAMETERS
    EVENTS = b.CS_RECORDED_EVENTS
    NOTICE = b.CS_RECORDED_NOTICE
    PARTICIPANT = b.CS_RECORDED_PARTICIPANT
    SCENE = b.CS_RECORDED_SCENE
    TICK = b.CS_RECORDED_TICK
    CHECKPOINT = b.CS_RECORDED_CHECKPOINT
    ALL = b.CS_RECORDED_ALL


@dataclasses.dataclass(frozen=True)
class Info:
    complete: int  # 0: the file is cut or damaged at its end, and is read up to there
    seconds: float  # from the first message to the last
    start_ns: int  # since 1970
    bytes: int
    frames: int  # 0 if the file is not complete
    ticks: int  # 0 in recordings of clients


@dataclasses.dataclass(frozen=True)
class Faults:
    """Frames that were read so far and cannot be shown as they were recorded."""

    frames: int  # all frames; frames that are read again after a seek count again
    undecodable: int  # the decoder refused them
    different: int  # decoded, but different from their recorded hash
    first_tick: int  # of the first such frame; 0 if its header cannot be read
    first_seconds: float  # since the start of the recording


@dataclasses.dataclass(frozen=True)
class Pose:
    position: Vec3  # m
    orientation: Quaternion


@dataclasses.dataclass(frozen=True)
class RecordedCollider:
    participant_id: int  # 0: the scene
    id: int
    shape: int  # Shape
    start: Pose  # at the start of the tick
    end: Pose
    friction: float
    radius: float  # m
    length: float  # m
    size: Vec3  # m
    top_radius: float  # m; as in Collider


@dataclasses.dataclass(frozen=True)
class RecordedGrab:
    state: int  # 0 holds nothing, 1 holds, 2 takes
    start: Pose
    end: Pose
    radius: float  # m
    reach: float  # m
    max_force: float  # N
    slip_distance: float  # m


@dataclasses.dataclass(frozen=True)
class RecordedTick:
    """Input and state hash of a tick."""

    tick: int
    state_hash: int
    recovery: int  # 0 none, 1 rollback, 2 reset
    unhealthy: int
    saves_state: int
    gravity: Vec3  # m/s^2
    wind: Vec3  # m/s, gust included
    air_density: float  # kg/m^3
    substeps: int  # 0: as many as the scene has
    colliders: list[RecordedCollider]
    attachments: list[Pose]
    grabs: list[RecordedGrab]


class Message:
    """A message of the recording that is not a frame."""

    def __init__(self, recorded: b.cs_recorded):
        self.kind = Recorded(recorded.kind)
        self.events = Event(recorded.events)
        """What changed; then ask the recording for grab_events, environment and so on."""
        self.seconds: float = recorded.seconds
        """Time since the start of the recording."""
        self.tick: int = recorded.tick
        self.state_hash: int = recorded.state_hash
        """Hash of the simulation's state after the tick; 0 if the message has none."""


class RecordedFrame(Frame):
    """A frame of a recording."""

    def __init__(self, state: ClientState, recorded: b.cs_recorded):
        super().__init__(state, recorded.tick, recorded.seconds)
        self.kind = Recorded.FRAME
        self.key = bool(recorded.key)
        """Whether it can be decoded without earlier frames."""
        self.recorded_hash: int = recorded.reconstruction_hash
        """Hash that the recording states. It equals `hash` unless the decoder or the file is wrong."""
        self.state_hash: int = recorded.state_hash
        """Hash of the simulation's state after the tick; 0 if the recording has none."""
        self.events = Event(recorded.events)


class Recording(ClientState):
    """A recording that is played. All members describe the place up to which it was read."""

    def __init__(self, handle: int, kept: object = None):
        self._handle: int | None = handle
        self._kept = kept  # memory that the library reads
        self._frame: RecordedFrame | None = None
        if not lib.cs_recording_is_open(handle):
            message = text(lib.cs_recording_error_text(handle))
            self.close()
            raise RecordingError(message)

    def close(self) -> None:
        """Frees the recording. Arrays of its frames must not be used any more."""
        handle, self._handle = self._handle, None
        self._end_frame()
        if handle is not None:
            lib.cs_recording_close(handle)

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()

    def _opened(self) -> int:
        if self._handle is None:
            raise RecordingError("The recording is closed.")
        return self._handle

    @contextlib.contextmanager
    def _client(self) -> Iterator[int]:
        yield lib.cs_recording_client(self._opened())

    def _end_frame(self) -> None:
        if self._frame is not None:
            self._frame._end()
        self._frame = None

    def _shown(self, recorded: b.cs_recorded) -> RecordedFrame:
        self._frame = RecordedFrame(self, recorded)
        return self._frame

    def _error(self) -> RecordingError:
        return RecordingError(text(lib.cs_recording_error_text(self._opened())))

    @property
    def info(self) -> Info:
        """Length and size of the file."""
        found = new(b.cs_recording_info)
        lib.cs_recording_get_info(self._opened(), c.byref(found))
        return to(Info, found)

    @property
    def faults(self) -> Faults:
        """Counts of frames with faults. A recording that was read without an error has none."""
        found = new(b.cs_recording_faults)
        lib.cs_recording_get_faults(self._opened(), c.byref(found))
        return to(Faults, found)

    def metadata(self, name: str) -> str:
        """Entry of the metadata, such as "server", "scene", "started" or "device"; "" if there is none."""
        return text(lib.cs_recording_metadata(self._opened(), name.encode()))

    def next(self, kinds: int = Recorded.ALL) -> RecordedFrame | Message | None:
        """Reads the next message of these kinds; None at the end. A frame is a RecordedFrame. Raises RecordingError for a
        damaged chunk, and for a frame that cannot be decoded or differs from its recorded hash; the next call continues
        after it. The frames that depend on such a frame are left out without a further error; `faults` counts them."""
        recorded = new(b.cs_recorded)
        self._end_frame()
        result = lib.cs_recording_next(self._opened(), int(kinds), c.byref(recorded))
        if result == b.CS_RECORDING_ERROR:
            raise self._error()
        if result == b.CS_RECORDING_END:
            return None
        return self._shown(recorded) if recorded.kind == b.CS_RECORDED_FRAME else Message(recorded)

    def frames(self) -> Iterator[RecordedFrame]:
        """The frames from here to the end. Raises RecordingError as next() does; a new iteration continues after it."""
        while (frame := self.next(Recorded.FRAME)) is not None:
            assert isinstance(frame, RecordedFrame)
            yield frame

    __iter__ = frames

    def messages(self, kinds: int = Recorded.ALL) -> Iterator[RecordedFrame | Message]:
        """All messages of these kinds from here to the end: frames, events, participants, the journal."""
        while (message := self.next(kinds)) is not None:
            yield message

    def seek(self, seconds: float) -> RecordedFrame | None:
        """Goes to the newest frame at or before a time since the start; None if there is none. Parameters and participants
        are those of this time."""
        return self._seek(lib.cs_recording_seek, seconds)

    def seek_tick(self, tick: int) -> RecordedFrame | None:
        """Like seek(), to the newest frame with this tick or an earlier one."""
        return self._seek(lib.cs_recording_seek_tick, tick)

    def _seek(self, function: object, where: float) -> RecordedFrame | None:
        recorded = new(b.cs_recorded)
        self._end_frame()
        if not function(self._opened(), where, c.byref(recorded)):  # type: ignore[operator]
            raise self._error()
        return self._shown(recorded) if recorded.kind else None

    @property
    def message(self) -> bytes:
        """The newest message as in the file: serialised protobuf (docs/recording.md). b"" before the first and after a
        seek."""
        size = c.c_size_t()
        pointer = lib.cs_recording_message(self._opened(), c.byref(size))
        return c.string_at(pointer, size.value) if pointer else b""

    @property
    def journal(self) -> RecordedTick | None:
        """The newest tick of the journal, which only servers write; None before the first."""
        found = new(b.cs_recorded_tick)
        if not lib.cs_recording_get_tick(self._opened(), c.byref(found)):
            return None

        def each(count: int, get: str, struct: type) -> Iterator[c.Structure]:
            element = new(struct)
            for index in range(count):
                getattr(lib, get)(self._opened(), index, c.byref(element))
                yield element

        return to(RecordedTick, found,
                  colliders=[to(RecordedCollider, one, start=to(Pose, one.start), end=to(Pose, one.end))
                             for one in each(found.collider_count, "cs_recording_get_collider", b.cs_recorded_collider)],
                  attachments=[to(Pose, one) for one in each(found.attachment_count, "cs_recording_get_attachment", b.cs_recorded_pose)],
                  grabs=[to(RecordedGrab, one, start=to(Pose, one.start), end=to(Pose, one.end))
                         for one in each(found.grab_count, "cs_recording_get_grab", b.cs_recorded_grab)])

    @property
    def checkpoint(self) -> tuple[int, np.ndarray] | None:
        """The newest exact state that a server recorded, and the tick after which it holds: float32 of shape (nodes, 6),
        position in metres and velocity in m/s. A copy. None before the first."""
        nodes, tick = c.c_uint32(), c.c_uint64()
        pointer = lib.cs_recording_state(self._opened(), c.byref(nodes), c.byref(tick))
        return (tick.value, array(pointer, (nodes.value, 6), np.float32).copy()) if pointer else None


def open_recording(source: str | os.PathLike[str] | bytes | bytearray | memoryview, max_vertices: int = 1_048_576) -> Recording:
    """Opens a recording (MCAP): a path, or the bytes of a file. Raises RecordingError if it cannot be read. A file that is
    cut is read up to the cut. max_vertices, 1 to 67108864: a recording with more vertices is refused before memory is
    used."""
    if isinstance(source, (bytes, bytearray, memoryview)):
        kept = bytes(source)  # the library reads it until the recording is closed
        memory = c.cast(c.c_char_p(kept), c.POINTER(c.c_uint8))
        return Recording(lib.cs_recording_open_bytes(memory, len(kept), max_vertices), kept)
    return Recording(lib.cs_recording_open(os.fsencode(source), max_vertices))
