"""Two deforming bodies that slide far: steps, time, penetration, beside CalculiX and GetFEM.

    python -m benchmarks.large_sliding [--only "ironing, shallow; CalculiX"] [--limit 300]

Every run is a process of its own.  Load steps are the user's; Newton steps count every solved
linear system after the predictor of a load step, those of failed attempts too.  Largest
penetration: of a node of one surface behind the nearest facet of the other, over all load
steps, in lengths of a slave facet.  Forces are those of the driven side, means over the second
half of the drag without one at the end, and ripple, the standard deviation of the first.

Runs are added to results/large_sliding.json, and results/large_sliding.md is written from all
of them; --only runs those whose name, "case; program", holds the text, --limit: CPU seconds of
one.  A second table compares with every peer's own limit: its stiffness (CalculiX: the penalty,
GetFEM: r) times 10 and 100, all with half the mesh width, and load steps of half the length.
Where programs differ in the limit a third method, `large_sliding_reference`, and runs that are
finer in mesh and load steps at once show who is right (a third table).
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import json
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from large_sliding_ccx import solved as by_calculix
from large_sliding_models import CASES, Case, split_off_volume
from large_sliding_more import MORE
from large_sliding_page import written
from large_sliding_peers import by_getfem, setting
from large_sliding_reference import meridian
from large_sliding_reference import solved as by_third_method

import amontons as am

HERE = Path(__file__).parent
OURS = ("amontons", "amontons, exchanged")
PEERS = ("amontons, half steps", "amontons, fine", "amontons, fine, exchanged",
         "amontons, law of CalculiX", "amontons, law of CalculiX, fine",
         "GetFEM", "GetFEM, half steps", "GetFEM, x 10", "GetFEM, x 100", "GetFEM, fine",
         "CalculiX", "CalculiX, exchanged", "CalculiX, x 10", "CalculiX, x 100",
         "CalculiX, fine", "CalculiX, x 10, fine")  # fmt: skip
ALONE = ("ironing, second order", "ironing, beyond the rim", "turned, second order")
ALL = CASES | MORE
MESHES = {"fine": 2, "finer": 4, "finest": 8}  # times as many cells
STEPS = {"half steps": 2, "quarter steps": 4}  # parts of a load step
THIRD = "third method"
ROUND = ("pressed into a tube",)  # given to it by its meridian
MORE_RUNS = {  # where two programs differ: finer in mesh, load step and stiffness
    "rolling tyre": (
        "amontons, quarter steps", "amontons, fine, half steps",
        "amontons, fine, quarter steps", "amontons, finer",
        "GetFEM, fine, half steps", "GetFEM, fine, x 10", THIRD, f"{THIRD}, half steps",
        f"{THIRD}, half steps, x 3", f"{THIRD}, quarter steps",
        f"{THIRD}, fine, half steps",
    ),
    "folded strip": (
        "amontons, fine, half steps", "GetFEM, finer", THIRD, f"{THIRD}, half steps",
        f"{THIRD}, x 3", f"{THIRD}, fine",
    ),
    "folded strip, round tip": (
        "amontons, fine, half steps", "amontons, finer", "GetFEM, finer", THIRD,
        f"{THIRD}, half steps", f"{THIRD}, fine",
    ),
    "pressed into a tube": (
        "amontons, exchanged, half steps", "GetFEM, exchanged",
        f"{THIRD}, fine", f"{THIRD}, fine, half steps", f"{THIRD}, finer",
        f"{THIRD}, finer, half steps", f"{THIRD}, finer, quarter steps",
        f"{THIRD}, finer, x 3", f"{THIRD}, finer, half steps, x 3", f"{THIRD}, finest",
        f"{THIRD}, finest, half steps", f"{THIRD}, finest, half steps, x 3",
    ),
}  # fmt: skip


def by_amontons(case, given, swap=False, law=am.NeoHookean, limit=600):
    """Evolve the case; a row as of `large_sliding_ccx.solved`."""
    model = case.model(swap, law)
    next(iter(am.evolve(model, am.QuasiStatic(1.0), until=1.0)))  # kernels
    began, worst, forces, newton = time.process_time(), 0.0, [], 0
    steps = am.evolve(model, am.QuasiStatic(1.0), until=float(given.steps))
    reached, why, most = 0.0, "", 0
    ends = np.cumsum([0, *(mesh.points.size for mesh, _ in given.bodies)])
    body, nodes, _ = given.driven
    try:
        for step in steps:
            count = step.solution.convergence.iterations
            newton, most = newton + count, max(most, count)
            paused = time.process_time()
            held = step.reaction[ends[body] : ends[body + 1]].reshape(-1, given.dim)
            forces.append(given.row(step.time, held[nodes]))
            reached = step.time / given.steps
            moved = [mesh.points + u for (mesh, _), u in zip(
                given.bodies, step.displacement, strict=True)]  # fmt: skip
            worst = max(worst, given.penetration(moved))
            began += time.process_time() - paused
            if time.process_time() - began > limit:
                why = "out of time"
                break
    except am.AmontonsError as error:
        why = str(error)
    return {"steps": len(forces), "newton": newton, "most": most,
            "seconds": time.process_time() - began, "penetration": worst, "forces": forces,
            "reached": reached, "why": why}  # fmt: skip


def in_parts(case, parts):
    """The same case with every load step in so many parts."""
    if isinstance(case, Case):
        return replace(case, presses=case.presses * parts, drags=case.drags * parts)
    way = case.way
    return replace(case, way=lambda x, step: way(x, step / parts), steps=case.steps * parts)


def child(name, program, limit):
    """One run; its row as JSON on the last line."""
    words = program.split(", ")
    fine = max(MESHES.get(word, 1) for word in words)
    case = ALL[name](fine=fine) if fine > 1 else ALL[name]()
    parts = max(STEPS.get(word, 1) for word in words)
    case = in_parts(case, parts)
    swap = "exchanged" in words
    round_ = words[0] == THIRD and name in ROUND
    given = meridian(fine, parts) if round_ else setting(case, swap)
    factor = float(next((word[2:] for word in words if word.startswith("x ")), 1.0))
    if words[0] == "amontons":
        law = split_off_volume if "law of CalculiX" in words else am.NeoHookean
        row = by_amontons(case, given, swap, law, limit)
    elif words[0] == THIRD:
        row = by_third_method(given, limit, factor, round_)
    else:
        by = by_getfem if words[0] == "GetFEM" else by_calculix
        with tempfile.TemporaryDirectory() as folder:
            row = by(given, folder, limit, factor)
    row["forces"] = [[force[0] / parts, *force[1:]] for force in row["forces"]]
    row |= {"facet": given.facet, "unknowns": given.unknowns}
    print(json.dumps({"case": name, "program": program, **row}))


def of_program(text):
    """Sorts by program, as in the lists above."""
    return ("amontons", "GetFEM", "CalculiX", THIRD).index(text.split(", ")[0])


def programs_of(name):
    """What runs a case."""
    return OURS if name in ALONE else (*OURS, *PEERS, *MORE_RUNS.get(name, ()))


def main():
    """Run what is asked for and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--limit", type=float, default=300.0)
    parser.add_argument("--missing", action="store_true", help="leave out what is stored")
    parser.add_argument("--page", action="store_true", help="write the page alone")
    parser.add_argument("--child", nargs=2)
    asked = parser.parse_args()
    if asked.child:
        child(*asked.child, asked.limit)
        return
    stored = HERE / "results" / "large_sliding.json"
    rows = json.loads(stored.read_text()) if stored.exists() else []
    for name in ALL if not asked.page else ():
        for program in programs_of(name):
            there = any((r["case"], r["program"]) == (name, program) for r in rows)
            wanted = not asked.only or any(text in f"{name}; {program};" for text in asked.only)
            if not wanted or (asked.missing and there):
                continue
            command = [sys.executable, __file__, "--limit", str(asked.limit)]
            done = subprocess.run([*command, "--child", name, program], capture_output=True,
                                  text=True, check=False)  # fmt: skip
            if done.returncode:
                print(name, program, done.stderr[-400:])
                continue
            row = json.loads(done.stdout.splitlines()[-1])
            rows = [r for r in rows if (r["case"], r["program"]) != (name, program)] + [row]
            print(name, program, f"{row['reached']:.0%}", row["newton"],
                  f"{row['seconds']:.1f}", *row["forces"][-1:], row["why"], sep=" | ",
                  flush=True)  # fmt: skip
            stored.write_text(json.dumps(rows) + "\n")
    more = dict.fromkeys(program for some in MORE_RUNS.values() for program in some)
    written(rows, list(ALL), sorted([*OURS, *PEERS, *more], key=of_program))


if __name__ == "__main__":
    main()
