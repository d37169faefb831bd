#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Tests of the kit for GPUs: it is small, needs nothing of the build, and its script keeps its promises.

  kit_test.py BUILD
"""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BUILD = pathlib.Path(sys.argv.pop(1)).resolve()
# Programs that a machine must have, in addition to a driver.
TOOLS = ("sh", "cat", "date", "dirname", "env", "mkdir", "timeout")
MOST_BYTES = 60_000_000

# Mounts empty folders over the arguments before `--`, and runs what follows.
HIDE = 'while [ "$1" != -- ]; do mount -t tmpfs none "$1" || exit; shift; done; shift; exec "$@"'


def make_kit(folder):
    kit = folder / "kit"
    subprocess.run([HERE / "make_kit.sh", BUILD, kit], check=True, stdout=subprocess.DEVNULL)
    return kit


def machine(folder):
    """Environment of a machine with these tools alone."""
    tools = folder / "tools"
    tools.mkdir()
    for tool in TOOLS:
        (tools / tool).symlink_to(shutil.which(tool))
    return {"PATH": str(tools)}


def hidden():
    """Command that hides the sources, the build and the network from the program after it, as far as this is allowed."""
    unshare = ["unshare", "--mount", "--net", *([] if os.getuid() == 0 else ["--map-root-user"])]
    # A build inside the sources is hidden with them.
    folders = [str(ROOT)] + [str(BUILD)] * (not BUILD.is_relative_to(ROOT))
    command = [*unshare, "sh", "-c", HIDE, "sh", *folders, "--"]
    allowed = subprocess.run([*command, "true"], cwd="/", stderr=subprocess.DEVNULL).returncode == 0
    if not allowed:
        print("namespaces are not permitted here: the sources and the build are not hidden")
    return command if allowed else []


class Kit(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.kit = make_kit(cls.folder)
        cls.environment = machine(cls.folder)

    def setUp(self):
        self.out = self.folder / self.id()

    def test_has_at_most_60_megabytes(self):
        self.assertLess(sum(file.lstat().st_size for file in self.kit.rglob("*")), MOST_BYTES)

    def test_needs_only_the_c_library(self):
        files = [*self.kit.glob("bin/*"), *self.kit.glob("lib/*.so*"), *self.kit.glob("lib/loader/*")]
        listing = subprocess.run(["ldd", *files], env=os.environ | {"LD_LIBRARY_PATH": self.kit / "lib"},
                                 capture_output=True, text=True, check=True).stdout
        self.assertNotIn("not found", listing)
        paths = {line.split()[2] for line in listing.splitlines() if "=> /" in line}
        parts_of_libc = {file.name for file in self.kit.glob("lib/libc/*")}
        self.assertEqual({path for path in paths if not pathlib.Path(path).is_relative_to(self.kit)
                          and pathlib.Path(path).name not in parts_of_libc}, set())

    def test_starts_with_its_own_c_library(self):
        lib = self.kit / "lib"
        subprocess.run([lib / "libc" / "ld.so", "--library-path", f"{lib / 'libc'}:{lib}",
                        self.kit / "bin" / "clothstream-bench", "--help"], check=True, stdout=subprocess.DEVNULL)

    def test_runs_with_a_driver_alone(self):
        command = [*hidden(), shutil.which("env"), "-i", *(f"{name}={text}" for name, text in self.environment.items()),
                   self.kit / "run", "--quick", "--out", self.out]
        result = subprocess.run(command, cwd="/", stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertIn("1 of 1 scenes have the state", result.stdout)
        run = json.loads((self.out / "run.json").read_text())
        self.assertEqual({step["state"] for step in run["steps"]}, {"complete"}, result.stdout)
        self.assertGreater(run["tests"]["passed"], 5)
        self.assertEqual(run["tests"]["failed"], [])
        for suite in ("doctor", "enforcement", "mass_spring"):
            self.assertTrue(json.loads((self.out / f"{suite}.json").read_text()), suite)
        # Scenes that share a tick share its barriers, and a few allocations of memory.
        one, four = json.loads((self.out / "batch.json").read_text())
        self.assertEqual((one["scenes"], four["scenes"]), (1, 4))
        self.assertEqual(one["barriers"], four["barriers"])
        self.assertLess(four["deviceAllocations"], 64)

    def test_keeps_what_it_has_when_interrupted(self):
        process = subprocess.Popen([self.kit / "run", "--out", self.out], cwd="/", env=self.environment,
                                   stdout=subprocess.PIPE, text=True)
        self.assertIn("doctor, at most", process.stdout.readline())
        process.send_signal(signal.SIGINT)
        text, _ = process.communicate(timeout=120)
        self.assertEqual(process.returncode, 130, text)
        states = {step["name"]: step["state"] for step in json.loads((self.out / "run.json").read_text())["steps"]}
        self.assertEqual(states.pop("doctor"), "cut_short")
        self.assertEqual(set(states.values()), {"not_run"})


# A kit whose only program is a script: `rows` prints a row, `slow` prints one and goes on, `wrong` fails.
STUB = """#!/bin/sh
case $1 in
  rows | slow | wrong) printf '[\\n  {"suite":"price","method":"%s","size":1,"iterations":1,"tick_ms":1}' "$1" ;;
esac
case $1 in
  slow) sleep 60 ;;
  wrong) exit 1 ;;
  nothing) echo 'there is no device' >&2; exit 1 ;;
esac
"""


class Script(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.kit = pathlib.Path(folder.name, "a kit")
        (self.kit / "bin").mkdir(parents=True)
        shutil.copy(HERE / "run", self.kit)
        for device in (ROOT / "tests" / "bench" / "results").glob("*/"):
            if device.is_dir():  # before Python 3.11 the pattern finds files, too
                shutil.copytree(device, self.kit / "kept" / device.name)
        (self.kit / "commit").write_text("abc\n")
        (self.kit / "bin" / "gpu-kit-report").symlink_to(BUILD / "bin" / "gpu-kit-report")
        (self.kit / "bin" / "clothstream-bench").write_text(STUB)
        (self.kit / "bin" / "clothstream-bench").chmod(0o755)
        self.out = self.kit / "out"

    def run_steps(self, *steps, options=()):
        (self.kit / "steps").write_text("# steps\n" + "".join(f"{step}\n" for step in steps))
        return subprocess.run([self.kit / "run", "--out", self.out, *options], capture_output=True, text=True)

    def test_cuts_a_step_at_its_share(self):
        result = self.run_steps("a|1|clothstream-bench slow|", "b|49|clothstream-bench rows|", options=("--minutes", "1"))
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("a was cut short after", result.stdout)
        self.assertIn("b, at most 4", result.stdout)
        methods = [row["method"] for row in json.loads((self.out / "price.json").read_text())]
        self.assertEqual(methods, ["slow", "rows"])

    def test_runs_only_short_commands_if_quick(self):
        result = self.run_steps("a|1|clothstream-bench rows|", "b|1|clothstream-bench slow|clothstream-bench rows",
                                options=("--quick",))
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertEqual((self.out / "steps.txt").read_text().split()[:2], ["b", "complete"])

    def test_fails_if_a_step_fails(self):
        result = self.run_steps("a|1|clothstream-bench rows|", "b|1|clothstream-bench wrong|")
        self.assertEqual(result.returncode, 1)
        self.assertIn("FAILED   b", result.stdout)

    def test_says_that_there_is_no_device(self):
        result = self.run_steps("a|1|clothstream-bench nothing|", "b|1|clothstream-bench rows|")
        self.assertEqual(result.returncode, 2)
        self.assertIn("there is no device", result.stderr)

    def test_refuses_wrong_options(self):
        for options in (["--minutes", "0"], ["--minutes", "601"], ["--minutes", "x"], ["--minutes"], ["--fast"],
                        ["--against", "none"]):
            result = self.run_steps("a|1|clothstream-bench rows|", options=options)
            self.assertEqual(result.returncode, 2, options)
            self.assertIn(options[0], result.stderr)

    def test_leaves_earlier_results(self):
        self.assertEqual(self.run_steps("a|1|clothstream-bench rows|").returncode, 0)
        self.assertEqual(self.run_steps("a|1|clothstream-bench rows|").returncode, 2)


if __name__ == "__main__":
    unittest.main(verbosity=2)
