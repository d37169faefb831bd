#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs suites of clothstream-bench and writes their tables into the pages of docs/.

A page holds a table between the lines "<!-- report: NAME -->" and "<!-- end -->". The line above a table has its
command, machine, commit and date.

  report.py --bench PROGRAM [SUITE...]   run the suites (default: all) and rewrite their tables
  report.py --kept DEVICE                rewrite the tables NAME_on_DEVICE from the rows in tests/bench/results/DEVICE
  report.py --check                      check that the tables in docs/ are known and have the right columns
"""
import argparse
import datetime
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
BEGIN, END = "<!-- report: %s -->", "<!-- end -->"


def number(value, digits=3):
    """A number with this many significant digits, and thousands separated."""
    if isinstance(value, int):
        return f"{value:,}"
    text = f"{value:.{digits}g}"
    return f"{float(text):,.0f}" if "e" in text or abs(value) >= 1000 else text


def percent(part):
    return number(100 * part, 2) + " %"


def pair(row, name, unit=1.0):
    """Median and 99th percentile."""
    return f"{number(unit * row[name + 'Median'])} / {number(unit * row[name + 'P99'])}"


def grid(row):
    return f"{row['size']}x{row['size']}"


def is_plain(row):
    return not (row["springDamping"] or row["air"] or row["spheres"]) and row["shape"] == "grid"


def variant(row):
    parts = ["springs"] + ["damping"] * row["springDamping"] + ["air"] * row["air"]
    parts += [f"{row['spheres']} spheres" if row["spheres"] > 1 else "1 sphere"] * (row["spheres"] > 0)
    return ", ".join(parts) + (", as a mesh" if row["shape"] == "mesh" else "")


def mass_spring(rows):
    return [[grid(r), number(r["nsMedian"]), number(r["nodeStepsPerSecond"] / 1e6), number(r["floorRatio"], 2),
             number(r["referenceNs"])] for r in rows if is_plain(r) and r["arithmetic"] == "deterministic"]


def features(rows):
    detailed = [r for r in rows if r["size"] == next((x["size"] for x in rows if x["air"]), None)]
    builtin = {variant(r): r for r in detailed if r["arithmetic"] == "builtin"}
    return [[variant(r), number(r["nsMedian"]), number(builtin[variant(r)]["nsMedian"]) if variant(r) in builtin else ""]
            for r in detailed if r["arithmetic"] == "deterministic"]


def equal_strain(rows):
    return [[number(r["nodes"]), percent(r["bound"]), r["method"], r["substeps"], r["iterations"],
             f"{number(r['nsPerNodeFrame'])} / {number(r['nsPerNodeFrameMin'])}", percent(r["strainMean"]),
             percent(r["strainP99"]), number(r["elasticEnergy"], 2)] for r in rows]


def coarse(rows):
    def case(r):
        levels = ", 2 levels" if r["levels"] == 2 else ""
        return f"{r['cells']} cells, {r['sweeps']} sweeps, every {r['every']}{levels}" if r["cells"] else "springs alone"
    def ball(r):
        return f"{number(r['ballSpeed'])} m/s" if r["ballSpeed"] else "none"
    return [[number(r["nodes"]), r["substeps"], case(r), ball(r),
             f"{number(r['nsPerNodeFrame'])} / {number(r['nsPerNodeFrameMin'])}", percent(r["strainMean"]),
             percent(r["strainP99"]), percent(r["largestStrainMean"]), f"{r['kineticEnergy']:.4f}"] for r in rows]


def paper(rows):
    def case(r):
        without = " without compliance" if r.get("compliance") == 0 else ""
        return r["method"] + without
    def of_paper(value):
        return value if isinstance(value, str) else number(value, 5)
    return [[r["figure"], case(r), number(r["nodes"]), number(r["springs"]), "yes" if r["ballAndNormals"] else "no",
             number(r["framesPerSecond"]), of_paper(r["paperFramesPerSecond"]),
             number(r["iterations"]) if "iterations" in r else "",
             {True: "yes", False: "no"}.get(r.get("converged"), "")] for r in rows]


def colliders(rows):
    return [[number(r["colliders"]), number(r["tickMsMin"]), number(r["nearMsMedian"], 2) if r["colliders"] else "",
             number(r["referenceMs"])] for r in rows if "touching" not in r]


def colliders_touching(rows):
    return [[r["touching"], number(r["tickMsMin"]), number(r["withoutMsMin"]), number(r["timesWithout"], 2)]
            for r in rows if "touching" in r]


def self_collision(rows):
    def case(r):
        return f"{r['lies']}, {grid(r)}, {'with' if r['selfCollision'] else 'without'} self-collision" if "lies" in r \
            else f"scene {r['scene']}, {number(r['nodes'])} nodes"
    return [[case(r), number(r["nsMedian"]), pair(r, "tickMs"), number(r["touching"]) if "touching" in r else "",
             number(r["crossings"]) if "crossings" in r else ""] for r in rows]


def garment(rows):
    return [[number(r["nodes"]), r["solver"], r["limits"], f"{number(r['nsMedian'])} / {number(r['nsMin'])}",
             number(r["timesNotSkinned"], 2)] for r in rows if "limits" in r]


def figures(rows):
    return [[r["scene"], number(r["nodes"]), r["figures"], pair(r, "tickMs")] for r in rows if "figures" in r]


def enforcement(rows):
    return [[number(r["nodes"]), number(r["springs"]), r["workgroups"], number(r["framesPerSecond"]),
             number(r["framesPerSecondBest"])] for r in rows]


def solvers(rows):
    return [[number(r["nodes"]), r["method"], r["substeps"],
             f"{number(r['nsPerNodeSubstep'])} / {number(r['nsPerNodeSubstepMin'])}", percent(r["strainMean"]),
             percent(r["strainP99"]), percent(r["strainMax"])] for r in rows]


def acad(rows):
    def case(r):
        return r["method"] + (", coarse" if r.get("coarse") else "")
    return [[number(r["nodes"]), case(r), percent(r["active"]) if "active" in r else "", number(r["nsPerNodeSubstep"]),
             number(r["timesMassSpring"], 2), number(r["timesFasterThanConstraint"], 2)] for r in rows]


def curtain(rows):
    return [[number(r["nodes"]), pair(r, "tickMs"), pair(r, "poseToPacketMs"), f"{r['frames']} of {r['ticks']}",
             r["lateTicks"], number(r["bitsPerVertex"], 2)] for r in rows]


def offload(rows):
    return [[number(r["vertices"]), number(r["streamMs"], 2), number(r["kbitPerSecond"], 2), r["substeps"],
             number(r["massSpringMs"], 2), number(r["xpbdMs"], 2), number(r["massSpringFewMs"], 2),
             number(r["xpbdFewMs"], 2), number(r["massSpringEvenSubsteps"], 2), number(r["xpbdEvenSubsteps"], 2)]
            for r in rows]


def page(rows):
    return [[r["figure"].strip(), f"{number(r['value'])} {r['unit']}", r["verdict"]] for r in rows]


# Name of the table: suite, arguments, columns, function from rows to cells.
TABLES = {
    "mass_spring": ("mass_spring", [], ["grid", "ns a node and substep", "million node-steps/s", "times the floor",
                                        "reference, ns"], mass_spring),
    "mass_spring_features": ("mass_spring", [], ["at 256x256", "ns a node and substep", "with built-in arithmetic"],
                             features),
    "equal_strain": ("equal_strain", [], ["nodes", "bound", "solver", "substeps", "iterations",
                                          "ns a node and frame, median / min", "strain, mean", "p99",
                                          "elastic energy, J"], equal_strain),
    "paper": ("paper", ["--seconds", "0.4"], ["figure", "solver", "nodes", "springs", "ball and normals",
                                              "our steps/s", "the paper's frames/s", "iterations", "converged"],
              paper),
    "coarse": ("coarse", [], ["nodes", "substeps", "correction", "ball", "ns a node and frame, median / min",
                              "strain, mean", "p99", "largest mean", "kinetic energy, J"], coarse),
    "colliders": ("colliders", [], ["colliders", "tick, min ms", "search for near colliders, ms", "reference, ms"],
                  colliders),
    "colliders_touching": ("colliders", [], ["a hundred spheres", "tick, min ms", "without them, min ms",
                                             "times without"], colliders_touching),
    "self_collision": ("self_collision", ["--size", "64"], ["case", "ns a node and substep", "tick, ms, median / p99",
                                                            "touching pairs", "crossings"], self_collision),
    "garment": ("garment", [], ["nodes", "solver", "limits of the nodes", "ns a node and substep, median / min",
                                "times not skinned"], garment),
    "garment_figures": ("garment", [], ["scene", "nodes", "figures", "tick, ms, median / p99"], figures),
    "enforcement": ("enforcement", [], ["nodes", "springs", "workgroups", "frames/s", "best"], enforcement),
    "solvers": ("solvers", [], ["nodes", "solver", "substeps", "ns a node and substep, median / min", "strain, mean",
                                "p99", "max"], solvers),
    "acad": ("acad", ["--size", "128"], ["nodes", "solver", "active springs", "ns a node and substep",
                                         "times mass-spring", "times faster than full enforcement"], acad),
    "curtain": ("curtain", ["--software-threads", "0"], ["nodes", "tick, ms, median / p99",
                                                         "pose to packet, ms, median / p99", "frames of ticks",
                                                         "late ticks", "bits a vertex"], curtain),
    "offload": ("offload", [], ["vertices", "stream, ms", "kbit/s", "substeps", "mass-spring, ms", "XPBD, ms",
                                "mass-spring with 10", "XPBD with 10", "even with mass-spring", "with XPBD"], offload),
    "page": ("page", [], ["figure", "measured", "goal"], page),
}
# Rows of earlier runs. PLOTTED are suites whose rows a plot reads from there.
RESULTS = ROOT / "tests" / "bench" / "results"
PLOTTED = {"offload"}
# Suites that are not part of clothstream-bench.
PROGRAMS = {"offload": ["node", "tests/bench/offload/offload.mjs"], "page": ["node", "tests/bench/page/page.mjs"]}


def pages():
    return sorted((ROOT / "docs").glob("*.md"))


# A table of another device has the name of its table on this machine, "_on_" and the device.
def header(name):
    columns = TABLES[name.partition("_on_")[0]][2]
    return "| " + " | ".join(columns) + " |\n|" + "---|" * len(columns) + "\n"


def sections(text):
    """Name and content of each table of a page."""
    pattern = re.escape(BEGIN).replace("%s", r"(\w+)") + r"\n(.*?)" + re.escape(END)
    return re.findall(pattern, text, re.S)


def check():
    found = set()
    for page in pages():
        for name, content in sections(page.read_text()):
            if name.partition("_on_")[0] not in TABLES:
                sys.exit(f"{page.name}: report.py has no table {name}; it has {', '.join(TABLES)}")
            if header(name) not in content:
                sys.exit(f"{page.name}: the table {name} must have the header\n{header(name)}")
            found.add(name)
    if missing := set(TABLES) - found:
        sys.exit(f"docs/: no page has the tables {', '.join(sorted(missing))}")
    print(f"{len(found)} tables have the columns of report.py")


def processor():
    names = re.findall(r"^model name\s*: (.*)$", pathlib.Path("/proc/cpuinfo").read_text(), re.M)
    return f"{os.cpu_count()} cores of {names[0] if names else 'an unknown processor'}"


def commit():
    def git(*arguments):
        return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    return git("rev-parse", "--short", "HEAD") + (" with changes" if git("status", "--porcelain", "-uno") else "")


def report(program, suites):
    unknown = set(suites) - {suite for suite, *_ in TABLES.values()}
    if unknown:
        sys.exit(f"no table is of suite {', '.join(sorted(unknown))}")
    made, results = commit(), {}
    for name, (suite, arguments, _, cells) in TABLES.items():
        if suites and suite not in suites:
            continue
        command = [suite, *arguments]
        key = tuple(command)
        shown = f"./dev bench {suite}" if suite in PROGRAMS else "clothstream-bench " + " ".join(command)
        if key not in results:
            print(shown, flush=True)
            called = PROGRAMS.get(suite, [program, *command])
            output = subprocess.run([*called, "--json"], cwd=ROOT, capture_output=True, text=True)
            if output.returncode:
                sys.exit(output.stderr.strip())
            # Log lines of a suite may precede the rows.
            results[key] = json.loads(output.stdout[output.stdout.index("[\n"):])
            if suite in PLOTTED:
                RESULTS.mkdir(exist_ok=True)
                (RESULTS / f"{suite}.json").write_text(json.dumps(results[key], indent=2) + "\n")
        rows = results[key]
        device = next((row[key] for row in rows for key in ("device", "engine") if key in row), "no device")
        table = (f"`{shown}`; {device}, {processor()}; commit {made}; "
                 f"{datetime.date.today():%-d %B %Y}\n\n" + header(name)
                 + "".join("| " + " | ".join(map(str, row)) + " |\n" for row in cells(rows)))
        replace(name, table)


def keep(device):
    """Tables from the rows of an earlier run elsewhere. run.json has its commit, date and machine."""
    folder = RESULTS / device
    run = json.loads((folder / "run.json").read_text())
    for page in pages():
        for name, _ in sections(page.read_text()):
            base, _, of = name.partition("_on_")
            if of != device:
                continue
            suite, _, _, cells = TABLES[base]
            rows = json.loads((folder / f"{suite}.json").read_text())
            replace(name, f"`tests/bench/results/{device}/{suite}.json`; {run['machine']};\n"
                          f"commit {run['commit']}; {run['date']}\n\n" + header(name)
                          + "".join("| " + " | ".join(map(str, row)) + " |\n" for row in cells(rows)))


def replace(name, table):
    for page in pages():
        text = page.read_text()
        begin = text.find(BEGIN % name + "\n")
        if begin >= 0:
            start, end = begin + len(BEGIN % name) + 1, text.index(END, begin)
            page.write_text(text[:start] + "\n" + table + "\n" + text[end:])
            return
    sys.exit(f"no page of docs/ has the line {BEGIN % name}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bench", help="path of clothstream-bench")
    parser.add_argument("--kept", metavar="DEVICE", help="rewrite the tables of this device from its kept rows")
    parser.add_argument("--check", action="store_true", help="only check the tables of docs/")
    parser.add_argument("suites", nargs="*")
    options = parser.parse_args()
    if options.check:
        check()
    elif options.kept:
        keep(options.kept)
    elif options.bench:
        report(options.bench, options.suites)
    else:
        parser.error("--bench PROGRAM, --kept DEVICE or --check is required")


if __name__ == "__main__":
    main()
