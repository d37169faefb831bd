# SPDX-License-Identifier: MIT
"""A real server with --agones beside a stand-in of Agones' sidecar."""
import contextlib
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
from programs import Server, wait_until  # noqa: E402
from sidecar import Sidecar  # noqa: E402

SERVER, PROGRAM = os.environ["CLOTHSTREAM_SERVER"], os.environ["CLOTHSTREAM_PROGRAM"]


@contextlib.contextmanager
def game_server(port):
    options = ["--agones", "--scene", "small", "--scene-file", ROOT / "tests/e2e/small.json"]
    with tempfile.TemporaryDirectory() as folder:
        with Server(SERVER, options, pathlib.Path(folder) / "log", {**os.environ, "AGONES_SDK_HTTP_PORT": str(port)}) as server:
            yield server


class GameServer(unittest.TestCase):
    def test_life_of_a_game_server(self):
        sidecar = Sidecar(["participants", "created-scenes", "load"], ["scenes"])
        sidecar.lists["scenes"] = ["left-over"]
        with game_server(sidecar.port) as server:
            wait_until(lambda: sidecar.state == "Ready")
            wait_until(lambda: "small" in sidecar.lists["scenes"])
            self.assertNotIn("left-over", sidecar.lists["scenes"])
            wait_until(lambda: sidecar.counters["participants"]["capacity"] > 1000)
            self.assertEqual(sidecar.counters["participants"]["count"], 0)
            self.assertEqual(sidecar.counters["created-scenes"], {"count": 0, "capacity": 16})
            wait_until(lambda: len(sidecar.health) >= 3)
            gaps = [b - a for a, b in zip(sidecar.health, sidecar.health[1:])]
            self.assertGreater(min(gaps), 0.9)

            with subprocess.Popen([PROGRAM, "join", server.address, "--seconds", "600"], stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL) as viewer:
                wait_until(lambda: sidecar.state == "Allocated")
                wait_until(lambda: sidecar.counters["participants"]["count"] == 1)
                viewer.terminate()
            wait_until(lambda: sidecar.counters["participants"]["count"] == 0)
            self.assertEqual(sidecar.state, "Allocated")  # someone may come back
            left = time.monotonic()
            wait_until(lambda: sidecar.state == "Ready")
            self.assertGreater(time.monotonic() - left, 20)

            subprocess.run([PROGRAM, "create", "--server", server.address, "--named", "flag", "--name", "mine"], check=True,
                           stdout=subprocess.DEVNULL)
            wait_until(lambda: "mine" in sidecar.lists["scenes"])
            wait_until(lambda: sidecar.counters["created-scenes"]["count"] == 1)
            wait_until(lambda: sidecar.counters["load"]["count"] > 0)
            self.assertEqual(sidecar.state, "Allocated")
            subprocess.run([PROGRAM, "delete", "--server", server.address, "mine"], check=True, stdout=subprocess.DEVNULL)
            wait_until(lambda: "mine" not in sidecar.lists["scenes"])
            server.end()
        self.assertEqual(sidecar.states, ["Ready", "Allocated", "Ready", "Allocated", "Shutdown"])
        sidecar.close()

    def test_a_sidecar_that_starts_later_and_knows_no_counters(self):
        first = Sidecar([], [])
        port = first.port
        first.close()
        with game_server(port) as server:
            time.sleep(2)
            self.assertTrue(server.runs)
            sidecar = Sidecar([], [], port)
            wait_until(lambda: sidecar.state == "Ready")
            sidecar.close()

    def test_a_server_that_nobody_uses_stays_healthy_and_becomes_ready_again(self):
        sidecar = Sidecar([], [])
        with game_server(sidecar.port):
            wait_until(lambda: sidecar.state == "Ready")
            sidecar.become("Allocated")  # by a backend
            allocated = time.monotonic()
            wait_until(lambda: sidecar.state == "Ready")
            self.assertGreater(time.monotonic() - allocated, 20)
            # The device thread must answer every five seconds.
            gaps = [b - a for a, b in zip(sidecar.health, sidecar.health[1:])]
            self.assertLess(max(gaps), 5)
            self.assertGreater(sidecar.health[-1] - sidecar.health[0], 20)
        self.assertEqual(sidecar.states, ["Ready", "Allocated", "Ready", "Shutdown"])
        sidecar.close()

    def test_a_wrong_port_is_explained(self):
        ended = subprocess.run([SERVER, "--agones"], capture_output=True, text=True,
                               env={**os.environ, "AGONES_SDK_HTTP_PORT": "none"})
        self.assertEqual(ended.returncode, 1)
        self.assertIn("AGONES_SDK_HTTP_PORT: 'none' is not a port", ended.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
