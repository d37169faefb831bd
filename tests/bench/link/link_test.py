# SPDX-License-Identifier: MIT
"""How link.py makes options and tables, and what it accepts."""
import contextlib
import io
import pathlib
import tempfile
import unittest

import link

GOOD = {"hashMismatches": 0, "decodeErrors": 0, "joined": 1, "lost": 0, "poses": 700, "framesPerSecond": 71.5,
        "withDatagrams": 0}
WHOLE = {way: {"overflowed": 0, "refused": 0} for way in ("down", "up")}


def row(condition, transport, *figures):
    return {"condition": condition, "transport": transport, **dict(zip(link.KEPT, figures))}


class LinkBench(unittest.TestCase):
    def test_conditions_replace_usual_options(self):
        self.assertEqual(link.link_options("5-reordered", "cubic", 3), [
            "--delay", 25, "--jitter", 20, "--seed", 3, "--loss", 5, "--reorder", "--congestion", "cubic"])
        self.assertEqual(link.link_options("0", None, 1), ["--delay", 25, "--jitter", 5, "--seed", 1])

    def test_finds_used_algorithms(self):
        text = ("ESTAB 0 0 10.77.0.1:80 10.77.0.2:5\n\t ts sack cubic wscale:7,7 rto:204\n"
                "ESTAB 0 0 10.77.0.1:80 10.77.0.2:6\n\t bbr wscale:7,7 rto:204\n")
        self.assertEqual(link.algorithms_of(text), ["bbr", "cubic"])

    def test_checks_what_arrived(self):
        link.check(GOOD, WHOLE)
        link.check({**GOOD, "decodeErrors": 15, "withDatagrams": 1}, WHOLE)
        for name, wrong in (("hashMismatches", 1), ("decodeErrors", 1), ("joined", 0), ("lost", 1), ("poses", 0),
                            ("framesPerSecond", 0)):
            with self.assertRaises(link.ProgramFailed, msg=name):
                link.check({**GOOD, name: wrong}, WHOLE)
        for name in ("overflowed", "refused"):
            with self.assertRaises(link.ProgramFailed, msg=name):
                link.check(GOOD, {**WHOLE, "up": {**WHOLE["up"], name: 1}})

    def test_reads_ages_of_frames(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "frames"
            path.write_text('{"seconds":0.5,"participant":0,"tick":7,"ageMs":26.1,"displayableMs":null}\n'
                            '{"seconds":0.6,"participant":0,"tick":8,"ageMs":27.2,"displayableMs":60.3}\n')
            self.assertEqual(link.frames_of(path), [[0.5, 26.1, None], [0.6, 27.2, 60.3]])

    def test_table_has_medians(self):
        rows = [row("0", "grpc", p50, p50 + 80, 70 + p50 / 100) for p50 in (70, 10, 90)] + [row("0", "websocket", 1, 2, 3)]
        self.assertEqual(list(link.table(rows, ["0"], ["websocket", "grpc"])), [
            "| loss | websocket | grpc |", "|---|---|---|", "| 0 % | 1 / 2; 3.0 | 70 / 150; 70.7 |"])

    def test_refuses_wrong_arguments(self):
        self.assertEqual(link.read_arguments(["--programs", ".", "--conditions", "10,0"]).conditions, ["10", "0"])
        for wrong in (["--transports", "pigeon"], ["--conditions", "3"], ["--seconds", "1"], ["--rounds", "0"],
                      ["--seed", "x"]):
            errors = io.StringIO()
            with self.assertRaises(SystemExit, msg=wrong), contextlib.redirect_stderr(errors):
                link.read_arguments(["--programs", ".", *wrong])
            self.assertIn(f"argument {wrong[0]}: ", errors.getvalue())


if __name__ == "__main__":
    unittest.main()
