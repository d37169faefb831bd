#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Measures what frames in datagrams cost compared with WebSocket under TLS: `./dev bench datagrams`.

- A server with TLS plays a recording of `flag`, so that it simulates nothing, for one viewer and for many. Differences
  between the two say what a frame costs for one more viewer: processor time of the server, resident memory, and bytes in
  packets. Transports alternate.
- 200 viewers watch two small scenes of one server.
- A client joins over a link of 25 ms each way (tests/link), and notes when the first frame arrives, and the first one in
  datagrams.

Exits with 1 if a viewer was refused or lost, frames were wrong, or one viewer got less than half of the frames. Times are
printed and never judged. Server and viewers share this machine, where the time of the kernel to deliver a packet counts for
its sender.
"""

import argparse
import functools
import json
import os
import pathlib
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request

FOLDER = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER.parents[1] / "support"), str(FOLDER.parent / "crowd"), str(FOLDER.parent / "link")]
from crowd import Metrics, stage_of, thread_seconds  # noqa: E402
from link import choice, number  # noqa: E402
from network_link import CLIENT, SERVER, NetworkLink  # noqa: E402
from programs import ProgramFailed, Server, wait_until  # noqa: E402

# Arguments of `clothstream load`. WebSocket is what the others are compared with, and the stream next to datagrams.
TRANSPORTS = {
    "websocket": ["--transport", "tcp"],
    "native": ["--transport", "datagrams"],
    "browser": ["--transport", "datagrams", "--sctp"],
}
FEW, MANY = 1, 120
CROWD, CROWD_SCENES, CROWD_NODES = 200, 2, 1024  # one scene has room for 135 viewers
RECORDED = 10  # s
DELAY_MS = 25
JOINS = 5  # over the link, for each round
MARGIN = 1  # s; the load test measures this long before and after this program does
# Bytes of a packet in addition to its datagram: IPv4, UDP, a DTLS record with nonce and tag; SCTP with a DATA chunk.
HEADERS = {"native": 20 + 8 + 37, "browser": 20 + 8 + 37 + 28}
COUNTERS = {"frames": "clothstream_scene_taken_frames_total", "packets": "clothstream_datagram_packets_total",
            "pieceBytes": "clothstream_datagram_bytes_total", "fallbacks": "clothstream_datagram_fallbacks_total",
            "repeats": "clothstream_datagram_repeats_total"}


def certificate(folder, address):
    """Options of a server. Programs that this one starts trust the certificate from now on."""
    key, file = folder / "key.pem", folder / "certificate.pem"
    make = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "1", "-subj",
            "/CN=localhost", "-addext", f"subjectAltName=IP:{address}"]
    subprocess.run([*make, "-keyout", key, "-out", file], check=True, stderr=subprocess.DEVNULL)
    os.environ["SSL_CERT_FILE"] = str(file)
    return ["--tls-certificate", file, "--tls-key", key]


def transport_seconds(threads):
    """Processor time of all threads but those of the device."""
    return sum(spent for name, spent in threads.values() if stage_of(name) != "device")


def resident_kb(rollup):
    """From the text of /proc/PID/smaps_rollup."""
    return int(re.search(r"^Rss: +(\d+) kB", rollup, re.MULTILINE)[1])


def kept(result):
    """Figures of a load test that rows keep."""
    names = ("framesPerSecond", "slowestFramesPerSecond", "mbitPerSecond", "dropped", "tickAgeMsP50", "tickAgeMsP99", "datagrams")
    return {name: result[name] for name in names}


def check(result, viewers, transport):
    """Raises ProgramFailed unless all viewers of a load test were served."""
    # With datagrams, a frame that nothing repaired is lost, and those that refer to it are not decoded.
    wrong = result["hashMismatches"] + (result["decodeErrors"] if transport == "websocket" else 0)
    if wrong:
        raise ProgramFailed(f"{wrong} frames were wrong")
    if (result["joined"], result["lost"]) != (viewers, 0):
        raise ProgramFailed(f"{result['joined']} of {viewers} viewers joined, and {result['lost']} were lost")
    if result["withDatagrams"] != (0 if transport == "websocket" else viewers):
        raise ProgramFailed(f"{result['withDatagrams']} of {viewers} viewers had datagrams")
    if result["slowestFramesPerSecond"] < result["medianFramesPerSecond"] / 2:
        raise ProgramFailed("a viewer got less than half of the frames")


class Bench:
    def __init__(self, arguments, folder):
        self.arguments, self.folder = arguments, folder

    def load(self, server, transport, *options, within=()):
        command = [*within, self.arguments.programs / "clothstream", "load", server.url.rstrip("/"), "--web", "--json",
                   *TRANSPORTS[transport], *options]
        return subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    @staticmethod
    def result_of(load):
        out, errors = load.communicate()
        if load.returncode != 0:
            raise ProgramFailed(f"the load test failed with {load.returncode}: {errors}{out}")
        return json.loads(out)

    def serve(self, options, within=()):
        return Server(self.arguments.programs / "clothstream-server", options, self.folder / "server.log", within=within)

    @functools.cache
    def recording(self):
        """A recording of `flag`, which is made when it is first needed."""
        made = subprocess.run(list(map(str, [
            self.arguments.programs / "clothstream-server", "--port", 0, "--grpc-port", 0, "--scene", "flag", "--always-run",
            "--record", self.folder, "--seconds", RECORDED])), capture_output=True, text=True)
        if made.returncode != 0:
            raise ProgramFailed(f"the recording failed: {made.stderr}")
        return next(self.folder.glob("*.mcap"))

    def cost(self, transport, viewers):
        """A row of the cost."""
        with self.serve(["play", self.recording(), "--loop", *self.options(viewers)]) as server:
            row, result = self.watched(server, transport, viewers)
        return {"figure": "cost", "transport": transport, "viewers": viewers, **row, **kept(result)}

    def crowd(self, transport):
        """A row of many viewers at once."""
        options = ["--max-created-scenes", CROWD_SCENES, "--max-load", 1_000_000]
        with self.serve([*self.options(CROWD), *options]) as server:
            row, result = self.watched(server, transport, CROWD, "--scenes", CROWD_SCENES, "--nodes", CROWD_NODES)
        return {"figure": "crowd", "transport": transport, "viewers": CROWD, **row, **kept(result)}

    def options(self, viewers):
        return [*certificate(self.folder, "127.0.0.1"), "--profile", "fleet", "--max-participants", 135,
                "--max-connections", 2 * viewers + 100, "--metrics-port", 0]

    def watched(self, server, transport, viewers, *options):
        """What was read from the server during a load test, and its result."""
        load = self.load(server, transport, "--participants", viewers, "--viewers", viewers, "--decoders", 0,
                         "--seconds", self.arguments.seconds + 2 * MARGIN, *options)
        try:
            count = "clothstream_scene_subscribers" if transport == "websocket" else "clothstream_datagram_peers"
            row = self.watch(server, load, count, viewers)
            result = self.result_of(load)
        finally:
            load.terminate()  # it deletes its scenes
            load.wait()
        check(result, viewers, transport)
        return row, result

    def watch(self, server, load, count, viewers):
        """Reads from the server while the load test measures."""
        url, pid = server.wait_for(r"^metrics +(\S+)")[1], server.process.pid

        def read():
            with urllib.request.urlopen(url, timeout=60) as answer:
                return Metrics(answer.read().decode())

        wait_until(lambda: load.poll() is not None or read().total(count) == viewers, f"{viewers} viewers", seconds=120)
        if load.poll() is not None:
            return {}  # its result says why
        time.sleep(MARGIN)
        metrics, threads, start = read(), thread_seconds(pid), time.monotonic()
        time.sleep(self.arguments.seconds - MARGIN)
        later, seconds, metrics_later = thread_seconds(pid), time.monotonic() - start, read()
        named = {}
        for thread, (name, spent) in later.items():
            named[name] = named.get(name, 0) + spent - threads.get(thread, (name, 0))[1]
        return {
            "seconds": seconds,
            "cpuSeconds": transport_seconds(later) - transport_seconds(threads),
            "threads": {name: spent for name, spent in named.items() if spent > 0},
            "residentKb": resident_kb(pathlib.Path(f"/proc/{pid}/smaps_rollup").read_text()),
            **{key: metrics_later.total(name) - metrics.total(name) for key, name in COUNTERS.items()},
        }

    def first_frames(self, transport):
        """Times of joins over the link, ms: to the first frame, and to the first one in datagrams."""
        rows = []
        with NetworkLink(self.arguments.programs / "clothstream-link", ["--delay", DELAY_MS], self.folder / "link.log") as link:
            address = link.address(SERVER)
            options = [*certificate(self.folder, address), "--host", address, "--insecure", "--scene", "flag"]
            with self.serve(options, within=link.within(SERVER)) as server:
                for _ in range(JOINS):
                    load = self.load(server, transport, "--participants", 1, "--viewers", 1, "--seconds", 1,
                                     within=link.within(CLIENT))
                    result = self.result_of(load)
                    rows.append((result["joinToFrameMsP50"], result["joinToDatagramFrameMsP50"]))
            link.end()
        return {"figure": "first", "transport": transport, "firstFrameMs": [first for first, _ in rows],
                "firstDatagramFrameMs": [first for _, first in rows if first is not None]}


FIGURES = {
    "cost": lambda bench, transport: [bench.cost(transport, viewers) for viewers in (FEW, MANY)],
    "crowd": lambda bench, transport: [bench.crowd(transport)],
    "first": lambda bench, transport: [bench.first_frames(transport)],
}


def cost(few, many):
    """What one more viewer costs, from rows with few viewers and with many."""
    frames = many["frames"] / many["seconds"] - few["frames"] / few["seconds"]
    spent = many["cpuSeconds"] / many["seconds"] - few["cpuSeconds"] / few["seconds"]
    frame_bytes = 1e6 / 8 * many["mbitPerSecond"] / (many["framesPerSecond"] * many["viewers"])
    wire = many["pieceBytes"] + many["packets"] * HEADERS.get(many["transport"], 0)
    return {
        "microseconds": 1e6 * spent / frames,
        "kilobytes": (many["residentKb"] - few["residentKb"]) / (many["viewers"] - few["viewers"]),
        "frameBytes": frame_bytes,
        "wireRatio": wire / many["frames"] / frame_bytes if many["packets"] else None,
    }


COLUMNS = {
    "microseconds": ("us a frame and viewer", "{:.1f}"),
    "ratio": ("times WebSocket", "{:.2f}"),
    "kilobytes": ("kB a viewer", "{:.0f}"),
    "wireRatio": ("bytes in packets / bytes of frames", "{:.2f}"),
    "framesPerSecond": ("frames/s of 200", "{:.1f}"),
    "slowest": ("of the slowest", "{:.1f}"),
    "lostFrames": ("frames lost", "{:.0f}"),
    "firstFrameMs": ("first frame, ms", "{:.0f}"),
    "firstDatagramFrameMs": ("first in datagrams, ms", "{:.0f}"),
}


def summary(rows, transport):
    """Medians over the rounds, by the name of a column. Columns that do not apply are left out."""
    def of(figure):
        return [row for row in rows if (row["figure"], row["transport"]) == (figure, transport)]

    found = {}
    by_viewers = [[row for row in of("cost") if row["viewers"] == viewers] for viewers in (FEW, MANY)]
    samples = [cost(few, many) for few, many in zip(*by_viewers)]
    samples += [{"framesPerSecond": row["framesPerSecond"], "slowest": row["slowestFramesPerSecond"],
                 "lostFrames": row["datagrams"]["lostFrames"]} for row in of("crowd")]
    samples += [{"firstFrameMs": first} for row in of("first") for first in row["firstFrameMs"]]
    samples += [{"firstDatagramFrameMs": first} for row in of("first") for first in row["firstDatagramFrameMs"]]
    for name in COLUMNS:
        if values := [sample[name] for sample in samples if sample.get(name) is not None]:
            found[name] = statistics.median(values)
    return found


def table(rows, transports):
    """Lines of Markdown."""
    yield "| transport | " + " | ".join(title for title, _ in COLUMNS.values()) + " |"
    yield "|---" * (1 + len(COLUMNS)) + "|"
    reference = summary(rows, "websocket").get("microseconds")
    for transport in transports:
        figures = summary(rows, transport)
        if reference and "microseconds" in figures:
            figures["ratio"] = figures["microseconds"] / reference
        cells = [form.format(figures[name]) if name in figures else "" for name, (_, form) in COLUMNS.items()]
        yield f"| {transport} | " + " | ".join(cells) + " |"


def read_arguments(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--programs", type=pathlib.Path, required=True,
                        help="folder of clothstream, clothstream-server and clothstream-link")
    parser.add_argument("--transports", type=choice(TRANSPORTS), default=list(TRANSPORTS),
                        help=f"some of {','.join(TRANSPORTS)}. Default: all")
    parser.add_argument("--figures", type=choice(FIGURES), default=list(FIGURES),
                        help=f"some of {','.join(FIGURES)}. Default: all")
    parser.add_argument("--rounds", type=number(1, 100, int), default=3, help="rounds (default: %(default)s)")
    parser.add_argument("--seconds", type=number(2, 3600, float), default=8,
                        help="time of each measurement (default: %(default)s)")
    parser.add_argument("--json", type=pathlib.Path, help="file for the rows")
    return parser.parse_args(arguments)


def main():
    arguments = read_arguments()
    # A connection of a viewer takes a descriptor of the server and two of the load test.
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    rows = []
    with tempfile.TemporaryDirectory(prefix="clothstream-datagrams-") as folder:
        bench = Bench(arguments, pathlib.Path(folder))
        try:
            for turn in range(arguments.rounds):
                for figure in arguments.figures:
                    for transport in arguments.transports:
                        print(f"round {turn + 1} of {arguments.rounds}: {figure}, {transport}", file=sys.stderr)
                        rows += [{"suite": "datagrams", "round": turn, "processors": os.cpu_count(), **row}
                                 for row in FIGURES[figure](bench, transport)]
                        if arguments.json:
                            arguments.json.write_text(json.dumps(rows) + "\n")
        except (AssertionError, ProgramFailed, unittest.SkipTest) as failure:
            sys.exit(str(failure))
    print("\n".join(table(rows, arguments.transports)))
    print(f"\n{MANY} viewers, {os.cpu_count()} processors; first frames over a link of {DELAY_MS} ms one way")


if __name__ == "__main__":
    main()
