# SPDX-License-Identifier: MIT
"""Simulates without a server, through the program `clothstream-server step`."""
from __future__ import annotations

import dataclasses
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
from typing import Any

import numpy as np

from ._library import Error


class SimulationFailed(Error):
    """clothstream-server was not found, or has failed. The text is what it printed."""


@dataclasses.dataclass(frozen=True)
class Simulation:
    """States of a scene."""

    positions: np.ndarray
    """Metres: float32 of shape (frames, nodes, 3). The first frame is the start."""
    velocities: np.ndarray
    """m/s: float32 of shape (frames, nodes, 3)."""
    ticks: np.ndarray
    """Tick of each frame: int64 of shape (frames,)."""
    seconds: np.ndarray
    """Time of each frame: float64 of shape (frames,)."""
    hashes: list[str]
    """State hash of each frame in hexadecimal digits."""
    reports: list[Any]
    """Measurements of each frame by cloth: strain, energy, penetration (docs/simulation.md). None for the first."""
    about: dict[str, Any]
    """Everything that the program states: cloths, scene, device, server."""


def simulate(scene: str | os.PathLike[str], ticks: int, *, every: int = 1, server: str | os.PathLike[str] = "",
             options: tuple[str, ...] = ()) -> Simulation:
    """Simulates a built-in scene or the scene of a JSON file for `ticks` ticks, without clock and network, and keeps every
    `every`-th state. The states have the same bits as on a server without participants.

    server: path of clothstream-server; "" searches PATH. options: more options of `clothstream-server step`, such as
    ("--device", "llvmpipe"). Raises SimulationFailed."""
    program = os.fspath(server) or shutil.which("clothstream-server")
    if not program:
        raise SimulationFailed("clothstream-server is not on PATH; name it with server=")
    with tempfile.TemporaryDirectory(prefix="clothstream-") as folder:
        out = pathlib.Path(folder, "states.f32")
        command = [program, "step", "--scene", os.fspath(scene), "--ticks", str(ticks), "--every", str(every), "--out", str(out),
                   *options]
        try:
            ended = subprocess.run(command, capture_output=True, text=True)
        except OSError as error:
            raise SimulationFailed(f"{program} cannot be started: {error.strerror}") from error
        if ended.returncode != 0:
            raise SimulationFailed(f"{program} step ended with {ended.returncode}: {ended.stderr.strip() or ended.stdout.strip()}")
        about = json.loads(pathlib.Path(f"{out}.json").read_text())
        states = np.fromfile(out, "<f4").reshape(about["shape"])
    kept = np.asarray(about["ticks"], np.int64)
    return Simulation(states[..., :3], states[..., 3:], kept, kept * about["tickSeconds"], about["hashes"], about["reports"], about)
