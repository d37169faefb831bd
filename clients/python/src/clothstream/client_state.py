# SPDX-License-Identifier: MIT
"""What a client knows of a scene: the same for a stream of a server and for a recording."""
from __future__ import annotations

import contextlib
import ctypes as c
from typing import Type, TypeVar

import numpy as np

from . import _bindings as b
from ._library import Error, array, lib, new, text, to
from .types import (Cloth, ClothReport, ClothSettings, Collider, ContactEvent, Environment, GrabEvent, Participant, Presence,
                    Statistics)

T = TypeVar("T")


class Frame:
    """A decoded frame. It is current until the next one is read; then its members raise clothstream.Error, and arrays that
    were taken from it must not be used any more. Keep `frame.positions.copy()` for longer."""

    def __init__(self, state: ClientState, tick: int, seconds: float):
        self._state: ClientState | None = state
        self.tick = tick
        self.seconds = seconds

    @property
    def _current(self) -> ClientState:
        if self._state is None:
            raise Error("The frame is no longer current: a later one was read, or a request has waited. Copy what is to stay.")
        return self._state

    @property
    def positions(self) -> np.ndarray:
        """Positions in metres: float32 of shape (vertices, 3). Not a copy."""
        return self._current._floats("cs_positions")

    @property
    def normals(self) -> np.ndarray:
        """Unit normals: float32 of shape (vertices, 3). Not a copy."""
        return self._current._floats("cs_normals")

    @property
    def hash(self) -> int:
        """Hash of the decoded frame, to compare with other clients."""
        with self._current._client() as client:
            return lib.cs_reconstruction_hash(client)

    @property
    def colliders(self) -> list[Collider]:
        """Colliders of the scene and of all participants in this frame."""
        return self._current._list("cs_collider_count", "cs_get_collider", b.cs_collider, Collider)

    def mesh(self, collider: int) -> tuple[np.ndarray, np.ndarray]:
        """Vertices, float32 of shape (vertices, 3), and triangles, uint32 of shape (triangles, 3), of a collider that is a hull
        or a mesh: the index counts in `colliders`. They are in the frame of the collider, where joints have moved them.
        Copies. Both are empty for other shapes."""
        with self._current._client() as client:
            vertices, indices, triangles = c.c_uint32(), c.c_uint32(), c.POINTER(c.c_uint32)()
            corners = lib.cs_get_hull(client, collider, c.byref(vertices), c.byref(triangles), c.byref(indices))
            return (array(corners, (vertices.value, 3), np.float32).copy(),
                    array(triangles, (indices.value // 3, 3), np.uint32).copy())

    def _end(self) -> None:
        self._state = None


class ClientState:
    """Cloths, parameters, participants and events. Subclasses give the cs_client."""

    def _client(self) -> contextlib.AbstractContextManager[int]:
        raise NotImplementedError

    def _floats(self, function: str, copied: bool = False) -> np.ndarray:
        with self._client() as client:
            view = array(getattr(lib, function)(client), (lib.cs_vertex_count(client), 3), np.float32)
            return view.copy() if copied else view

    def _list(self, count: str, get: str, struct: Type[c.Structure], kind: Type[T]) -> list[T]:
        with self._client() as client:
            found = new(struct)
            return [to(kind, found) for index in range(getattr(lib, count)(client))
                    if getattr(lib, get)(client, index, c.byref(found))]

    @property
    def scene(self) -> str:
        """Name of the scene."""
        with self._client() as client:
            return text(lib.cs_scene_name(client))

    @property
    def vertex_count(self) -> int:
        """Number of vertices of all cloths."""
        with self._client() as client:
            return lib.cs_vertex_count(client)

    @property
    def simulation_rate(self) -> int:
        """Ticks per second."""
        with self._client() as client:
            return lib.cs_simulation_rate(client)

    @property
    def stream_rate(self) -> int:
        """Frames per second."""
        with self._client() as client:
            return lib.cs_stream_rate(client)

    @property
    def cloths(self) -> list[Cloth]:
        return self._list("cs_cloth_count", "cs_get_cloth", b.cs_cloth, Cloth)

    @property
    def positions(self) -> np.ndarray:
        """Positions of the newest frame, or at rest before the first, in metres: float32 of shape (vertices, 3). A copy."""
        return self._floats("cs_positions", copied=True)

    @property
    def triangles(self) -> np.ndarray:
        """Vertex indices of all cloths: uint32 of shape (triangles, 3). A copy."""
        with self._client() as client:
            count = c.c_uint32()
            pointer = lib.cs_triangles(client, c.byref(count))
            return array(pointer, (count.value // 3, 3), np.uint32).copy()

    @property
    def environment(self) -> Environment:
        with self._client() as client:
            found = new(b.cs_environment)
            if not lib.cs_get_environment(client, c.byref(found)):
                raise Error("The scene has no description yet.")
            return to(Environment, found)

    def cloth_settings(self, cloth: int = 0) -> ClothSettings:
        """Current parameters of a cloth. Raises IndexError for an unknown index."""
        with self._client() as client:
            found = new(b.cs_cloth_settings)
            if not lib.cs_get_cloth_settings(client, cloth, c.byref(found)):
                raise IndexError(f"cloth {cloth}; the scene has {lib.cs_cloth_count(client)}")
            return to(ClothSettings, found)

    def material(self, cloth: int = 0) -> str:
        """Material that was last applied to a cloth; "" if none was applied."""
        with self._client() as client:
            return text(lib.cs_cloth_material(client, cloth))

    @property
    def materials(self) -> list[str]:
        """Names of the materials that the server offers."""
        with self._client() as client:
            return [text(lib.cs_material(client, index)) for index in range(lib.cs_material_count(client))]

    @property
    def participants(self) -> list[Participant]:
        """People in the scene, in the order in which they joined."""
        return self._list("cs_participant_count", "cs_get_participant", b.cs_participant, Participant)

    @property
    def presence(self) -> Presence | None:
        """The newest change of the participants."""
        with self._client() as client:
            found, participant = new(b.cs_presence), new(b.cs_participant)
            if not lib.cs_get_presence(client, c.byref(found), c.byref(participant)):
                return None
            return to(Presence, found, participant=to(Participant, participant))

    @property
    def grab_events(self) -> list[GrabEvent]:
        """Events of the newest Event.GRABS, for the grabs of all participants."""
        return self._list("cs_grab_event_count", "cs_get_grab_event", b.cs_grab_event, GrabEvent)

    @property
    def contact_events(self) -> list[ContactEvent]:
        """Events of the newest Event.CONTACTS."""
        return self._list("cs_contact_event_count", "cs_get_contact_event", b.cs_contact_event, ContactEvent)

    @property
    def notice(self) -> str:
        """Text of the newest notice of the server; "" before the first."""
        with self._client() as client:
            return text(lib.cs_notice_text(client))

    def report(self, cloth: int = 0) -> ClothReport | None:
        """The server's newest measurements of a cloth; None before the first."""
        with self._client() as client:
            found = new(b.cs_cloth_report)
            return to(ClothReport, found) if lib.cs_get_cloth_report(client, cloth, c.byref(found)) else None

    def constraint_ends(self, cloth: int = 0) -> list[tuple[int, int]]:
        """Active constraints of a cloth with ACAD in the newest report: the two vertices of each, numbered from the
        cloth's first vertex. At most 16,384. Empty without want_constraints()."""
        with self._client() as client:
            count = c.c_uint32()
            ends = lib.cs_constraint_ends(client, cloth, c.byref(count))
            return [(ends[2 * i], ends[2 * i + 1]) for i in range(count.value)]

    @property
    def statistics(self) -> Statistics:
        with self._client() as client:
            found = new(b.cs_statistics)
            lib.cs_get_statistics(client, lib.clothstream_now_us(), c.byref(found))
            return to(Statistics, found)
