# SPDX-License-Identifier: MIT
"""Those who watch a scene during the demo: a page in a browser, a viewer in a terminal, and a load of viewers.

All times are seconds of time.time(), which is also the clock of the page.
"""

import json
import os
import pathlib
import signal
import subprocess
import threading
import time

from programs import Program, ProgramFailed

FOLDER = pathlib.Path(__file__).resolve().parent
OPEN_SECONDS = 90
PICTURE_SECONDS = 60


def longest_gap(times, since, until):
    """Longest time without a frame that ends after `since`, in seconds. The time from the last frame to `until` counts."""
    before = [at for at in times if at < since]
    marks = before[-1:] + [at for at in times if since <= at <= until] + [until]
    return max((later - earlier for earlier, later in zip(marks, marks[1:])), default=until - since)


class Watcher:
    """Times of frames. Threads may add and read them."""

    def __init__(self):
        self.lock = threading.Lock()
        self.times = []

    def add_frame(self, at):
        with self.lock:
            self.times.append(at)

    def frames_since(self, since):
        with self.lock:
            return sum(at >= since for at in self.times)

    def gap(self, since, until=None):
        with self.lock:
            return longest_gap(self.times, since, until or time.time())


class Page(Watcher):
    """The page of an edge in a browser without a window."""

    def __init__(self, node, url, out, log):
        super().__init__()
        self.states = []  # (time, state)
        self.said = []  # (time, text) that a person at the page reads
        self.errors = []
        self.pictures = {}
        self.wrong_frames = 0
        environment = {**os.environ, "CLOTHSTREAM_SCREENSHOTS": str(out)}
        self.program = Program("the browser", [node, FOLDER / "page.mjs", url], log, environment, pipes=True)
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.program.process.stdout:
            event = json.loads(line)
            if "tick" in event:
                self.add_frame(event["at"])
            with self.lock:
                if "state" in event:
                    self.states.append((event["at"], event["state"]))
                if "said" in event:
                    self.said.append((event["at"], event["said"]))
                if "error" in event:
                    self.errors.append(event["error"])
                if "picture" in event:
                    self.pictures[event["picture"]] = event
                    self.wrong_frames = event["wrongFrames"]

    @property
    def state(self):
        with self.lock:
            return self.states[-1][1] if self.states else "opening"

    def states_since(self, since):
        with self.lock:
            return [state for at, state in self.states if at >= since]

    def said_since(self, since):
        with self.lock:
            return list(dict.fromkeys(text for at, text in self.said if at >= since))

    def seconds_away(self, since, until):
        """Time without a connection to the scene."""
        with self.lock:
            states = [(at, state) for at, state in self.states if since <= at <= until] + [(until, "")]
            return sum(later[0] - earlier[0] for earlier, later in zip(states, states[1:]) if earlier[1] != "live")

    def check(self):
        if not self.program.runs:
            code = self.program.process.returncode
            raise ProgramFailed(f"the browser ended with {code}; its log, {self.program.log}, ends:\n{self.program.tail()}")

    def wait_until(self, holds, seconds):
        """Returns whether it holds before the time is over."""
        end = time.monotonic() + seconds
        while not holds():
            self.check()
            if time.monotonic() > end:
                return False
            time.sleep(0.02)
        return True

    def wait_for_frames(self, count, since, seconds=OPEN_SECONDS):
        """Waits for this number of frames of a connected page."""
        return self.wait_until(lambda: self.state == "live" and self.frames_since(since) >= count, seconds)

    def ask_for_picture(self, name):
        self.program.process.stdin.write(f"picture {name}\n")

    def wait_for_picture(self, name):
        """Waits for NAME.png. Returns what the page shows there, as page.mjs says."""
        if not self.wait_until(lambda: name in self.pictures, PICTURE_SECONDS):
            raise ProgramFailed(f"the page made no picture within {PICTURE_SECONDS} s")
        return self.pictures[name]

    def stop(self):
        try:
            self.program.process.stdin.close()
            self.program.process.wait(10)
        except (OSError, subprocess.TimeoutExpired):
            self.program.stop()


class Viewer(Watcher):
    """`clothstream join` with the role viewer. Times are those at which frames are decoded."""

    def __init__(self, program, address, scene, log):
        super().__init__()
        command = [program, "join", address, "--scene", scene, "--role", "viewer", "--name", "Viewer", "--events", "--frames"]
        self.program = Program("the viewer", command, log, pipes=True)
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.program.process.stdout:
            if '"event":"frame"' in line:
                self.add_frame(time.time())

    def stop(self):
        self.program.stop()


class Load:
    """`clothstream load`: viewers that join again when they are disconnected."""

    def __init__(self, program, address, scene, viewers, log):
        self.viewers = viewers
        command = [program, "load", address, "--scene", scene, "--participants", viewers, "--viewers", viewers]
        command += ["--decoders", max(1, viewers // 10), "--seconds", 3600, "--json"]
        self.program = Program("the load", command, log, pipes=True)

    def end(self):
        """Ends it and returns its figures."""
        self.program.process.send_signal(signal.SIGINT)
        out, _ = self.program.process.communicate(timeout=20)
        try:
            figures = json.loads(out)
        except json.JSONDecodeError:
            raise ProgramFailed(f"the load gave no figures; its log, {self.program.log}, ends:\n{self.program.tail()}") from None
        figures["connected"] = figures["joined"] - figures["lost"]
        figures["wrong"] = figures["hashMismatches"] + figures["decodeErrors"]
        return figures

    def stop(self):
        self.program.stop(3)
