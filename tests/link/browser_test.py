# SPDX-License-Identifier: MIT
"""The page in Chromium and a real server with a bad link between them."""
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

LINK, NODE, SERVER_PROGRAM = (os.environ[f"CLOTHSTREAM_{name}"] for name in ("LINK", "NODE", "SERVER"))
CHROMIUM = pathlib.Path("/usr/bin/chromium")
CONDITIONS = ["--loss", 2, "--delay", 25, "--jitter", 5]
FRAMES = 300


class Browser(unittest.TestCase):
    def setUp(self):
        if not CHROMIUM.exists():
            self.skipTest(f"there is no {CHROMIUM} (apt install chromium)")

    def open_page(self, link, server):
        """What the page shows after FRAMES frames in datagrams."""
        command = [*link.within(CLIENT), NODE, ROOT / "tests/link/page.mjs", server.url, FRAMES]
        ended = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=200)
        self.assertEqual(ended.returncode, 0, ended.stderr)
        return json.loads(ended.stdout)

    def test_page_repairs_losses(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            with NetworkLink(LINK, CONDITIONS, folder / "link.log") as link:
                options = ["--scene", "flag", "--host", link.address(SERVER), "--insecure"]
                with Server(SERVER_PROGRAM, options, folder / "server.log", within=link.within(SERVER)) as server:
                    page = self.open_page(link, server)
                    server.end()
                for statistics in link.end().values():
                    self.assertGreater(statistics["lost"], 0)
        self.assertEqual((page["shown"], page["errors"]), ("datagrams", []))
        stream, datagrams = page["after"]["stream"], page["after"]["datagrams"]
        self.assertTrue(datagrams["inUse"])
        self.assertGreater(datagrams["lostPackets"], 0)
        self.assertGreater(datagrams["repairedFrames"], 0)
        # Without repair at least 2 % of the frames would be lost, because a frame has one packet or more.
        self.assertLess(datagrams["lostFrames"], datagrams["frames"] / 100)
        self.assertEqual(stream["hashMismatches"], 0)
        if datagrams["lostFrames"] == 0:  # a frame that refers to a lost one is not decoded
            self.assertEqual(stream["decodeErrors"], 0)
        # A link that carried half of the frames would drop one for each that it carries.
        frames, dropped = (stream[name] - page["before"]["stream"][name] for name in ("frames", "dropped"))
        self.assertLess(dropped, frames / 4)


if __name__ == "__main__":
    unittest.main(verbosity=2)
