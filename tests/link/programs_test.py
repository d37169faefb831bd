# SPDX-License-Identifier: MIT
"""A real server and `clothstream load` with a bad link between them."""
import contextlib
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
from network_link import CLIENT, SERVER, NetworkLink  # noqa: E402
from programs import Server  # noqa: E402

LINK, PROGRAM = os.environ["CLOTHSTREAM_LINK"], os.environ["CLOTHSTREAM_PROGRAM"]
SERVER_PROGRAM = os.environ["CLOTHSTREAM_SERVER"]
DELAY_MS = 10


class Programs(unittest.TestCase):
    def setUp(self):
        self.stack = contextlib.ExitStack()
        self.addCleanup(self.stack.close)
        folder = pathlib.Path(self.stack.enter_context(tempfile.TemporaryDirectory()))
        options = ["--loss", 2, "--delay", DELAY_MS, "--jitter", 3]
        self.link = self.stack.enter_context(NetworkLink(LINK, options, folder / "link.log"))
        scene = ["--scene", "small", "--scene-file", ROOT / "tests/e2e/small.json"]
        host = ["--host", self.link.address(SERVER), "--insecure"]
        self.server = self.stack.enter_context(
            Server(SERVER_PROGRAM, [*scene, *host], folder / "server.log", within=self.link.within(SERVER)))

    def load(self, *options):
        command = [*self.link.within(CLIENT), PROGRAM, "load", *options, "--participants", 1, "--seconds", 2, "--json"]
        ended = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=120)
        self.assertEqual(ended.returncode, 0, ended.stderr)
        return json.loads(ended.stdout)

    def test_frames_arrive_and_are_right(self):
        web = ["--web", self.server.url.split("/")[2]]
        for way, options in (("tcp", [self.server.address]), ("tcp", web), ("datagrams", [self.server.address]),
                             ("datagrams", web), ("datagrams", [*web, "--sctp"])):
            report = self.load(*options, "--transport", way)
            self.assertEqual((report["joined"], report["lost"]), (1, 0))
            self.assertEqual(report["hashMismatches"], 0)
            self.assertGreater(report["framesPerSecond"], 5)
            # The clock of the server is estimated through the link.
            self.assertGreater(report["tickAgeMsP50"], DELAY_MS - 5)
            self.assertGreater(report["poseToDisplayableMsP50"], 2 * DELAY_MS)
            self.assertEqual(report["withDatagrams"], int(way == "datagrams"))
            if way == "tcp":
                self.assertEqual(report["decodeErrors"], 0)
            else:
                # All frames but the first few, which the stream carries.
                self.assertGreater(report["datagrams"]["frames"], 0.9 * report["framesPerSecond"] * report["seconds"])
                self.assertLess(report["datagrams"]["lostFrames"], 3)
        self.server.end()
        for statistics in self.link.end().values():
            self.assertGreater(statistics["lost"], 0)
            self.assertEqual((statistics["overflowed"], statistics["refused"]), (0, 0))


if __name__ == "__main__":
    unittest.main(verbosity=2)
