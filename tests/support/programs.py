# SPDX-License-Identifier: MIT
"""Child processes of tests, benchmarks and the demo. All end with their parent, even if it is killed."""

import ctypes
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import time
import unittest

PR_SET_PDEATHSIG = 1
LIBC = ctypes.CDLL(None, use_errno=True)
START_SECONDS = 60


class MissingProgram(Exception):
    """Something that is needed is not installed. The text says how to install it."""


class ProgramFailed(Exception):
    """A program ended or did not say what it should. The text has the end of its log."""


def find_program(name, package, path=None):
    """Path of a program. Debian's package name is for the error."""
    found = path if path and pathlib.Path(path).exists() else shutil.which(name) or shutil.which(f"/usr/sbin/{name}")
    if not found:
        raise MissingProgram(f"{name} was not found; install it: sudo apt install {package}")
    return found


def end_with_parent():
    """Runs in a new process. It gets SIGKILL when its parent ends, and no SIGINT from the terminal."""
    LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def wait_until(condition, what="it", seconds=60):
    """Returns the value of `condition()` when it is true. `what` is for the error."""
    end = time.monotonic() + seconds
    while not (value := condition()):
        if time.monotonic() > end:
            raise AssertionError(f"{what} did not come in {seconds} s")
        time.sleep(0.05)
    return value


class Program:
    """A process whose output goes to a log file. `pipes`: its input and output are pipes instead. It stops at the end of
    a `with` block."""

    def __init__(self, name, command, log, environment=None, pipes=False):
        self.name = name
        self.command = [str(part) for part in command]
        self.log = log
        self.environment = environment
        self.pipes = pipes
        self.start()

    def start(self):
        """Starts it, also again after kill()."""
        self.log_start = self.log.stat().st_size if self.log.exists() else 0
        channels = {"stdin": subprocess.DEVNULL}
        with open(self.log, "ab") as log:
            if self.pipes:
                channels = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": log, "text": True, "bufsize": 1}
            else:
                channels |= {"stdout": log, "stderr": subprocess.STDOUT}
            self.process = subprocess.Popen(
                self.command, env=self.environment, start_new_session=True, preexec_fn=end_with_parent, **channels
            )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop(60)

    @property
    def runs(self):
        return self.process.poll() is None

    def said(self):
        """Text of the log since the last start."""
        if not self.log.exists():
            return ""
        return self.log.read_bytes()[self.log_start :].decode(errors="replace")

    def wait_for(self, pattern, seconds=START_SECONDS):
        """Waits for a line of the log that matches, and returns the match."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            ended = not self.runs
            if found := re.search(pattern, self.said(), re.MULTILINE):
                return found
            if ended:
                raise ProgramFailed(f"{self.name} ended with {self.process.returncode}; its log, {self.log}, ends:\n{self.tail()}")
            time.sleep(0.02)
        raise ProgramFailed(f"{self.name}: no line matches '{pattern}' after {seconds} s; its log, {self.log}, ends:\n{self.tail()}")

    def tail(self):
        return "\n".join(self.said().splitlines()[-15:])

    def kill(self):
        """SIGKILL, as if the machine had lost its power."""
        self.process.kill()
        self.process.wait()

    def ask_to_stop(self):
        if self.runs:
            self.process.send_signal(signal.SIGTERM)

    def stop(self, seconds=10):
        """SIGTERM, and SIGKILL if it has not ended after this time."""
        self.ask_to_stop()
        self.wait_or_kill(seconds)

    def wait_or_kill(self, seconds):
        try:
            self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            self.kill()


class Server(Program):
    """A server or an edge on free ports, which has started. `address` is that of gRPC, and `url` that of the page. `within`:
    command that runs the server, for example in a namespace."""

    def __init__(self, server, arguments, log, environment=None, within=()):
        command = [*within, server, *arguments, "--port", 0, "--grpc-port", 0]
        super().__init__(pathlib.Path(server).name, command, log, environment)

    def start(self):
        super().start()
        try:
            self.url = self.wait_for(r"^page +(\S+)")[1]
            self.address = self.wait_for(r"^gRPC +(\S+)")[1]
        except ProgramFailed:
            if "no Vulkan" in self.said():
                raise unittest.SkipTest("the server needs a Vulkan device") from None
            raise

    def end(self):
        """SIGTERM. Fails unless the server ends with 0 in time."""
        self.ask_to_stop()
        status = self.process.wait(60)
        if status != 0:
            raise ProgramFailed(f"{self.name} ended with {status}; its log ends:\n{self.tail()}")
