#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Measures how many scenes one server carries: `./dev bench crowd`.

Starts a server for each row. `clothstream load --scenes` creates equal scenes, each with a viewer, measures what the
viewers receive, and deletes the scenes. Meanwhile this program reads from the server

- the time of the device in a tick of all scenes, and the memory of the device, from /metrics;
- the processor time of its threads, by their names, and its memory, from /proc.

Up to 64 viewers decode every frame and compare its hash. Exits with 1 if a frame was wrong, a scene was refused or not
deleted, or a viewer was lost or got no frames. Times are printed and never judged. Viewers use the same machine as the
server: those that do not decode cost a few microseconds of a processor for each frame.
"""

import argparse
import json
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from programs import ProgramFailed, Server, wait_until  # noqa: E402

FEW, MANY = (1, 4, 16, 64), (256, 1000)
# Processors with which the large rows are measured, too, if --scenes does not say otherwise.
LARGE_MACHINE = 16
MOST_SCENES = 1000  # that a server may have
DECODERS = 64
# The load test measures this long before and after this program does.
MARGIN = 1
CLOCK_TICKS = os.sysconf("SC_CLK_TCK")
# Stages by the beginning of the names of threads. gRPC and software Vulkan name their threads themselves.
STAGES = {
    "device": ("device", "worker", "llvmpipe"),
    "publisher": ("publisher",),
    "network": ("grpc", "web", "event_engine", "default-exec", "resolver-exec"),
}
COLUMNS = {
    "scenes": ("scenes", "{:,}"),
    "deviceMs": ("device, ms a tick", "{:.2f}"),
    "deviceCores": ("cores: device", "{:.2f}"),
    "publisherCores": ("publisher", "{:.2f}"),
    "networkCores": ("network", "{:.2f}"),
    "otherCores": ("other", "{:.2f}"),
    "slowestFramesPerSecond": ("slowest frames/s", "{:.1f}"),
    "medianFramesPerSecond": ("median", "{:.1f}"),
    "ageMsP99": ("age p99, ms", "{:.1f}"),
    "firstFrameMsP99": ("first frame p99, ms", "{:.0f}"),
    "serverMb": ("memory, MB", "{:.0f}"),
    "deviceMb": ("of the device", "{:.0f}"),
}


def stage_of(thread):
    """Stage of a thread by its name."""
    return next((stage for stage, names in STAGES.items() if thread.startswith(names)), "other")


def cores_by_stage(before, after, seconds):
    """Cores in use between two readings of thread_seconds(): by stage, and by name of the threads."""
    stages = dict.fromkeys((*STAGES, "other"), 0.0)
    threads = {}
    for thread, (name, spent) in after.items():
        cores = (spent - before.get(thread, (name, 0))[1]) / seconds
        stages[stage_of(name)] += cores
        threads[name] = threads.get(name, 0) + cores
    return stages, {name: cores for name, cores in sorted(threads.items(), key=lambda item: -item[1]) if cores >= 0.001}


def thread_seconds(pid):
    """Name and processor time of each thread of a process, by its id."""
    threads = {}
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        try:
            text = (task / "stat").read_text()
        except OSError:
            continue  # it has ended
        name, fields = text[text.index("(") + 1 : text.rindex(")")], text.rsplit(")", 1)[1].split()
        threads[int(task.name)] = (name, (int(fields[11]) + int(fields[12])) / CLOCK_TICKS)
    return threads


class Metrics:
    """Samples of /metrics at one time."""

    def __init__(self, text):
        self.samples = re.findall(r"^(clothstream_\w+)(?:\{([^}]*)\})? (\S+)$", text, re.MULTILINE)

    def values(self, name):
        """Values of a metric by their labels."""
        return {labels: float(value) for metric, labels, value in self.samples if metric == name}

    def total(self, name):
        return sum(self.values(name).values())

    def device(self):
        return re.search(r'device="([^"]*)"', next(iter(self.values("clothstream_build_info"))))[1]


def device_seconds_of_tick(before, after):
    """Time of the device for one tick of all scenes, between two readings. Scenes have the same rate, and the one that
    ticked most often shows how many ticks there were."""
    spent, ticks = ({labels: value - before.values(name).get(labels, 0) for labels, value in after.values(name).items()}
                    for name in ("clothstream_scene_device_seconds_sum", "clothstream_scene_device_seconds_count"))
    most = max(ticks.values(), default=0)
    if most <= 0:
        sys.exit("the server simulated nothing while it was measured")
    return sum(spent.values()) / most


def check(result, scenes):
    """Exits unless each viewer got frames, and all frames are right."""
    wrong = result["hashMismatches"] + result["decodeErrors"]
    if wrong:
        sys.exit(f"{wrong} frames were wrong")
    for name, wanted in (("scenesCreated", scenes), ("joined", scenes), ("lost", 0), ("scenesNotDeleted", 0)):
        if result[name] != wanted:
            sys.exit(f"{name} is {result[name]}, not {wanted}")
    if result["slowestFramesPerSecond"] <= 0:
        sys.exit("a viewer got no frames")


class Crowd:
    """A server with room for a number of scenes, and the load test."""

    def __init__(self, programs, folder, scenes):
        options = ["--profile", "fleet", "--max-created-scenes", scenes, "--max-connections", 2 * scenes + 100]
        options += ["--max-load", 1_000_000, "--max-memory", 1_000_000, "--metrics-port", 0]
        self.programs, self.scenes = programs, scenes
        self.server = Server(programs / "clothstream-server", options, folder / f"server{scenes}.log")
        self.url = self.server.wait_for(r"^metrics +(\S+)")[1]

    def metrics(self):
        with urllib.request.urlopen(self.url, timeout=60) as answer:
            return Metrics(answer.read().decode())

    def measure(self, nodes, seconds, joins):
        command = [self.programs / "clothstream", "load", self.server.address, "--scenes", self.scenes, "--nodes", nodes]
        command += ["--joins", joins, "--decoders", min(self.scenes, DECODERS), "--seconds", seconds + 2 * MARGIN, "--json"]
        load = subprocess.Popen([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            row = self.watch(load, seconds)
            out, errors = load.communicate()
        finally:
            if load.poll() is None:
                load.terminate()  # it deletes its scenes
                load.wait()
        if load.returncode != 0:
            sys.exit(f"the load test failed with {load.returncode}: {errors}{out}")
        result = json.loads(out)
        check(result, self.scenes)
        ages = {"ageMsP50": result["tickAgeMsP50"], "ageMsP99": result["tickAgeMsP99"]}
        kept = ("slowestFramesPerSecond", "medianFramesPerSecond", "lateFrames", "dropped", "firstFrameMsP50", "firstFrameMsP99")
        return {**row, "nodes": nodes, **{name: result[name] for name in kept}, **ages}

    def watch(self, load, seconds):
        """Reads from the server while the load test measures."""

        def all_are_there():
            if load.poll() is not None:
                return True
            time.sleep(0.5)  # reading the metrics of many scenes takes the server some time
            return self.metrics().total("clothstream_scene_subscribers") == self.scenes

        wait_until(all_are_there, "a viewer of each scene", seconds=600)
        if load.poll() is not None:
            return {}  # its result says why
        time.sleep(MARGIN)
        pid = self.server.process.pid
        metrics = self.metrics()
        threads, start = thread_seconds(pid), time.monotonic()
        time.sleep(seconds - MARGIN)
        stages, named = cores_by_stage(threads, thread_seconds(pid), time.monotonic() - start)
        after = self.metrics()
        return {
            "suite": "crowd",
            "scenes": self.scenes,
            "device": after.device(),
            "processors": os.cpu_count(),
            "deviceMs": 1e3 * device_seconds_of_tick(metrics, after),
            **{f"{stage}Cores": cores for stage, cores in stages.items()},
            "threads": named,
            "serverMb": after.total("clothstream_process_resident_memory_bytes") / 1e6,
            "deviceMb": after.total("clothstream_device_memory_bytes") / 1e6,
        }


def print_row(cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def numbers(text):
    """Numbers of scenes, for --scenes."""
    try:
        found = [int(part) for part in text.split(",")]
    except ValueError:
        found = []
    if not found or not all(1 <= number <= MOST_SCENES for number in found):
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of numbers from 1 to {MOST_SCENES}, such as 1,4,16")
    return found


def seconds_of(text):
    try:
        seconds = float(text)
    except ValueError:
        seconds = 0
    if not 2 <= seconds <= 3600:
        raise argparse.ArgumentTypeError(f"'{text}' is not a time from 2 to 3600 s")
    return seconds


def main():
    large = (os.cpu_count() or 1) >= LARGE_MACHINE
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--programs", type=pathlib.Path, required=True, help="folder of clothstream and clothstream-server")
    parser.add_argument("--scenes", type=numbers, default=[*FEW, *(MANY if large else ())],
                        help="numbers of scenes, such as 1,4,16. Default: 1 to 64, and to 1000 with 16 processors")
    parser.add_argument("--nodes", type=int, default=1024, help="about this many nodes in each scene (default: %(default)s)")
    parser.add_argument("--seconds", type=seconds_of, default=10, help="time of each measurement (default: %(default)s)")
    parser.add_argument("--joins", type=float, default=20, help="scenes created per second (default: %(default)s)")
    parser.add_argument("--json", type=pathlib.Path, help="file for the rows")
    arguments = parser.parse_args()
    # A connection of a viewer takes a descriptor of the server and one of the load test.
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    rows = []
    print_row(title for title, _ in COLUMNS.values())
    print_row(["---"] * len(COLUMNS))
    with tempfile.TemporaryDirectory(prefix="clothstream-crowd-") as folder:
        for scenes in arguments.scenes:
            try:
                crowd = Crowd(arguments.programs, pathlib.Path(folder), scenes)
                with crowd.server:
                    row = crowd.measure(arguments.nodes, arguments.seconds, arguments.joins)
            except (AssertionError, ProgramFailed, unittest.SkipTest) as failure:
                sys.exit(str(failure))
            rows.append(row)
            print_row(form.format(row[name]) for name, (_, form) in COLUMNS.items())
            if arguments.json:
                arguments.json.write_text(json.dumps(rows, indent=2) + "\n")
    print(f"\nDevice: {rows[0]['device']}; {rows[0]['processors']} processors; scenes of about {arguments.nodes:,} nodes")


if __name__ == "__main__":
    main()
