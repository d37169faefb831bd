# SPDX-License-Identifier: MIT
"""A real server with --agones beside a stand-in of Agones' sidecar.

The stand-in follows the REST interface of Agones' SDK (sdk.proto and beta.proto of Agones 1.4x): states of a GameServer,
counters with a capacity, lists. It refuses what the sidecar refuses.
"""
import contextlib
import http.server
import json
import os
import pathlib
import re
import signal
import subprocess
import threading
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SERVER, PROGRAM = os.environ["CLOTHSTREAM_SERVER"], os.environ["CLOTHSTREAM_PROGRAM"]


class Sidecar(http.server.ThreadingHTTPServer):
    """Counters and lists must be in the GameServer's specification."""

    def __init__(self, counters, lists, port=0):
        super().__init__(("127.0.0.1", port), Handler)
        self.state, self.states, self.health = "Scheduled", [], []
        self.counters = {name: {"count": 0, "capacity": 1000} for name in counters}
        self.lists = {name: [] for name in lists}
        self.lock = threading.Lock()
        threading.Thread(target=self.serve_forever, daemon=True).start()

    @property
    def port(self):
        return self.server_address[1]

    def become(self, state):
        self.state = state
        self.states.append(state)


class Handler(http.server.BaseHTTPRequestHandler):
    def log_message(self, *_):
        pass

    def answer(self, status, body):
        data = json.dumps(body).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def refuse(self, status, code, text):
        self.answer(status, {"code": code, "message": text, "details": []})

    def body(self):
        return json.loads(self.rfile.read(int(self.headers["Content-Length"])))

    def do_POST(self):
        sidecar, body = self.server, self.body()
        with sidecar.lock:
            if self.path == "/health":
                sidecar.health.append(time.monotonic())
                return self.answer(200, {})
            states = {"/ready": "Ready", "/allocate": "Allocated", "/shutdown": "Shutdown"}
            if self.path in states:
                if sidecar.state == "Shutdown":
                    return self.refuse(400, 9, "cannot leave Shutdown")
                sidecar.become(states[self.path])
                return self.answer(200, {})
            if found := re.fullmatch(r"/v1beta1/lists/([\w-]+):(addValue|removeValue)", self.path):
                values = sidecar.lists.get(found[1])
                if values is None:
                    return self.refuse(404, 5, f"list not found: {found[1]}")
                if found[2] == "addValue":
                    if body["value"] in values:
                        return self.refuse(409, 6, "already in the list")
                    values.append(body["value"])
                else:
                    if body["value"] not in values:
                        return self.refuse(404, 5, "not in the list")
                    values.remove(body["value"])
                return self.answer(200, {"name": found[1], "values": values})
        return self.refuse(404, 5, "Not Found")

    def do_GET(self):
        sidecar = self.server
        with sidecar.lock:
            if found := re.fullmatch(r"/v1beta1/lists/([\w-]+)", self.path):
                if found[1] not in sidecar.lists:
                    return self.refuse(404, 5, f"list not found: {found[1]}")
                return self.answer(200, {"name": found[1], "capacity": "1000", "values": sidecar.lists[found[1]]})
        return self.refuse(404, 5, "Not Found")

    def do_PATCH(self):
        sidecar, body = self.server, self.body()
        with sidecar.lock:
            found = re.fullmatch(r"/v1beta1/counters/([\w-]+)", self.path)
            if not found or found[1] not in sidecar.counters:
                return self.refuse(404, 5, "counter not found")
            counter = sidecar.counters[found[1]]
            # Int64Value is a string in JSON; the sidecar refuses other members.
            if not set(body) <= {"count", "capacity", "countDiff"} or not all(isinstance(v, str) for v in body.values()):
                return self.refuse(400, 3, "invalid CounterUpdateRequest")
            capacity = int(body.get("capacity", counter["capacity"]))
            count = int(body.get("count", counter["count"]))
            if not 0 <= count <= capacity:
                return self.refuse(400, 11, "out of range")
            counter.update(count=count, capacity=capacity)
            return self.answer(200, {"name": found[1], "count": str(count), "capacity": str(capacity)})


@contextlib.contextmanager
def game_server(port, *more):
    """Starts a server, and gives it with its gRPC address."""
    command = [SERVER, "--port", "0", "--grpc-port", "0", "--scene", "small", "--scene-file",
               str(ROOT / "tests/e2e/small.json"), "--agones", *more]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               env={**os.environ, "AGONES_SDK_HTTP_PORT": str(port)})
    try:
        printed = ""
        for line in process.stdout:
            printed += line
            if found := re.match(r"gRPC +(\S+)", line):
                break
        else:
            if "no Vulkan" in printed:
                raise unittest.SkipTest("the server needs a Vulkan device")
            raise AssertionError(f"the server ended: {printed}")
        threading.Thread(target=process.stdout.read, daemon=True).start()
        yield process, found[1]
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=60)


class GameServer(unittest.TestCase):
    def until(self, holds, seconds=60):
        deadline = time.monotonic() + seconds
        while not holds():
            self.assertLess(time.monotonic(), deadline, "it never came")
            time.sleep(0.05)

    def test_life_of_a_game_server(self):
        sidecar = Sidecar(["participants", "created-scenes", "load"], ["scenes"])
        sidecar.lists["scenes"] = ["left-over"]
        with game_server(sidecar.port) as (process, address):
            self.until(lambda: sidecar.state == "Ready")
            self.until(lambda: "small" in sidecar.lists["scenes"])
            self.assertNotIn("left-over", sidecar.lists["scenes"])
            self.until(lambda: sidecar.counters["participants"]["capacity"] > 1000)
            self.assertEqual(sidecar.counters["participants"]["count"], 0)
            self.assertEqual(sidecar.counters["created-scenes"], {"count": 0, "capacity": 16})
            self.until(lambda: len(sidecar.health) >= 3)
            gaps = [b - a for a, b in zip(sidecar.health, sidecar.health[1:])]
            self.assertGreater(min(gaps), 0.9)

            with subprocess.Popen([PROGRAM, "join", address, "--seconds", "600"], stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL) as viewer:
                self.until(lambda: sidecar.state == "Allocated")
                self.until(lambda: sidecar.counters["participants"]["count"] == 1)
                viewer.terminate()
            self.until(lambda: sidecar.counters["participants"]["count"] == 0)
            self.assertEqual(sidecar.state, "Allocated")  # someone may come back
            left = time.monotonic()
            self.until(lambda: sidecar.state == "Ready")
            self.assertGreater(time.monotonic() - left, 20)

            subprocess.run([PROGRAM, "create", "--server", address, "--named", "flag", "--name", "mine"], check=True,
                           stdout=subprocess.DEVNULL)
            self.until(lambda: "mine" in sidecar.lists["scenes"])
            self.until(lambda: sidecar.counters["created-scenes"]["count"] == 1)
            self.until(lambda: sidecar.counters["load"]["count"] > 0)
            self.assertEqual(sidecar.state, "Allocated")
            subprocess.run([PROGRAM, "delete", "--server", address, "mine"], check=True, stdout=subprocess.DEVNULL)
            self.until(lambda: "mine" not in sidecar.lists["scenes"])
            process.send_signal(signal.SIGTERM)
            process.wait(timeout=60)
        self.assertEqual(sidecar.states, ["Ready", "Allocated", "Ready", "Allocated", "Shutdown"])
        sidecar.shutdown()

    def test_a_sidecar_that_starts_later_and_knows_no_counters(self):
        first = Sidecar([], [])
        port = first.port
        first.shutdown()
        first.server_close()
        with game_server(port) as (process, _):
            time.sleep(2)
            self.assertIsNone(process.poll())
            sidecar = Sidecar([], [], port)
            self.until(lambda: sidecar.state == "Ready")
            sidecar.shutdown()

    def test_a_server_without_participants_stays_healthy(self):
        sidecar = Sidecar([], [])
        with game_server(sidecar.port):
            # Longer than the five seconds in which the device thread must answer.
            self.until(lambda: sidecar.health and sidecar.health[-1] - sidecar.health[0] > 9)
            gaps = [b - a for a, b in zip(sidecar.health, sidecar.health[1:])]
            self.assertLess(max(gaps), 5)
        sidecar.shutdown()

    def test_a_wrong_port_is_explained(self):
        ended = subprocess.run([SERVER, "--agones"], capture_output=True, text=True,
                               env={**os.environ, "AGONES_SDK_HTTP_PORT": "none"})
        self.assertEqual(ended.returncode, 1)
        self.assertIn("AGONES_SDK_HTTP_PORT: 'none' is not a port", ended.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
