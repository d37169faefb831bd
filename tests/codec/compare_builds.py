#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Whatever compiles codec 2, for whatever processor: it writes the golden packets as they are, and reads them alike.

Run from the project's root with the directory of zstd's sources (lib/ of its release), which codec 1 needs. Takes minutes.
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
    "gcc without optimisation": (["g++", "-O0"], "gcc", []),
    "gcc for this processor": (["g++", "-O3", "-march=native"], "gcc", []),
    "clang": (["clang++", "-O1"], "clang", []),
    "clang for this processor": (["clang++", "-O3", "-march=native"], "clang", []),
    "gcc for arm64": (["aarch64-linux-gnu-g++", "-O2"], "aarch64-linux-gnu-gcc",
                      ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"]),
}
SOURCES = glob.glob("proto/codec/*.cpp") + glob.glob("proto/codec/*/*.cpp") + [
    "tests/codec/%s.cpp" % name for name in ("cut_grid", "golden", "motion", "write_golden_packets")]


def compile_all(compiler, sources, options, folder):
    def one(source):
        target = os.path.join(folder, source.replace("/", "_") + ".o")
        subprocess.run(compiler + options + ["-c", source, "-o", target], check=True)
        return target

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(one, sources))


def differences(written):
    """Files of codec 2 that are not as they are in tests/golden; those of codec 1 are as zstd's version makes them."""
    different = []
    for stream in json.load(open("tests/golden/streams.json")):
        if stream["codec"] != 2:
            continue
        different += [packet["file"] for packet in stream["packets"]
                      if not filecmp.cmp("tests/golden/" + packet["file"], written + packet["file"], shallow=False)]
        other = next(s for s in json.load(open(written + "streams.json")) if s["name"] == stream["name"])
        different += [stream["name"]] if other != stream else []
    return different


def check(name, zstd):
    (compiler, c_compiler, runner) = BUILDS[name]
    for program in [compiler[0], c_compiler] + runner[:1]:
        if shutil.which(program) is None:
            return "there is no %s: install it (./dev test --long does)" % program
    with tempfile.TemporaryDirectory() as folder:
        # These are headers alone, the same for every processor.
        headers = os.path.join(folder, "headers")
        os.mkdir(headers)
        for library in "simde", "nlohmann", "fmt":
            os.symlink("/usr/include/" + library, os.path.join(headers, library))
        objects = compile_all(compiler, SOURCES, ["-std=c++20", "-ffp-contract=off", "-DFMT_HEADER_ONLY", "-I.", "-I" + zstd,
                                                  "-isystem", headers], folder)
        zstd_sources = [source for part in ("common", "compress", "decompress") for source in glob.glob(zstd + "/%s/*.c" % part)]
        objects += compile_all([c_compiler, "-O1", "-DZSTD_DISABLE_ASM=1"], zstd_sources, [], folder)
        program = os.path.join(folder, "write_golden_packets")
        subprocess.run(compiler[:1] + objects + ["-o", program, "-pthread"], check=True)
        os.makedirs(os.path.join(folder, "tests/golden"))
        subprocess.run(runner + [program], cwd=folder, check=True)
        different = differences(os.path.join(folder, "tests/golden/"))
        return "other than they are: " + " ".join(different) if different else None


def main():
    if len(sys.argv) != 2 or not os.path.isfile(sys.argv[1] + "/zstd.h"):
        sys.exit("usage: compare_builds.py DIRECTORY, zstd's lib/")
    failed = False
    for name in BUILDS:
        problem = check(name, sys.argv[1])
        failed = failed or problem is not None
        print("%s: %s" % (name, problem or "the same bits"), flush=True)
    sys.exit(failed)


if __name__ == "__main__":
    main()
