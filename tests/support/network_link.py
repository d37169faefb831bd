# SPDX-License-Identifier: MIT
"""A bad network link between two namespaces (tests/link), for tests and benchmarks."""

import ctypes
import json
import os
import signal
import socket
import unittest

from programs import LIBC, Program, ProgramFailed

NOT_PERMITTED = 3  # exit code of clothstream-link
SERVER, CLIENT = "server", "client"


class NetworkLink(Program):
    """A link, which is ready. Raises unittest.SkipTest where namespaces are not permitted. Options are those of
    `clothstream-link --help`."""

    def __init__(self, program, options, log):
        super().__init__("clothstream-link", [program, *options], log)

    def start(self):
        super().start()
        try:
            self.ends = json.loads(self.wait_for(r'^\{"server".*\}$')[0])
        except ProgramFailed:
            if self.process.wait() == NOT_PERMITTED:
                raise unittest.SkipTest(self.said().strip().removeprefix("clothstream-link: ")) from None
            raise

    def address(self, end, family=socket.AF_INET):
        """Address of an end. Raises unittest.SkipTest if this machine has no IPv6."""
        found = [address for address in self.ends[end]["addresses"] if (":" in address) == (family == socket.AF_INET6)]
        if not found:
            raise unittest.SkipTest("this machine has no IPv6")
        return found[0]

    def within(self, end):
        """Command that runs the program that follows in the network of an end. Programs must end before the link."""
        return ["nsenter", "--preserve-credentials", "--user", "--net", "--target", str(self.ends[end]["pid"]), "--"]

    def open_socket(self, end, family, kind):
        """A socket of this process in the network of an end. The process must have one thread."""
        ours, theirs = socket.socketpair()
        with ours, theirs:
            child = os.fork()
            if child == 0:
                make_socket(self.ends[end]["pid"], family, kind, theirs)
            theirs.close()
            sent, descriptors, _, _ = socket.recv_fds(ours, 1000, 1)
            os.waitpid(child, 0)
        if not descriptors:
            raise OSError(sent.decode())
        return socket.socket(fileno=descriptors[0])

    def end(self, how=signal.SIGTERM):
        """Ends the link and returns its statistics by direction."""
        self.process.send_signal(how)
        status = self.process.wait(60)
        if status != 0:
            raise ProgramFailed(f"{self.name} ended with {status}; its log ends:\n{self.tail()}")
        return json.loads(self.said().splitlines()[-1])


def make_socket(pid, family, kind, channel):
    """Runs in a child process: enters the namespaces of a process, and sends a socket. Never returns."""
    try:
        for namespace in ("user", "net"):
            with open(f"/proc/{pid}/ns/{namespace}", "rb") as file:
                if LIBC.setns(file.fileno(), 0) != 0:
                    raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
        with socket.socket(family, kind) as made:
            socket.send_fds(channel, [b"made"], [made.fileno()])
    except OSError as error:
        channel.send(str(error).encode())
    finally:
        os._exit(0)
