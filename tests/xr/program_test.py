#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What clothstream-xr says, and its exit status, when it is started wrongly or ended. No OpenXR runtime is active, and no
server runs. About a second. CLOTHSTREAM_XR: file of the build."""

import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from programs import Program  # noqa: E402

XR = os.environ["CLOTHSTREAM_XR"]
ENVIRONMENT = os.environ | {"XR_RUNTIME_JSON": "/nowhere.json"}


class Options(unittest.TestCase):
    def refuses(self, arguments, text):
        run = subprocess.run([XR, *arguments], env=ENVIRONMENT, capture_output=True, text=True, timeout=60)
        self.assertEqual(run.returncode, 2, f"{arguments}: {run.stderr}")
        self.assertIn(text, run.stderr, arguments)

    def test_each_bad_value_is_named_with_what_is_allowed(self):
        for arguments, text in (
            (["--code", "12345"], 'six digits that the server shows'),
            (["--detail", "some"], '"some" is not allowed; use one of: full, reduced'),
            (["--foveation", "most"], '"most" is not allowed; use one of: off, low, medium, high'),
            (["--pictures", "here"], "--pictures requires --flat"),
            (["--quality", "4"], "0 to 3"),
            (["--rate", "nan"], '"nan" is not a number from 1 to 1000'),
            (["--role", "king"], '"king" is not allowed; use one of: viewer, participant, owner'),
            (["--samples", "3"], "{1,2,4,8}"),
            (["--scale", "nan"], '"nan" is not a number from 0.1 to 2'),
            (["--token", "/dev/null"], "/dev/null has no token"),
            (["--token", "/dev/zero"], "has more than"),
            (["--transport", "udp"], '"udp" is not allowed; use one of: auto, datagrams, tcp'),
            (["--wait", "-1"], '"-1" is not a number from 0 to'),
        ):
            self.refuses(arguments, text)

    def test_what_only_the_library_refuses_ends_the_program_too(self):
        for arguments, text in (
            (["no host:here"], 'the address "no host:here" has no host'),
            (["127.0.0.1:0"], "use 1 to 65535"),
            (["https://127.0.0.1", "--fingerprint", "abc"], "--fingerprint is"),
            (["127.0.0.1", "--fingerprint", "abc"], "--ca and --fingerprint need TLS"),
            (["192.0.2.1", "--code", "123456"], "Use https://"),
        ):
            self.refuses(arguments, text)


class Ending(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.log = pathlib.Path(folder.name) / "log"

    def start(self, *arguments):
        program = Program("clothstream-xr", [XR, *arguments], self.log, ENVIRONMENT)
        self.addCleanup(program.stop)
        program.wait_for("No OpenXR runtime is active")
        return program

    def test_signals_end_it_without_waiting_for_a_silent_server(self):
        with socket.create_server(("127.0.0.1", 0)) as silent:
            for number in (signal.SIGINT, signal.SIGTERM):
                program = self.start(f"127.0.0.1:{silent.getsockname()[1]}")
                start = time.monotonic()
                program.process.send_signal(number)
                self.assertEqual(program.process.wait(30), 0, program.tail())
                # An attempt to join takes 10 s.
                self.assertLess(time.monotonic() - start, 5)

    def test_missing_runtime_is_said_once(self):
        program = self.start("--wait", "1.5")
        self.assertEqual(program.process.wait(30), 1)
        self.assertEqual(program.said().count("OpenXR runtime"), 1, program.said())
        self.assertIn("No headset within 1.5 s (--wait)", program.said())


if __name__ == "__main__":
    unittest.main(verbosity=2)
