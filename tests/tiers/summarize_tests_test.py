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
FAILED_GOOGLE_TEST = """\
[  FAILED  ] Channel.CarriesFrames (3 ms)
[==========] 5 tests from 1 test suite ran. (3 ms total)
[  PASSED  ] 3 tests.
[  FAILED  ] 2 tests, listed below:
[  FAILED  ] Channel.CarriesFrames
[  FAILED  ] Channel.Ends
"""
FAILED_UNITTEST = """\
test_moves (__main__.Directory.test_moves) ... skipped 'there is no nats-server'
test_reads (__main__.Directory.test_reads) ... FAIL
test_ends (__main__.Directory.test_ends) ... ERROR
test_grows (__main__.Directory.test_grows) ... expected failure
test_writes (__main__.Directory.test_writes) ... ok
----------------------------------------------------------------------
Ran 5 tests in 0.010s

FAILED (failures=1, errors=1, skipped=1, expected failures=1)
"""
# Two classes, of which one is skipped as a whole, and a part of a test.
UNITTEST_OF_CLASSES = """\
setUpClass (__main__.Directory) ... skipped 'there is no nats-server'
test_reads (__main__.File.test_reads) ... ok
test_writes (__main__.File.test_writes) ...\x20
  test_writes (__main__.File.test_writes) (kind='fifo') ... skipped 'there is no fifo'
----------------------------------------------------------------------
Ran 2 tests in 0.010s

OK (skipped=2)
"""
NODE = """\
ok 1 - the cloth moves
ok 2 - another device joins # SKIP this machine has no address in a network
ok 3 - the cloth tears # SKIP test name does not match pattern
# tests 2
# pass 1
# skipped 1
"""
FAILED_NODE = "# tests 3\n# pass 1\n# fail 2\n"
FAILED_VITEST = " Test Files  1 failed | 2 passed (3)\n      Tests  1 failed | 5 passed (6)\n"
FAILED_PYTEST = "========= 1 failed, 2 passed in 0.12s =========\n"


def suite(output, status="run", not_run=None):
    """A suite as ctest writes it. `not_run` is ctest's reason for which it did not run, or ended as skipped."""
    inner = f'<skipped message="{not_run}"/>' if not_run else ""
    status = "notrun" if not_run else status
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

    def test_counts_single_tests_of_a_suite_that_failed(self):
        self.assertEqual(self.last_line(suite(FAILED_GOOGLE_TEST, "fail")), "3 passed, 2 failed, 0 skipped")
        self.assertEqual(self.last_line(suite(FAILED_UNITTEST, "fail")), "2 passed, 2 failed, 1 skipped")
        self.assertEqual(self.last_line(suite(FAILED_NODE, "fail")), "1 passed, 2 failed, 0 skipped")
        self.assertEqual(self.last_line(suite(FAILED_VITEST, "fail")), "5 passed, 1 failed, 0 skipped")
        self.assertEqual(self.last_line(suite(FAILED_PYTEST, "fail")), "2 passed, 1 failed, 0 skipped")
        self.assertEqual(self.last_line(suite("Segmentation fault", "fail")), "0 passed, 1 failed, 0 skipped")
        # The time was over after the last test.
        self.assertEqual(self.last_line(suite("[  PASSED  ] 4 tests.", "fail")), "4 passed, 1 failed, 0 skipped")

    def test_counts_tests_that_a_skipped_class_does_not_run(self):
        self.assertEqual(self.last_line(suite(UNITTEST_OF_CLASSES)), "2 passed, 0 failed, 2 skipped")
        only = "setUpClass (__main__.Directory) ... skipped 'no server'\nRan 0 tests in 0.000s\n\nOK (skipped=1)\n"
        self.assertEqual(self.last_line(suite(only)), "0 passed, 0 failed, 1 skipped")

    def test_counts_a_suite_that_did_not_run(self):
        self.assertEqual(self.last_line(suite("skipped: there is no chromium", not_run="SKIP_RETURN_CODE=77")),
                         "0 passed, 0 failed, 1 skipped")
        self.assertEqual(self.last_line(suite("", status="disabled")), "0 passed, 0 failed, 1 skipped")
        for reason in ("Unable to find executable", "Fixture dependency failed", "Required Files Missing"):
            self.assertEqual(self.last_line(suite("", not_run=reason)), "0 passed, 1 failed, 0 skipped")

    def test_prints_each_reason_with_its_count(self):
        result = summarize(suite(GOOGLE_TEST), suite(GOOGLE_TEST), ci=False)
        self.assertIn("    2  there is no nats-server (apt install nats-server)", result.stdout)
        self.assertEqual(result.returncode, 0)

    def test_fails_in_ci_for_a_reason_that_is_not_accepted(self):
        self.assertEqual(summarize(suite(GOOGLE_TEST), ci=True).returncode, 1)
        self.assertEqual(summarize(suite("", not_run="SKIP_RETURN_CODE=77"), ci=True).returncode, 1)
        self.assertEqual(summarize(suite(NODE), ci=True).returncode, 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
