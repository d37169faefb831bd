#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs a whole fleet on this machine, and shows that it works: `./dev fleet`.

Starts nats-server, two origins on software Vulkan, two edges, and a stand-in for the sidecar of Agones next to the second
origin. A scene is created at the first origin. A page in a browser joins it at the first edge, a load of viewers at the
second edge. Then the scene moves to the second origin and back, and nats-server, the first edge and the first origin are
killed (SIGKILL). nats-server and the edge are started again. The origin is not: the second one continues the scene from
its checkpoint.

Every step says what page and viewers saw, and writes screenshots and logs.
"""

import argparse
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests/support"))
from programs import MissingProgram, Program, ProgramFailed, find_program  # noqa: E402
from sidecar import Sidecar  # noqa: E402
from watching import Load, Page, Viewer  # noqa: E402

SCENE = "fleet-demo"
BOUND_SECONDS = 20  # within which the page must have new frames after a kill
FRAMES_AFTER = 10  # new frames that the page must have
CHROMIUM = "/usr/bin/chromium"  # as in tests/page/browser.mjs
INTERRUPTED, WRONG_ARGUMENTS, MISSING = 130, 2, 77


class Interrupted(Exception):
    """SIGINT or SIGTERM."""


class Story:
    """What is printed, with the seconds since the start."""

    def __init__(self):
        self.start = time.monotonic()

    def say(self, text):
        print(f"[{time.monotonic() - self.start:6.1f} s] {text}", flush=True)

    @staticmethod
    def detail(text):
        for line in text.rstrip().splitlines():
            print(f"           {line}".rstrip(), flush=True)

    @staticmethod
    def title(text):
        print(f"\n{text}", flush=True)


def flag_scene():
    """The flag of server/scenes with fewer vertices and 30 ticks per second, so that two cores can also draw the page."""
    scene = json.loads((ROOT / "server/scenes/flag.json").read_text())
    scene["cloths"][0]["grid"] |= {"rows": 24, "columns": 36}
    scene["cloths"][0]["pins"] = [{"firstRow": 0, "lastRow": 23, "firstColumn": 0}]
    return {**scene, "name": SCENE, "simulationRate": 30, "streamRate": 30, "substeps": 16}


class Fleet:
    def __init__(self, arguments, story, folder):
        self.arguments, self.story, self.folder = arguments, story, folder
        self.out = arguments.out
        self.logs = self.out / "logs"
        self.server = find_program("clothstream-server", "clothstream", arguments.programs / "clothstream-server")
        self.client = find_program("clothstream", "clothstream", arguments.programs / "clothstream")
        self.nats_server = find_program("nats-server", "nats-server")
        self.node = find_program("node", "nodejs")
        find_program("chromium", "chromium", CHROMIUM)
        if not (ROOT / "clients/web/node_modules/playwright-core").exists():
            raise MissingProgram("playwright-core was not found; install it: npm ci --prefix clients/web")
        self.started = []
        self.sidecar = self.page = None

    def start(self):
        say = self.story.say
        nats = [self.nats_server, "--addr", "127.0.0.1", "--port", -1, "--jetstream", "--store_dir", self.folder / "nats"]
        self.nats = self.run("nats-server", nats)
        self.nats_url = f"nats://127.0.0.1:{self.nats.wait_for(r'Listening for client connections on .*:([0-9]+)')[1]}"
        self.nats.command[self.nats.command.index("-1")] = self.nats_url.rpartition(":")[2]
        self.nats.wait_for("Server is ready")
        say(f"nats-server with JetStream: {self.nats_url}")
        self.sidecar = Sidecar(["participants", "created-scenes", "load"], ["scenes"])
        origin = ["--device", self.arguments.device, "--insecure", "--drain", 3, "--max-load", 1000]
        agones = ["--public-name", "origin-2.example", "--agones"]
        environment = {**os.environ, "AGONES_SDK_HTTP_PORT": str(self.sidecar.port)}
        self.origins = [self.serve("origin-1", [*origin, "--public-name", "origin-1.example"])]
        self.origins.append(self.serve("origin-2", [*origin, *agones], environment))
        self.edges = []

    def start_edges(self):
        self.edges = [self.serve(f"edge-{i}", ["edge"]) for i in (1, 2)]
        for edge in self.edges:
            edge.wait_for(f"{SCENE}: serves this scene")

    def run(self, name, command, environment=None):
        program = Program(name, command, self.logs / f"{name}.log", environment)
        self.started.append(program)
        return program

    def serve(self, name, more, environment=None):
        """Starts a server on free ports. It has the same ports when it is started again."""
        command = [self.server, "--port", 0, "--grpc-port", 0, "--nats", self.nats_url, *more]
        program = self.run(name, command, environment)
        self.wait_for_addresses(program)
        for option, address in (("--port", program.url.rstrip("/")), ("--grpc-port", program.address)):
            program.command[program.command.index(option) + 1] = address.rpartition(":")[2]
        self.story.say(f"{name}: page {program.url}, gRPC {program.address}")
        return program

    def wait_for_addresses(self, program):
        try:
            program.url = program.wait_for(r"^page +(\S+)")[1]
            program.address = program.wait_for(r"^gRPC +(\S+)")[1]
        except ProgramFailed:
            if "Vulkan" in program.said():
                problem = f"Vulkan device '{self.arguments.device}' was not found; install the one in software: "
                problem += "sudo apt install mesa-vulkan-drivers"
                raise MissingProgram(f"{problem}\n{program.tail()}") from None
            raise

    def start_again(self, program):
        program.start()
        if program is self.nats:
            program.wait_for("Server is ready")
        else:
            self.wait_for_addresses(program)

    def ask(self, *command):
        """Runs `clothstream`, and returns what it prints."""
        done = subprocess.run([str(part) for part in (self.client, *command)], capture_output=True, text=True)
        if done.returncode != 0:
            raise ProgramFailed(f"clothstream {' '.join(map(str, command))}: exit code {done.returncode}: {done.stderr or done.stdout}")
        return done.stdout

    def listed(self):
        return self.ask("list", "--nats", self.nats_url)

    def directory(self):
        """(name of the origin that has the scene, tick of its checkpoint), as far as the directory knows."""
        listed = json.loads(self.ask("list", "--nats", self.nats_url, "--json"))
        names = {server["server"]: server["publicName"] for server in listed["servers"]}
        for scene in listed["scenes"]:
            if scene["scene"] == SCENE:
                return names.get(scene["server"], "?").removesuffix(".example"), scene["checkpointTick"]
        return "", 0

    def wait_for_directory(self, holds, seconds, what):
        end = time.monotonic() + seconds
        while not holds(*self.directory()):
            if time.monotonic() > end:
                raise ProgramFailed(f"{what} within {seconds} s:\n{self.listed()}")
            time.sleep(0.2)

    def agones_line(self):
        counters = self.sidecar.counters
        created, participants = counters["created-scenes"], counters["participants"]
        return (
            f"Agones' stand-in: origin-2 is {self.sidecar.state}, {participants['count']} participants, "
            f"{created['count']} of {created['capacity']} created scenes"
        )

    def stop(self):
        """Ends all processes."""
        if self.page:
            self.page.stop()
        for program in reversed(self.started):
            program.ask_to_stop()
        for program in reversed(self.started):
            program.wait_or_kill(5)
        if self.sidecar:
            self.sidecar.close()


class Demo:
    def __init__(self, fleet, story, viewers):
        self.fleet, self.story, self.viewers = fleet, story, viewers
        self.rows, self.problems = [], []

    def run(self):
        fleet, say = self.fleet, self.story.say
        self.story.title("Start")
        fleet.start()
        scene = fleet.folder / "scene.json"
        scene.write_text(json.dumps(flag_scene()))
        fleet.ask("create", scene, "--server", fleet.origins[0].address)
        say(f"the scene {SCENE} is created at origin-1")
        fleet.start_edges()
        fleet.wait_for_directory(lambda origin, tick: origin == "origin-1", 20, f"{SCENE} is not in the directory")
        self.open_page()
        self.viewer = Viewer(fleet.client, fleet.edges[1].address, SCENE, fleet.logs / "viewer.log")
        fleet.started.append(self.viewer.program)
        say(f"{self.viewers} viewers join at edge-2")
        fleet.wait_for_directory(lambda origin, tick: tick > 0, 20, f"{SCENE} has no checkpoint")
        self.story.detail(fleet.listed() + fleet.agones_line())
        self.move("origin-2", "move-during")
        self.move("origin-1")
        self.picture("move-after")
        self.kill("nats-server", fleet.nats, "nats-lost")
        self.kill("edge-1", fleet.edges[0], "edge-lost")
        self.kill("origin-1", fleet.origins[0], "origin-lost", back=False)
        if fleet.page.wrong_frames:
            self.problems.append(f"the page has decoded {fleet.page.wrong_frames} wrong frames")
        self.problems += [f"the page: {error}" for error in fleet.page.errors]

    def open_page(self):
        fleet = self.fleet
        url = f"{fleet.edges[0].url}?scene={SCENE}&name=Visitor&detail=reduced"
        fleet.page = Page(fleet.node, url, fleet.out, fleet.logs / "browser.log")
        if not fleet.page.wait_for_frames(60, 0):
            raise ProgramFailed(f"the page at {url} has no frames; its state is {fleet.page.state}")
        self.story.say(f"the page is open: {url}")

    def picture(self, name):
        self.fleet.page.ask_for_picture(name)
        self.picture_taken(name)

    def picture_taken(self, name):
        shown = self.fleet.page.wait_for_picture(name)
        self.story.say(f"screenshot {self.fleet.out / name}.png: {100 * shown['cloth']:.0f} % of {shown['vertices']} vertices show cloth")
        if shown["cloth"] < 0.5:
            self.problems.append(f"{name}.png shows no cloth")

    def begin(self):
        """A load joins, and everything runs undisturbed."""
        fleet = self.fleet
        load = Load(fleet.client, fleet.edges[1].address, SCENE, self.viewers, fleet.logs / "load.log")
        fleet.started.append(load.program)
        begun = time.time()
        if not fleet.page.wait_for_frames(60, begun):
            raise ProgramFailed("the page has no frames")
        return load

    def move(self, to, picture=""):
        """Moves the scene. A picture that is taken meanwhile keeps the page from showing frames."""
        fleet, page, say = self.fleet, self.fleet.page, self.story.say
        self.story.title(f"The scene moves to {to}" + (f", while {picture}.png is taken" if picture else ""))
        load = self.begin()
        if picture:
            self.picture("move-before")
        begun = time.time()
        if picture:
            page.ask_for_picture(picture)
        said = fleet.ask("move", SCENE, "--to", f"{to}.example", "--nats", fleet.nats_url)
        moved = time.time()
        say(said.strip())
        returned = page.wait_for_frames(60, moved, BOUND_SECONDS)
        until = time.time()
        if picture:
            self.picture_taken(picture)
        self.note(f"move to {to}", begun, until, returned, load)
        if to != fleet.directory()[0]:
            self.problems.append(f"the directory does not say that {to} has the scene")
        if page.states_since(begun):
            self.problems.append(f"the page was disconnected by the move: {', '.join(page.states_since(begun))}")
        self.story.detail(fleet.listed() + fleet.agones_line())

    def kill(self, name, program, picture, back=True):
        fleet, page, say = self.fleet, self.fleet.page, self.story.say
        self.story.title(f"{name} is killed")
        load = self.begin()
        if not back:
            ticks = fleet.directory()[1]
            fleet.wait_for_directory(lambda origin, tick: tick > ticks, 20, f"{SCENE} has no new checkpoint")
        killed = time.time()
        program.kill()
        say(f"{name} is killed")
        self.pause_until(killed + 1)
        page.ask_for_picture(picture)
        after = killed + 1  # no frame that comes later was sent before
        if back:
            self.pause_until(killed + fleet.arguments.away)
            fleet.start_again(program)
            after = time.time() if program is fleet.nats else after
            say(f"{name} runs again")
        returned = page.wait_for_frames(FRAMES_AFTER, after, killed + BOUND_SECONDS - time.time())
        until = time.time()
        self.picture_taken(picture)
        self.note(f"kill {name}", killed, until, returned, load)
        self.picture(f"{picture}-after")
        if not back:
            problem = "the directory does not say that origin-2 has the scene"
            fleet.wait_for_directory(lambda origin, tick: origin == "origin-2", 10, problem)
            self.story.detail(fleet.listed() + fleet.agones_line())
            self.story.detail("The directory still lists origin-1: entries of servers are deleted 30 s after their last renewal.")

    def pause_until(self, at):
        self.fleet.page.wait_until(lambda: time.time() >= at, 60)

    def note(self, step, since, until, returned, load):
        """Prints and keeps what the page and the viewers saw."""
        page, say = self.fleet.page, self.story.say
        # Viewers at the other edge may come back later than the page.
        end = time.monotonic() + max(1, since + BOUND_SECONDS - time.time())
        while time.monotonic() < end and not self.viewer.frames_since(until):
            time.sleep(0.02)
        viewer_returned = self.viewer.frames_since(until) > 0
        time.sleep(1)  # viewers of the load join again at random times
        figures = load.end()
        row = {
            "step": step,
            "connected": page.state == "live",
            "pageGap": page.gap(since, until),
            "pageAway": page.seconds_away(since, until),
            "viewerGap": self.viewer.gap(since, until),
            "load": figures,
        }
        self.rows.append(row)
        says = "; ".join(page.said_since(since))
        state = "connected" if row["connected"] else page.state
        say(f"the page is {state}; {row['pageGap']:.2f} s without a frame, {row['pageAway']:.2f} s without a connection")
        if says:
            say(f"the page said: {says}")
        say(
            f"at edge-2: {row['viewerGap']:.2f} s without a frame; {figures['connected']} of {self.viewers} viewers are connected, "
            f"{figures['lost']} were disconnected, {figures['framesPerSecond']:.1f} frames/s each, {figures['wrong']} wrong frames"
        )
        if not returned or not row["connected"]:
            self.problems.append(f"{row['step']}: the page has no new frames {BOUND_SECONDS} s later; its state is {page.state}")
        if not viewer_returned:
            self.problems.append(f"{row['step']}: the viewer at edge-2 has no new frames {BOUND_SECONDS} s later")
        if figures["connected"] != self.viewers:
            self.problems.append(f"{row['step']}: {figures['connected']} of {self.viewers} viewers at edge-2 are connected")
        if figures["wrong"]:
            self.problems.append(f"{row['step']}: viewers have decoded {figures['wrong']} wrong frames")

    def summary(self):
        self.story.title("Summary")
        heads = ["step", "page", "s without a frame", "s without connection", "edge-2: s without a frame", "viewers", "disconnected"]
        table = [heads]
        for row in self.rows:
            load = row["load"]
            table.append([
                row["step"], "connected" if row["connected"] else "lost", f"{row['pageGap']:.2f}", f"{row['pageAway']:.2f}",
                f"{row['viewerGap']:.2f}", f"{load['connected']} of {self.viewers}", str(load["lost"]),
            ])
        widths = [max(len(line[i]) for line in table) for i in range(len(heads))]
        for line in table:
            print("  ".join(cell.ljust(width) for cell, width in zip(line, widths)).rstrip())
        for problem in self.problems:
            print(f"failed: {problem}")
        if not self.problems:
            print(f"All steps: the page had new frames within {BOUND_SECONDS} s, and no frame was wrong.")
        print(f"Screenshots and logs: {self.fleet.out}", flush=True)


def keep_running(fleet, story):
    story.title("The fleet keeps running until Ctrl-C")
    fleet.start_again(fleet.origins[0])
    for program in (*fleet.edges, *fleet.origins):
        print(f"{program.name:10} page {program.url}?scene={SCENE}   gRPC {program.address}")
    print(f"clothstream list --nats {fleet.nats_url}", flush=True)
    while True:
        signal.pause()


def interrupt(number, frame):
    raise Interrupted


def read_arguments():
    parser = argparse.ArgumentParser(
        prog="./dev fleet", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog=f"Exit codes: 0 success; 1 a check failed, such as no new frame {BOUND_SECONDS} s after a kill; "
        f"{WRONG_ARGUMENTS} wrong arguments; {MISSING} a program is missing; {INTERRUPTED} interrupted.",
    )
    add = parser.add_argument
    add("--out", type=pathlib.Path, default=ROOT / "build/fleet-demo", metavar="DIR",
        help="folder for screenshots and logs; its former ones are replaced (default: build/fleet-demo)")
    add("--keep", action="store_true", help="leave everything running at the end, and print the addresses, until Ctrl-C")
    add("--away", type=float, default=3, metavar="SECONDS",
        help="time after which nats-server and the edge are started again, 1.5 to 15 (default: %(default)s)")
    add("--viewers", type=int, default=20, metavar="N", help="viewers at the second edge, 1 to 1000 (default: %(default)s)")
    add("--device", default="llvmpipe", metavar="NAME",
        help="Vulkan device of the origins: a part of its name (default: %(default)s, in software)")
    add("--programs", type=pathlib.Path, default=ROOT / "build/release/bin", metavar="DIR",
        help="folder of clothstream and clothstream-server (default: build/release/bin)")
    arguments = parser.parse_args()
    if not 1 <= arguments.viewers <= 1000:
        parser.error(f"--viewers: {arguments.viewers} is not allowed; use 1 to 1000")
    if not 1.5 <= arguments.away <= 15:
        parser.error(f"--away: {arguments.away} is not allowed; use 1.5 to 15")
    return arguments


def prepare(out):
    out.mkdir(parents=True, exist_ok=True)
    for picture in out.glob("*.png"):
        picture.unlink()
    shutil.rmtree(out / "logs", ignore_errors=True)
    (out / "logs").mkdir()


def main():
    arguments = read_arguments()
    story = Story()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, interrupt)
    fleet = None
    code = None
    with tempfile.TemporaryDirectory(prefix="clothstream-fleet-") as folder:
        try:
            arguments.out = arguments.out.resolve()
            fleet = Fleet(arguments, story, pathlib.Path(folder))
            prepare(arguments.out)
            demo = Demo(fleet, story, arguments.viewers)
            demo.run()
            demo.summary()
            code = 1 if demo.problems else 0
            if arguments.keep:
                keep_running(fleet, story)
        except Interrupted:
            code = INTERRUPTED if code is None else code
        except MissingProgram as problem:
            print(f"fleet: {problem}", file=sys.stderr)
            code = MISSING
        except (ProgramFailed, OSError) as problem:
            print(f"fleet: {problem}", file=sys.stderr)
            code = 1
        finally:
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.signal(number, signal.SIG_IGN)
            if fleet:
                fleet.stop()
    sys.exit(code)


if __name__ == "__main__":
    main()
