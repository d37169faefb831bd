#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Size of a fleet: servers, edges, NATS nodes and bandwidth for a number of scenes and viewers.

The first table is arithmetic from measured costs (docs/fleet.md names them). The second one simulates a crowd that joins
and leaves while edges fail, and shows by how much the arithmetic is too low: the load of the fullest edge, and how many
viewers an edge must admit in one second.
"""

import argparse
import heapq
import math
import random

# Measured: processor time of an edge for one frame to one viewer by WebSocket, s.
EDGE_FRAME = 15e-6
# Measured by fleet.py: processor time of nats-server for one frame that it sends to an edge, s.
NATS_MESSAGE = 71e-6
# Part of a processor and of a network card that is used, so that bursts have room.
USED = 0.6
# A network card, bit/s.
CARD = 10e9
# New connections that a port admits per second (profiles home and public).
ADMITTED = 200


def demand(scenes, viewers, rate, frame_bytes, scenes_of_server, qualities):
    """What a fleet needs for `scenes` with `viewers` in each."""
    stream = rate * frame_bytes * 8  # bit/s of one viewer
    of_edge = min(USED / (rate * EDGE_FRAME), USED * CARD / stream)
    edges_of_scene = math.ceil(viewers / of_edge)
    edges = max(math.ceil(scenes * viewers / of_edge), edges_of_scene)
    # Small scenes share edges; each scene of an edge costs its stream once.
    streams_to_edges = scenes * edges_of_scene * qualities
    nats = streams_to_edges * rate * NATS_MESSAGE / USED
    return {
        "servers": math.ceil(scenes / scenes_of_server),
        "edges": edges,
        "NATS processors": max(1, math.ceil(nats)),
        "Gbit/s into NATS": scenes * qualities * stream / 1e9,
        "Gbit/s to edges": streams_to_edges * stream / 1e9,
        "Gbit/s to viewers": scenes * viewers * stream / 1e9,
        "viewers of an edge": of_edge,
    }


def simulate(viewers, edges, of_edge, stay, seconds, failures, seed=1):
    """A crowd of about `viewers`, who are there at the start, in which everybody stays for `stay` seconds on average, joins by name (a random edge
    of two, the emptier one, as a proxy chooses), and reconnects when its edge fails. A failed edge comes back after a
    minute. Returns the load of the fullest edge, as a part of its capacity, and the most joins of an edge in a second."""
    chance = random.Random(seed)
    load = [0] * edges
    up = [True] * edges
    at = {}  # edge of each viewer
    events = [(0.0, "join", None)]
    for i in range(failures):
        heapq.heappush(events, (seconds * (i + 1) / (failures + 1), "fail", None))
    fullest, most, joins = 0.0, 0, {}

    def place(viewer, now, counts=True):
        nonlocal fullest, most
        alive = [edge for edge in range(edges) if up[edge]]
        edge = min(chance.sample(alive, min(2, len(alive))), key=lambda one: load[one])
        at[viewer] = edge
        load[edge] += 1
        fullest = max(fullest, load[edge] / of_edge)
        if not counts:
            return
        key = (edge, int(now))
        joins[key] = joins.get(key, 0) + 1
        most = max(most, joins[key])

    for number in range(1, viewers + 1):
        place(number, 0, counts=False)
        heapq.heappush(events, (chance.expovariate(1 / stay), "leave", number))
    while events:
        now, kind, viewer = heapq.heappop(events)
        if now > seconds:
            break
        if kind == "join":
            number += 1
            place(number, now)
            heapq.heappush(events, (now + chance.expovariate(1 / stay), "leave", number))
            heapq.heappush(events, (now + chance.expovariate(viewers / stay), "join", None))
        elif kind == "leave":
            edge = at.pop(viewer, None)
            if edge is not None:
                load[edge] -= 1
        elif kind == "back":
            up[viewer] = True
        elif kind == "again":
            if viewer in at:
                place(viewer, now)
        else:
            lost = max((edge for edge in range(edges) if up[edge]), key=lambda one: load[one])
            up[lost], load[lost] = False, 0
            heapq.heappush(events, (now + 60, "back", lost))
            for who, edge in list(at.items()):
                if edge == lost:
                    # Clients wait for a random time before they connect again.
                    heapq.heappush(events, (now + chance.uniform(0.1, 2), "again", who))
    return fullest, most


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rate", type=float, default=72, help="frames/s (default: %(default)s)")
    parser.add_argument("--frame-bytes", type=float, default=7300, help="bytes of a frame (default: %(default)s)")
    parser.add_argument("--scenes-of-server", type=float, default=16, help="scenes that a server carries (default: %(default)s)")
    parser.add_argument("--qualities", type=int, default=2, help="qualities that edges receive (default: %(default)s)")
    arguments = parser.parse_args()
    cases = [(1, 100_000), (100, 1_000), (10_000, 10)]
    columns = None
    for scenes, viewers in cases:
        needs = demand(scenes, viewers, arguments.rate, arguments.frame_bytes, arguments.scenes_of_server, arguments.qualities)
        if columns is None:
            columns = list(needs)
            print("| scenes | viewers in each | " + " | ".join(columns) + " |")
            print("|" + "---|" * (2 + len(columns)))
        print(f"| {scenes:,} | {viewers:,} | " + " | ".join(f"{needs[name]:,.3g}" if needs[name] < 1000 else f"{needs[name]:,.0f}" for name in columns) + " |")

    of_edge = demand(1, 1, arguments.rate, arguments.frame_bytes, 1, 1)["viewers of an edge"]
    print("\n| viewers | edges | edges that fail in ten minutes | fullest edge, of its share | joins of an edge in the worst second |")
    print("|---|---|---|---|---|")
    for viewers in (10_000, 100_000):
        for failures in (0, 3):
            edges = math.ceil(viewers / of_edge)
            fullest, most = simulate(viewers, edges, of_edge, 300, 600, failures)
            print(f"| {viewers:,} | {edges} | {failures} | {100 * fullest:.0f} % | {most} (admitted: {ADMITTED}) |")


if __name__ == "__main__":
    main()
