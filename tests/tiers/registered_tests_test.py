#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Every test script is run by a test of some tier. Usage: registered_tests_test.py CTEST BUILD"""
import json
import pathlib
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]


class RegisteredTests(unittest.TestCase):
    def test_every_script_is_registered(self):
        listed = subprocess.run([CTEST, "--test-dir", BUILD, "--show-only=json-v1"], capture_output=True, text=True, check=True)
        words = [word for test in json.loads(listed.stdout)["tests"] for word in test.get("command", [])]
        # A shell script may prepare what another script needs, and run that.
        run = "\n".join(words + [pathlib.Path(word).read_text() for word in words if word.endswith("_test.sh")])
        scripts = [path for pattern in ("*_test.py", "*.test.mjs") for path in (ROOT / "tests").rglob(pattern)]
        self.assertGreater(len(scripts), 20)
        missing = [str(path.relative_to(ROOT)) for path in scripts if path.name not in run]
        self.assertEqual(missing, [])


if __name__ == "__main__":
    BUILD, CTEST = sys.argv.pop(), sys.argv.pop()
    unittest.main(verbosity=2)
