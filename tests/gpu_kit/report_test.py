#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Tests of gpu-kit-report: what it says about the output of steps, compared with the committed figures.

  report_test.py PROGRAM
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
RESULTS = ROOT / "tests" / "bench" / "results"
PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()

TICK = {"suite": "price", "method": "air", "size": 16, "iterations": 20, "tick_ms": 2.0, "device": "Some GPU"}
STATE = {"suite": "doctor", "topic": "acceptance", "level": "ok", "text": "flag: right", "scene": "flag"}
TESTS = """[ RUN      ] Solve.Reaches
[       OK ] Solve.Reaches (12 ms)
[  SKIPPED ] Solve.Waits (0 ms)
[  FAILED  ] Solve.Moves, where GetParam() = 3 (5 ms)
[==========] 3 tests from 1 test suite ran. (17 ms total)
[  FAILED  ] Solve.Moves, where GetParam() = 3
"""


def printed(*rows):
    """What clothstream-bench --json prints."""
    return "[\n  " + ",\n  ".join(map(json.dumps, rows)) + "\n]\n"


class Report(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.out, self.kept = pathlib.Path(folder.name, "out"), pathlib.Path(folder.name, "kept")
        (self.out / "steps").mkdir(parents=True)
        self.keep("some_gpu", [TICK])

    def keep(self, name, rows):
        (self.kept / name).mkdir(parents=True)
        (self.kept / name / "run.json").write_text(json.dumps({"machine": "x", "commit": "abc", "date": "1 May 2026"}))
        (self.kept / name / "price.json").write_text(json.dumps(rows))

    def report(self, *steps, against=None):
        """Status and text for steps, each with its name, state and output."""
        (self.out / "steps.txt").write_text("".join(f"{name} {state} 3\n" for name, state, _ in steps))
        for name, _, output in steps:
            (self.out / "steps" / f"{name}.txt").write_text(output)
        result = subprocess.run([PROGRAM, self.out, self.kept, *(["--against", against] if against else []), "--commit",
                                 "def", "--date", "2 May 2026"], capture_output=True, text=True)
        self.assertLess(result.returncode, 2, result.stderr)
        return result.returncode, result.stdout

    def test_names_times_that_grew_noticeably(self):
        slow = printed(TICK | {"tick_ms": 3.0}, TICK | {"size": 32})
        status, text = self.report(("price", "complete", slow))
        self.assertEqual(status, 0)
        self.assertIn("price: method air, size 16, iterations 20: tick_ms was 2 and is 3, 1.50 times the time", text)
        self.assertIn("of 1 figures 1 are slower and 0 faster", text)
        _, text = self.report(("price", "complete", printed(TICK | {"tick_ms": 2.4})))
        self.assertIn("of 1 figures 0 are slower", text)

    def test_compares_rates_the_other_way_round(self):
        row = {"suite": "enforcement", "nodes": 256, "workgroups": "one", "framesPerSecond": 100.0, "device": "Some GPU"}
        (self.kept / "some_gpu" / "enforcement.json").write_text(json.dumps([row]))
        _, text = self.report(("enforcement", "complete", printed(row | {"framesPerSecond": 50.0})))
        self.assertIn("framesPerSecond was 100 and is 50, 2.00 times the time", text)

    def test_compares_equal_cases_in_their_order(self):
        (self.kept / "some_gpu" / "price.json").write_text(json.dumps([TICK, TICK | {"tick_ms": 8.0}]))
        _, text = self.report(("price", "complete", printed(TICK, TICK | {"tick_ms": 9.0})))
        self.assertIn("of 2 figures 0 are slower and 0 faster", text)

    def test_compares_with_another_device_only_if_asked(self):
        other = printed(TICK | {"device": "Another GPU"})
        self.assertIn("no committed figures of Another GPU; --against compares with those of some_gpu",
                      self.report(("price", "complete", other))[1])
        self.assertIn("of 1 figures", self.report(("price", "complete", other), against="some_gpu")[1])

    def test_fails_for_a_wrong_state(self):
        status, text = self.report(("doctor", "complete", printed(STATE)))
        self.assertEqual(status, 0)
        self.assertIn("1 of 1 scenes", text)
        wrong = STATE | {"level": "problem", "text": "flag: 1 instead of 2"}
        status, text = self.report(("doctor", "failed", printed(wrong, STATE)))
        self.assertEqual(status, 1)
        self.assertIn("flag: 1 instead of 2", text)
        self.assertIn("1 of 2 scenes", text)

    def test_fails_for_a_failed_test(self):
        status, text = self.report(("test", "failed", TESTS))
        self.assertEqual(status, 1)
        self.assertIn("FAILED   Solve.Moves\n", text)
        self.assertIn("1 passed, 1 failed, 1 skipped", text)

    def test_counts_whole_rows_of_a_step_cut_short(self):
        cut = printed(TICK, TICK | {"size": 32})[:-20]
        status, text = self.report(("price", "cut_short", cut), ("paper", "not_run", ""))
        self.assertEqual(status, 0)
        self.assertIn("price was cut short after 3 s", text)
        self.assertIn("not run  paper", text)
        self.assertEqual(json.loads((self.out / "price.json").read_text()), [TICK])

    def test_knows_the_times_of_every_step(self):
        rows = [{"suite": suite, "device": "Some GPU"} for suite in suites_of_steps()]
        self.assertIn("of 0 figures", self.report(("all", "complete", printed(*rows)))[1])

    def test_writes_files_like_the_committed_ones(self):
        machine = {"suite": "doctor", "topic": "machine", "text": "Some GPU, driver 1"}
        self.report(("doctor", "complete", printed(machine)), ("price", "complete", printed(TICK)))
        run = json.loads((self.out / "run.json").read_text())
        self.assertEqual((run["machine"], run["commit"], run["date"]), ("Some GPU, driver 1", "def", "2 May 2026"))
        self.assertEqual(json.loads((self.out / "price.json").read_text()), [TICK])


def suites_of_steps():
    steps = (pathlib.Path(__file__).parent / "steps").read_text()
    return set(re.findall(r"\|clothstream-bench (\w+) ", steps))


class CommittedFigures(unittest.TestCase):
    def test_are_all_compared(self):
        for folder in filter(pathlib.Path.is_dir, RESULTS.iterdir()):
            with tempfile.TemporaryDirectory() as out:
                steps, kept = pathlib.Path(out, "steps"), pathlib.Path(out, "kept")
                steps.mkdir()
                kept.mkdir()
                (kept / folder.name).symlink_to(folder)
                suites = [file for file in folder.glob("*.json") if file.name != "run.json"]
                rows = 0
                for file in suites:
                    of_suite = json.loads(file.read_text())
                    rows += len(of_suite)
                    (steps / f"{file.stem}.txt").write_text(printed(*of_suite))
                pathlib.Path(out, "steps.txt").write_text("".join(f"{file.stem} complete 1\n" for file in suites))
                result = subprocess.run([PROGRAM, out, kept, "--commit", "x", "--date", "x"], capture_output=True, text=True)
                self.assertEqual(result.returncode, 0, result.stderr)
                figures = re.search(r"of (\d+) figures 0 are slower and 0 faster", result.stdout)
                self.assertGreaterEqual(int(figures[1]), rows, result.stdout)

    def test_are_measured_by_the_steps(self):
        measured = suites_of_steps()
        kept = {file.stem for file in RESULTS.glob("*/*.json")} - {"run"}
        tables = re.findall(r"^<!-- report: (\w+)_on_\w+ -->$", (ROOT / "docs" / "gpu-kernels.md").read_text(),
                            re.MULTILINE)
        self.assertEqual((kept | set(tables)) - measured, set())


if __name__ == "__main__":
    unittest.main(verbosity=2)
