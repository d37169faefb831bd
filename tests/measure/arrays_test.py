#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Arrays of numpy: `clothstream export` to .npz, `import`, `measure` and `diff` of what numpy wrote.

Usage: arrays_test.py CLOTHSTREAM [unittest arguments], in the root of the repository.
"""
import csv
import gzip
import io
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile

import numpy

CLOTHSTREAM = sys.argv.pop(1)
VERSION = sorted(name for name in os.listdir("tests/replay") if name[0].isdigit())[-1]
MAX_ERROR = 1e-5  # default of import, metres along each axis
REACH = numpy.sqrt(3) * MAX_ERROR + 1e-6  # distance, with the rounding of float32


def grid(rows, columns, spacing=0.1):
    """Rest positions and triangles of a flat sheet, as docs/protocol.md describes grids."""
    x, y = numpy.meshgrid(numpy.arange(columns), -numpy.arange(rows))
    rest = numpy.stack([x, y, 0 * x], axis=-1).reshape(-1, 3) * spacing
    triangles = []
    for row in range(rows - 1):
        for column in range(columns - 1):
            a = row * columns + column
            triangles += [(a, a + columns, a + 1), (a + 1, a + columns, a + columns + 1)]
    return rest.astype("<f4"), numpy.array(triangles, "<u4")


def waves(frames=40, rows=8, columns=9):
    """Arrays of a sheet that waves."""
    rest, triangles = grid(rows, columns)
    seconds = numpy.arange(frames)[:, None] / 60
    positions = numpy.repeat(rest[None], frames, axis=0)
    positions[:, :, 2] += 0.05 * numpy.sin(7 * seconds + 9 * rest[:, 0])
    return {"positions": positions, "rest_positions": rest, "triangles": triangles, "rate": 60.0,
            "ticks": numpy.arange(5, 5 + frames)}


class Arrays(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.mkdtemp(prefix="clothstream-")
        self.addCleanup(shutil.rmtree, self.directory)

    def path(self, name):
        return os.path.join(self.directory, name)

    def run_program(self, *arguments):
        return subprocess.run([CLOTHSTREAM, *arguments], capture_output=True, text=True, timeout=120)

    def succeed(self, *arguments):
        ended = self.run_program(*arguments)
        self.assertEqual(ended.returncode, 0, ended.stderr + ended.stdout)
        return ended.stdout

    def save(self, name, arrays):
        numpy.savez(self.path(name), **arrays)
        return self.path(name)

    def imported(self, name, arrays, *options):
        out = self.path(name + ".mcap")
        self.succeed("import", self.save(name + ".npz", arrays), "-o", out, *options)
        return out

    def exported(self, recording, name="exported.npz", *options):
        self.succeed("export", recording, self.path(name), *options)
        return numpy.load(self.path(name))

    def kept(self, scene):
        """A recording that a server made."""
        path = self.path(scene + ".mcap")
        with gzip.open(f"tests/replay/{VERSION}/{scene}.mcap.gz") as kept, open(path, "wb") as out:
            shutil.copyfileobj(kept, out)
        return path

    def diff(self, a, b, *options):
        ended = self.run_program("diff", a, b, "--json", *options)
        self.assertTrue(ended.stdout, ended.stderr)
        result = json.loads(ended.stdout)
        self.assertEqual(result["exitCode"], ended.returncode)
        return result


class Export(Arrays):
    def test_has_every_frame_of_a_recording(self):
        recording = self.kept("flag")
        arrays = self.exported(recording)
        frames, vertices, _ = arrays["positions"].shape
        self.assertEqual(frames, json.loads(self.succeed("info", "--json", recording))["frames"]["decoded"])
        self.assertEqual(arrays["positions"].dtype, numpy.float32)
        self.assertEqual(arrays["normals"].shape, (frames, vertices, 3))
        numpy.testing.assert_allclose(numpy.linalg.norm(arrays["normals"], axis=-1), 1, atol=1e-3)
        self.assertTrue((numpy.diff(arrays["ticks"].astype(int)) > 0).all())
        self.assertTrue((numpy.diff(arrays["seconds"]) >= 0).all())
        self.assertEqual(arrays["triangles"].max(), vertices - 1)
        self.assertEqual(arrays["rest_positions"].shape, (vertices, 3))
        self.assertEqual(list(arrays["cloth_names"]), ["flag"])
        self.assertEqual(len(set(arrays["state_hashes"])), frames)
        self.assertEqual(len(set(arrays["reconstruction_hashes"])), frames)
        first, count, first_triangle, triangles, rows, columns = arrays["cloths"][0]
        self.assertEqual((first, count, first_triangle, triangles),
                         (0, vertices, 0, len(arrays["triangles"])))
        self.assertEqual(rows * columns, vertices)

    def test_has_the_positions_of_the_obj_files(self):
        recording = self.kept("folds")
        arrays = self.exported(recording, "all.npz")
        self.succeed("export", recording, self.path("objs"), "--rate", "100000")
        names = sorted(os.listdir(self.path("objs")))
        self.assertEqual(len(names), len(arrays["positions"]))
        for frame in (0, 3, len(names) - 1):
            with open(os.path.join(self.path("objs"), names[frame])) as obj:
                lines = [line.split()[1:] for line in obj if line.startswith("v ")]
            numpy.testing.assert_array_equal(numpy.array(lines, numpy.float32), arrays["positions"][frame])

    def test_limits_rate_and_time(self):
        recording = self.imported("waves", waves(60))
        whole = self.exported(recording, "whole.npz")
        self.assertEqual(len(whole["ticks"]), 60)
        some = self.exported(recording, "some.npz", "--rate", "20", "--from", "0.25", "--seconds", "0.5")
        self.assertEqual(len(some["ticks"]), 10)
        for index, tick in enumerate(some["ticks"]):
            numpy.testing.assert_array_equal(some["positions"][index],
                                             whole["positions"][list(whole["ticks"]).index(tick)])

    def test_writes_equal_files_for_equal_recordings_and_overwrites_none(self):
        recording = self.kept("flag")
        for name in ("one.npz", "two.npz"):
            self.succeed("export", recording, self.path(name))
        with open(self.path("one.npz"), "rb") as one, open(self.path("two.npz"), "rb") as two:
            self.assertEqual(one.read(), two.read())
        again = self.run_program("export", recording, self.path("one.npz"))
        self.assertEqual(again.returncode, 6)
        self.assertIn("exists already", again.stderr)
        self.assertEqual(sorted(os.listdir(self.directory)), ["flag.mcap", "one.npz", "two.npz"])


class Import(Arrays):
    def test_keeps_positions_within_the_error(self):
        arrays = waves()
        out = self.exported(self.imported("waves", arrays))
        numpy.testing.assert_array_equal(out["ticks"], arrays["ticks"])
        numpy.testing.assert_array_equal(out["triangles"], arrays["triangles"])
        numpy.testing.assert_array_equal(out["rest_positions"], arrays["rest_positions"])
        self.assertLess(numpy.linalg.norm(out["positions"] - arrays["positions"], axis=-1).max(), REACH)
        self.assertEqual(out["rate"][0], 60)
        coarse = self.exported(self.imported("coarse", arrays, "--max-error", "2mm"), "coarse_out.npz")
        far = numpy.linalg.norm(coarse["positions"] - arrays["positions"], axis=-1).max()
        self.assertTrue(REACH < far < numpy.sqrt(3) * 0.002 + 1e-6, far)

    def test_checks_what_it_claims(self):
        arrays = waves(4)
        arrays["positions"] += 55
        said = self.succeed("import", self.save("far.npz", arrays), "-o", self.path("far.mcap"))
        out = self.exported(self.path("far.mcap"))
        largest = numpy.linalg.norm(out["positions"].astype(float) - arrays["positions"], axis=-1).max()
        self.assertIn("every vertex is within %.3g m of its place, promised were " % largest, said)
        # At 10 um coordinates reach 60.3 m.
        arrays["positions"] += 6
        self.refuse([self.save("far.npz", arrays)], 7, "Use a max error of ")
        error = self.run_program("import", self.path("far.npz"), "-o", self.path("refused.mcap")).stderr
        self.succeed("import", self.path("far.npz"), "-o", self.path("farther.mcap"), "--max-error",
                     error.split("Use a max error of ")[1].split(" ")[0])

    def test_makes_a_recording_that_is_whole(self):
        recording = self.imported("waves", waves())
        about = json.loads(self.succeed("info", "--json", recording))
        self.assertTrue(about["whole"])
        self.assertEqual(about["frames"]["decoded"], 40)
        self.assertEqual(about["facts"]["scene"], "waves")
        again = self.run_program("import", self.path("waves.npz"), "-o", recording)
        self.assertEqual(again.returncode, 6)

    def test_takes_back_what_export_wrote(self):
        for scene in ("flag", "figure_12"):
            with self.subTest(scene):
                arrays = dict(self.exported(self.kept(scene), scene + ".npz"))
                out = self.exported(self.imported(scene + "_again", arrays), scene + "_again_out.npz")
                for name in ("ticks", "triangles", "cloths", "cloth_names", "rest_positions", "rate"):
                    numpy.testing.assert_array_equal(out[name], arrays[name], name)
                self.assertLess(numpy.linalg.norm(out["positions"] - arrays["positions"], axis=-1).max(), REACH)

    def test_reads_the_mesh_from_an_obj_file(self):
        arrays = waves()
        with open(self.path("mesh.obj"), "w") as obj:
            obj.write("# a comment\no sheet\n")
            obj.writelines(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in arrays["rest_positions"])
            obj.writelines(f"f {a + 1}/1/1 {b + 1}//1 {c + 1}\n" for a, b, c in arrays["triangles"])
        positions = {"positions": arrays["positions"].astype("<f8")}
        recording = self.imported("doubles", positions, "--mesh", self.path("mesh.obj"), "--rate", "60",
                                  "--first-tick", "5")
        result = self.diff(self.imported("waves", arrays), recording)
        self.assertEqual(result["frames"]["common"], 40)
        self.assertEqual(result["verdict"], "equal", result)

    def test_makes_fans_of_faces_and_counts_backwards(self):
        with open(self.path("mesh.obj"), "w") as obj:
            obj.write("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4 -3 -2 -1\n")
        positions = numpy.zeros((2, 4, 3), numpy.float32)
        out = self.exported(self.imported("quad", {"positions": positions}, "--mesh", self.path("mesh.obj"),
                                          "--rate", "30"))
        numpy.testing.assert_array_equal(out["triangles"], [[0, 1, 2], [0, 2, 3]])
        numpy.testing.assert_array_equal(out["ticks"], [1, 2])

    def test_reads_obj_files_with_any_ends_of_lines(self):
        text = "# \u00e4\\\nv 0 0 0\nv 1 \\\n0 0\nv 1 1 0\nv 0 1 0\nf 1 2 \\\n3 4\n"
        positions = numpy.zeros((2, 4, 3), numpy.float32)
        for number, (mark, end) in enumerate([("", "\r"), ("", "\r\n"), ("\ufeff", "\n")]):
            with open(self.path("mesh.obj"), "w", encoding="utf-8", newline="") as obj:
                obj.write(mark + text.replace("\n", end))
            recording = self.imported(f"quad_{number}", {"positions": positions}, "--mesh", self.path("mesh.obj"),
                                      "--rate", "30")
            out = self.exported(recording, f"out_{number}.npz")
            numpy.testing.assert_array_equal(out["triangles"], [[0, 1, 2], [0, 2, 3]])

    def refuse(self, arguments, code, text):
        out = self.path("refused.mcap")
        ended = self.run_program("import", "-o", out, *arguments)
        self.assertEqual(ended.returncode, code, ended.stderr)
        self.assertIn(text, ended.stderr)
        self.assertFalse(os.path.exists(out))

    def test_refuses_wrong_arrays(self):
        good = waves(4)
        bad = numpy.array(good["positions"])
        bad[2, 7, 1] = numpy.nan
        triangles = numpy.array(good["triangles"], numpy.int64)
        triangles[0, 0] = -1
        cases = [
            ({"positions": bad}, 7, "in frame 2 (of 0 to 3), vertex 7 has the coordinate nan"),
            ({"positions": good["positions"].astype(">f4")}, 7, 'its type is ">f4"'),
            ({"positions": good["positions"].astype(object)}, 7, 'its type is "|O"'),
            ({"positions": numpy.asfortranarray(good["positions"])}, 7, "Fortran order"),
            ({"positions": good["positions"][:, :, :2]}, 7, "it must be (frames, vertices, 3)"),
            ({"positions": good["positions"][:0]}, 7, "it must be (frames, vertices, 3)"),
            ({"positions": good["positions"][0]}, 7, "it must be (frames, vertices, 3)"),
            ({"positions": good["positions"][:, :9]}, 7, "rest_positions has 72 vertices, positions 9"),
            ({"positions": numpy.zeros(4, [("x", "<f4")])}, 7, "named columns"),
            ({"triangles": triangles}, 7, "-1 is not allowed there"),
            ({"triangles": good["triangles"] + 5}, 7, "triangles has vertex 76; 0 to 71 are allowed"),
            ({"triangles": good["triangles"].ravel()}, 7, "array triangles has the shape"),
            ({"ticks": [1, 2, 2, 3]}, 7, "ticks must ascend, but 2 follows 2"),
            ({"ticks": [1, 2, 3]}, 7, "ticks has 3 numbers for 4 frames"),
            ({"ticks": [1.5, 2, 3, 4]}, 7, "1.5 is not allowed there"),
            ({"rate": 0}, 7, "rate is 0"),
            ({"rate": 59.94}, 2, "whole ticks per second"),
            ({"rate": None}, 2, "give the ticks per second with --rate"),
            ({"triangles": None}, 2, "give the cloth at rest with --mesh"),
            ({"positions": None}, 7, "has no array positions; it has "),
            ({"cloths": [[0, 72, 0, 112, 7, 9]]}, 7, "row 0 of cloths"),
            ({"cloths": [[0, 9, 0, 112, 0, 0]]}, 7, "row 0 of cloths"),
            ({"cloths": numpy.zeros((0, 6))}, 7, "0 vertices"),
        ]
        for change, code, text in cases:
            with self.subTest(text):
                arrays = {name: array for name, array in {**good, **change}.items() if array is not None}
                self.refuse([self.save("bad.npz", arrays)], code, text)

    def test_refuses_files_that_lie(self):
        def entry(header, data=b"", name="positions.npy"):
            with zipfile.ZipFile(self.path("lies.npz"), "w") as lies:
                lies.writestr(name, header + data)
            return [self.path("lies.npz"), "--rate", "60", "--mesh", "tests/e2e/nowhere.obj"]

        def header(dictionary, version=b"\x01\x00"):
            return b"\x93NUMPY" + version + len(dictionary).to_bytes(2, "little") + dictionary.encode()

        def shaped(shape, descr="'<f4'"):
            return header("{'descr': %s, 'fortran_order': False, 'shape': %s, }\n" % (descr, shape))

        self.refuse(entry(shaped("(1, 4, 3)")), 7, "shape (1, 4, 3) of <f4 needs")
        self.refuse(entry(shaped("(99999999999, 99999999, 3)")), 7, "too large")
        self.refuse(entry(shaped("(-1, 4, 3)")), 7, "not that of an array")
        self.refuse(entry(shaped("(1, 4, 3)", "'<f16'")), 7, "its type is")
        self.refuse(entry(shaped("(1, 4, 3)", "'<f99999999999999999999'")), 7, "its type is")
        self.refuse(entry(b"no array"), 7, "ends before its last value")
        self.refuse(entry(b"no array at all"), 7, "its first bytes differ")
        self.refuse(entry(header("{", b"\x09\x00")), 7, "version 9")
        self.refuse(entry(b"\x93NUMPY\x02\x00\xff\xff\xff\xff"), 7, "at most 4096")
        with open(self.path("text.npz"), "w") as text:
            text.write("This is a text.")
        self.refuse([self.path("text.npz")], 7, "is not a .npz file")
        self.refuse([self.directory], 7, "it is not a regular file")
        self.refuse([self.path("missing.npz")], 7, "No such file")

    def test_refuses_wrong_obj_files(self):
        states = self.save("states.npz", {"positions": numpy.zeros((1, 3, 3), numpy.float32)})
        triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
        for text, expected in [
            ("", "is not an OBJ file with vertices and faces"),
            (triangle, "is not an OBJ file with vertices and faces"),
            ("\0v\0 \0000\0", "is text in UTF-16 or UTF-32"),
            (triangle.replace("\n", "\r") + "f 1 2 4\r", 'line 4 is "f 1 2 4": a face has vertex 4'),
            (triangle + "f 1 2 4\n", "a face has vertex 4, but 3 vertices come before it"),
            (triangle + "f 1 2 -4\n", "a face has vertex -4"),
            (triangle + "f 1 2 0\n", "a face has vertex 0"),
            (triangle + "f 1 2\n", "needs three corners"),
            (triangle + "f 1 2 x\n", "a corner of a face needs the number of a vertex"),
            (triangle + "f 1 2 99999999999999999999\n", "a corner of a face needs the number of a vertex"),
            ("v 0 0\n", 'line 1 is "v 0 0": a vertex needs three finite numbers'),
            ("v 0 0 nan\n", "three finite numbers"),
            ("v 0 0 1e99\n", "three finite numbers"),
            (triangle + "v 2 2 2\nf 1 2 3\n", "has 4 vertices, but the positions of"),
        ]:
            with self.subTest(text):
                with open(self.path("mesh.obj"), "w") as obj:
                    obj.write(text)
                self.refuse([states, "--mesh", self.path("mesh.obj"), "--rate", "60"], 7, expected)

    def test_survives_changed_and_cut_files(self):
        buffer = io.BytesIO()
        numpy.savez_compressed(buffer, **waves(3, 4, 4))
        whole = buffer.getvalue()
        chance = random.Random(7)
        for attempt in range(120):
            changed = bytearray(whole)
            if attempt % 3 == 0:
                del changed[chance.randrange(len(changed)):]
            else:
                for _ in range(chance.choice((1, 1, 20))):
                    changed[chance.randrange(len(changed))] = chance.randrange(256)
            with open(self.path("changed.npz"), "wb") as out:
                out.write(changed)
            ended = self.run_program("import", self.path("changed.npz"), "-o", self.path("out.mcap"))
            self.assertIn(ended.returncode, (0, 2, 7), f"attempt {attempt}: {ended.stderr}")
            self.assertEqual(ended.returncode == 0, os.path.exists(self.path("out.mcap")))
            if ended.returncode == 0:
                os.remove(self.path("out.mcap"))


class Diff(Arrays):
    def test_finds_one_vertex_that_moved_in_one_frame(self):
        arrays = waves()
        original = self.imported("original", arrays)
        moved = {**arrays, "positions": numpy.array(arrays["positions"])}
        moved["positions"][17, 33] += (0.003, 0, -0.004)
        result = self.diff(original, self.imported("moved", moved))
        self.assertEqual(result["verdict"], "different")
        self.assertEqual(result["exitCode"], 1)
        self.assertEqual(result["kernels"], "unknown")
        self.assertEqual(result["first"]["tick"], 22)
        self.assertEqual(result["firstDifferentTick"], 22)
        self.assertEqual(result["largest"]["vertex"], 33)
        self.assertEqual(result["largest"]["cloth"], "cloth")
        self.assertAlmostEqual(result["largest"]["metres"], 0.005, delta=2 * REACH)
        self.assertEqual(self.diff(original, self.path("moved.mcap"), "--tolerance", "4.9mm")["exitCode"], 1)
        self.assertEqual(self.diff(original, self.path("moved.mcap"), "--tolerance", "0.51cm")["exitCode"], 0)
        self.assertEqual(self.diff(original, self.path("moved.mcap"), "--tolerance", "0.0051")["exitCode"], 0)
        text = self.run_program("diff", original, self.path("moved.mcap"))
        self.assertIn("first frame that differs: tick 22, ", text.stdout)
        self.assertIn(" mm at vertex 33 of cloth", text.stdout)
        self.assertTrue(text.stdout.endswith("different\n"))

    def test_measures_the_mean_distance_over_all_frames(self):
        arrays = waves()
        other = {**arrays, "positions": arrays["positions"] + numpy.array((0.002, 0, 0), "<f4")}
        result = self.diff(self.imported("one", arrays), self.imported("two", other))
        self.assertAlmostEqual(result["mean"], 0.002, delta=2 * REACH)
        self.assertEqual(result["frames"]["different"], 40)
        self.assertEqual(result["first"]["tick"], 5)

    def test_reports_ticks_that_are_in_one_recording_only(self):
        arrays = waves()
        part = {**arrays, "positions": arrays["positions"][8:30], "ticks": arrays["ticks"][8:30]}
        # The other part of the stream starts with another key frame, so its positions differ within the error.
        result = self.diff(self.imported("whole", arrays), self.imported("part", part), "--tolerance", "0.1mm")
        self.assertEqual(result["verdict"], "missing")
        self.assertEqual(result["exitCode"], 10)
        self.assertEqual(result["frames"]["only"], [18, 0])
        later = {**arrays, "ticks": arrays["ticks"] + 1000}
        self.assertEqual(self.diff(self.path("whole.mcap"), self.imported("later", later))["exitCode"], 10)

    def test_refuses_recordings_of_different_cloths(self):
        ended = self.run_program("diff", self.imported("large", waves()), self.imported("small", waves(40, 3, 3)))
        self.assertEqual(ended.returncode, 7)
        self.assertIn("cloth 0 has 72 and 9 vertices", ended.stderr)
        missing = self.run_program("diff", self.path("large.mcap"), self.path("none.mcap"))
        self.assertEqual(missing.returncode, 7)
        for tolerance in ("1 mile", "-1mm", "much"):
            wrong = self.run_program("diff", self.path("large.mcap"), self.path("large.mcap"), "--tolerance", tolerance)
            self.assertEqual(wrong.returncode, 2, tolerance)


class Measure(Arrays):
    def measure(self, file, *options):
        return json.loads(self.succeed("measure", file, "--json", *options))

    def test_gives_the_strain_of_a_stretched_sheet(self):
        rest, triangles = grid(5, 6)
        scales = numpy.array([1, 1.1, 0.8, 1.02])
        arrays = {"positions": rest * scales[:, None, None], "rest_positions": rest, "triangles": triangles,
                  "rate": 60}
        measured = self.measure(self.save("stretched.npz", arrays))
        for frame, scale in zip(measured["frames"], scales):
            for figure in ("strainMean", "strainP99", "strainMax"):
                self.assertAlmostEqual(frame["cloths"][0][figure], abs(scale - 1), delta=1e-6)
        summary = measured["cloths"][0]["strainMax"]
        self.assertAlmostEqual(summary["largest"], 0.2, delta=1e-6)
        self.assertEqual(summary["tick"], 3)
        # A single edge that is longer changes the largest strain alone.
        arrays["positions"][0, 0, 0] -= 0.05
        frame = self.measure(self.save("one.npz", arrays))["frames"][0]["cloths"][0]
        self.assertAlmostEqual(frame["strainMax"], 0.5, delta=1e-6)
        self.assertLess(frame["strainMean"], 0.02)

    def test_gives_the_energies_of_a_sheet_that_flies(self):
        rest, triangles = grid(5, 6)
        seconds = numpy.arange(9)[:, None, None] / 50
        fall = numpy.array((3, 4, 0)) * seconds + numpy.array((0, -0.5 * 9.81, 0)) * seconds**2
        arrays = {"positions": rest + fall, "rest_positions": rest, "triangles": triangles, "rate": 50,
                  "ticks": numpy.arange(9)}
        mass = 0.3 * 0.5 * 0.4
        frames = self.measure(self.save("flies.npz", arrays), "--areal-mass", "0.3")["frames"]
        self.assertIsNone(frames[0]["cloths"][0]["kineticEnergy"])
        self.assertIsNone(frames[-1]["cloths"][0]["kineticEnergy"])
        for index in range(1, 8):
            speed = numpy.hypot(3, 4 - 9.81 * index / 50)
            self.assertAlmostEqual(frames[index]["cloths"][0]["kineticEnergy"], 0.5 * mass * speed**2, delta=1e-4)
        # The sum is constant.
        sums = [frame["cloths"][0]["kineticEnergy"] + frame["cloths"][0]["gravityEnergy"] for frame in frames[1:-1]]
        self.assertLess(max(sums) - min(sums), 1e-4)
        moon = self.measure(self.path("flies.npz"), "--areal-mass", "0.3", "--gravity", "0,-1.62,0")
        self.assertAlmostEqual(moon["frames"][0]["cloths"][0]["gravityEnergy"] * 9.81 / 1.62,
                               frames[0]["cloths"][0]["gravityEnergy"], delta=1e-6)

    def test_counts_intersections(self):
        # The first two edges of the second triangle pierce the first one in the second frame.
        rest = numpy.array([(0, 0, 0), (4, 0, 0), (0, 4, 0), (1, 1, 1), (1, 1.5, 3), (2, 1, 3)], "<f4")
        low = numpy.array(rest)
        low[3, 2] = -1
        arrays = {"positions": numpy.stack([rest, low, low + 9]), "rest_positions": rest,
                  "triangles": [(0, 1, 2), (3, 4, 5)], "rate": 60}
        counts = [frame["cloths"][0]["intersections"] for frame in
                  self.measure(self.save("crossed.npz", arrays))["frames"]]
        self.assertEqual(counts, [0, 2, 2])
        left_out = self.measure(self.path("crossed.npz"), "--no-intersections")
        self.assertEqual(left_out["cloths"][0]["intersections"]["largest"], 0)

    def test_finds_penetration_of_recorded_colliders(self):
        measured = self.measure(self.kept("sphere_drop"), "--no-intersections")
        deepest = max(cloth["penetration"] for frame in measured["frames"] for cloth in frame["cloths"])
        # Constraints and thickness keep nodes outside, so that only the codec's error is left.
        self.assertLess(deepest, 2 * measured["maxError"])
        self.assertLess(measured["gravity"][1], -9.8)

    def test_prints_the_same_numbers_in_each_format(self):
        recording = self.imported("waves", waves())
        measured = self.measure(recording)
        rows = list(csv.DictReader(io.StringIO(self.succeed("measure", recording, "--csv"))))
        self.assertEqual(len(rows), 40)
        for row, frame in zip(rows, measured["frames"]):
            self.assertEqual(int(row["tick"]), frame["tick"])
            for key, value in frame["cloths"][0].items():
                if value is None:
                    self.assertEqual(row[key], "")
                else:
                    self.assertAlmostEqual(float(row[key]), value, delta=1e-6 * abs(value) + 1e-12)
        table = self.succeed("measure", recording)
        self.assertIn("strain, largest", table)
        self.assertIn("cloth, 72 vertices, 0.2 kg/m^2", table)
        self.assertEqual(self.run_program("measure", recording, "--rate", "60").returncode, 2)


if __name__ == "__main__":
    unittest.main(verbosity=2)
