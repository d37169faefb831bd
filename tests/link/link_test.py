# SPDX-License-Identifier: MIT
"""clothstream-link with the kernel's UDP and TCP."""
import contextlib
import os
import pathlib
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from network_link import CLIENT, NOT_PERMITTED, SERVER, NetworkLink  # noqa: E402
from programs import wait_until  # noqa: E402

PROGRAM = os.environ["CLOTHSTREAM_LINK"]
BATCH = 100  # packets that a socket can keep
PATIENCE = 60  # s
LAST = 10  # packets of which one arrives at 10 % loss
QUIET = 0.08  # s after which no packet comes


def number_of(packet):
    return struct.unpack_from("I", packet)[0]


def numbers_of_rest(receiver):
    """Numbers of the packets that come until none came for some time."""
    numbers = []
    while select.select([receiver], [], [], QUIET)[0]:
        numbers.append(number_of(receiver.recv(2000)))
    return numbers


def exists(pid):
    """Whether a process runs."""
    try:
        return "\nState:\tZ" not in pathlib.Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return False


class Link(unittest.TestCase):
    def setUp(self):
        self.stack = contextlib.ExitStack()
        self.addCleanup(self.stack.close)
        self.folder = pathlib.Path(self.stack.enter_context(tempfile.TemporaryDirectory()))
        self.links = 0

    def start(self, *options):
        self.links += 1
        return self.stack.enter_context(NetworkLink(PROGRAM, options, self.folder / f"link{self.links}.log"))

    def bound(self, link, end, family, kind):
        made = self.stack.enter_context(link.open_socket(end, family, kind))
        made.settimeout(PATIENCE)
        made.bind((link.address(end, family), 0))
        return made

    def udp(self, link, family=socket.AF_INET):
        """Sockets of the server and of the client. The server's is connected to the other one."""
        server, client = (self.bound(link, end, family, socket.SOCK_DGRAM) for end in (SERVER, CLIENT))
        server.connect(client.getsockname())
        return server, client

    def numbers_that_arrive(self, link, packets, family=socket.AF_INET):
        """Sends packets with numbers to the client, as many at a time as a socket keeps."""
        sender, receiver = self.udp(link, family)
        arrived = []
        for first in range(0, packets, BATCH):
            for number in range(first, first + BATCH):
                sender.send(struct.pack("I", number))
            while not arrived or arrived[-1] < first + BATCH - LAST:
                arrived.append(number_of(receiver.recv(10)))
        return arrived + numbers_of_rest(receiver)

    def test_same_seed_loses_same_packets(self):
        packets, loss = 600, 0.1
        runs = []
        for family in (socket.AF_INET, socket.AF_INET6):
            link = self.start("--loss", 100 * loss, "--seed", 7)
            arrived = self.numbers_that_arrive(link, packets, family)
            down = link.end()["down"]
            self.assertEqual((down["packets"], down["lost"]), (packets, packets - len(arrived)))
            self.assertEqual((down["overflowed"], down["refused"]), (0, 0))
            # Four standard deviations of the binomial distribution.
            self.assertAlmostEqual(down["lost"] / packets, loss, delta=4 * (loss * (1 - loss) / packets) ** 0.5)
            runs.append(arrived)
        self.assertEqual(runs[0], runs[1])

    def test_delays_each_way(self):
        link = self.start("--delay", "20:5", "--jitter", "10:0")
        server, client = self.udp(link)
        client.connect(server.getsockname())
        for sender, receiver, least, most in ((server, client, 0.02, 0.03), (client, server, 0.005, 0.005)):
            delays = []
            for _ in range(8):
                sent = time.monotonic()
                sender.send(b"x")
                receiver.recv(10)
                delays.append(time.monotonic() - sent)
            self.assertGreaterEqual(min(delays), least)
            # The machine may be late, but hardly each time.
            self.assertLess(min(delays), least + 0.005)
            self.assertGreater(max(delays), (least + most) / 2)

    def test_reorders_only_if_allowed(self):
        for options in ((), ("--reorder",)):
            link = self.start("--jitter", 10, *options)
            sender, receiver = self.udp(link)
            for number in range(BATCH):
                sender.send(struct.pack("I", number))
            numbers = [number_of(receiver.recv(10)) for _ in range(BATCH)]
            self.assertEqual(sorted(numbers), list(range(BATCH)))
            self.assertEqual(numbers != sorted(numbers), bool(options))
            reordered = sum(number < max(numbers[: i + 1]) for i, number in enumerate(numbers))
            self.assertEqual(link.end()["down"]["reordered"], reordered)

    def test_full_queue_drops(self):
        # 20 ms of the rate are 20 packets of 1,000 bytes with their headers.
        link = self.start("--rate", 8, "--queue-ms", 20)
        sender, receiver = self.udp(link)
        for number in range(BATCH):
            sender.send(struct.pack("I", number) + bytes(1000 - 28 - 4))
        arrived = numbers_of_rest(receiver)
        down = link.end()["down"]
        self.assertEqual(down["dropped"], BATCH - len(arrived))
        self.assertGreater(down["dropped"], 0)
        self.assertGreaterEqual(len(arrived), 20)
        self.assertEqual(down["bytes"], 1000 * BATCH)
        self.assertGreater(down["queueMsP99"], 10)
        self.assertLessEqual(down["queueMsP99"], 20.1)

    def test_tcp_survives_losses(self):
        conditions = ["--loss", 3, "--delay", 1, "--rate", 100, "--queue-bytes", 100_000]
        for family in (socket.AF_INET, socket.AF_INET6):
            link = self.start(*conditions, "--congestion", "reno")
            listener = self.bound(link, SERVER, family, socket.SOCK_STREAM)
            listener.listen()
            client = self.bound(link, CLIENT, family, socket.SOCK_STREAM)
            client.connect(listener.getsockname())
            server = self.stack.enter_context(listener.accept()[0])
            server.settimeout(PATIENCE)
            sent = os.urandom(100_000)
            for sender, receiver in ((server, client), (client, server)):
                used = sender.getsockopt(socket.IPPROTO_TCP, socket.TCP_CONGESTION, 16)
                self.assertEqual(used.rstrip(b"\0"), b"reno")
                sender.sendall(sent)
                with receiver.makefile("rb") as file:
                    self.assertEqual(file.read(len(sent)), sent)
            for statistics in link.end().values():
                self.assertGreater(statistics["bytes"], len(sent))
                self.assertGreater(statistics["lost"], 0)

    def test_leaves_nothing_behind(self):
        devices = pathlib.Path("/proc/net/dev")
        names = [line.split(":")[0] for line in devices.read_text().splitlines()]
        for how in (signal.SIGINT, signal.SIGKILL):
            link = self.start()
            self.assertEqual([line.split(":")[0] for line in devices.read_text().splitlines()], names)
            if how == signal.SIGKILL:
                link.kill()
            else:
                self.assertEqual(link.end(how)["down"]["packets"], 0)
            for end in link.ends.values():
                wait_until(lambda pid=end["pid"]: not exists(pid))

    def test_wrong_arguments_are_named(self):
        for options, error in (
            (["--loss", "100"], "--loss: '100' is not a number from 0 to 99"),
            (["--delay", "5:x"], "--delay: 'x' is not a number"),
            (["--burst-ms", "4", "--burst-packets", "4", "--loss", "1"], "in packets or in time, not both"),
            (["--burst-packets", "2", "--loss", "90"], "too short for this loss"),
            (["--rate", "0.1", "--queue-ms", "1"], "the queue is shorter than one packet"),
            (["--congestion", "none"], "--congestion: this kernel has no 'none'"),
            (["--seed", "-1"], "--seed"),
            (["--mtu", "100"], "--mtu"),
            (["more"], "more"),
        ):
            ended = subprocess.run([PROGRAM, *options], capture_output=True, text=True, timeout=60)
            self.assertEqual(ended.returncode, 2, options)
            self.assertIn(error, ended.stderr)

    def test_says_what_is_not_permitted(self):
        self.start().end()  # the namespaces below are permitted, too
        command = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", f"mount -t tmpfs none /dev; exec {PROGRAM}"]
        ended = subprocess.run(command, capture_output=True, text=True, timeout=60)
        self.assertEqual(ended.returncode, NOT_PERMITTED, ended.stderr)
        self.assertIn("network namespaces with virtual links are not permitted here: /dev/net/tun", ended.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
