#!/usr/bin/env python3
"""Tests of cmake/summarize_tests.py: it counts single tests, prints why some were skipped, and fails in CI for a reason
that is not accepted."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
from xml.sax.saxutils import escape

SUMMARIZE = pathlib.Path(__file__).resolve().parents[2] / "cmake" / "summarize_tests.py"

GOOGLE_TEST = """\
Running main() from gmock_main.cc
/tests/fleet/channel_test.cpp:24: Skipped
there is no nats-server (apt install nats-server)
[  SKIPPED ] Channel.CarriesFrames
[==========] 5 tests from 1 test suite ran. (3 ms total)
[  PASSED  ] 4 tests.
[  SKIPPED ] 1 test, listed below:
"""
UNITTEST = """\
test_moves (__main__.Directory) ... skipped 'there is no nats-server'
test_reads (__main__.Directory) ... ok
----------------------------------------------------------------------
Ran 2 tests in 0.010s

OK (skipped=1)
"""
NODE = """\
ok 1 - the cloth moves
ok 2 - another device joins # SKIP this machine has no address in a network
ok 3 - the cloth tears # SKIP test name does not match pattern
# tests 2
# pass 1
# skipped 1
"""


def suite(output, status="run", skipped=False):
    inner = '<skipped message=""/>' if skipped else ""
    return f'<testcase name="x" status="{status}">{inner}<system-out>{escape(output)}</system-out></testcase>'


def summarize(*suites, ci):
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "tests.xml").write_text(f"<testsuite>{''.join(suites)}</testsuite>", encoding="utf-8")
        return subprocess.run([sys.executable, "-B", SUMMARIZE, folder], capture_output=True, text=True, check=False,
                              env=os.environ | {"CI": "true" if ci else ""})


class SummarizeTests(unittest.TestCase):
    def last_line(self, *suites):
        return summarize(*suites, ci=False).stdout.splitlines()[-1]

    def test_counts_single_tests_of_each_runner(self):
        self.assertEqual(self.last_line(suite(GOOGLE_TEST)), "4 passed, 0 failed, 1 skipped")
        self.assertEqual(self.last_line(suite(UNITTEST)), "1 passed, 0 failed, 1 skipped")
        self.assertEqual(self.last_line(suite(NODE)), "1 passed, 0 failed, 1 skipped")
        self.assertEqual(self.last_line(suite("a script that counts nothing")), "1 passed, 0 failed, 0 skipped")

    def test_counts_a_suite_that_failed_or_was_skipped(self):
        self.assertEqual(self.last_line(suite("", status="fail"), suite("skipped: there is no chromium", skipped=True)),
                         "0 passed, 1 failed, 1 skipped")

    def test_prints_each_reason_with_its_count(self):
        result = summarize(suite(GOOGLE_TEST), suite(GOOGLE_TEST), ci=False)
        self.assertIn("    2  there is no nats-server (apt install nats-server)", result.stdout)
        self.assertEqual(result.returncode, 0)

    def test_fails_in_ci_for_a_reason_that_is_not_accepted(self):
        self.assertEqual(summarize(suite(GOOGLE_TEST), ci=True).returncode, 1)
        self.assertEqual(summarize(suite("", skipped=True), ci=True).returncode, 1)
        self.assertEqual(summarize(suite(NODE), ci=True).returncode, 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
