# SPDX-License-Identifier: MIT
"""What a participant brings into a scene: colliders, hands, grabs, winds, a body, and surfaces of its real room."""
from __future__ import annotations

import ctypes as c
from typing import Any, Sequence

import numpy as np

from . import _bindings as b
from ._library import array, lib, new, text, to, vector
from .client_state import ClientState
from .types import Grab, OwnCollider, OwnWind, Quaternion, RoomSurface, Surface, SurfacePolicy, TrackedBody, Vec3

# Parts of a body by the names that TrackedBody and the library's struct have for them.
_BODY_PARTS = {name: getattr(b, f"CS_BODY_{name.upper()}") for name, _ in b.cs_tracked_body._fields_
               if name not in ("version", "parts", "floor")}


def _room_surface(client: int, index: int) -> RoomSurface:
    found = new(b.cs_room_surface)
    lib.cs_get_room_surface(client, index, c.byref(found))
    return to(RoomSurface, found, two_sided=bool(found.two_sided),
              positions=array(found.positions, (found.vertex_count, 3), np.float32).copy(),
              triangles=array(found.triangles, (found.triangle_count, 3), np.uint32).copy())


class OwnInput(ClientState):
    """Input of this participant. It is sent as soon as the current frame ends."""

    def set_colliders(self, colliders: Sequence[OwnCollider | Sequence[float]]) -> None:
        """Replaces the colliders of this participant. Each is an OwnCollider, or a sphere (x, y, z, radius) in metres. At
        most 40 are used."""
        shapes = (b.cs_own_collider * max(1, len(colliders)))()
        for struct, given in zip(shapes, colliders):
            if not isinstance(given, OwnCollider):
                x, y, z, radius = given
                given = OwnCollider(position=(x, y, z), radius=radius)
            struct.version, struct.shape = b.CS_OWN_COLLIDER_VERSION, given.shape
            struct.position, struct.orientation = tuple(given.position), tuple(given.orientation)
            struct.radius, struct.top_radius, struct.length = given.radius, given.top_radius, given.length
            struct.size = tuple(given.size)
        with self._client() as client:
            lib.cs_set_colliders(client, shapes, len(colliders), lib.clothstream_now_us())

    def set_hand(self, side: str, joints: Any) -> None:
        """Replaces a tracked hand. side: "left" or "right". joints: an array of shape (26, 4) in the order of OpenXR's
        XrHandJointEXT, or (25, 4) in that of WebXR: x, y, z, radius in metres. None removes the hand."""
        numbers = [] if joints is None else [float(number) for joint in joints for number in joint]
        array = (c.c_float * max(1, len(numbers)))(*numbers)
        with self._client() as client:
            if not lib.cs_set_hand(client, {"left": b.CS_HAND_LEFT, "right": b.CS_HAND_RIGHT}[side], array,
                                   len(numbers) // 4, lib.clothstream_now_us()):
                raise ValueError(f"{len(numbers)} numbers; a hand has 26 or 25 joints of 4 numbers")

    def set_head(self, position: Vec3 | None, orientation: Quaternion | None = None, radius: float = 0.12) -> None:
        """Replaces the head of this participant: a sphere that looks along -Z. None removes it."""
        with self._client() as client:
            lib.cs_set_head(client, vector(position, 3), vector(orientation, 4), radius, lib.clothstream_now_us())

    def set_grabs(self, grabs: Sequence[Grab]) -> None:
        """Replaces the grabs of this participant. At most 10 are used."""
        structs = (b.cs_grab * max(1, len(grabs)))()
        for struct, grab in zip(structs, grabs):
            struct.version = b.CS_GRAB_VERSION
            struct.id, struct.position, struct.orientation = grab.id, tuple(grab.position), tuple(grab.orientation)
            struct.radius, struct.reach, struct.max_force = grab.radius, grab.reach, grab.max_force
            struct.slip_distance = grab.slip_distance
        with self._client() as client:
            lib.cs_set_grabs(client, structs, len(grabs), lib.clothstream_now_us())

    def set_winds(self, winds: Sequence[OwnWind]) -> None:
        """Replaces the winds that this participant holds. At most 2 are used."""
        structs = (b.cs_own_wind * max(1, len(winds)))()
        for struct, wind in zip(structs, winds):
            struct.version, struct.kind = b.CS_OWN_WIND_VERSION, wind.kind
            struct.position, struct.orientation = tuple(wind.position), tuple(wind.orientation)
            struct.speed, struct.radius, struct.spread, struct.reach = wind.speed, wind.radius, wind.spread, wind.reach
        with self._client() as client:
            lib.cs_set_winds(client, structs, len(winds), lib.clothstream_now_us())

    def move_attachment(self, attachment: str, position: Vec3, orientation: Quaternion | None = None,
                        jumps: bool = False) -> None:
        """Moves an attachment of the scene; it stays there. If it jumps, its cloth goes along at once, however short the way
        is: use this for teleports and cuts of an animation.
        """
        with self._client() as client:
            lib.cs_move_attachment(client, attachment.encode(), vector(position, 3), vector(orientation, 4), int(jumps),
                                   lib.clothstream_now_us())

    def move_joints(self, collider: str, poses: Any, jumps: bool = False) -> None:
        """Moves the joints of a collider of the scene that is a mesh with joints; they stay there. poses: an array of shape
        (joints, 7) with all joints in the order of the scene: position and quaternion x, y, z, w, relative to the parent.
        If they jump, they are there in one tick, and the cloth that follows them goes along: use this for teleports and cuts
        of an animation. Event.ERROR reports a refusal."""
        numbers = [float(number) for pose in poses for number in pose]
        if len(numbers) % 7 != 0:
            raise ValueError(f"{len(numbers)} numbers; a pose has 7: position and quaternion x, y, z, w")
        array = (c.c_float * max(1, len(numbers)))(*numbers)
        with self._client() as client:
            lib.cs_move_joints(client, collider.encode(), array, len(numbers) // 7, int(jumps),
                               lib.clothstream_now_us())

    def is_body(self, collider: int) -> bool:
        """Whether a collider is a human body that can be worn: the index counts in `frame.colliders`."""
        with self._client() as client:
            return bool(lib.cs_is_body(client, collider))

    def wear(self, collider: str | None) -> None:
        """Takes a collider of the scene as the body of this participant; None gives back the one that it has. Event.PRESENCE
        announces the result, Event.ERROR a refusal, for example because another participant wears it."""
        with self._client() as client:
            if not lib.cs_wear(client, None if collider is None else collider.encode()):
                raise ValueError(f"{collider!r} is not a body of the scene")

    def body_of(self, participant_id: int) -> str:
        """Name of the collider that a participant wears; "" for none."""
        with self._client() as client:
            return text(lib.cs_body_of(client, participant_id))

    def set_body(self, tracked: TrackedBody) -> None:
        """Bends the worn body to a person, and sends its joints. It jumps the first time, and when the head moves by more than
        1 m."""
        parts, struct = 0, b.cs_tracked_body(version=b.CS_TRACKED_BODY_VERSION, floor=tracked.floor)
        for name, part in _BODY_PARTS.items():
            value = getattr(tracked, name)
            if value is not None:
                parts |= part
                setattr(struct, name, tuple(vector(value, len(getattr(struct, name)))))
        struct.parts = parts
        with self._client() as client:
            if not lib.cs_set_body(client, c.byref(struct), lib.clothstream_now_us()):
                raise ValueError("no body is worn, no head is tracked, or a number is not finite")

    def body_part(self, part: str) -> np.ndarray | None:
        """Where set_body() has put a part, by its name in TrackedBody: position and quaternion x, y, z, w. None if the body
        has no such part, or before."""
        pose = (c.c_float * 7)()
        with self._client() as client:
            return np.array(pose) if lib.cs_get_body_part(client, _BODY_PARTS[part], pose) else None

    @property
    def surface_policy(self) -> SurfacePolicy:
        """What the server does with surfaces of the real room."""
        with self._client() as client:
            return SurfacePolicy(lib.cs_get_surface_policy(client))

    def allow_surfaces(self, policy: SurfacePolicy) -> None:
        """Says how far the server's policy may go for surfaces to be sent: OWN (default) or EVERYONE. Ask the person first."""
        with self._client() as client:
            lib.cs_allow_surfaces(client, policy)

    def set_surface(self, surface: Surface) -> None:
        """Adds a surface of the real room, or replaces the one with its id. Event.ERROR reports a refusal by the server."""
        positions = [float(number) for vertex in surface.positions for number in vector(vertex, 3)]
        triangles = [int(corner) for triangle in surface.triangles for corner in triangle]
        if len(triangles) != 3 * len(surface.triangles):
            raise ValueError(f"{len(triangles)} numbers; a triangle has 3 vertices")
        struct = b.cs_surface(version=b.CS_SURFACE_VERSION, id=surface.id, vertex_count=len(positions) // 3,
                              triangle_count=len(surface.triangles), two_sided=int(surface.two_sided),
                              friction=surface.friction)
        struct.position, struct.orientation = tuple(surface.position), tuple(surface.orientation)
        numbers = (c.c_float * max(1, len(positions)))(*positions)
        corners = (c.c_uint32 * max(1, len(triangles)))(*triangles)
        struct.positions = c.cast(numbers, c.POINTER(c.c_float))
        struct.triangles = c.cast(corners, c.POINTER(c.c_uint32))
        with self._client() as client:
            if lib.cs_set_surface(client, c.byref(struct)):
                return
            policy = SurfacePolicy(lib.cs_get_surface_policy(client))
        triangle_count, vertex_count = len(surface.triangles), len(positions) // 3
        fits = 0 < triangle_count <= b.CS_MAX_SURFACE_TRIANGLES and vertex_count <= b.CS_MAX_SURFACE_VERTICES
        if policy in (SurfacePolicy.OWN, SurfacePolicy.EVERYONE) and not fits:
            raise ValueError(f"{triangle_count} triangles and {vertex_count} vertices; a surface has 1 to "
                             f"{b.CS_MAX_SURFACE_TRIANGLES} and at most {b.CS_MAX_SURFACE_VERTICES}")
        if policy is SurfacePolicy.EVERYONE:
            raise RuntimeError("this server sends surfaces to everyone in the scene; call allow_surfaces() first")
        raise RuntimeError(f"this server takes no surfaces of the real room ({policy.name.lower()})")

    def move_surface(self, id: int, position: Vec3, orientation: Quaternion | None = None) -> None:
        """Moves a surface of the real room, which stands in its new pose from the next tick on."""
        with self._client() as client:
            if not lib.cs_move_surface(client, id, vector(position, 3), vector(orientation, 4)):
                raise ValueError(f"there is no surface {id}; call set_surface() first")

    def remove_surface(self, id: int) -> None:
        """Removes a surface of the real room."""
        with self._client() as client:
            if not lib.cs_remove_surface(client, id):
                raise ValueError(f"there is no surface {id}; call set_surface() first")

    def follow_surfaces(self, on: bool = True) -> None:
        """Gets the surfaces of others, if the policy of the server is EVERYONE. Event.SURFACES says that they changed."""
        with self._client() as client:
            lib.cs_follow_surfaces(client, int(on))

    @property
    def room_surfaces(self) -> list[RoomSurface]:
        """Surfaces of others whose meshes have arrived. Copies."""
        with self._client() as client:
            return [_room_surface(client, index) for index in range(lib.cs_room_surface_count(client))]
