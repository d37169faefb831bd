# SPDX-License-Identifier: MIT
"""A client whose address changes, such as a phone that leaves its Wi-Fi."""
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

LINK, PROGRAM, SERVER_PROGRAM = (os.environ[f"CLOTHSTREAM_{name}"] for name in ("LINK", "PROGRAM", "SERVER"))
RATE = 72


class Address(unittest.TestCase):
    def setUp(self):
        self.stack = contextlib.ExitStack()
        self.addCleanup(self.stack.close)
        folder = pathlib.Path(self.stack.enter_context(tempfile.TemporaryDirectory()))
        self.link = self.stack.enter_context(NetworkLink(LINK, ["--delay", 25], folder / "link.log"))
        options = ["--scene", "flag", "--host", self.link.address(SERVER), "--insecure"]
        self.server = self.stack.enter_context(
            Server(SERVER_PROGRAM, options, folder / "server.log", within=self.link.within(SERVER)))

    def ip(self, *arguments):
        subprocess.run([*self.link.within(CLIENT), "ip", *arguments], check=True)

    def move(self):
        """Replaces the client's address. TCP connections from the old one are dead."""
        old = self.link.address(CLIENT)
        network, host = old.rsplit(".", 1)
        listed = subprocess.run([*self.link.within(CLIENT), "ip", "-json", "address"], capture_output=True, text=True, check=True)
        device = next(one["ifname"] for one in json.loads(listed.stdout)
                      if any(address["local"] == old for address in one["addr_info"]))
        self.ip("address", "del", f"{old}/24", "dev", device)
        self.ip("address", "add", f"{network}.{int(host) + 7}/24", "dev", device)
        self.ip("route", "replace", f"{network}.0/24", "dev", device)

    def test_frames_go_on_at_the_new_address(self):
        command = [*self.link.within(CLIENT), PROGRAM, "join", self.server.address, "--events", "--frames",
                   "--transport", "datagrams", "--seconds", 12]
        events, moved_at = [], None
        with subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, text=True) as client:
            for line in client.stdout:
                events.append(json.loads(line))
                if moved_at is None and len(events) == 2 * RATE:
                    self.move()
                    moved_at = events[-1]["tick"]
        self.assertEqual(client.returncode, 0)
        names = [event["event"] for event in events]
        # The stream was found dead, and opened again.
        self.assertEqual((names.count("connectionLost"), names.count("reconnected")), (1, 1))
        summary = events[-1]
        self.assertEqual(summary["event"], "summary", events[-3:])
        self.assertEqual(summary["transport"], "datagrams")
        ticks = [event["tick"] for event in events if event["event"] == "frame"]
        missed = [later - tick - 1 for tick, later in zip(ticks, ticks[1:]) if tick >= moved_at]
        print(f"frames in a row that the client missed: {max(missed)}", file=sys.stderr)
        # The stream is found dead after four seconds. Datagrams bridge them.
        self.assertLess(max(missed), 2 * RATE)


if __name__ == "__main__":
    unittest.main(verbosity=2)
