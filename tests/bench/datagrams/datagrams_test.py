# SPDX-License-Identifier: MIT
"""What datagrams.py makes of the figures of servers and load tests, and what it accepts."""
import unittest

import datagrams

GOOD = {"hashMismatches": 0, "decodeErrors": 0, "joined": 4, "lost": 0, "withDatagrams": 4, "slowestFramesPerSecond": 70,
        "medianFramesPerSecond": 72}


def cost_row(transport, viewers, cpu_seconds, resident_kb, packets):
    frames = 720 * viewers
    return {"figure": "cost", "transport": transport, "viewers": viewers, "seconds": 10, "cpuSeconds": cpu_seconds,
            "residentKb": resident_kb, "frames": frames, "packets": packets * frames, "pieceBytes": packets * frames * 1000,
            "mbitPerSecond": 8e-6 * 2000 * 72 * viewers, "framesPerSecond": 72}


class DatagramsBench(unittest.TestCase):
    def test_leaves_out_the_device(self):
        threads = {1: ("device", 5.0), 2: ("web", 1.0), 3: ("datagrams", 0.5)}
        self.assertEqual(datagrams.transport_seconds(threads), 1.5)

    def test_reads_resident_memory(self):
        self.assertEqual(datagrams.resident_kb("0-1 ---p [rollup]\nRss:   34048 kB\nPss:  1 kB\n"), 34048)

    def test_cost_is_of_more_viewers(self):
        one = datagrams.cost(cost_row("native", 1, 0.1, 1000, 3), cost_row("native", 101, 0.1 + 720 * 100 * 20e-6, 9000, 3))
        self.assertAlmostEqual(one["microseconds"], 20)
        self.assertEqual(one["kilobytes"], 80)
        self.assertAlmostEqual(one["wireRatio"], 3 * 1065 / 2000)

    def test_table_compares_with_websocket(self):
        rows = [cost_row(transport, viewers, 720 * viewers * us * 1e-6, 100 * viewers, packets)
                for transport, us, packets in (("websocket", 20, 0), ("native", 30, 3))
                for viewers in (datagrams.FEW, datagrams.MANY)]
        rows.append({"figure": "first", "transport": "native", "firstFrameMs": [1, 3, 2], "firstDatagramFrameMs": [7]})
        header, _, web, native = datagrams.table(rows, ["websocket", "native"])
        self.assertEqual(header.count("|"), native.count("|"))
        self.assertEqual(web, "| websocket | 20.0 | 1.00 | 100 |  |  |  |  |  |  |")
        self.assertEqual(native, "| native | 30.0 | 1.50 | 100 | 1.60 |  |  |  | 2 | 7 |")

    def test_checks_that_all_were_served(self):
        datagrams.check(GOOD, 4, "native")
        datagrams.check({**GOOD, "decodeErrors": 3}, 4, "browser")
        for name, wrong in (("hashMismatches", 1), ("joined", 3), ("lost", 1), ("withDatagrams", 3),
                            ("slowestFramesPerSecond", 35)):
            with self.assertRaises(datagrams.ProgramFailed, msg=name):
                datagrams.check({**GOOD, name: wrong}, 4, "native")
        for wrong in (GOOD, {**GOOD, "withDatagrams": 0, "decodeErrors": 1}):
            with self.assertRaises(datagrams.ProgramFailed):
                datagrams.check(wrong, 4, "websocket")


if __name__ == "__main__":
    unittest.main()
