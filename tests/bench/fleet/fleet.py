#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Measures edge servers on this machine: `./dev bench fleet`.

Starts nats-server, two origins that play a recording of 10 frames/s each, and three edges. Then it measures

- the CPU time of an origin with 1, 60 and 600 viewers at the edges;
- the age of frames (packet complete at the origin to arrival) of four viewers at an origin and at an edge;
- how long viewers are without frames when nats-server, an edge and an origin are killed and started again;
- how long a scene of 10,000 vertices stands still when it moves between two servers that simulate it, and how long a
  participant at an edge, and one that is connected to the server of the scene, has no frame. The latter also with TLS
  and a round trip of 50 ms.

One viewer in twenty decodes every frame and compares its hash. Exits with 1 if any frame was wrong or a viewer was lost.
"""

import argparse
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from programs import MissingProgram, Program, ProgramFailed, find_program  # noqa: E402

EDGES = 3
NATS_PORT = 24222
NEAR_PORT, FAR_PORT = 25220, 25240
ROUND_TRIP_MS = 50
LINK = pathlib.Path(__file__).with_name("link.py")
CLOCK_TICKS = os.sysconf("SC_CLK_TCK")

SCENE = {
    "simulationRate": 60,
    "streamRate": 10,
    "substeps": 32,
    "cloths": [
        {
            "name": "sheet",
            "grid": {"rows": 64, "columns": 64, "width": 1, "height": 1, "pose": {"position": {"y": 2}}},
            "mass": 0.2,
            "structural": {"stiffness": 20, "damping": 0.01},
            "shear": {"stiffness": 5, "damping": 0.002},
            "damping": 0.5,
            "drag": 0.5,
            "pins": [{"firstRow": 0, "firstColumn": 0, "lastColumn": 63, "columnStep": 63}],
        }
    ],
    "environment": {"wind": {"z": 3}},
}


MOVING = {
    **SCENE,
    "name": "moving",
    "streamRate": 30,
    "substeps": 12,
    "cloths": [
        {
            **SCENE["cloths"][0],
            "mass": 2,
            "structural": {"stiffness": 5, "damping": 0.01},
            "shear": {"stiffness": 1, "damping": 0.002},
            "grid": {**SCENE["cloths"][0]["grid"], "rows": 100, "columns": 100},
        }
    ],
}
MOVES = 6


class Measured(Program):
    def cpu_seconds(self):
        fields = pathlib.Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / CLOCK_TICKS


class Fleet:
    def __init__(self, programs, folder):
        self.programs = programs
        self.folder = folder
        self.started = []

    def start(self):
        nats = [find_program("nats-server", "nats-server"), "--addr", "127.0.0.1", "--port", NATS_PORT, "--jetstream", "--store_dir", self.folder / "nats"]
        self.nats = self.run(nats, "nats", "Server is ready")
        self.options = ["--nats", f"nats://127.0.0.1:{NATS_PORT}"]
        self.origins = []
        for i, name in enumerate(("first", "second")):
            self.origins.append(self.serve(name, 25000 + 10 * i, ["play", "--loop", self.record(name)]))
        self.edges = [self.serve(f"edge{i}", 25100 + 10 * i, ["edge"]) for i in range(EDGES)]
        for edge in self.edges:
            for name in ("first", "second"):
                edge.wait_for(f"{name}: serves this scene")

    def run(self, command, name, ready):
        program = Measured(name, command, self.folder / f"{name}.log")
        self.started.append(program)
        program.wait_for(ready)
        return program

    def serve(self, name, port, more):
        limits = ["--max-connections", 2000, "--profile", "fleet"]
        command = [self.programs / "clothstream-server", "--port", port, "--grpc-port", port + 1, *limits, *self.options, *more]
        program = self.run(command, name, "gRPC ")
        program.address = f"127.0.0.1:{port + 1}"
        return program

    def certificate(self):
        """Options of servers for a certificate that clients trust from now on."""
        key, certificate = self.folder / "key.pem", self.folder / "certificate.pem"
        names = "DNS:localhost,IP:127.0.0.10,IP:127.0.0.20,IP:127.0.0.2"
        make = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=localhost"]
        subprocess.run([*make, "-addext", f"subjectAltName={names}", "-keyout", key, "-out", certificate], check=True,
                       stderr=subprocess.DEVNULL)
        os.environ["GRPC_DEFAULT_SSL_ROOTS_FILE_PATH"] = str(certificate)
        return ["--tls-certificate", certificate, "--tls-key", key]

    def record(self, name):
        """Records 20 seconds of the scene, and returns the file."""
        scene = self.folder / f"{name}.json"
        scene.write_text(json.dumps({"name": name, **SCENE}))
        recordings = self.folder / f"{name}-recordings"
        recordings.mkdir()
        command = [self.programs / "clothstream-server", "--port", 0, "--grpc-port", 0, "--scene-file", scene, "--scene", name]
        command += ["--always-run", "--record", recordings, "--seconds", 20]
        made = subprocess.run([str(part) for part in command], capture_output=True, text=True)
        if made.returncode != 0:
            sys.exit(f"the recording failed: {made.stderr}")
        return next(recordings.glob("*.mcap"))

    def load(self, address, scene, viewers, seconds, decoders=None):
        command = [self.programs / "clothstream", "load", address, "--scene", scene, "--participants", viewers, "--viewers", viewers]
        command += ["--seconds", seconds, "--joins", 200, "--json", "--decoders", decoders or max(1, viewers // 20)]
        return subprocess.Popen([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def stop(self):
        for program in reversed(self.started):
            program.stop(60)


def result_of(load):
    out, errors = load.communicate()
    if load.returncode != 0:
        sys.exit(f"the load test failed with {load.returncode}: {errors}{out}")
    result = json.loads(out)
    wrong = result["hashMismatches"] + result["decodeErrors"]
    if wrong or result["lost"]:
        sys.exit(f"{wrong} frames were wrong, {result['lost']} viewers lost")
    return result


def crowd(fleet, viewers, seconds):
    """Viewers at the edges, divided among edges and scenes. CPU times are seconds per second."""
    groups = []
    share = [(edge, scene) for edge in fleet.edges for scene in ("first", "second")]
    for i, (edge, scene) in enumerate(share):
        mine = viewers // len(share) + (1 if i < viewers % len(share) else 0)
        if mine:
            groups.append(fleet.load(edge.address, scene, mine, seconds))
    time.sleep(3 + viewers / 400)  # all have joined
    programs = [fleet.origins[0], fleet.nats, fleet.edges[0]]
    before = [program.cpu_seconds() for program in programs]
    start = time.monotonic()
    time.sleep(max(1, seconds - 4))
    took = time.monotonic() - start
    cpu = [(program.cpu_seconds() - then) / took for program, then in zip(programs, before)]
    results = [result_of(group) for group in groups]
    joined = sum(result["joined"] for result in results)
    if joined != viewers:
        sys.exit(f"{joined} of {viewers} viewers joined")
    frames = min(result["framesPerSecond"] for result in results)
    return {"viewers": viewers, "originCpu": cpu[0], "natsCpu": cpu[1], "edgeCpu": cpu[2], "framesPerSecond": frames}


def message_cost(fleet, seconds):
    """Processor time of nats-server for one frame that it sends, from two speeds of the recordings."""
    spent = []
    for speed in (1, 8):
        for origin, name in zip(fleet.origins, ("first", "second")):
            command = [fleet.programs / "clothstream", "speed", "--server", origin.address, name, speed]
            subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)
        viewers = [fleet.load(edge.address, name, 1, seconds, 1) for edge in fleet.edges for name in ("first", "second")]
        time.sleep(4)
        before, start = fleet.nats.cpu_seconds(), time.monotonic()
        time.sleep(max(1, seconds - 6))
        spent.append((fleet.nats.cpu_seconds() - before) / (time.monotonic() - start))
        for viewer in viewers:
            result_of(viewer)
    messages = [len(fleet.edges) * 2 * SCENE["streamRate"] * speed for speed in (1, 8)]
    return (spent[1] - spent[0]) / (messages[1] - messages[0])


def gap(fleet, lost, lose, come_back):
    """Longest time between two frames of a viewer at the first edge, while `lost` is away for a second."""
    edge = fleet.edges[0]
    command = [fleet.programs / "clothstream", "join", edge.address, "--scene", "first", "--seconds", 15]
    command += ["--events", "--frames"]
    viewer = subprocess.Popen([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    start = time.monotonic()
    times, state = [], 0
    for line in viewer.stdout:
        now = time.monotonic()
        if '"frame"' in line:
            times.append(now)
        if state == 0 and now - start > 3:
            threading.Thread(target=lambda: (lose(), time.sleep(1), come_back())).start()
            state = 1
    viewer.wait()
    gaps = longest_gaps(times)
    if not gaps or time.monotonic() - times[-1] > 2:
        sys.exit(f"no frames came back after {lost} was lost (exit code {viewer.returncode})")
    return {"lost": lost, "longestGapSeconds": gaps[0]}


def longest_gaps(times):
    return sorted((later - earlier for earlier, later in zip(times, times[1:])), reverse=True)


class Watcher:
    """A participant that notes when frames arrive."""

    def __init__(self, fleet, address, scene):
        command = [fleet.programs / "clothstream", "join", address, "--scene", scene, "--events", "--frames"]
        self.program = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.times = []
        self.reader = threading.Thread(target=self.read)
        self.reader.start()

    def read(self):
        self.times.extend(time.monotonic() for line in self.program.stdout if '"frame"' in line)

    def leave(self):
        """Returns the seconds between frames, longest first."""
        left = time.monotonic()
        self.program.send_signal(signal.SIGINT)
        self.program.wait()
        self.reader.join()
        if not self.times or left - self.times[-1] > 2:
            sys.exit(f"a participant lost the scene that moved (exit code {self.program.returncode})")
        return longest_gaps(self.times)


def create(fleet, server, name):
    file = fleet.folder / f"{name}.json"
    file.write_text(json.dumps({**MOVING, "name": name}))
    command = [fleet.programs / "clothstream", "create", file, "--server", server.address]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def move(fleet, name, *more):
    """Returns the seconds for which the scene stood still."""
    command = [fleet.programs / "clothstream", "move", name, *fleet.options, *more]
    moved = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    if moved.returncode != 0:
        sys.exit(f"the scene did not move: {moved.stderr}")
    return float(moved.stdout.rsplit(" ", 2)[1]) / 1000


def moves(fleet):
    """Moves a scene between two servers while a participant watches at an edge. Times are seconds."""
    servers = [fleet.serve(name, port, ["--scene", "sphere_drop"]) for name, port in (("a", 25200), ("b", 25210))]
    create(fleet, servers[0], "moving")
    fleet.edges[0].wait_for("moving: serves this scene")
    time.sleep(3)  # it is in the directory
    watcher, still = Watcher(fleet, fleet.edges[0].address, "moving"), []
    time.sleep(3)
    for _ in range(MOVES):
        began = time.monotonic()
        still.append(move(fleet, "moving"))
        time.sleep(max(0, 3 - (time.monotonic() - began)))
    gaps = watcher.leave()
    for server in servers:
        server.stop()
    return {"stillSeconds": still, "longestFrameGapsSeconds": gaps[:MOVES], "usualFrameGapSeconds": gaps[len(gaps) // 2]}


def moves_of_direct_clients(fleet, far=False):
    """The same with participants that are connected to the server which has the scene: one scene for each move, between
    two servers with the same ports. Clients reach the first one at 127.0.0.2, and the other as localhost. `far`: by TLS,
    over links with a round trip of ROUND_TRIP_MS."""
    hosts = {"here": ("127.0.0.2", "here.example"), "there": ("127.0.0.1", "localhost")}
    options = ["--scene", "sphere_drop", "--insecure", *(fleet.certificate() if far else [])]
    scheme, port, servers, links = "https://" if far else "", FAR_PORT if far else NEAR_PORT, {}, []
    for name, (host, public) in hosts.items():
        own = host + "0" if far else host  # clients reach it by the link
        servers[name] = fleet.serve(f"{name}-{port}", port, [*options, "--host", own, "--public-name", public])
        servers[name].address = f"{scheme}{own}:{port + 1}"
        if far:
            command = [sys.executable, LINK, f"{host}:{port + 1}", f"{own}:{port + 1}", ROUND_TRIP_MS / 2]
            links.append(fleet.run(command, f"link-{name}", "forwards"))
    still, gaps = [], []
    for i in range(MOVES):
        name = f"direct{i}"
        create(fleet, servers["here"], name)
        time.sleep(3)  # it is in the directory
        watcher = Watcher(fleet, f"{scheme}{hosts['here'][0]}:{port + 1}", name)
        time.sleep(3)
        still.append(move(fleet, name, "--to", "localhost"))
        time.sleep(2)
        gaps.append(watcher.leave()[0])
        deleted = [fleet.programs / "clothstream", "delete", name, "--server", servers["there"].address]
        subprocess.run(deleted, check=True)
    for program in (*links, *servers.values()):
        program.stop(60)
    return {"stillSeconds": still, "longestFrameGapsSeconds": sorted(gaps, reverse=True)}


def restart(program, ready):
    program.start()
    program.wait_for(ready)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--programs", type=pathlib.Path, required=True, help="folder of clothstream and clothstream-server")
    parser.add_argument("--seconds", type=float, default=20, help="time of each measurement (default: %(default)s)")
    parser.add_argument("--json", type=pathlib.Path, help="file for the figures")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="clothstream-fleet-") as folder:
        fleet = Fleet(arguments.programs, pathlib.Path(folder))
        try:
            fleet.start()
            figures = measure(fleet, arguments.seconds)
        except (MissingProgram, ProgramFailed) as failure:
            sys.exit(str(failure))
        finally:
            fleet.stop()
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=2) + "\n")


def measure(fleet, seconds):
    origin, edge = fleet.origins[0], fleet.edges[0]
    print("| viewers at 3 edges | CPU of an origin | of nats-server | of an edge | slowest frames/s |\n|---|---|---|---|---|")
    crowds = []
    for viewers in (1, 60, 600):
        crowds.append(crowd(fleet, viewers, seconds))
        row = crowds[-1]
        cpu = " | ".join(f"{100 * row[name]:.2f} %" for name in ("originCpu", "natsCpu", "edgeCpu"))
        print(f"| {viewers} | {cpu} | {row['framesPerSecond']:.2f} |", flush=True)

    print("\n| four viewers at | age of frames p50, ms | p99, ms |\n|---|---|---|")
    ages = {}
    for name, server in (("the origin", origin), ("an edge", edge)):
        result = result_of(fleet.load(server.address, "first", 4, seconds, 4))
        ages[name] = (result["frameAgeMsP50"], result["frameAgeMsP99"])
        print(f"| {name} | {ages[name][0]:.2f} | {ages[name][1]:.2f} |", flush=True)

    print("\n| killed for a second | longest time without a frame, s |\n|---|---|")
    gaps = []
    for lost, program, ready in (("nats-server", fleet.nats, "Server is ready"), ("the edge", edge, "gRPC "),
                                 ("the origin", origin, "gRPC ")):
        gaps.append(gap(fleet, lost, program.kill, lambda program=program, ready=ready: restart(program, ready)))
        print(f"| {lost} | {gaps[-1]['longestGapSeconds']:.2f} |", flush=True)
    print("\n| a scene of 10,000 vertices moves; client at | time without simulation, ms | longest time without a frame, ms |\n|---|---|---|")
    moved = {
        "an edge": moves(fleet),
        "its server": moves_of_direct_clients(fleet),
        f"its server, by TLS, {ROUND_TRIP_MS} ms away": moves_of_direct_clients(fleet, far=True),
    }
    for place, figures in moved.items():
        for still, frame in zip(sorted(figures["stillSeconds"], reverse=True), figures["longestFrameGapsSeconds"]):
            print(f"| {place} | {1000 * still:.0f} | {1000 * frame:.0f} |", flush=True)
    cost = message_cost(fleet, seconds)
    print(f"\nnats-server takes {1e6 * cost:.1f} us of processor time for one frame that it sends to one edge.", flush=True)
    return {"crowds": crowds, "frameAgeMs": ages, "natsSecondsOfFrame": cost, "gaps": gaps, "moves": moved}


if __name__ == "__main__":
    main()
