#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Writes figure_*.json, based on the figures of Va, Choi and Hong (Applied Sciences 2021, 11, 8255), and solver_*.json: one
# sheet with every solver. Figure 8 (7,820,856 nodes) is only in clothstream-bench paper, because it is too large to open by mistake.
import json

NODE_MASS, WIDTH, BALL, DAMPING = 0.13, 10, 2.5, 0.1
FLAT = {"x": -0.70710678, "w": 0.70710678}


def write(name, description, scene):
    with open(f"{name}.json", "w") as out:
        json.dump({"name": name, "description": description, **scene}, out, indent=1)
        out.write("\n")


def on_balls(rate, panels):
    """Scene with sheets next to each other, each above its ball. A tick is one substep."""
    cloths, colliders = [], [{"name": "floor", "plane": {}}]
    for i, (name, nodes, stiffness, solver, bend) in enumerate(panels):
        x = (i - (len(panels) - 1) / 2) * 12
        spring = {"stiffness": stiffness, "damping": DAMPING}
        cloths.append({
            "name": name,
            "grid": {"rows": nodes, "columns": nodes, "width": WIDTH, "height": WIDTH,
                     "pose": {"position": {"x": x, "y": 3.3 + BALL + 0.5, "z": -WIDTH / 2}, "orientation": FLAT}},
            "mass": round(NODE_MASS * nodes * nodes, 3),
            "structural": spring, "shear": spring, **({"bend": spring} if bend else {}),
            "damping": 0.5, "friction": 0.8, "thickness": 0.1, "solver": solver})
        colliders.append({"name": f"ball-{i + 1}", "sphere": {"radius": BALL}, "pose": {"position": {"x": x, "y": 3.3}}})
    return {"simulationRate": rate, "streamRate": rate // (rate // 50), "substeps": 1, "cloths": cloths,
            "colliders": colliders}


def constraint(bend):
    return {"constraint": {"bendConstraints": bend, "iterations": 20}}


def acad(iterations=20):
    return {"acad": {"constraint": {"bendConstraints": True, "iterations": iterations}}}


SPRINGS = {"massSpring": {}}
SHORT, LONG = 200, 62  # steps per second: 0.005 s, and 0.0161 s instead of 0.016 s

write("figure_07", "Mass-spring sheet of 9,216 nodes on a ball, steps of 5 ms.",
      on_balls(SHORT, [("sheet", 96, 600, SPRINGS, True)]))
write("figure_09", "Constraint enforcement: 1,024 nodes without bend springs, 1,156 with them.",
      on_balls(SHORT, [("without-bend", 32, 200, constraint(False), False), ("with-bend", 34, 200, constraint(True), True)]))
write("figure_10", "1,024 nodes as mass-spring and as ACAD.",
      on_balls(SHORT, [("mass-spring", 32, 200, SPRINGS, True), ("acad", 32, 200, acad(), True)]))
write("figure_11", "Mass-spring sheets of 100, 200 and 600 N/m: soft to hard.",
      on_balls(SHORT, [(f"ks-{k}", 32, k, SPRINGS, True) for k in (100, 200, 600)]))
write("figure_12", "Constraint enforcement without and with bend springs, steps of 5 ms.",
      on_balls(SHORT, [("without-bend", 32, 200, constraint(False), False), ("with-bend", 32, 200, constraint(True), True)]))
write("figure_13", "ACAD sheets of 100, 200 and 600 N/m: none gets long.",
      on_balls(SHORT, [(f"ks-{k}", 32, k, acad(), True) for k in (100, 200, 600)]))
write("figure_14", "Constraint enforcement without and with bend springs, steps of 16 ms.",
      on_balls(LONG, [("without-bend", 32, 200, constraint(False), False), ("with-bend", 32, 200, constraint(True), True)]))
write("figure_15", "ACAD at steps of 16 ms, where 200 N/m as springs alone blow up (and are refused).",
      on_balls(LONG, [("acad", 32, 200, acad(60), True)]))

SHEET = {
    "grid": {"rows": 32, "columns": 32, "width": 1, "height": 1, "pose": {"position": {"y": 1.6, "z": -0.5}, "orientation": FLAT}},
    "mass": 0.2, "structural": {"stiffness": 60, "damping": 0.004}, "shear": {"stiffness": 30, "damping": 0.002},
    "bend": {"stiffness": 3, "damping": 0.001}, "damping": 0.4, "friction": 0.3,
    "pins": [{"firstRow": 0, "firstColumn": 0, "lastColumn": 31, "columnStep": 31}]}
SOLVERS = {
    "mass_spring": ("springs are forces", {"massSpring": {}}, 16),
    "constraint": ("structural and shear springs keep their length", {"constraint": {}}, 6),
    "acad": ("springs stretched by more than a tenth are constraints", {"acad": {}}, 16),
    "xpbd": ("extended position-based dynamics", {"xpbd": {}}, 16),
    "implicit_euler": ("springs are forces of the step's end", {"implicitEuler": {}}, 4),
}
for solver, (what, settings, substeps) in SOLVERS.items():
    write(f"solver_{solver}", f"A sheet swings down from two corners past a ball: {what}.",
          {"simulationRate": 72, "streamRate": 72, "substeps": substeps,
           "cloths": [{"name": "sheet", **SHEET, "solver": settings}],
           "colliders": [{"name": "ball", "sphere": {"radius": 0.2}, "pose": {"position": {"y": 0.9, "z": -0.3}}}]})
