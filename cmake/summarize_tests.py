#!/usr/bin/env python3
"""Prints what ctest does not say: how many single tests passed, failed and were skipped, and why they were skipped.

Usage: summarize_tests.py BUILD. Reads BUILD/tests.xml, which ctest --output-junit wrote. The last line is
`N passed, N failed, N skipped`. With CI=true in the environment, a skipped test whose reason is not in
tests/accepted_skips.txt makes the exit status 1.
"""
import collections
import os
import pathlib
import re
import sys
import xml.etree.ElementTree

# node:test says this of tests that --test-name-pattern leaves to another suite.
NOT_CHOSEN = "test name does not match pattern"
ROOT = pathlib.Path(__file__).resolve().parent.parent
# Number of single tests that a runner reports as passed, and as failed: GoogleTest, node:test, Vitest, pytest.
PASSED = [re.compile(pattern, re.MULTILINE) for pattern in (
    r"^\[  PASSED  \] (\d+) tests?\.", r"^(?:#|ℹ) pass (\d+)", r"^ +Tests .*?(\d+) passed",
    r"^(?:=+ )?(?:\d+ failed, )?(\d+) passed")]
FAILED = [re.compile(pattern, re.MULTILINE) for pattern in (
    r"^\[  FAILED  \] (\d+) tests?, listed below:", r"^(?:#|ℹ) fail (\d+)", r"^ +Tests .*?(\d+) failed",
    r"^(?:=+ )?(\d+) failed")]
# unittest reports the number of tests that it ran, which includes those that failed or were skipped. Tests of a class or
# module that is skipped as a whole in its setUp are not run.
UNITTEST_RAN = re.compile(r"^Ran (\d+) tests? in", re.MULTILINE)
UNITTEST_FAILED = re.compile(r"^FAILED \(.+\)$", re.MULTILINE)
UNITTEST_FAILURES = re.compile(r"(?:\(|, )(?:failures|errors|unexpected successes)=(\d+)")
UNITTEST_SKIPPED = re.compile(r"^(?! |setUpClass |setUpModule ).*\.\.\. skipped ['\"].+['\"]$", re.MULTILINE)
# Reason of a single test that was skipped: GoogleTest (on the line after `Skipped`), unittest, node:test as TAP and in
# its other format, the scripts of this project.
REASONS = [re.compile(pattern, re.MULTILINE) for pattern in (
    r": Skipped\n(.+)$", r"\.\.\. skipped ['\"](.+)['\"]$", r"^ *ok \d+ .*# SKIP (.+)$", r"^ *﹣ .*# (.+)$", r"^skipped: (.+)$")]


def accepted():
    """Patterns of reasons that CI accepts: the lines of tests/accepted_skips.txt that are not comments."""
    lines = (ROOT / "tests" / "accepted_skips.txt").read_text(encoding="utf-8").splitlines()
    return [re.compile(line) for line in lines if line and not line.startswith("#")]


def count(patterns, output):
    """Sum of the numbers that these patterns find; None if they find none."""
    counts = [int(number) for pattern in patterns for number in pattern.findall(output)]
    return sum(counts) if counts else None


def read(suite):
    """Returns the number of single tests that passed and failed in a suite, and the reasons of those that were skipped."""
    output = suite.findtext("system-out") or ""
    reasons = [reason.strip() for pattern in REASONS for reason in pattern.findall(output)]
    reasons = [reason for reason in reasons if reason != NOT_CHOSEN]
    skipped = suite.find("skipped")
    if suite.get("status") == "notrun" and not (skipped is not None and skipped.get("message", "").startswith("SKIP_")):
        return 0, 1, reasons  # such as a program that is not built, or a fixture that failed
    if suite.get("status") in ("notrun", "disabled"):
        return 0, 0, reasons or ["the suite gives no reason"]
    passed, failed, ran = count(PASSED, output), count(FAILED, output) or 0, count([UNITTEST_RAN], output)
    if ran is not None:
        failures = count([UNITTEST_FAILURES], "\n".join(UNITTEST_FAILED.findall(output))) or 0
        passed = (passed or 0) + max(0, ran - failures - len(UNITTEST_SKIPPED.findall(output)))
        failed += failures
    if suite.get("status") == "fail":
        return passed or 0, failed or 1, reasons
    return 1 if passed is None else passed, 0, reasons


def main():
    suites = xml.etree.ElementTree.parse(pathlib.Path(sys.argv[1]) / "tests.xml").getroot().findall("testcase")
    results = [read(suite) for suite in suites]
    skipped = collections.Counter(reason for _, _, reasons in results for reason in reasons)
    unexpected = [reason for reason in skipped if not any(pattern.fullmatch(reason) for pattern in accepted())]
    if skipped:
        print("\nSkipped tests, with the reason:")
    for reason, count in skipped.most_common():
        print(f"{count:5}  {reason}")
    status = 0
    if unexpected and os.environ.get("CI") == "true":
        print("\nCI accepts only the reasons of tests/accepted_skips.txt. Others were:", *unexpected, sep="\n  ")
        status = 1
    print(f"{sum(row[0] for row in results)} passed, {sum(row[1] for row in results)} failed, {skipped.total()} skipped")
    return status


if __name__ == "__main__":
    sys.exit(main())
