# SPDX-License-Identifier: MIT
"""Joins a scene of a server."""
from __future__ import annotations

import contextlib
import ctypes as c
import time
from typing import Any, Iterator

from . import _bindings as b
from ._library import Error, lib, new, text, to, vector
from .client_state import Frame
from .own_input import OwnInput
from .types import DatagramStatistics, Event, Role, SceneSummary, Vec3


class ConnectionFailed(Error):
    """The server cannot be reached, has refused the client, or the connection was lost for good."""


class RequestRefused(Error):
    """The server refused a request. `code` is an ErrorCode of session.proto."""

    def __init__(self, message: str, code: int):
        super().__init__(message)
        self.code = code


_ROLES = {"viewer": Role.VIEWER, "participant": Role.PARTICIPANT, "owner": Role.OWNER, "": Role.UNSPECIFIED}

_TRANSPORTS = {"auto": b.CLOTHSTREAM_TRANSPORT_AUTO, "datagrams": b.CLOTHSTREAM_TRANSPORT_DATAGRAMS,
               "tcp": b.CLOTHSTREAM_TRANSPORT_TCP}


def join(address: str, scene: str = "", *, role: str | Role = "", name: str = "", token: str = "", ca_file: str = "",
         fingerprint: str = "", quality: int = 0, timeout: float = 10.0,
         reconnect_for: float = 60.0, transport: str = "auto") -> Stream:
    """Joins a scene, and returns when its description has arrived. Use the result in a `with` statement.

    address: HOST or HOST:PORT of the server's page (default port 8080); wss:// or https:// before it means TLS.
    scene: "" means the server's default scene. role: "viewer", "participant" or "owner"; "" lets the server choose.
    name: what other participants see. token: proof of identity, sent to other machines only with TLS.
    ca_file, fingerprint: with TLS, a PEM file of authorities, or the fingerprint of the server's key.
    quality: best quality level, 0 (finest) to 3.
    timeout, reconnect_for: seconds to join, and to try to reconnect after a loss.
    transport: "auto": frames and input travel in datagrams if the server and the network allow them; "datagrams": joining
    fails if they do not; "tcp": never.

    Raises ValueError if an argument is not allowed, and ConnectionFailed."""
    if isinstance(role, str) and role.lower() not in _ROLES:
        raise ValueError(f"role: '{role}'; use viewer, participant, owner or \"\"")
    if transport not in _TRANSPORTS:
        raise ValueError(f"transport: '{transport}'; use auto, datagrams or tcp")
    options = b.clothstream_options()
    lib.clothstream_default_options(c.byref(options))
    kept = [value.encode() for value in (scene, name, token, ca_file, fingerprint)]
    options.scene, options.display_name, options.token, options.ca_file, options.fingerprint = kept
    options.client_name = b"clothstream Python"
    options.role = _ROLES[role.lower()] if isinstance(role, str) else role
    options.quality = quality
    options.transport = _TRANSPORTS[transport]
    options.join_timeout_ms, options.reconnect_for_ms = max(1, round(1000 * timeout)), round(1000 * reconnect_for)
    handle = c.c_void_p()
    result = lib.clothstream_open(address.encode(), c.byref(options), c.byref(handle))
    if result == b.CLOTHSTREAM_INVALID:
        raise ValueError(text(lib.clothstream_error_text()))
    if result != b.CLOTHSTREAM_OK:
        raise ConnectionFailed(text(lib.clothstream_error_text()))
    assert handle.value is not None
    return Stream(handle.value)


class Stream(OwnInput):
    """A joined scene. A thread of the library receives and sends. Use a Stream from one thread at a time."""

    def __init__(self, handle: int):
        self._handle: int | None = handle
        self._acquired: int | None = None  # the client while it is acquired
        self._frame: Frame | None = None
        self._pending = Event(0)
        self.events = Event(0)
        """What changed since the frame before."""

    def close(self) -> None:
        """Leaves the scene. Arrays of its frames must not be used any more."""
        self._end_frame()
        handle, self._handle = self._handle, None
        if handle is not None:
            lib.clothstream_close(handle)

    def __enter__(self) -> Stream:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()

    @contextlib.contextmanager
    def _client(self) -> Iterator[int]:
        if self._acquired is not None:
            yield self._acquired
            return
        if self._handle is None:
            raise Error("The stream is closed.")
        self._acquired = lib.clothstream_acquire(self._handle)
        assert self._acquired is not None
        try:
            yield self._acquired
        finally:
            self._release()

    def _release(self) -> None:
        if self._acquired is not None:
            self._acquired = None
            lib.clothstream_release(self._handle)

    def _end_frame(self) -> None:
        if self._frame is not None:
            self._frame._end()
            self._frame = None
            self._release()

    def wait(self, timeout: float = 1.0) -> Event:
        """Waits until something changes, for at most `timeout` seconds, and returns what. Ends the current frame. Raises
        ConnectionFailed if the stream has ended."""
        self._end_frame()
        if self._handle is None:
            raise Error("The stream is closed.")
        events = c.c_uint32()
        if lib.clothstream_wait(self._handle, max(0, round(1000 * timeout)), c.byref(events)) != b.CLOTHSTREAM_OK:
            raise ConnectionFailed(text(lib.clothstream_error_text()))
        changed = Event(events.value)
        self._pending |= changed
        return changed

    @property
    def datagrams(self) -> DatagramStatistics | None:
        """Figures of the datagrams; None if none were open."""
        if self._handle is None:
            raise Error("The stream is closed.")
        found = new(b.cs_datagram_statistics)
        if not lib.clothstream_get_datagram_statistics(self._handle, c.byref(found)):
            return None
        return to(DatagramStatistics, found)

    def next_frame(self, timeout: float = 10.0) -> Frame:
        """Waits for the next frame. It is current, and its arrays are valid, until the next call that waits. Until then no
        message of the server is processed, so copy what is to stay and call again soon. Raises TimeoutError."""
        self._end_frame()
        end = time.monotonic() + timeout
        while Event.FRAME not in self._pending:
            left = end - time.monotonic()
            if left <= 0:
                raise TimeoutError(f"no frame of the server in {timeout} s; is the scene paused?")
            self.wait(left)
        self.events, self._pending = self._pending, Event(0)
        assert self._handle is not None
        self._acquired = client = lib.clothstream_acquire(self._handle)
        statistics = new(b.cs_statistics)
        lib.cs_get_statistics(client, lib.clothstream_now_us(), c.byref(statistics))
        rate = lib.cs_simulation_rate(client)
        self._frame = Frame(self, statistics.tick, statistics.tick / rate if rate else 0.0)
        return self._frame

    def frames(self, timeout: float = 10.0) -> Iterator[Frame]:
        """Frames as they arrive, until the loop ends. If the loop is slow, frames between are skipped. See next_frame()."""
        try:
            while True:
                yield self.next_frame(timeout)
        finally:
            self._end_frame()

    __iter__ = frames

    @property
    def participant_id(self) -> int:
        """Id of this participant."""
        with self._client() as client:
            return lib.cs_participant_id(client)

    @property
    def role(self) -> int:
        """Role that the server granted."""
        with self._client() as client:
            return lib.cs_get_role(client)

    def renew_token(self, token: str) -> None:
        """Sends a new token of the same subject before the current one expires. Event.ERROR reports a refusal."""
        with self._client() as client:
            if not lib.cs_renew_token(client, token.encode()):
                raise Error("The token was not sent: the connection is lost, or the token is empty.")

    def want_contacts(self, wants: bool = True) -> None:
        """Turns Event.CONTACTS on or off."""
        with self._client() as client:
            lib.cs_want_contacts(client, int(wants), lib.clothstream_now_us())

    def want_constraints(self, wants: bool = True) -> None:
        """Turns constraint_ends() on or off."""
        with self._client() as client:
            lib.cs_want_constraints(client, int(wants), lib.clothstream_now_us())

    # Parameters. Event.PARAMETERS follows when a change took effect.

    def set_environment(self, gravity: Vec3 | None = None, wind: Vec3 | None = None, air_density: float | None = None) -> None:
        """Changes gravity (m/s^2), wind (m/s) and air density (kg/m^3). None keeps a value."""
        with self._client() as client:
            lib.cs_set_environment(client, vector(gravity, 3), vector(wind, 3),
                                   vector(None if air_density is None else [air_density], 1))

    def set_gust(self, strength: float, seconds: float) -> None:
        """Changes the gusts: largest deviation of each component of the wind (m/s), and the time between changes."""
        with self._client() as client:
            lib.cs_set_gust(client, strength, seconds)

    def change_cloth(self, cloth: str = "", **settings: Any) -> None:
        """Changes settings of a cloth by the names of ClothSettings: change_cloth("flag", drag=1.2, solver=Solver.XPBD). ""
        means every cloth. Raises TypeError for an unknown name."""
        struct = b.cs_cloth_settings()
        lib.cs_keep_cloth_settings(c.byref(struct))
        names = {name for name, _ in b.cs_cloth_settings._fields_} - {"version"}
        for name, value in settings.items():
            if name not in names:
                raise TypeError(f"cloths have no setting '{name}'; they have {', '.join(sorted(names))}")
            setattr(struct, name, tuple(value) if name in ("structural", "shear", "bend") else value)
        with self._client() as client:
            if not lib.cs_set_cloth(client, cloth.encode(), c.byref(struct)):
                raise ValueError(f"the scene has no cloth '{cloth}'")

    def set_material(self, material: str, cloth: str = "") -> None:
        """Applies one of `materials` to a cloth; "" means every cloth."""
        with self._client() as client:
            lib.cs_set_material(client, cloth.encode(), material.encode())

    def set_areal_mass(self, kilograms: float, cloth: str = "") -> None:
        """Changes the mass per area of a cloth: 0.0001 to 1000 kg/m^2. "" means every cloth."""
        with self._client() as client:
            lib.cs_set_areal_mass(client, cloth.encode(), kilograms)

    def change_collider(self, collider: str, **changes: Any) -> None:
        """Changes a collider of the scene: position, radius, length, size (m), orientation (x, y, z, w), friction."""
        struct = b.cs_collider_change()
        lib.cs_keep_collider(c.byref(struct))
        names = {name for name, _ in b.cs_collider_change._fields_} - {"version"}
        for name, value in changes.items():
            if name not in names:
                raise TypeError(f"colliders have no '{name}'; they have {', '.join(sorted(names))}")
            setattr(struct, name, tuple(value) if name in ("position", "orientation", "size") else value)
        with self._client() as client:
            lib.cs_set_collider(client, collider.encode(), c.byref(struct))

    # Requests about scenes. They wait for the server's answer, which ends the current frame.

    def _request(self, function: str, *arguments: Any, timeout: float = 60.0) -> b.cs_answer:
        with self._client() as client:
            request = getattr(lib, function)(client, *arguments)
        if request == 0:
            raise Error("The request was not sent: the connection is lost, or too many requests wait.")
        answer = new(b.cs_answer)
        end = time.monotonic() + timeout
        while True:
            if Event.ANSWER in self.wait(min(1.0, max(0.0, end - time.monotonic()))):
                with self._client() as client:
                    if lib.cs_get_answer(client, c.byref(answer)) and answer.request_id == request:
                        if answer.error:
                            raise RequestRefused(text(answer.error_text), answer.error)
                        answer.kept_name = text(answer.name)
                        return answer
            if time.monotonic() >= end:
                raise TimeoutError(f"no answer of the server in {timeout} s")

    def scenes(self, timeout: float = 10.0) -> list[SceneSummary]:
        """The scenes of the server."""
        with self._client() as client:
            lib.cs_list_scenes(client)
        end = time.monotonic() + timeout
        while Event.SCENES not in self.wait(min(1.0, max(0.0, end - time.monotonic()))):
            if time.monotonic() >= end:
                raise TimeoutError(f"no answer of the server in {timeout} s")
        return self._list("cs_scene_count", "cs_get_scene", b.cs_scene_summary, SceneSummary)

    def create_scene(self, definition: bytes, name: str = "", max_participants: int = 0) -> str:
        """Creates a scene from a serialised Scene (scene.proto), and returns its name."""
        memory = c.cast(c.c_char_p(definition), c.POINTER(c.c_uint8))
        return self._request("cs_create_scene", memory, len(definition), name.encode(), max_participants).kept_name

    def copy_scene(self, source: str, name: str, max_participants: int = 0) -> str:
        """Creates a scene as a copy of another scene or of a built-in one, and returns its name."""
        return self._request("cs_copy_scene", source.encode(), name.encode(), max_participants).kept_name

    def delete_scene(self, scene: str) -> None:
        """Deletes a scene that a client made."""
        self._request("cs_delete_scene", scene.encode())

    def pause(self, paused: bool = True, scene: str = "") -> None:
        """Stops or restarts the clock of a scene; "" means the joined one."""
        self._request("cs_pause_scene", scene.encode(), int(paused))

    def reset(self, scene: str = "") -> None:
        """Puts all cloths back to their start. Parameters stay."""
        self._request("cs_reset_scene", scene.encode())

    def start_recording(self, file: str = "", scene: str = "") -> str:
        """Starts a recording on the server, and returns the name of its file. file: 1 to 64 characters out of
        [A-Za-z0-9_-]; "" lets the server choose."""
        return self._request("cs_start_recording", scene.encode(), file.encode()).kept_name

    def stop_recording(self, scene: str = "") -> tuple[str, int]:
        """Ends the recording of a scene, and returns the name and the bytes of its file."""
        answer = self._request("cs_stop_recording", scene.encode())
        return answer.kept_name, answer.bytes

    def definition(self, scene: str = "") -> bytes:
        """Definition of a scene with its current parameters: a serialised Scene (scene.proto), at most 1 MiB."""
        self._request("cs_request_definition", scene.encode())
        with self._client() as client:
            size = c.c_size_t()
            pointer = lib.cs_definition(client, c.byref(size))
            return c.string_at(pointer, size.value) if pointer else b""
