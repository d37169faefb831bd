# SPDX-License-Identifier: MIT
"""Plain data: what a scene contains, what happens in it, and what can be changed. Units are SI; coordinates are
right-handed with +Y up."""
from __future__ import annotations

import dataclasses
import enum
from typing import Sequence

import numpy as np

from . import _bindings as b

Vec3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
"""x, y, z, w."""
Pose = tuple[float, float, float, float, float, float, float]
"""Position in m, and quaternion x, y, z, w."""
Spring = tuple[float, float]
"""Stiffness in N/m and damping in N s/m."""


class Event(enum.IntFlag):
    """What changed."""

    FRAME = b.CS_EVENT_FRAME
    DESCRIPTION = b.CS_EVENT_DESCRIPTION
    NOTICE = b.CS_EVENT_NOTICE
    ERROR = b.CS_EVENT_ERROR
    PARAMETERS = b.CS_EVENT_PARAMETERS
    SCENES = b.CS_EVENT_SCENES
    REPORT = b.CS_EVENT_REPORT
    GRABS = b.CS_EVENT_GRABS
    CONTACTS = b.CS_EVENT_CONTACTS
    PARTICIPANTS = b.CS_EVENT_PARTICIPANTS
    PRESENCE = b.CS_EVENT_PRESENCE
    RETURNED = b.CS_EVENT_RETURNED
    PLAYBACK = b.CS_EVENT_PLAYBACK
    TOKEN = b.CS_EVENT_TOKEN
    PAIRING_CODE = b.CS_EVENT_PAIRING_CODE
    ANSWER = b.CS_EVENT_ANSWER
    SURFACES = b.CS_EVENT_SURFACES


class Role(enum.IntEnum):
    UNSPECIFIED = b.CS_ROLE_UNSPECIFIED
    VIEWER = b.CS_ROLE_VIEWER
    PARTICIPANT = b.CS_ROLE_PARTICIPANT
    OWNER = b.CS_ROLE_OWNER


class Shape(enum.IntEnum):
    """Shape of a collider, in its own frame."""

    SPHERE = b.CS_SHAPE_SPHERE  # radius
    CAPSULE = b.CS_SHAPE_CAPSULE  # radius, top_radius; length of the segment along Y, centred on the origin
    PLANE = b.CS_SHAPE_PLANE  # the half-space y <= 0
    BOX = b.CS_SHAPE_BOX  # size, centred on the origin
    HULL = b.CS_SHAPE_HULL


class WindKind(enum.IntEnum):
    FAN = b.CS_WIND_FAN
    VORTEX = b.CS_WIND_VORTEX


class SurfacePolicy(enum.IntEnum):
    """What the server does with surfaces of the real room."""

    UNKNOWN = b.CS_SURFACES_UNKNOWN  # not connected yet, or the server is of a release that knows none
    OFF = b.CS_SURFACES_OFF  # it refuses them
    OWN = b.CS_SURFACES_OWN  # they act on the cloth, and their shape is sent to no client
    EVERYONE = b.CS_SURFACES_EVERYONE  # they act on the cloth, and everyone in the scene gets their shape


class Solver(enum.IntEnum):
    AS_IS = b.CS_SOLVER_AS_IS
    MASS_SPRING = b.CS_SOLVER_MASS_SPRING
    CONSTRAINT = b.CS_SOLVER_CONSTRAINT
    ACAD = b.CS_SOLVER_ACAD
    XPBD = b.CS_SOLVER_XPBD
    IMPLICIT_EULER = b.CS_SOLVER_IMPLICIT_EULER


@dataclasses.dataclass(frozen=True)
class Cloth:
    name: str
    first_vertex: int
    vertex_count: int
    rows: int  # 0 if the cloth is not a grid
    columns: int
    first_index: int  # range of its corners in the flattened triangles
    index_count: int


@dataclasses.dataclass(frozen=True)
class Collider:
    name: str  # of a participant's collider: its id
    shape: int  # Shape
    position: Vec3  # m
    orientation: Quaternion
    radius: float  # m
    length: float  # m
    size: Vec3  # m
    yields: int  # 1: it is not where its participant put it, because the cloth there has no room to give way
    participant_id: int  # 0: the scene
    top_radius: float  # m; of a capsule: radius of its end at +Y, else the same as radius


@dataclasses.dataclass(frozen=True)
class Participant:
    id: int
    name: str
    client_name: str
    role: int  # Role, or a newer role
    away: int  # 1 if the connection is lost and the server waits for a reconnect


@dataclasses.dataclass(frozen=True)
class Presence:
    kind: int  # 1 joined, 2 left, 3 role changed, 4 disconnected, 5 returned, 6 wears another body
    reason: int  # of leaving: 1 left, 2 timed out, 3 removed
    by: int  # id of the participant who caused it; 0: the participant itself or the server
    participant: Participant


@dataclasses.dataclass(frozen=True)
class Environment:
    gravity: Vec3  # m/s^2
    wind: Vec3  # m/s
    air_density: float  # kg/m^3
    gust_strength: float  # m/s; 0: no gusts
    gust_seconds: float


@dataclasses.dataclass(frozen=True)
class ClothSettings:
    """Parameters of a cloth. NaN, and -1 for bend_constraints and assembled: not known, or its solver has none."""

    structural: Spring
    shear: Spring
    bend: Spring
    damping: float  # 1/s
    drag: float
    lift: float
    friction: float
    thickness: float  # m
    solver: int  # Solver, or a newer kind
    bend_constraints: int
    iterations: int
    tolerance: float
    compliance: float  # m/N
    activation: float
    assembled: int
    dihedral_bending: float  # N m
    ball_radius: float  # m
    ball_friction: float
    tether_slack: float
    pressure: float  # Pa, of the gas inside; NaN for cloths that cannot hold gas


@dataclasses.dataclass(frozen=True)
class GrabEvent:
    participant_id: int
    grab_id: int
    kind: int  # 1 taken, 2 slipped, 3 released
    vertices: int  # number of vertices that the grab holds now


@dataclasses.dataclass(frozen=True)
class ContactEvent:
    kind: int  # 1 began, 2 ended
    collider_id: int
    participant_id: int  # 0: a collider of the scene
    collider: str
    cloth: str
    impulse: float  # N s
    seconds: float


@dataclasses.dataclass(frozen=True)
class ClothReport:
    """Measurements of a cloth by the server, a few times per second."""

    active_constraints: int
    iterations: int
    residual: float
    strain_max: float  # fraction of the rest length
    strain_p99: float
    strain_mean: float
    kinetic_energy: float  # J
    elastic_energy: float
    gravity_energy: float
    penetration: float  # m
    device_ms: float
    tick: int


@dataclasses.dataclass(frozen=True)
class Statistics:
    tick: int
    frames: int
    key_frames: int
    dropped: int
    decode_errors: int
    bytes: int
    hash_mismatches: int
    frames_per_second: float
    kbit_per_second: float
    bits_per_vertex: float
    round_trip_ms: float
    clock_offset_us: float
    decode_ms: float


@dataclasses.dataclass(frozen=True)
class DatagramStatistics:
    """Counts over all connections of the stream."""

    in_use: int
    packets: int
    lost_packets: int
    parity_packets: int
    frames: int
    repaired_frames: int
    lost_frames: int
    requests: int
    held_frames: int


@dataclasses.dataclass(frozen=True)
class SceneSummary:
    name: str
    description: str
    vertex_count: int
    cloth_count: int
    participants: int
    max_participants: int
    running: int
    paused: int
    created: int
    recorded: int
    is_recording: int


@dataclasses.dataclass(frozen=True)
class OwnCollider:
    """Collider of this participant: a sphere, capsule or box."""

    shape: Shape = Shape.SPHERE
    position: Vec3 = (0, 0, 0)  # m
    orientation: Quaternion = (0, 0, 0, 1)
    radius: float = 0.1  # m
    length: float = 0  # m
    size: Vec3 = (0, 0, 0)  # m
    top_radius: float = 0  # m; of a capsule: radius of its end at +Y; 0: the same as radius


@dataclasses.dataclass(frozen=True)
class Grab:
    """Hand that holds the cloth. NaN: the server's default."""

    id: int  # a new id takes hold; an id that is missing in the next call lets go
    position: Vec3  # m
    orientation: Quaternion = (0, 0, 0, 1)
    radius: float = float("nan")  # m
    reach: float = float("nan")  # m
    max_force: float = float("nan")  # N
    slip_distance: float = float("nan")  # m


@dataclasses.dataclass(frozen=True)
class Surface:
    """Surface of the real room of this participant: a triangle mesh that cloth does not pass through."""

    id: int  # a known id replaces its surface
    positions: Sequence[Vec3]  # m, -100 to 100, of each vertex, in the frame of the surface
    triangles: Sequence[tuple[int, int, int]]  # vertices, counter-clockwise seen from the front
    position: Vec3 = (0, 0, 0)  # m
    orientation: Quaternion = (0, 0, 0, 1)
    two_sided: bool = False  # cloth can be on both sides; else it passes the surface from behind
    friction: float = 1.0  # coefficient, 0 to 10, multiplied with the cloth's


@dataclasses.dataclass(frozen=True)
class RoomSurface:
    """Surface of the real room of another participant."""

    id: int  # unique for its participant
    participant_id: int
    revision: int  # differs from that of every other mesh of the scene
    position: Vec3  # m
    orientation: Quaternion
    positions: np.ndarray  # m, float32 of shape (vertices, 3), in the frame of the surface
    triangles: np.ndarray  # uint32 of shape (triangles, 3), counter-clockwise seen from the front
    two_sided: bool  # cloth can be on both sides


@dataclasses.dataclass(frozen=True)
class TrackedBody:
    """What is known of a person, in the scene. None: not tracked. Without a head, nothing acts."""

    head: Pose  # between the eyes; looks along -Z
    left_hand: Pose | None = None  # wrists: the fingers point along -Z, and the back of the hand to +Y
    right_hand: Pose | None = None
    hips: Vec3 | None = None  # joints of body tracking, m
    left_elbow: Vec3 | None = None
    right_elbow: Vec3 | None = None
    left_ankle: Vec3 | None = None
    right_ankle: Vec3 | None = None
    floor: float = 0.0  # height of the floor, m


@dataclasses.dataclass(frozen=True)
class OwnWind:
    """Wind that this participant holds: a fan or a vortex. NaN: the server's default."""

    position: Vec3  # m
    orientation: Quaternion = (0, 0, 0, 1)  # turns +Y to the axis
    kind: WindKind = WindKind.FAN
    speed: float = float("nan")  # m/s
    radius: float = float("nan")  # m; of a fan's opening, or of a vortex's core
    spread: float = float("nan")  # of a fan: growth of its radius for each metre of distance
    reach: float = float("nan")  # m
