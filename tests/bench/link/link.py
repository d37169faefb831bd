#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Measures the delay from a hand to the picture over bad networks: `./dev bench link`.

For each condition and transport, a link between two network namespaces (tests/link) connects a server to one participant
who moves a sphere: of `clothstream load`, or the page in Chromium (browser.mjs). Every figure is the median over rounds, in
which transports alternate. With the same --seed, packets with the same number are lost in every round and transport.

The participant decodes every frame and compares its hash. Exits with 1 if a frame was wrong, the participant was lost or
got no frames, or packets were lost that the link did not lose, and with 77 where namespaces are not permitted. Times are
printed and never judged. The link, the server and the participant share this machine: `late` says by how much the link
delayed packets for too long.
"""

import argparse
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from network_link import CLIENT, SERVER, NetworkLink  # noqa: E402
from programs import ProgramFailed, Server  # noqa: E402

SKIPPED = 77  # CMake's SKIP_RETURN_CODE
DELAY_MS, JITTER_MS = 25, 5
# Options of the link by the name of a condition. Later ones replace earlier ones.
CONDITIONS = {
    "0": ("0 %", {}),
    "1": ("1 %", {"--loss": 1}),
    "2": ("2 %", {"--loss": 2}),
    "5": ("5 %", {"--loss": 5}),
    "2-bursts": ("2 % in bursts of 4", {"--loss": 2, "--burst-packets": 4}),
    "5-reordered": ("5 %, jitter up to 20 ms, reordered", {"--loss": 5, "--jitter": 20, "--reorder": None}),
    "10": ("10 %", {"--loss": 10}),
}
PLOTTED = "2"  # condition of which rows keep the age of each frame

BROWSER = pathlib.Path(__file__).with_name("browser.mjs")


def load(connect):
    """Participant of `clothstream load`. `connect` makes the arguments that name a server."""
    return lambda programs, server: [programs / "clothstream", "load", *connect(server), "--participants", 1, "--json"]


def web(server):
    return ["--web", server.url.split("/")[2]]


# Command of the participant, without --seconds and --frames, from the folder of programs and the server.
TRANSPORTS = {
    "websocket": load(lambda server: [*web(server), "--transport", "tcp"]),
    "grpc": load(lambda server: [server.address, "--transport", "tcp"]),
    "datagrams": load(lambda server: [*web(server), "--transport", "datagrams"]),
    "browser": lambda programs, server: ["node", BROWSER, "--url", server.url],
}
# Figures of the participant that rows keep.
KEPT = ("poseToDisplayableMsP50", "poseToDisplayableMsP99", "framesPerSecond", "tickAgeMsP50", "tickAgeMsP99",
        "decodedToDisplayableMsP50", "poses", "dropped", "decodeErrors", "mbitPerSecond", "datagrams")


def link_options(condition, congestion, seed):
    """Arguments of clothstream-link."""
    options = {"--delay": DELAY_MS, "--jitter": JITTER_MS, "--seed": seed, **CONDITIONS[condition][1]}
    if congestion:
        options["--congestion"] = congestion
    return [part for name, value in options.items() for part in ((name,) if value is None else (name, value))]


def algorithms_of(text):
    """Congestion controls in the output of `ss -tinH`, sorted."""
    return sorted(set(re.findall(r"(\w+) wscale:", text)))


def check(result, link):
    """Raises ProgramFailed unless all frames were right, and the link alone has lost packets."""
    # With datagrams, a frame that nothing repaired is lost, and those that refer to it are not decoded.
    wrong = result["hashMismatches"] + (0 if result["withDatagrams"] else result["decodeErrors"])
    if wrong:
        raise ProgramFailed(f"{wrong} frames were wrong")
    if (result["joined"], result["lost"]) != (1, 0):
        raise ProgramFailed("the participant was lost")
    if not result["poses"] or result["framesPerSecond"] <= 0:
        raise ProgramFailed("no frame showed a pose")
    for direction in link.values():
        if direction["overflowed"] + direction["refused"]:
            raise ProgramFailed("this machine is too slow for the link: the kernel dropped packets")


def frames_of(path):
    """Arrival, age on arrival and age when displayable, s and ms, from a file of `clothstream load --frames`."""
    lines = map(json.loads, path.read_text().splitlines())
    return [[line["seconds"], line["ageMs"], line["displayableMs"]] for line in lines]


class Bench:
    def __init__(self, arguments, folder):
        self.arguments, self.folder = arguments, folder

    def measure(self, condition, transport):
        """A row without its round."""
        arguments = self.arguments
        options = link_options(condition, arguments.congestion, arguments.seed)
        with NetworkLink(arguments.programs / "clothstream-link", options, self.folder / "link.log") as link:
            options = ["--scene", arguments.scene, "--host", link.address(SERVER), "--insecure"]
            program = arguments.programs / "clothstream-server"
            with Server(program, options, self.folder / "server.log", within=link.within(SERVER)) as server:
                participant = TRANSPORTS[transport](arguments.programs, server)
                result, algorithms, frames = self.run(link, participant, condition == PLOTTED)
            link_statistics = link.end()
        check(result, link_statistics)
        late = max(direction["lateMsP99"] for direction in link_statistics.values())
        return {"suite": "link", "condition": condition, "transport": transport, "scene": arguments.scene,
                "seconds": arguments.seconds, "seed": arguments.seed, "processors": os.cpu_count(),
                "congestion": algorithms, **{name: result[name] for name in KEPT}, "lateMsP99": late,
                "link": link_statistics, **({"frames": frames} if frames else {})}

    def run(self, link, participant, keeps_frames):
        """Runs a participant. Returns its result, the congestion controls of TCP, and the frames, if they are kept."""
        path = self.folder / "frames"
        command = [*link.within(CLIENT), *participant, "--seconds", self.arguments.seconds,
                   *(["--frames", path] if keeps_frames else [])]
        with subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            try:
                time.sleep(self.arguments.seconds / 2)
                algorithms = self.algorithms(link)
                while not algorithms and process.poll() is None:  # a browser takes seconds to start
                    time.sleep(0.1)
                    algorithms = self.algorithms(link)
                out, errors = process.communicate()
            finally:
                process.terminate()
        if process.returncode != 0:
            raise ProgramFailed(f"the participant failed with {process.returncode}: {errors}{out}")
        return json.loads(out), algorithms, frames_of(path) if keeps_frames else None

    def algorithms(self, link):
        """Congestion controls of the server's connections."""
        listed = subprocess.run([*link.within(SERVER), "ss", "-tinH"], capture_output=True, text=True)
        if listed.returncode != 0:
            raise ProgramFailed(f"ss failed with {listed.returncode} (package iproute2): {listed.stderr}")
        return algorithms_of(listed.stdout)


def table(rows, conditions, transports):
    """Lines of Markdown: medians over the rounds."""
    def cell(condition, transport):
        group = [row for row in rows if (row["condition"], row["transport"]) == (condition, transport)]
        p50, p99, rate = (statistics.median(row[name] for row in group) for name in KEPT[:3])
        return f"{p50:.0f} / {p99:.0f}; {rate:.1f}"

    yield "| loss | " + " | ".join(transports) + " |"
    yield "|---" * (1 + len(transports)) + "|"
    for condition in conditions:
        cells = [CONDITIONS[condition][0], *(cell(condition, transport) for transport in transports)]
        yield "| " + " | ".join(cells) + " |"


def choice(known):
    """A type of argparse: names from a table, with commas between them."""
    def names(text):
        found = text.split(",")
        if unknown := [name for name in found if name not in known]:
            raise argparse.ArgumentTypeError(f"there is no '{unknown[0]}'; there are {', '.join(known)}")
        return found
    return names


def number(least, most, kind):
    """A type of argparse: a number in a range."""
    def read(text):
        try:
            value = kind(text)
        except ValueError:
            value = None
        if value is None or not least <= value <= most:
            raise argparse.ArgumentTypeError(f"'{text}' is not a number from {least} to {most}")
        return value
    return read


def read_arguments(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--programs", type=pathlib.Path, required=True,
                        help="folder of clothstream, clothstream-server and clothstream-link; the server finds the page")
    parser.add_argument("--transports", type=choice(TRANSPORTS), default=list(TRANSPORTS),
                        help=f"some of {','.join(TRANSPORTS)}. Default: all")
    parser.add_argument("--conditions", type=choice(CONDITIONS), default=list(CONDITIONS),
                        help=f"some of {','.join(CONDITIONS)}. Default: all")
    parser.add_argument("--congestion",
                        help="congestion control of TCP at both ends, such as bbr or cubic, unless the server chooses its own; "
                             "the line below the table says what the server used. Default: that of the kernel")
    parser.add_argument("--scene", default="flag", help="built-in scene (default: %(default)s)")
    parser.add_argument("--rounds", type=number(1, 100, int), default=3, help="rounds (default: %(default)s)")
    parser.add_argument("--seconds", type=number(2, 3600, float), default=15,
                        help="time of each measurement (default: %(default)s)")
    parser.add_argument("--seed", type=number(0, 2**53, int), default=1, help="chooses the losses (default: %(default)s)")
    parser.add_argument("--json", type=pathlib.Path, help="file for the rows, which plot.py draws")
    return parser.parse_args(arguments)


def main():
    arguments = read_arguments()
    rows = []
    with tempfile.TemporaryDirectory(prefix="clothstream-link-") as folder:
        bench = Bench(arguments, pathlib.Path(folder))
        for turn in range(arguments.rounds):
            for condition in arguments.conditions:
                for transport in arguments.transports:
                    print(f"round {turn + 1} of {arguments.rounds}: {CONDITIONS[condition][0]}, {transport}", file=sys.stderr)
                    try:
                        rows.append({**bench.measure(condition, transport), "round": turn})
                    except unittest.SkipTest as skipped:
                        print(f"skipped: {skipped}")
                        sys.exit(SKIPPED)
                    except (AssertionError, ProgramFailed) as failure:
                        sys.exit(str(failure))
                    if arguments.json:
                        arguments.json.write_text(json.dumps(rows) + "\n")
    print(f"From a pose to the first picture that can show it, ms, p50 / p99; frames/s; {DELAY_MS} ms one way\n")
    print("\n".join(table(rows, arguments.conditions, arguments.transports)))
    used = sorted({name for row in rows for name in row["congestion"]})
    late = max(row["lateMsP99"] for row in rows)
    print(f"\nTCP used {', '.join(used)}; {rows[0]['processors']} processors; late: at most {late:.1f} ms (p99 of a run)")


if __name__ == "__main__":
    main()
