# SPDX-License-Identifier: MIT
"""Streamed cloth in Python: join a scene of a clothstream-server, read recordings, simulate.

    import clothstream

    with clothstream.join("localhost", scene="flag") as stream:
        for frame in stream:
            print(frame.tick, frame.positions.mean(axis=0))

    for frame in clothstream.open_recording("drape.mcap"):
        print(frame.seconds, frame.positions[0])

Arrays of a frame are views of the library's memory, valid until the next frame: copy what is to stay."""
from ._library import Error, lib as _lib, text as _text
from .client_state import ClientState, Frame
from .recording import (Faults, Info, Message, Pose, Recorded, RecordedCollider, RecordedFrame, RecordedGrab, RecordedTick, Recording,
                        RecordingError, open_recording)
from .simulation import Simulation, SimulationFailed, simulate
from .stream import ConnectionFailed, RequestRefused, Stream, join
from .types import (Cloth, ClothReport, ClothSettings, Collider, ContactEvent, DatagramStatistics, Environment, Event, Grab, GrabEvent,
                    OwnCollider, OwnWind, Participant, Presence, Role, RoomSurface, SceneSummary, Shape, Solver, Statistics, Surface,
                    SurfacePolicy, TrackedBody, WindKind)

__version__: str = _text(_lib.clothstream_version())

__all__ = [
    "ClientState", "Cloth", "ClothReport", "ClothSettings", "Collider", "ConnectionFailed", "ContactEvent", "DatagramStatistics",
    "Environment", "Error",
    "Event", "Faults", "Frame", "Grab", "GrabEvent", "Info", "Message", "OwnCollider", "OwnWind", "Participant", "Pose", "Presence", "Recorded",
    "RecordedCollider", "RecordedFrame", "RecordedGrab", "RecordedTick", "Recording", "RecordingError", "RequestRefused", "Role",
    "RoomSurface", "SceneSummary", "Shape", "Simulation", "SimulationFailed", "Solver", "Statistics", "Stream", "Surface", "SurfacePolicy", "TrackedBody", "WindKind", "join",
    "open_recording", "simulate",
]
