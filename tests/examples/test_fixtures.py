# SPDX-License-Identifier: MIT
"""clothstream_pytest: how it starts and ends the server. examples/testing has its usual use."""

import signal
from pathlib import Path

import clothstream_pytest
import pytest

RECORDING = Path(__file__).parent.parent / "cloth.mcap"


def test_shows_the_log_of_a_program_that_does_not_start(clothstream_serve):
    with pytest.raises(RuntimeError, match=r"(?s)ended; set CLOTHSTREAM_SERVER to the program. Its log:.*missing\.mcap"):
        clothstream_serve("play", "missing.mcap")


def test_says_what_to_set_if_there_is_no_program(clothstream_serve, monkeypatch):
    monkeypatch.setenv("CLOTHSTREAM_SERVER", "/nowhere/clothstream-server")
    with pytest.raises(RuntimeError, match="set CLOTHSTREAM_SERVER"):
        clothstream_serve()


def test_names_a_missing_recording(clothstream_play):
    with pytest.raises(FileNotFoundError, match="missing.mcap"):
        clothstream_play("missing.mcap")


def test_kills_a_server_that_does_not_end():
    server = clothstream_pytest.Server(["play", str(RECORDING)])
    server.signal(signal.SIGSTOP)
    assert server.stop(0.1) == -signal.SIGKILL
