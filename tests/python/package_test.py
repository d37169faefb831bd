# SPDX-License-Identifier: MIT
"""The installed package: its structs, recordings of every version, a real server, and simulating."""
import contextlib
import ctypes
import dataclasses
import gzip
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import unittest

import numpy as np

import clothstream
from clothstream import _bindings

TESTS = pathlib.Path(__file__).resolve().parent.parent
SERVER, PROGRAM = os.environ["CLOTHSTREAM_SERVER"], os.environ["CLOTHSTREAM_PROGRAM"]
SMALL = TESTS / "e2e/small.json"


@contextlib.contextmanager
def running_server(*options, scene="small"):
    """Starts a server with a scene of tests/e2e, or a built-in one, on a free port, and gives its address."""
    file = TESTS / f"e2e/{scene}.json"
    files = ["--scene-file", str(file)] if file.exists() else []
    command = [SERVER, "--port", "0", "--grpc-port", "0", "--scene", scene, *files, *options]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        printed = ""
        for line in server.stdout:
            printed += line
            if found := re.match(r"page *(http:\S+)", line):
                break
        else:
            if "no Vulkan" in printed:
                raise unittest.SkipTest("the server needs a Vulkan device")
            raise AssertionError(f"the server ended: {printed}")
        yield found[1]
    finally:
        server.terminate()
        server.communicate(timeout=60)


def recorded(path):
    with gzip.open(path) as file:
        return file.read()


def recording_without_good_frames(frames):
    """An MCAP file with a cloth of 2x2 vertices, whose packets are a text. It has no index."""
    def text(content):
        return struct.pack("<I", len(content)) + content

    def record(opcode, content):
        return struct.pack("<BQ", opcode, len(content)) + content

    def field(number, content):
        return bytes([number << 3 | 2, len(content)]) + content

    def message(channel, time, content):
        return record(5, struct.pack("<HIQQ", channel, 0, time, time) + content)

    cloth = bytes([2 << 3, 4, 3 << 3, 2, 4 << 3, 2]) + field(5, np.zeros((4, 3), np.float32).tobytes())
    description = (bytes([1 << 3, 1, 2 << 3, 2, 4 << 3, 60, 5 << 3, 60]) + struct.pack("<Bf", 6 << 3 | 5, 0.001) +
                   field(8, cloth))
    messages = message(1, 1, description) + b"".join(message(2, 1 + i, field(1, b"garbage")) for i in range(frames))
    channels = b"".join(record(4, struct.pack("<HH", number, 0) + text(topic) + text(b"protobuf") + text(b""))
                        for number, topic in ((1, b"/description"), (2, b"/frames")))
    chunk = struct.pack("<QQQI", 1, frames, len(messages), 0) + text(b"") + struct.pack("<Q", len(messages)) + messages
    return (b"\x89MCAP0\r\n" + record(1, text(b"") + text(b"test")) + channels +
            record(12, text(b"clothstream") + text(text(b"scene") + text(b"sheet"))) + record(6, chunk))


class Bindings(unittest.TestCase):
    def test_structs_have_the_layout_of_the_c_compiler(self):
        structs = [kind for kind in vars(_bindings).values() if isinstance(kind, type) and issubclass(kind, ctypes.Structure)]
        self.assertGreater(len(structs), 30)
        wanted, found = {}, {}
        code = "#include <clothstream/clothstream.h>\n#include <clothstream/recording.h>\n#include <stdio.h>\nint main(void) {\n"
        for kind in structs:
            name = kind.__name__
            wanted[name] = ctypes.sizeof(kind)
            code += f'printf("{name} %zu\\n", sizeof({name}));\n'
            for field, _ in kind._fields_:
                wanted[f"{name}.{field}"] = getattr(kind, field).offset
                code += f'printf("{name}.{field} %zu\\n", offsetof({name}, {field}));\n'
        with tempfile.TemporaryDirectory() as folder:
            source, program = pathlib.Path(folder, "layout.c"), pathlib.Path(folder, "layout")
            source.write_text(code + "return 0;\n}\n")
            subprocess.run(["cc", "-I", os.environ["CLOTHSTREAM_INCLUDE"], str(source), "-o", str(program)], check=True)
            for line in subprocess.run([str(program)], check=True, capture_output=True, text=True).stdout.splitlines():
                name, value = line.split()
                found[name] = int(value)
        self.assertEqual(found, wanted)

    def test_the_package_has_the_version_of_its_library(self):
        from importlib.metadata import version
        self.assertEqual(clothstream.__version__, version("clothstream"))
        self.assertTrue(pathlib.Path(clothstream.__file__).with_name("libclothstream.so").exists(), "it is the wheel")


class Recordings(unittest.TestCase):
    def test_frames_of_every_version_have_the_recorded_hashes(self):
        files = sorted(TESTS.glob("replay/*/*.mcap.gz"))
        self.assertGreater(len(files), 20)
        for file in files:
            with self.subTest(file=file.name), clothstream.open_recording(recorded(file)) as recording:
                ticks = []
                for frame in recording:
                    self.assertEqual(frame.hash, frame.recorded_hash)
                    ticks.append(frame.tick)
                self.assertEqual(len(ticks), recording.info.frames)
                self.assertEqual(ticks, sorted(set(ticks)))

    def test_a_seek_gives_the_frame_that_playing_gives(self):
        with clothstream.open_recording(recorded(TESTS / "replay/0.2.0/flag.mcap.gz")) as recording:
            frames = [(frame.tick, frame.seconds, frame.positions.copy(), recording.environment.wind) for frame in recording]
            for tick, seconds, positions, wind in frames[::-5] + frames[::7]:
                for seek, where in ((recording.seek, seconds), (recording.seek_tick, tick)):
                    frame = seek(where)
                    self.assertEqual(frame.tick, tick)
                    np.testing.assert_array_equal(frame.positions, positions)
                    self.assertEqual(recording.environment.wind, wind)
            self.assertIsNone(recording.seek_tick(0))

    def test_the_journal_has_the_input_of_each_tick(self):
        with clothstream.open_recording(recorded(TESTS / "replay/0.2.0/flag.mcap.gz")) as recording:
            kinds, radii, states = set(), set(), 0
            for message in recording.messages():
                kinds.add(message.kind)
                if message.kind == clothstream.Recorded.TICK:
                    self.assertEqual(recording.journal.tick, message.tick)
                    self.assertEqual(recording.journal.state_hash, message.state_hash)
                    radii |= {one.radius for one in recording.journal.colliders if one.participant_id == 7}
                if message.kind == clothstream.Recorded.CHECKPOINT:
                    tick, state = recording.checkpoint
                    self.assertEqual(state.shape, (recording.vertex_count, 6))
                    states += 1
            self.assertGreater(states, 0)
            self.assertEqual([round(radius, 6) for radius in radii], [0.1])
            self.assertLessEqual({clothstream.Recorded.FRAME, clothstream.Recorded.PARAMETERS, clothstream.Recorded.SCENE}, kinds)
            self.assertEqual(recording.scene, "flag")
            self.assertEqual(recording.cloths[0].vertex_count, recording.vertex_count)
            self.assertEqual(recording.triangles.max(), recording.vertex_count - 1)

    def test_cut_and_other_files_are_errors_or_end_early(self):
        whole = recorded(TESTS / "replay/0.2.0/flag.mcap.gz")
        with self.assertRaisesRegex(clothstream.RecordingError, "not an MCAP file"):
            clothstream.open_recording(b"PNG")
        with self.assertRaisesRegex(clothstream.RecordingError, "no such file.mcap"):
            clothstream.open_recording("no such file.mcap")
        before = 0
        for length in range(0, len(whole), len(whole) // 60):
            with contextlib.suppress(clothstream.RecordingError):
                with clothstream.open_recording(whole[:length]) as recording:
                    self.assertFalse(recording.info.complete)
                    frames = sum(1 for _ in recording)
                    self.assertGreaterEqual(frames, before)
                    before = frames
        self.assertGreater(before, 0)

    def test_frames_that_cannot_be_decoded_are_an_error_and_are_counted(self):
        with clothstream.open_recording(recording_without_good_frames(5)) as recording:
            self.assertEqual(recording.vertex_count, 4)
            with self.assertRaisesRegex(clothstream.RecordingError, "the frame of an unknown tick at 0.000 s cannot be decoded"):
                list(recording)
            self.assertEqual(list(recording), [])
            self.assertEqual((recording.faults.frames, recording.faults.undecodable), (5, 5))

    def test_more_vertices_than_allowed_are_refused(self):
        with self.assertRaisesRegex(clothstream.RecordingError, "4 vertices; this client accepts at most 3"):
            clothstream.open_recording(recording_without_good_frames(1), max_vertices=3)

    def test_a_frame_that_is_not_current_says_so(self):
        recording = clothstream.open_recording(recorded(TESTS / "replay/0.2.0/flag.mcap.gz"))
        frame = recording.next(clothstream.Recorded.FRAME)
        view = frame.positions
        self.assertEqual((view.dtype, view.shape, view.flags.owndata, view.flags.writeable),
                         (np.float32, (recording.vertex_count, 3), False, False))
        recording.next(clothstream.Recorded.FRAME)
        with self.assertRaisesRegex(clothstream.Error, "no longer current"):
            frame.positions
        recording.close()
        with self.assertRaisesRegex(clothstream.RecordingError, "closed"):
            recording.info


class Streams(unittest.TestCase):
    def test_a_stream_and_its_recording_have_the_same_frames(self):
        with tempfile.TemporaryDirectory() as folder, running_server("--recordings", folder) as address:
            with clothstream.join(address, "small", role="owner", name="Py") as stream:
                self.assertEqual((stream.scene, stream.vertex_count, len(stream.cloths)), ("small", 320, 2))
                self.assertEqual([one.name for one in stream.participants], ["Py"])
                file = stream.start_recording("drape")
                seen, wind = {}, None
                stream.set_environment(wind=(1, 0, 3))
                stream.set_colliders([(-0.5, 3.25, 0.125, 0.25)])
                for frame in stream:
                    seen[frame.tick] = (frame.hash, frame.positions.copy())
                    own = [one for one in frame.colliders if one.participant_id == stream.participant_id]
                    wind = stream.environment.wind
                    if len(seen) >= 60 and own and wind == (1, 0, 3):
                        break
                self.assertEqual((own[0].position, own[0].radius), ((-0.5, 3.25, 0.125), 0.25))
                self.assertEqual(stream.statistics.hash_mismatches, 0)
                name, size = stream.stop_recording()
            [path] = pathlib.Path(folder).glob("*drape*.mcap")
            self.assertEqual(path.stat().st_size, size)
            self.assertIn("drape", file)
            with clothstream.open_recording(path) as recording:
                same = 0
                for frame in recording:
                    self.assertEqual(frame.hash, frame.recorded_hash)
                    if frame.tick in seen:
                        self.assertEqual(frame.hash, seen[frame.tick][0])
                        np.testing.assert_array_equal(frame.positions, seen[frame.tick][1])
                        same += 1
                self.assertGreater(same, 20)
                self.assertEqual(recording.environment.wind, (1, 0, 3))
            # The C client of the program finds the same hashes.
            subprocess.run([PROGRAM, "info", str(path)], check=True, capture_output=True)

    def test_scenes_are_made_changed_and_deleted(self):
        with running_server() as address, clothstream.join(address, role="owner") as stream:
            self.assertEqual(stream.copy_scene("small", "other"), "other")
            self.assertEqual({one.name for one in stream.scenes()} & {"small", "other"}, {"small", "other"})
            with self.assertRaises(clothstream.RequestRefused) as refused:
                stream.copy_scene("no-such-scene", "third")
            self.assertIn("no-such-scene", str(refused.exception))
            stream.delete_scene("other")
            self.assertNotIn("other", {one.name for one in stream.scenes()})
            self.assertGreater(len(stream.definition()), 100)
            stream.change_cloth("left", drag=1.25, solver=clothstream.Solver.XPBD)
            while stream.cloth_settings(0).solver != clothstream.Solver.XPBD:
                stream.wait(10)
            self.assertEqual(stream.cloth_settings(0).drag, 1.25)
            stream.change_collider("ball", radius=0.2)
            while [one.radius for one in stream.next_frame().colliders if one.name == "ball"] != [np.float32(0.2)]:
                pass
            with self.assertRaisesRegex(TypeError, "drift"):
                stream.change_cloth(drift=1)
            with self.assertRaisesRegex(ValueError, "no cloth"):
                stream.change_cloth("sail", drag=1)
            stream.pause()
            stream.reset()
            stream.pause(False)
            stream.next_frame()

    def test_a_fan_blows_against_the_wind(self):
        with running_server() as address, clothstream.join(address, role="owner") as stream:
            depth = lambda: float(stream.next_frame().positions[221:, 2].mean())  # of the right cloth
            while depth() < 0.02:  # the scene's wind goes to +Z
                pass
            half = 0.5 ** 0.5
            stream.set_winds([clothstream.OwnWind((0.5, 1.8, 0.5), (-half, 0, 0, half), speed=20, radius=0.5)])
            while depth() > -0.05:
                pass
            stream.set_winds([])
            while depth() < 0.02:
                pass
            with self.assertRaises(AttributeError):
                stream.set_winds([(0, 0, 0)])

    def test_joints_move_a_mesh_and_the_cloth(self):
        with running_server(scene="arm") as address, clothstream.join(address) as stream:
            vertices, triangles = stream.next_frame().mesh(0)
            self.assertEqual((vertices.shape, triangles.shape), ((8, 3), (12, 3)))
            self.assertEqual(vertices[:, 2].max(), np.float32(0.1))
            for z in (0.1, 0.25, 0.4):
                poses = np.zeros((2, 7))
                poses[:, 6], poses[1, 2] = 1, z
                stream.next_frame()
                stream.move_joints("block", poses)
            for frame in stream:
                if frame.mesh(0)[0][:, 2].max() > 0.499 and frame.positions[:, 2].max() > 0.19:
                    break
            self.assertEqual(stream.next_frame().mesh(99)[0].shape, (0, 3))
            with self.assertRaisesRegex(ValueError, "8 numbers"):
                stream.move_joints("block", [range(8)])
            stream.move_joints("leg", poses)
            while clothstream.Event.ERROR not in stream.wait(10):
                pass

    # The eyes of the figure are at 1.65 m; the person's are 10 cm lower, and the right hand is in reach. Within 2 cm: what
    # docs/bodies.md promises of a hand.
    def test_a_worn_body_reaches_where_its_wearer_does(self):
        with running_server(scene="walker") as address, clothstream.join(address, role="participant") as stream:
            frame = stream.next_frame()
            self.assertEqual([one.name for index, one in enumerate(frame.colliders) if stream.is_body(index)], ["avatar"])
            body = clothstream.TrackedBody((0, 1.55, 2, 0, 0, 0, 1), right_hand=(0.2, 1.2, 1.6, 0, 0, 0, 1))
            with self.assertRaisesRegex(ValueError, "no body is worn"):
                stream.set_body(body)
            with self.assertRaisesRegex(ValueError, "'floor' is not a body"):
                stream.wear("floor")
            stream.wear("avatar")
            while stream.body_of(stream.participant_id) != "avatar":
                stream.wait(10)
            stream.set_body(body)
            np.testing.assert_allclose(stream.body_part("right_hand")[:3], body.right_hand[:3], atol=0.02)
            stream.wear(None)
            while stream.body_of(stream.participant_id):
                stream.wait(10)

    def test_surfaces_of_the_real_room_carry_cloth(self):
        corners = [(-2, 0, -2), (-2, 0, 2), (2, 0, 2), (2, 0, -2)]
        floor = clothstream.Surface(1, corners, [(0, 1, 2), (0, 2, 3)], (0, 1.2, 0))
        with running_server() as address, clothstream.join(address, role="owner") as stream:
            self.assertEqual(stream.surface_policy, clothstream.SurfacePolicy.OWN)
            lowest = lambda: float(stream.next_frame().positions[:, 1].min())
            for _ in range(60):  # the cloth falls at first
                height = lowest() - 0.1
            stream.set_surface(dataclasses.replace(floor, position=(0, height - 1, 0)))
            stream.move_surface(1, (0, height, 0))
            for _ in range(60):  # the first surface waits for its kernels, up to 0.2 s
                self.assertGreater(lowest(), height)
            stream.set_environment(gravity=(0, -60, 0), wind=(0, 0, 0))
            for _ in range(72):
                self.assertGreater(lowest(), height)
            stream.remove_surface(1)
            while lowest() > height - 0.02:
                pass
            with self.assertRaisesRegex(ValueError, "no surface 1"):
                stream.move_surface(1, (0, 0, 0))
            with self.assertRaisesRegex(ValueError, "no surface 1"):
                stream.remove_surface(1)
            with self.assertRaisesRegex(ValueError, "0 triangles and 4 vertices"):
                stream.set_surface(clothstream.Surface(1, corners, []))
            with self.assertRaisesRegex(ValueError, "2 numbers"):
                stream.set_surface(clothstream.Surface(1, corners, [(0, 1)]))
            stream.set_surface(clothstream.Surface(2, corners, [(0, 1, 4)]))
            while clothstream.Event.ERROR not in stream.wait(10):
                pass
        with running_server("--room-surfaces", "off") as address, clothstream.join(address) as stream:
            stream.next_frame()
            self.assertEqual(stream.surface_policy, clothstream.SurfacePolicy.OFF)
            with self.assertRaisesRegex(RuntimeError, "takes no surfaces"):
                stream.set_surface(floor)
        with running_server("--room-surfaces", "everyone") as address, clothstream.join(address) as stream:
            stream.next_frame()
            self.assertEqual(stream.surface_policy, clothstream.SurfacePolicy.EVERYONE)
            with self.assertRaisesRegex(RuntimeError, "allow_surfaces"):
                stream.set_surface(floor)
            stream.allow_surfaces(clothstream.SurfacePolicy.EVERYONE)
            stream.set_surface(floor)
            stream.wait()  # ends the frame, so that the surface is sent
            with clothstream.join(address) as other:
                other.follow_surfaces()
                while not other.room_surfaces:
                    other.wait(10)
                seen = other.room_surfaces[0]
                self.assertEqual((seen.id, seen.participant_id, seen.two_sided), (1, stream.participant_id, False))
                self.assertEqual(seen.position, tuple(np.float32([0, 1.2, 0])))
                np.testing.assert_array_equal(seen.positions, corners)
                np.testing.assert_array_equal(seen.triangles, [(0, 1, 2), (0, 2, 3)])

    def test_joining_says_why_it_fails(self):
        with self.assertRaisesRegex(ValueError, "HOST"):
            clothstream.join("")
        with self.assertRaisesRegex(ValueError, "guest"):
            clothstream.join("localhost", role="guest")
        with self.assertRaisesRegex(clothstream.ConnectionFailed, "127.0.0.1:1"):
            clothstream.join("127.0.0.1:1", timeout=3)


class Simulations(unittest.TestCase):
    def test_simulating_gives_states(self):
        try:
            states = clothstream.simulate(SMALL, 24, every=6, server=SERVER)
        except clothstream.SimulationFailed as error:
            if "no Vulkan" in str(error):
                self.skipTest("the server needs a Vulkan device")
            raise
        self.assertEqual(states.positions.shape, (5, 320, 3))
        self.assertEqual(states.velocities.shape, (5, 320, 3))
        self.assertEqual(list(states.ticks), [0, 6, 12, 18, 24])
        self.assertEqual(len(set(states.hashes)), 5)
        self.assertAlmostEqual(states.seconds[-1], 24 / 120)
        self.assertLess(states.positions[-1, :, 1].mean(), states.positions[0, :, 1].mean(), "the cloth falls")
        with self.assertRaisesRegex(clothstream.SimulationFailed, "no-such-scene"):
            clothstream.simulate("no-such-scene", 1, server=SERVER)
        with self.assertRaisesRegex(clothstream.SimulationFailed, "cannot be started"):
            clothstream.simulate("small", 1, server="/no/such/program")


if __name__ == "__main__":
    sys.exit(0 if unittest.main(exit=False).result.wasSuccessful() else 1)
