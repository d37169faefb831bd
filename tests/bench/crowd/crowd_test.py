# SPDX-License-Identifier: MIT
"""What crowd.py makes of the figures that a server exposes."""

import argparse
import os
import threading
import unittest

import crowd


def metrics(seconds, counts):
    lines = ["# HELP clothstream_scenes Scenes of the server.", 'clothstream_build_info{device="a (b)",version="1"} 1']
    for scene, value in seconds.items():
        lines.append(f'clothstream_scene_device_seconds_sum{{scene="{scene}"}} {value}')
        lines.append(f'clothstream_scene_device_seconds_count{{scene="{scene}"}} {counts[scene]}')
    return crowd.Metrics("\n".join(lines) + "\n")


GOOD = {"hashMismatches": 0, "decodeErrors": 0, "scenesCreated": 4, "joined": 4, "lost": 0, "scenesNotDeleted": 0,
        "slowestFramesPerSecond": 1.5}


class Crowd(unittest.TestCase):
    def test_threads_have_stages(self):
        names = {"device": "device", "llvmpipe-0": "device", "publisher": "publisher", "grpc acceptor": "network",
                 "grpc_global_tim": "network", "web": "network", "scene maker": "other", "clothstream-ser": "other"}
        self.assertEqual({name: crowd.stage_of(name) for name in names}, names)

    def test_cores_are_those_of_the_time_between(self):
        before = {1: ("device", 5.0), 2: ("web", 1.0)}
        after = {1: ("device", 6.0), 2: ("web", 1.0), 3: ("grpc", 0.5), 4: ("grpc", 0.5)}
        stages, threads = crowd.cores_by_stage(before, after, 2)
        self.assertEqual(stages, {"device": 0.5, "publisher": 0, "network": 0.5, "other": 0})
        self.assertEqual(threads, {"device": 0.5, "grpc": 0.5})

    def test_reads_the_threads_of_a_process(self):
        threads = crowd.thread_seconds(os.getpid())
        name, spent = threads[threading.get_native_id()]
        self.assertTrue(name)
        self.assertGreaterEqual(spent, 0)

    def test_device_time_is_that_of_all_scenes(self):
        before = metrics({"a": 1.0}, {"a": 100})
        after = metrics({"a": 1.2, "b": 0.1}, {"a": 200, "b": 50})
        self.assertAlmostEqual(crowd.device_seconds_of_tick(before, after), 0.003)
        self.assertEqual(after.device(), "a (b)")
        with self.assertRaises(SystemExit):
            crowd.device_seconds_of_tick(after, after)

    def test_checks_what_viewers_received(self):
        crowd.check(GOOD, 4)
        for name, wrong in (("hashMismatches", 1), ("joined", 3), ("lost", 1), ("scenesNotDeleted", 1),
                            ("slowestFramesPerSecond", 0)):
            with self.assertRaises(SystemExit, msg=name):
                crowd.check({**GOOD, name: wrong}, 4)

    def test_refuses_bad_numbers(self):
        self.assertEqual(crowd.numbers("1,64"), [1, 64])
        for text in ("", "0", "1001", "four", "1,,2"):
            with self.assertRaises(argparse.ArgumentTypeError, msg=text):
                crowd.numbers(text)
        for text in ("1", "x", "4000"):
            with self.assertRaises(argparse.ArgumentTypeError, msg=text):
                crowd.seconds_of(text)


if __name__ == "__main__":
    unittest.main()
