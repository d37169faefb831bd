# SPDX-License-Identifier: MIT
"""The examples of the page: packets with what they decode to, and a mesh with its order."""
import re

from decoder import Decoder, parse
from entropy import FORMAT
from order import MeshOrder


def rows(width):
    """Rows of the tables with this number of cells, without backquotes."""
    for line in open(FORMAT):
        cells = [cell.strip().strip("`") for cell in line.strip().strip("|").split("|")]
        if line.startswith("|") and len(cells) == width:
            yield cells


def numbers(cell):
    return tuple(None if word == "-" else int(word) for word in cell.split())


def check_packets():
    """Decodes the packets of the page. Returns their number."""
    positions = list(zip(*(map(numbers, row[1:]) for row in rows(4) if row[0].isdigit())))
    expected = {"small_1": positions[0], "small_2": positions[1], "small_3": positions[1], "small_4": positions[2]}
    cloth = {"vertexCount": 9, "rows": 3, "columns": 3}
    decoder = Decoder({"maxError": 0.009999999776482582, "normals": "none", "cloths": [cloth]})
    found = [row for row in rows(3) if re.fullmatch("small_[0-9]", row[0])]
    assert [row[0] for row in found] == list(expected)
    for name, packet, hashed in found:
        packet = bytes.fromhex(packet)
        assert packet == open("tests/golden/%s.bin" % name, "rb").read(), name
        decoder.decode(parse(packet))
        assert tuple(decoder.newest["R"]) == expected[name], name
        assert decoder.hash() == hashed, name
    return len(found)


def check_mesh():
    """Compares the order of the page's mesh. Returns the number of its vertices."""
    page = open(FORMAT).read().split("### A mesh")[1].split("## ")[0]
    triangles = [int(number) for number in " ".join(re.findall("^    (.*)$", page, re.M)).replace(",", "").split()]
    table = [list(map(numbers, row)) for row in rows(7) if row[0].isdigit()]
    rest = [float(x) for row in table for x in row[1]]
    order = MeshOrder(len(table), triangles, rest)
    for (v,), _, (rank,), parents, weights, ring, nearest in table:
        found = order.rank[v], tuple(order.parents[v]), order.weights[v], tuple(order.ring[v]), tuple(order.nearest[v])
        assert found == (rank, parents, weights, ring, nearest), "vertex %d: %s" % (v, found)
    return len(table)
