# SPDX-License-Identifier: MIT
"""Head and controllers of Monado's remote driver, which a test moves. The driver listens on a TCP port and takes whole
states of 376 bytes, the newest of which holds."""

import contextlib
import dataclasses
import socket
import struct
import time

HEADER = b"mndrmt3\0"  # of Monado 24 and 25
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
STATE_BYTES = 376


def turned(yaw):
    """Quaternion x y z w of a turn around the vertical, counter-clockwise seen from above, in radians."""
    import math

    return (0.0, math.sin(yaw / 2), 0.0, math.cos(yaw / 2))


@dataclasses.dataclass
class Controller:
    position: tuple = (0.0, 1.0, 0.0)
    orientation: tuple = UPRIGHT
    active: bool = True
    tracks_hand: bool = False  # the driver makes a hand of the pose, `curl` and `pinch`
    curl: float = 0.0  # of little finger, ring finger and middle finger, 0 to 1
    pinch: float = 0.0  # curl of index finger and thumb, whose tips meet
    trigger: float = 0.0
    squeeze: float = 0.0
    menu: bool = False  # the button B of a Valve Index controller

    def packed(self):
        values = [*self.orientation, *self.position, *[0.0] * 6, *[self.curl] * 3, *[self.pinch] * 2]
        values += [self.trigger, self.squeeze, self.squeeze, *[0.0] * 5]
        # hand, active; then clicks and touches of: system, a, b, trigger, thumbstick; touch of the trackpad.
        flags = [self.tracks_hand, self.active, False, False, False, False, self.menu, self.menu, self.trigger > 0.9]
        return struct.pack("<26f", *values) + bytes(flags).ljust(16, b"\0")


@dataclasses.dataclass
class Remote:
    head: tuple = (0.0, 1.6, 0.0)
    head_orientation: tuple = UPRIGHT
    left: Controller = dataclasses.field(default_factory=lambda: Controller(position=(-0.3, 1.0, -0.2)))
    right: Controller = dataclasses.field(default_factory=lambda: Controller(position=(0.3, 1.0, -0.2)))

    def connect(self, port, seconds=20):
        end = time.monotonic() + seconds
        while True:
            try:
                self.socket = socket.create_connection(("127.0.0.1", port), timeout=10)
                break
            except OSError:
                if time.monotonic() > end:
                    raise
                time.sleep(0.05)
        # The driver sends its state at the start and its newest one, which shows whether it speaks this protocol.
        self.socket.settimeout(1)
        received = b""
        with contextlib.suppress(TimeoutError):
            while len(received) <= 2 * STATE_BYTES:
                received += self.socket.recv(4 * STATE_BYTES)
        if len(received) != 2 * STATE_BYTES:
            raise AssertionError(f"Monado's remote driver has states of {len(received) / 2} bytes, not {STATE_BYTES}")
        self.socket.settimeout(10)
        self.send()

    def close(self):
        self.socket.close()

    def send(self):
        """Sends the present state."""
        views = bytes(2 * 48)  # the driver's own, because they are not marked as valid
        center = struct.pack("<7f", *self.head_orientation, *self.head) + bytes(4)
        state = HEADER + views + center + self.left.packed() + self.right.packed()
        assert len(state) == STATE_BYTES
        self.socket.sendall(state)
