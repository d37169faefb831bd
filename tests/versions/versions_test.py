# SPDX-License-Identifier: MIT
"""Programs of an earlier version with those of this one: client and server, and recordings in both directions.

Builds the earlier version from the history of this repository, which takes minutes the first time."""
import contextlib
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from programs import Server  # noqa: E402

PRESENT, ROOT, BUILDS = (pathlib.Path(os.environ[f"CLOTHSTREAM_{name}"]) for name in ("PROGRAMS", "ROOT", "BUILDS"))
VERSION, COMMIT = "0.2.0", "1562918f93d8f520ca1e37fd78499ec1daae569a"
PROGRAMS = ("clothstream-server", "clothstream")
SKIPPED = 77
RELEASE = "bookworm"  # the only release of Debian on which that version compiles


def build_earlier():
    """Returns the folder of the earlier version's programs, or None if the history does not reach back to it."""
    sources = BUILDS / VERSION
    programs = sources / "build" / "no-web" / "bin"
    if subprocess.run(["git", "-C", ROOT, "cat-file", "-e", COMMIT], stderr=subprocess.DEVNULL).returncode != 0:
        return None
    if not all((programs / name).exists() for name in PROGRAMS):
        sources.mkdir(parents=True, exist_ok=True)
        archive = subprocess.run(["git", "-C", ROOT, "archive", COMMIT], check=True, capture_output=True)
        subprocess.run(["tar", "-x", "-C", sources], check=True, input=archive.stdout)
        subprocess.run(["cmake", "--preset", "no-web"], check=True, cwd=sources)
        subprocess.run(["cmake", "--build", "--preset", "no-web", "--target", *PROGRAMS], check=True, cwd=sources)
    return programs


class Versions(unittest.TestCase):
    earlier = None  # folder of programs

    def setUp(self):
        self.stack = contextlib.ExitStack()
        self.addCleanup(self.stack.close)
        self.folder = pathlib.Path(self.stack.enter_context(tempfile.TemporaryDirectory()))

    def run_program(self, programs, *arguments):
        done = subprocess.run([programs / "clothstream", *map(str, arguments)], capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done

    def serve(self, programs, *arguments):
        """Starts a server and returns its address for gRPC."""
        self.count = getattr(self, "count", 0) + 1
        log = self.folder / f"server{self.count}.log"
        home = {**os.environ, "HOME": str(self.folder), "XDG_STATE_HOME": str(self.folder)}
        server = Server(programs / "clothstream-server", arguments, log, home)
        self.stack.callback(server.end)
        return server.address

    def join(self, programs, address, *arguments):
        """Checks each frame against the hash of the server, and returns the summary."""
        done = self.run_program(programs, "join", address, "--seconds", 4, "--json", "--hash", *arguments)
        summary = json.loads(done.stdout)
        self.assertGreater(summary["frames"], 20)
        self.assertEqual(summary["decodeErrors"], 0)
        self.assertEqual(summary["hashMismatches"], 0)
        return summary

    def use(self, client, server):
        """A client of one version takes part in the scenes of a server of the other."""
        address = self.serve(server, "--scene", "curtain")
        summary = self.join(client, address, "--name", "guest", "--collider", "0,1,0,0.2")
        self.assertEqual(summary["scene"], "curtain")
        self.join(client, address, "--quality", 1)
        self.run_program(client, "set", address, "--gravity", "0,-5,0")
        self.run_program(client, "create", "--named", "flag", "--name", "mine", "--server", address)
        names = [scene["name"] for scene in json.loads(self.run_program(client, "list", address, "--json").stdout)]
        self.assertIn("mine", names)
        self.assertEqual(self.join(client, address, "--scene", "mine")["scene"], "mine")
        self.run_program(client, "delete", "mine", "--server", address)

    def record(self, client, address):
        recording = self.folder / "recorded.mcap"
        self.run_program(client, "record", "--server", address, "--seconds", 3, "--output", recording)
        return recording

    def test_earlier_client_with_this_server(self):
        self.use(self.earlier, PRESENT)

    def test_this_client_with_the_earlier_server(self):
        self.use(PRESENT, self.earlier)

    def test_earlier_recording_is_played_by_this_server(self):
        recording = self.record(self.earlier, self.serve(self.earlier, "--scene", "curtain"))
        self.run_program(PRESENT, "info", recording)
        address = self.serve(PRESENT, "play", recording, "--loop")
        self.join(PRESENT, address)
        self.join(self.earlier, address)

    def test_recording_of_this_version_is_played_by_the_earlier_server(self):
        recording = self.record(PRESENT, self.serve(PRESENT, "--scene", "curtain"))
        self.run_program(self.earlier, "info", recording)
        self.join(self.earlier, self.serve(self.earlier, "play", recording, "--loop"))


if __name__ == "__main__":
    if platform.freedesktop_os_release().get("VERSION_CODENAME") != RELEASE:
        print(f"skipped: version {VERSION} compiles only on Debian {RELEASE}")
        sys.exit(SKIPPED)
    Versions.earlier = build_earlier()
    if Versions.earlier is None:
        print(f"skipped: this repository has no commit {COMMIT} (version {VERSION}); fetch its whole history")
        sys.exit(SKIPPED)
    unittest.main(verbosity=2)
