#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Builds of the codec by several compilers and for several processors write and read identical golden packets.

Run it from the project's root. It takes minutes.
"""
import concurrent.futures
import filecmp
import glob
import json
import os
import shutil
import subprocess
import sys
import tempfile

BUILDS = {
    "gcc without optimisation": (["g++", "-O0"], []),
    "gcc for this processor": (["g++", "-O3", "-march=native"], []),
    "gcc without vectors": (["g++", "-O2", "-fwrapv", "-DSIMDE_NO_NATIVE"], []),
    "clang": (["clang++", "-O1"], []),
    "clang for this processor": (["clang++", "-O3", "-march=native"], []),
    "gcc for arm64": (["aarch64-linux-gnu-g++", "-O2"], ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"]),
}
SOURCES = glob.glob("proto/codec/*.cpp") + glob.glob("proto/codec/*/*.cpp") + [
    "tests/codec/%s.cpp" % name for name in ("cut_grid", "golden", "motion", "packet_crafter", "write_golden_packets")]


def compile_all(compiler, sources, options, folder):
    def one(source):
        target = os.path.join(folder, source.replace("/", "_") + ".o")
        subprocess.run(compiler + options + ["-c", source, "-o", target], check=True)
        return target

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(one, sources))


def differences(written):
    """Names of files that differ from tests/golden."""
    streams = json.load(open("tests/golden/streams.json"))
    names = ["streams.json"]
    for stream in streams:
        names += [packet["file"] for packet in stream["packets"]] + stream.get("refused", [])
    return [name for name in names
            if not os.path.isfile(written + name) or not filecmp.cmp("tests/golden/" + name, written + name, shallow=False)]


def check(name):
    (compiler, runner) = BUILDS[name]
    for program in compiler[:1] + runner[:1]:
        if shutil.which(program) is None:
            return "%s is missing: install it (./dev test --long does)" % program
    with tempfile.TemporaryDirectory() as folder:
        # Header-only libraries, the same for every processor.
        headers = os.path.join(folder, "headers")
        os.mkdir(headers)
        for library in "simde", "nlohmann", "fmt":
            os.symlink("/usr/include/" + library, os.path.join(headers, library))
        objects = compile_all(compiler, SOURCES, ["-std=c++20", "-ffp-contract=off", "-DFMT_HEADER_ONLY", "-I.",
                                                  "-isystem", headers], folder)
        program = os.path.join(folder, "write_golden_packets")
        subprocess.run(compiler[:1] + objects + ["-o", program, "-pthread"], check=True)
        os.makedirs(os.path.join(folder, "tests/golden"))
        subprocess.run(runner + [program], cwd=folder, check=True)
        different = differences(os.path.join(folder, "tests/golden/"))
        return "different files: " + " ".join(different) if different else None


def main():
    failed = False
    for name in BUILDS:
        problem = check(name)
        failed = failed or problem is not None
        print("%s: %s" % (name, problem or "the same bits"), flush=True)
    sys.exit(failed)


if __name__ == "__main__":
    main()
