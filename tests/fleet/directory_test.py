# SPDX-License-Identifier: MIT
"""Real servers of one fleet, and `clothstream list --nats` and `clothstream move`, with Debian's nats-server."""
import contextlib
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
from programs import Program, Server, free_port, wait_until  # noqa: E402

SERVER, PROGRAM = os.environ["CLOTHSTREAM_SERVER"], os.environ["CLOTHSTREAM_PROGRAM"]
NATS_SERVER = shutil.which("nats-server", path=os.environ["PATH"] + ":/usr/sbin")
SCENE = {
    "name": "moves", "simulationRate": 20, "streamRate": 10, "substeps": 16,
    "cloths": [{"name": "sheet", "mass": 0.2, "structural": {"stiffness": 20, "damping": 0.01},
                "grid": {"rows": 16, "columns": 16, "width": 1, "height": 1, "pose": {"position": {"y": 2}}},
                "pins": [{"firstRow": 0, "firstColumn": 0, "lastColumn": 15, "columnStep": 15}]}],
}


@unittest.skipUnless(NATS_SERVER, "there is no nats-server (apt install nats-server)")
class Directory(unittest.TestCase):
    def setUp(self):
        self.stack = contextlib.ExitStack()
        self.addCleanup(self.stack.close)
        self.folder = pathlib.Path(self.stack.enter_context(tempfile.TemporaryDirectory()))
        self.nats_port = free_port()
        self.url = f"nats://127.0.0.1:{self.nats_port}"

    def start_nats(self, *more):
        command = [NATS_SERVER, "--addr", "127.0.0.1", "--port", self.nats_port, *more]
        self.stack.enter_context(Program("nats-server", command, self.folder / "nats.log")).wait_for("Server is ready")

    def start_server(self, name, state=""):
        scene = self.folder / "first.json"
        scene.write_text(json.dumps({**SCENE, "name": "first"}))
        options = ["--scene-file", scene, "--scene", "first", "--nats", self.url, "--public-name", f"{name}.example.com",
                   "--insecure", "--state-dir", state]
        return self.stack.enter_context(Server(SERVER, options, self.folder / f"{name}.log"))

    def run_program(self, *arguments):
        return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120)

    def test_addresses_of_nats_have_a_scheme(self):
        ended = subprocess.run([SERVER, "edge", "--nats", f"{self.url},http://127.0.0.1:4222"], capture_output=True,
                               text=True, timeout=60)
        self.assertEqual(ended.returncode, 1)
        self.assertIn("--nats: 'http://127.0.0.1:4222' begins with neither nats:// nor tls://", ended.stderr)

    def directory(self):
        listed = self.run_program("list", "--nats", self.url, "--json")
        self.assertEqual(listed.returncode, 0, listed.stderr)
        return json.loads(listed.stdout)

    def entry_of(self, scene):
        return next((entry for entry in self.directory()["scenes"] if entry["scene"] == scene), None)

    def server_of(self, scene):
        names = {server["server"]: server["publicName"] for server in self.directory()["servers"]}
        entry = self.entry_of(scene)
        return names.get(entry["server"]) if entry else None

    def create(self, server):
        scene = self.folder / "moves.json"
        scene.write_text(json.dumps(SCENE))
        created = self.run_program("create", scene, "--server", server.address)
        self.assertEqual(created.returncode, 0, created.stderr)

    def test_lists_and_moves_scenes(self):
        self.start_nats("--jetstream", "--store_dir", self.folder / "store")
        first, second = self.start_server("one"), self.start_server("two")
        self.create(first)
        wait_until(lambda: self.server_of("moves") == "one.example.com")
        wait_until(lambda: len(self.directory()["servers"]) == 2)
        table = self.run_program("list", "--nats", self.url).stdout
        for text in ("one.example.com", "two.example.com", "moves", "first", "clothstream-server"):
            self.assertIn(text, table)

        refused = self.run_program("move", "none", "--nats", self.url)
        self.assertEqual((refused.returncode, "no scene 'none'" in refused.stderr), (4, True), refused.stderr)
        refused = self.run_program("move", "moves", "--to", "three.example.com", "--nats", self.url)
        self.assertEqual((refused.returncode, "0 servers" in refused.stderr), (4, True), refused.stderr)
        refused = self.run_program("move", "first", "--nats", self.url)
        self.assertEqual((refused.returncode, "only created ones move" in refused.stderr), (4, True), refused.stderr)

        moved = self.run_program("move", "moves", "--to", "two.example.com", "--nats", self.url)
        self.assertEqual(moved.returncode, 0, moved.stderr)
        self.assertRegex(moved.stdout, r"moves is at server [0-9a-f]{16} now; it stood still for \d+ ms")
        wait_until(lambda: self.server_of("moves") == "two.example.com")

        # A server that stops moves its scenes, and one that is killed leaves a checkpoint.
        joined = self.run_program("join", second.address, "--scene", "moves", "--seconds", 4)
        self.assertEqual(joined.returncode, 0, joined.stderr)
        second.end()
        self.assertEqual(self.server_of("moves"), "one.example.com")
        third = self.start_server("three")
        wait_until(lambda: len(self.directory()["servers"]) == 2 and self.entry_of("moves")["checkpointTick"] > 0)
        first.kill()
        wait_until(lambda: self.server_of("moves") == "three.example.com")
        joined = self.run_program("join", third.address, "--scene", "moves", "--seconds", 2, "--hash")
        self.assertEqual(joined.returncode, 0, joined.stderr)

        deleted = self.run_program("delete", "moves", "--server", third.address)
        self.assertEqual(deleted.returncode, 0, deleted.stderr)
        wait_until(lambda: self.server_of("moves") is None)

    def test_a_server_that_was_killed_keeps_its_scenes(self):
        self.start_nats("--jetstream", "--store_dir", self.folder / "store")
        server = self.start_server("one", self.folder / "state")
        self.create(server)
        wait_until(lambda: self.entry_of("moves") and self.entry_of("moves")["checkpointTick"] is not None)
        former = wait_until(lambda: self.entry_of("moves"))["server"]
        server.kill()
        server.start()
        wait_until(lambda: self.entry_of("moves")["server"] != former)  # its own lease had to end
        self.assertNotIn("removed here", server.said())
        joined = self.run_program("join", server.address, "--scene", "moves", "--seconds", 1)
        self.assertEqual(joined.returncode, 0, joined.stderr)

    def test_says_what_is_missing(self):
        refused = self.run_program("list", "--nats", self.url)
        self.assertEqual((refused.returncode, f"NATS at {self.url}" in refused.stderr), (3, True), refused.stderr)
        self.start_nats()
        refused = self.run_program("list", "--nats", self.url)
        self.assertEqual((refused.returncode, "--jetstream" in refused.stderr), (3, True), refused.stderr)
        refused = self.run_program("move", "moves")
        self.assertEqual((refused.returncode, "--nats" in refused.stderr), (2, True), refused.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
