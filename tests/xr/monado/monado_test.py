#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""clothstream-xr with a real OpenXR runtime: Monado without a headset, whose head and controllers this test moves. Another
client, of the Python package, sees what happens to the cloth on the server.

CLOTHSTREAM_SERVER, CLOTHSTREAM_XR, CLOTHSTREAM_LIBRARY: files of the build. CLOTHSTREAM_XR_ROOT: folder for the root, kept
between runs. CLOTHSTREAM_XR_PICTURES: folder that gets the pictures; default: none are kept."""

import math
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parents[2]
sys.path[:0] = [str(HERE), str(SOURCE / "clients/python/src")]

from monado import Root  # noqa: E402
from remote import Remote, turned  # noqa: E402
from programs import Server, wait_until  # noqa: E402

GRAB_TAKEN = 1  # cs_grab_event_kind
RADIUS = 0.045  # of the sphere of a controller, m
THUMB, INDEX, WRIST = 2, 6, 19  # bones of a hand (proto/hands/bones.h)
# Grabber::kReach, and half the length of the last bones, in whose middle fingers() is, m.
REACH = 0.12
# The largest depth of a vertex in a collider that is no penetration: rounding of positions in the stream.
ROUNDING = 0.002
# Software Vulkan draws slowly.
SMALL = ("--scale", "0.5", "--samples", "1", "--detail", "reduced")
FOCUSED = r"The session is FOCUSED"


def setUpModule():
    for tool in ("mmdebstrap", "unshare", "chroot"):
        if not shutil.which(tool):
            raise unittest.SkipTest(f"{tool} is missing (./dev test --long installs it)")
    if os.geteuid() != 0:
        raise unittest.SkipTest("only root can install a Debian into a folder")
    global clothstream, np, pictures
    try:
        import numpy as np  # noqa: F811
    except ImportError:
        raise unittest.SkipTest("python3-numpy is missing") from None
    import clothstream
    import pictures

    subprocess.run([HERE / "make_root.sh", os.environ["CLOTHSTREAM_XR_ROOT"]], check=True)


class WithMonado(unittest.TestCase):
    """Server, Monado, client and an observer."""

    def setUp(self):
        self.root = Root(os.environ["CLOTHSTREAM_XR_ROOT"], os.environ["CLOTHSTREAM_XR"])
        self.addCleanup(self.root.remove)
        self.addCleanup(self.keep)
        self.remote = Remote()
        (self.root.folder / "pictures").mkdir()

    def start_server(self, *arguments, port=0):
        server = Server(
            os.environ["CLOTHSTREAM_SERVER"],
            ["--scene-file", HERE / "hanging.json", "--scene", "hanging", *arguments],
            self.root.folder / "server.log",
        )
        self.addCleanup(server.stop)
        self.address = server.url.removeprefix("http://").rstrip("/")
        return server

    def start_monado(self):
        monado = self.root.monado()
        self.addCleanup(monado.stop)
        self.remote.connect(self.root.port)
        self.addCleanup(self.remote.close)
        return monado

    def start_client(self, *arguments, **settings):
        arguments = [self.address, "--name", "Visor", "--eye-pictures", "/shared/pictures", "--picture-every", "3", *(arguments if "--detail" in arguments else (*SMALL, *arguments))]
        client = self.root.client(*arguments, **settings)
        self.addCleanup(client.stop)
        return client

    def observe(self):
        stream = clothstream.join(self.address, scene="hanging", name="Observer")
        self.addCleanup(stream.close)
        return stream

    def keep(self):
        """Keeps pictures and logs for people."""
        folder = os.environ.get("CLOTHSTREAM_XR_PICTURES")
        if folder:
            shutil.copytree(self.root.folder, pathlib.Path(folder) / self.id(), dirs_exist_ok=True, ignore=shutil.ignore_patterns("input", "run"))

    def end(self, client):
        """SIGTERM. The client must end with 0, which it does not after messages of validation layers."""
        client.ask_to_stop()
        status = client.process.wait(30)
        self.assertEqual(status, 0, client.tail())
        self.assertNotRegex(client.said(), r"validation:|Validation Error|VALID_(ERROR|WARNING)")

    def look(self, name, after=0):
        """Waits for a new picture of the left eye, and keeps it under a name for people. Returns its pixels."""
        newest = self.newest()
        wait_until(lambda: self.newest() > newest + after, "an eye picture", 200)
        number = self.newest()
        folder = self.root.folder / "pictures"
        for side in ("left", "right"):
            shutil.copy(folder / f"{side}_{number}.png", self.root.folder / f"{name}_{side}.png")
        return self.root.folder / f"{name}_left.png", self.root.folder / f"{name}_right.png"

    def newest(self):
        numbers = [int(file.stem.split("_")[1]) for file in (self.root.folder / "pictures").glob("right_*.png")]
        return max(numbers, default=-1)

    def find_visor(self, observer):
        """Id of the client under test."""
        return wait_until(
            lambda: observer.next_frame() and next((each.id for each in observer.participants if each.name == "Visor"), 0),
            "the participant",
        )

    def bones(self, frame, visor):
        """Number of colliders of the visor's hands."""
        return sum(each.participant_id == visor and each.name.isdecimal() and 2**31 <= int(each.name) < 2**31 + 64 for each in frame.colliders)

    def bone(self, frame, visor, number):
        """Middle of a bone of the visor's right hand."""
        name = str(2**31 + 32 + number)
        return next(np.array(each.position) for each in frame.colliders if each.participant_id == visor and each.name == name)

    def fingers(self, frame, visor):
        """Middle of the last bones of thumb and index finger."""
        return (self.bone(frame, visor, THUMB) + self.bone(frame, visor, INDEX)) / 2

    def takes(self, observer, visor):
        """Whether a grab of the visor takes hold in the next frame."""
        observer.next_frame()
        return any(each.participant_id == visor and each.kind == GRAB_TAKEN and each.vertices > 0 for each in observer.grab_events)

    def nearest(self, frame, visor, point):
        """Centre of the controller's sphere that is nearest to a point."""
        return min(self.own(frame, visor), key=lambda sphere: np.linalg.norm(sphere - point))

    def arrives(self, observer, visor, point):
        """Waits until a controller is there on the server."""
        wait_until(
            lambda: np.linalg.norm(self.nearest(observer.next_frame(), visor, point) - point) < 0.01, f"a controller at {point}"
        )

    def carry(self, observer, visor, to_scene, to, step=0.02):
        """Moves the right controller to a point of the scene in steps (m), each of which the server has before the next one:
        software Vulkan may show two frames a second."""
        start, end = np.array(self.remote.right.position) + to_scene, np.array(to)
        steps = math.ceil(np.linalg.norm(end - start) / step)
        for part in range(1, steps + 1):
            point = start + (end - start) * part / steps
            self.remote.right.position = tuple(point - to_scene)
            self.remote.send()
            self.arrives(observer, visor, point)

    def own(self, frame, visor):
        """Centres of the spheres of the visor's controllers."""
        return [
            np.array(each.position)
            for each in frame.colliders
            if each.participant_id == visor and each.name.isdecimal() and int(each.name) < 40
        ]


def settle(stream, frames=120):
    """Positions and colliders after some more frames."""
    for _ in range(frames):
        frame = stream.next_frame()
    return frame


class Touching(WithMonado):
    def test_controller_pushes_and_squeeze_lifts(self):
        self.start_server()
        self.start_monado()
        client = self.start_client()
        client.wait_for(FOCUSED)
        observer = self.observe()
        visor = self.find_visor(observer)
        wait_until(lambda: len(self.own(observer.next_frame(), visor)) == 2, "both controllers")

        # The scene stands before the user, who looks along -Z: its coordinates are those of the room, moved.
        spheres = self.own(observer.next_frame(), visor)
        right = max(spheres, key=lambda sphere: sphere[0])
        to_scene = right - np.array(self.remote.right.position)
        np.testing.assert_allclose(to_scene, (0, 0, 0.5), atol=0.01)

        # Steps back, to see more.
        self.remote.head = (0.5, 1.7, 1.0)
        self.remote.head_orientation = turned(0.35)
        self.remote.send()
        rest = settle(observer).positions.copy()
        for side, picture in zip(("left", "right"), self.look("before", after=3)):
            difference = pictures.difference(picture, HERE / f"before_{side}.png")
            print(f"picture of the {side} eye: differs by {difference:.2f} of 255 on average", flush=True)
            # A pushed cloth differs by 4.7, and the picture of the other eye by 3.3.
            self.assertLess(difference, 1.5)

        # Pushes: 0.25 m through where the cloth hangs.
        self.carry(observer, visor, to_scene, (0.05, 1.2, 0.12), step=0.5)
        self.carry(observer, visor, to_scene, (0.05, 1.2, -0.25))
        deepest = 0.0
        for _ in range(60):
            frame = observer.next_frame()
            sphere = self.nearest(frame, visor, (0.05, 1.2, -0.25))
            deepest = max(deepest, RADIUS - np.linalg.norm(frame.positions - sphere, axis=1).min())
        moved = np.linalg.norm(frame.positions - rest, axis=1).max()
        print(f"pushed: a vertex moved by {moved:.3f} m; deepest in the controller {1000 * deepest:.1f} mm", flush=True)
        self.look("pushed")
        self.assertGreater(moved, 0.15)
        self.assertLess(deepest, ROUNDING)

        # Grabs where it touches, and lifts by half a metre towards the user.
        touched = np.linalg.norm(frame.positions - sphere, axis=1) < RADIUS + 0.05
        self.remote.right.squeeze = 1.0
        self.remote.send()
        wait_until(lambda: self.takes(observer, visor), "the grab")
        self.look("grabbed")
        self.carry(observer, visor, to_scene, (0.05, 1.6, 0.3))
        frame = settle(observer, 60)
        sphere = self.nearest(frame, visor, (0.05, 1.6, 0.3))
        held = np.linalg.norm(frame.positions[touched] - sphere, axis=1).min()
        lifted = (frame.positions[touched, 1] - rest[touched, 1]).max()
        print(f"lifted: {lifted:.3f} m; the held vertex is {held:.3f} m from the controller", flush=True)
        self.look("lifted")
        self.assertGreater(lifted, 0.3)
        self.assertLess(held, 0.12)

        # Lets go: the cloth hangs again.
        self.remote.right.squeeze = 0.0
        self.carry(observer, visor, to_scene, (0.7, 1.0, 0.6), step=0.5)
        frame = settle(observer, 240)
        self.assertLess(np.abs(frame.positions - rest)[:, 2].max(), 0.2)
        self.look("released")
        self.end(client)

    def test_hand_pinches_and_lifts(self):
        self.start_server()
        self.start_monado()
        client = self.start_client()
        client.wait_for(FOCUSED)
        observer = self.observe()
        visor = self.find_visor(observer)
        wait_until(lambda: len(self.own(observer.next_frame(), visor)) == 2, "both controllers")
        self.remote.left.active = False
        hand = self.remote.right
        hand.active, hand.tracks_hand, hand.pinch = False, True, 1.0
        self.remote.send()
        wait_until(lambda: self.bones(observer.next_frame(), visor) == 20, "the right hand")
        frame = settle(observer, 30)
        # The scene is 0.5 m behind the origin of the room; the parts of a hand keep their places in it.
        to_scene = np.array((0, 0, 0.5))
        fingers = self.fingers(frame, visor) - to_scene - hand.position
        wrist = self.bone(frame, visor, WRIST) - to_scene - hand.position

        def carry(to):
            """Moves the fingers to a point of the scene in steps, each of which the server has before the next one."""
            start, end = np.array(hand.position), np.array(to) - to_scene - fingers
            steps = math.ceil(np.linalg.norm(end - start) / 0.03)
            for part in range(1, steps + 1):
                hand.position = tuple(start + (end - start) * part / steps)
                self.remote.send()
                there = hand.position + to_scene + wrist
                wait_until(
                    lambda: np.linalg.norm(self.bone(observer.next_frame(), visor, WRIST) - there) < 0.01, f"a wrist at {there}"
                )

        hand.pinch = 0.0
        self.remote.send()
        carry((0.05, 1.2, 0.08))
        rest = settle(observer).positions.copy()
        hand.pinch = 1.0
        self.remote.send()
        wait_until(lambda: self.takes(observer, visor), "the grab")
        self.look("pinched")
        near = np.linalg.norm(rest - self.fingers(observer.next_frame(), visor), axis=1) < REACH
        carry((0.05, 1.6, 0.3))
        frame = settle(observer, 60)
        held = np.linalg.norm(frame.positions[near] - self.fingers(frame, visor), axis=1).min()
        lifted = (frame.positions[near, 1] - rest[near, 1]).max()
        print(f"pinched: lifted by {lifted:.3f} m; the held vertex is {held:.3f} m from the fingers", flush=True)
        self.look("pinched_and_lifted")
        self.assertGreater(lifted, 0.3)
        self.assertLess(held, REACH)
        hand.pinch = 0.0
        self.remote.send()
        frame = settle(observer, 240)
        self.assertLess((frame.positions[near, 1] - rest[near, 1]).max(), 0.2, "the open hand lets go")
        self.end(client)

    def test_hands_replace_controllers_and_come_back(self):
        self.start_server()
        self.start_monado()
        client = self.start_client()
        client.wait_for(FOCUSED)
        observer = self.observe()
        visor = self.find_visor(observer)
        wait_until(lambda: len(self.own(observer.next_frame(), visor)) == 2, "both controllers")
        for controller in (self.remote.left, self.remote.right):
            controller.active, controller.tracks_hand = False, True
        self.remote.send()
        wait_until(lambda: self.bones(observer.next_frame(), visor) == 40, "both hands")
        self.assertEqual(self.own(observer.next_frame(), visor), [])
        self.look("hands", after=5)
        for controller in (self.remote.left, self.remote.right):
            controller.active, controller.tracks_hand = True, False
        self.remote.send()
        wait_until(lambda: len(self.own(observer.next_frame(), visor)) == 2, "both controllers again")
        self.assertEqual(self.bones(observer.next_frame(), visor), 0)
        self.end(client)


class Validation(WithMonado):
    def test_layers_of_openxr_and_vulkan_say_nothing(self):
        self.start_server()
        self.start_monado()
        client = self.start_client("--detail", "full", "--samples", "4", validates=True)
        client.wait_for(FOCUSED)
        observer = self.observe()
        visor = self.find_visor(observer)
        wait_until(lambda: len(self.own(observer.next_frame(), visor)) == 2, "both controllers", 200)
        self.look("validated", after=3)
        self.end(client)


class Life(WithMonado):
    def test_runtime_is_killed_and_started_again(self):
        self.start_server()
        monado = self.start_monado()
        client = self.start_client()
        client.wait_for(FOCUSED)
        observer = self.observe()
        visor = self.find_visor(observer)
        wait_until(lambda: len(self.own(observer.next_frame(), visor)) == 2, "both controllers")
        self.look("before_restart")
        monado.kill()
        client.wait_for("A new session follows as soon as the OpenXR runtime answers")
        # Without a headset nothing of the user is in the scene, but the participant stays.
        wait_until(lambda: self.own(observer.next_frame(), visor) == [], "the controllers to go")
        self.assertEqual(self.find_visor(observer), visor)
        self.remote.close()
        self.start_monado()
        wait_until(lambda: len(re.findall(FOCUSED, client.said())) == 2, "the second session")
        wait_until(lambda: len(self.own(observer.next_frame(), visor)) == 2, "both controllers again")
        self.assertEqual(self.find_visor(observer), visor)
        self.look("after_restart", after=5)
        self.end(client)

    def test_ends_although_the_runtime_hangs(self):
        self.start_server()
        monado = self.start_monado()
        for signals, status in ((1, 1), (2, 128 + signal.SIGTERM)):
            client = self.start_client()
            client.wait_for(FOCUSED)
            monado.process.send_signal(signal.SIGSTOP)
            client.ask_to_stop()
            if signals == 2:
                time.sleep(1)  # the runtime would have ended the session by now
                client.ask_to_stop()
            self.assertEqual(client.process.wait(30), status, client.tail())
            monado.process.send_signal(signal.SIGCONT)
        self.assertIn("The program is stopped: 10 s after a signal", (self.root.folder / "client.log").read_text())

    def test_server_is_killed_and_started_again(self):
        server = self.start_server()
        self.start_monado()
        client = self.start_client()
        client.wait_for(FOCUSED)
        client.wait_for("joined")
        self.look("joined", after=5)
        server.kill()
        client.wait_for("The server is gone")
        before = self.newest()
        self.look("server_gone", after=5)
        self.assertGreater(self.newest(), before, "the headset goes on without the server")
        server.command[server.command.index("--port") + 1] = self.address.rsplit(":", 1)[1]
        server.start()
        client.wait_for("The connection to .* is back")
        observer = self.observe()
        visor = self.find_visor(observer)
        wait_until(lambda: len(self.own(observer.next_frame(), visor)) == 2, "both controllers")
        self.look("server_back", after=5)
        self.assertEqual(len(re.findall(FOCUSED, client.said())), 1, "the session of OpenXR went on")
        self.end(client)

    def test_wrong_code_is_said_in_the_headset(self):
        self.start_server("--pairing")
        self.start_monado()
        client = self.start_client("--code", "000000")
        client.wait_for("The server refused the pairing code")
        client.wait_for(FOCUSED)
        self.look("wrong_code", after=5)
        self.end(client)

    def test_waits_for_the_server(self):
        server = self.start_server()
        server.stop()
        self.start_monado()
        client = self.start_client()
        client.wait_for("The server does not answer")
        client.wait_for(FOCUSED)
        self.look("no_server", after=5)
        server.command[server.command.index("--port") + 1] = self.address.rsplit(":", 1)[1]
        server.start()
        client.wait_for("is back")
        self.end(client)

    def test_says_that_there_is_no_runtime(self):
        self.start_server()
        client = self.start_client("--wait", "2", environment={"XR_RUNTIME_JSON": "/nowhere.json"})
        self.assertEqual(client.process.wait(30), 1)
        self.assertIn("No OpenXR runtime is active", client.said())

    def test_says_that_the_service_of_the_runtime_does_not_run(self):
        self.start_server()
        client = self.start_client("--wait", "2")
        self.assertEqual(client.process.wait(30), 1)
        self.assertIn("does not answer", client.said())


if __name__ == "__main__":
    unittest.main(verbosity=2)
