# SPDX-License-Identifier: MIT
"""pytest plug-in: clothstream-server in tests, with a scene that is simulated or a recording that is played.

    pytest -p clothstream_pytest

or, in conftest.py, `pytest_plugins = ["clothstream_pytest"]`. Then:

    def test_curtain(clothstream_play):
        server = clothstream_play("curtain.mcap")
        # Join ws://{server.host}:{server.port}/stream with any client.

The program is the one that the environment variable CLOTHSTREAM_SERVER names, else clothstream-server in PATH.
Needs Python 3.9 and pytest 7. docs/testing-with-recordings.md explains the whole way.
"""

from __future__ import annotations

import os
import re
import subprocess
import threading
from pathlib import Path
from typing import Callable, Iterator, Optional, Sequence, Union

import pytest

__all__ = ["Server", "clothstream_play", "clothstream_serve"]

START_SECONDS = 60.0
STOP_SECONDS = 15.0

_SERVERS = pytest.StashKey[list]()


class Server:
    """A running clothstream-server on free ports of 127.0.0.1."""

    def __init__(self, arguments: Sequence[str], start_seconds: float = START_SECONDS) -> None:
        """Starts the program and returns when clients can connect. Raises RuntimeError with the log if it does not."""
        program = os.environ.get("CLOTHSTREAM_SERVER") or "clothstream-server"
        command = [program, "--port", "0", "--grpc-port", "0", *arguments]
        self._lines: list[str] = []
        self._changed = threading.Condition()
        self._ended = False
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                errors="replace",
            )
        except OSError as error:
            raise RuntimeError(
                f"{program} cannot be started: {error}; set CLOTHSTREAM_SERVER to the program"
            ) from error
        # The thread keeps the pipe empty, so that the program never waits for the test.
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        with self._changed:
            self._changed.wait_for(lambda: self._ended or self._found("gRPC"), start_seconds)
            ready = self._found("page") and self._found("gRPC")
        if not ready:
            why = "ended" if self._ended else f"printed no address within {start_seconds:g} s"
            self.stop(0)
            raise RuntimeError(f"{program} {why}; set CLOTHSTREAM_SERVER to the program. Its log:\n{self.log}")
        #: Address of the page, such as "http://127.0.0.1:41234/". libclothstream takes it, too.
        self.address: str = self._found("page")
        #: Address of the gRPC endpoint, such as "127.0.0.1:41235".
        self.grpc_address: str = self._found("gRPC")
        match = re.fullmatch(r"https?://(.+):(\d+)/", self.address)
        assert match, self.address
        self.host: str = match[1]
        #: Port of the page and of the WebSocket.
        self.port: int = int(match[2])

    @property
    def log(self) -> str:
        """Output of the program so far: standard output and standard error."""
        with self._changed:
            return "".join(self._lines)

    def signal(self, number: int) -> None:
        """Sends a signal, for example SIGKILL for a server that crashes."""
        self._process.send_signal(number)

    def stop(self, seconds: float = STOP_SECONDS) -> int:
        """Ends the program with SIGTERM, and with SIGKILL if it still runs after this time. Returns the exit code, or
        the negative number of the signal that ended it."""
        self._process.terminate()
        try:
            code = self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        self._reader.join()
        return code

    def _read(self) -> None:
        assert self._process.stdout
        with self._process.stdout as output:
            for line in output:
                with self._changed:
                    self._lines.append(line)
                    self._changed.notify_all()
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def _found(self, what: str) -> str:
        """Rest of the line that begins with this word; needs the lock."""
        for line in self._lines:
            if line.startswith(what + " ") and line.endswith("\n"):
                return line[len(what) :].strip()
        return ""


def _play_arguments(
    recording: Union[str, "os.PathLike[str]"],
    lockstep: bool,
    speed: Optional[float],
    wait_for: int,
    faults: Optional[int],
) -> list[str]:
    arguments = ["play", os.fspath(recording), "--wait-for", str(wait_for)]
    if lockstep:
        arguments.append("--lockstep")
    if speed is not None:
        arguments += ["--speed", f"{speed:g}"]
    elif lockstep:
        arguments += ["--speed", "max"]
    if faults is not None:
        arguments += ["--faults", str(faults)]
    return arguments


@pytest.fixture
def clothstream_serve(request: pytest.FixtureRequest) -> Iterator[Callable[..., Server]]:
    """Function that starts a server with these arguments and returns it. The server ends with the test; if the test has
    failed, its log is part of the report. Simulating scenes needs a Vulkan device."""
    servers: list[Server] = request.node.stash.setdefault(_SERVERS, [])

    def serve(*arguments: Union[str, "os.PathLike[str]"]) -> Server:
        server = Server([os.fspath(argument) for argument in arguments])
        servers.append(server)
        return server

    yield serve
    codes = [server.stop() for server in servers]
    assert not any(codes), f"clothstream-server ended with {codes}"


@pytest.fixture
def clothstream_play(clothstream_serve: Callable[..., Server]) -> Callable[..., Server]:
    """Function that plays a recording and returns the server. It needs no device.

    lockstep: the server sends the next frame when every client has acknowledged the last one, so that a client misses
    no frame. speed: recorded seconds per second, 0.1 to 8; None in lockstep: as fast as clients acknowledge. wait_for:
    clients that must be there before the first frame. faults: seed of dropped and delayed frames. Further arguments are
    those of clothstream-server."""

    def play(
        recording: Union[str, "os.PathLike[str]"],
        *arguments: str,
        lockstep: bool = True,
        speed: Optional[float] = None,
        wait_for: int = 1,
        faults: Optional[int] = None,
    ) -> Server:
        if not Path(recording).is_file():
            raise FileNotFoundError(f"{recording}: no such recording")
        return clothstream_serve(*_play_arguments(recording, lockstep, speed, wait_for, faults), *arguments)

    return play


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo):
    """Adds the logs of the servers to the report of a failure."""
    outcome = yield
    report = outcome.get_result()
    if not report.failed:
        return
    for server in item.stash.get(_SERVERS, []):
        report.sections.append(("Log of clothstream-server", server.log))
