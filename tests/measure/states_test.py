#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""States of every tick, and measures of them compared with the reports of the server.

Usage: states_test.py CLOTHSTREAM CLOTHSTREAM_SERVER [unittest arguments], in the root of the repository.
"""
import gzip
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy

CLOTHSTREAM, SERVER = sys.argv.pop(1), sys.argv.pop(1)
VERSION = sorted(name for name in os.listdir("tests/replay") if name[0].isdigit())[-1]
NO_DEVICE = 77


class States(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.mkdtemp(prefix="clothstream-")
        self.addCleanup(shutil.rmtree, self.directory)

    def path(self, name):
        return os.path.join(self.directory, name)

    def run_program(self, *command):
        return subprocess.run(command, capture_output=True, text=True, timeout=200)

    def kept(self, scene, name=None):
        path = self.path(name or scene + ".mcap")
        with gzip.open(f"tests/replay/{VERSION}/{scene}.mcap.gz") as kept, open(path, "wb") as out:
            shutil.copyfileobj(kept, out)
        return path

    def states(self, path):
        with open(path + ".json") as description:
            about = json.load(description)
        return numpy.fromfile(path, "<f4").reshape(about["shape"]), about

    def test_every_tick_of_a_recording_has_its_exact_state(self):
        recording, out = self.kept("flag"), self.path("flag.f32")
        ended = self.run_program(SERVER, "resimulate", recording, "--states", out, "--json")
        self.assertEqual(ended.returncode, 0, ended.stderr)
        result = json.loads(ended.stdout)
        self.assertEqual(result["verdict"], "equal")
        states, about = self.states(out)
        self.assertEqual(len(states), result["ticks"] + 1)
        self.assertEqual(about["ticks"], list(range(result["ticks"] + 1)))
        self.assertEqual(about["differentTicks"], [])
        self.assertTrue(about["complete"])
        # The frames of the recording show these states within the error of the codec.
        exported = self.run_program(CLOTHSTREAM, "export", recording, self.path("flag.npz"))
        self.assertEqual(exported.returncode, 0, exported.stderr)
        frames = numpy.load(self.path("flag.npz"))
        reach = numpy.sqrt(3) * result["frames"]["maxError"] + 1e-5
        for frame, tick in enumerate(frames["ticks"]):
            self.assertEqual(about["hashes"][tick], f"{frames['state_hashes'][frame]:016x}")
            away = numpy.linalg.norm(states[tick, :, :3] - frames["positions"][frame], axis=-1)
            self.assertLess(away.max(), reach)
        # Velocities are those of the motion.
        moved = (states[10:, :, :3] - states[9:-1, :, :3]) / about["tickSeconds"]
        self.assertGreater(numpy.corrcoef(moved.ravel(), states[10:, :, 3:].ravel())[0, 1], 0.9)

    def measure(self, file):
        ended = self.run_program(CLOTHSTREAM, "measure", file, "--json", "--no-intersections")
        self.assertEqual(ended.returncode, 0, ended.stderr)
        return {frame["tick"]: frame["cloths"][0] for frame in json.loads(ended.stdout)["frames"]}

    def test_exact_states_have_the_measures_of_the_frames_within_their_error(self):
        # The steps of docs/comparing.md.
        recording, out = self.kept("swing"), self.path("out.f32")
        self.assertEqual(self.run_program(SERVER, "resimulate", recording, "--states", out).returncode, 0)
        exported = self.run_program(CLOTHSTREAM, "export", recording, self.path("frames.npz"))
        self.assertEqual(exported.returncode, 0, exported.stderr)
        states, about = self.states(out)
        frames = numpy.load(self.path("frames.npz"))
        surface = {name: frames[name] for name in ("rest_positions", "triangles", "cloths", "cloth_names", "rate")}
        numpy.savez(self.path("out.npz"), positions=states[..., :3], ticks=about["ticks"], **surface)
        exact, shown = self.measure(self.path("out.npz")), self.measure(recording)
        for tick, measured in shown.items():
            self.assertAlmostEqual(exact[tick]["strainMean"], measured["strainMean"], delta=0.02)

    def test_exit_codes_of_resimulate(self):
        recording = self.kept("flag")
        resimulate = (SERVER, "resimulate")
        same = self.run_program(*resimulate, recording, "--states", recording)
        self.assertEqual(same.returncode, 2)
        self.assertIn("choose another file", same.stderr)
        self.assertEqual(self.run_program(*resimulate, recording, "--nonsense").returncode, 2)
        self.assertEqual(self.run_program(*resimulate).returncode, 2)
        self.assertEqual(self.run_program(*resimulate, self.path("missing")).returncode, 7)
        unwritten = self.run_program(*resimulate, recording, "--states", "/nowhere/states")
        self.assertEqual(unwritten.returncode, 6)
        self.assertIn("cannot write /nowhere/states", unwritten.stderr)
        self.assertEqual(self.run_program(*resimulate, recording, "--device", "nowhere").returncode, 8)
        # Every chunk after the first third of the file has one wrong bit somewhere.
        with open(recording, "r+b") as damaged:
            damaged.seek(os.path.getsize(recording) * 2 // 3)
            byte = damaged.read(1)
            damaged.seek(-1, os.SEEK_CUR)
            damaged.write(bytes([byte[0] ^ 1]))
        self.assertIn(self.run_program(*resimulate, recording).returncode, (7, 10))

    def test_measures_agree_with_the_reports_of_the_server(self):
        out = self.path("curtain.f32")
        ended = self.run_program(SERVER, "step", "--scene", "curtain", "--ticks", "30", "--out", out)
        self.assertEqual(ended.returncode, 0, ended.stderr)
        states, about = self.states(out)
        cloth = about["cloths"][0]
        rows, columns = cloth["rows"], cloth["columns"]
        corners = numpy.arange(rows * columns).reshape(rows, columns)
        a, b, e, f = (part.ravel() for part in
                      (corners[:-1, :-1], corners[:-1, 1:], corners[1:, :-1], corners[1:, 1:]))
        triangles = numpy.stack([numpy.stack([a, e, b], 1), numpy.stack([b, e, f], 1)], 1).reshape(-1, 3)
        mass = about["scene"]["cloths"][0]["mass"]
        numpy.savez(self.path("curtain.npz"), positions=states[..., :3], rest_positions=states[0, :, :3],
                    triangles=triangles, ticks=about["ticks"], rate=1 / about["tickSeconds"],
                    cloths=[[0, rows * columns, 0, len(triangles), rows, columns]], cloth_names=[cloth["name"]])
        corner, left, right = (states[0, triangles[:, k], :3].astype(float) for k in range(3))
        area = 0.5 * numpy.linalg.norm(numpy.cross(left - corner, right - corner), axis=-1).sum()
        ended = self.run_program(CLOTHSTREAM, "measure", self.path("curtain.npz"), "--json", "--areal-mass",
                                 str(mass / area))
        self.assertEqual(ended.returncode, 0, ended.stderr)
        frames = json.loads(ended.stdout)["frames"]
        self.assertEqual(len(frames), 31)
        most = max(report["cloths"][0]["kineticEnergy"] for report in about["reports"][1:])
        gravity = []
        for frame, report in zip(frames[1:-1], about["reports"][1:-1]):
            measured, reported = frame["cloths"][0], report["cloths"][0]
            self.assertAlmostEqual(measured["strainMax"], reported["strainMax"], delta=2e-5)
            self.assertAlmostEqual(measured["strainMean"], reported["strainMean"], delta=2e-5)
            # Central differences of positions are close to the velocities of the integration.
            self.assertAlmostEqual(measured["kineticEnergy"], reported["kineticEnergy"], delta=0.02 * most)
            gravity.append(measured["gravityEnergy"] - reported["gravityEnergy"])
        # The report leaves out pinned nodes, which do not move.
        self.assertLess(numpy.ptp(gravity), 1e-3)


if __name__ == "__main__":
    devices = subprocess.run([SERVER, "--list-devices"], capture_output=True, text=True, timeout=60)
    if devices.returncode != 0 or not devices.stdout.strip():
        print("skipped: no Vulkan device")
        sys.exit(NO_DEVICE)
    unittest.main(verbosity=2)
