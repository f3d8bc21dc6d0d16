"""Two deforming bodies that slide far: steps, time, penetration, beside CalculiX and GetFEM.

    python -m benchmarks.large_sliding [--only "ironing, shallow"] [--limit 600]

Every run is a process of its own.  Load steps are the user's; Newton steps count every solved
linear system after the predictor of a load step, those of failed attempts too.  Largest
penetration: of a node of one surface behind the nearest facet of the other, over all load
steps, in lengths of a slave facet.  Forces on the upper body: mean over the second half of the
drag, without one at the end, and ripple (standard deviation of the normal one).

Writes results/large_sliding.md and .json beside this file.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from large_sliding_ccx import solved as by_calculix
from large_sliding_models import CASES, by_getfem, corners, penetration
from large_sliding_more import MORE
from machine import describe

import amontons as am

HERE = Path(__file__).parent
PROGRAMS = ("amontons", "amontons, exchanged", "CalculiX", "CalculiX, exchanged", "GetFEM")


ALONE = (  # cases of amontons alone
    "ironing, second order", "ironing in 3D, fine", "ironing, beyond the rim", *MORE,
)  # fmt: skip


def by_amontons(case, swap=False, limit=600):
    """Evolve the case; a row as of `large_sliding_ccx.solved`."""
    model = case.model(swap)
    next(iter(am.evolve(model, am.QuasiStatic(1.0), until=1.0)))  # kernels
    began, worst, forces, newton = time.process_time(), 0.0, [], 0
    steps = am.evolve(model, am.QuasiStatic(1.0), until=float(case.steps), time_limit=limit)
    reached, why = 0.0, ""
    most = 0
    try:
        for step in steps:
            count = step.solution.convergence.iterations
            newton, most = newton + count, max(most, count)
            f = step.resultant()
            forces.append([step.time, *(-(-1 if swap else 1) * f)[[0, -1]]])
            reached = step.time / case.steps
            if not hasattr(case, "lower"):
                continue
            paused = time.process_time()
            u = step.state.displacement.reshape(-1, case.lower.points.shape[1])
            n = len(case.lower.points)
            moved = [case.lower.points + u[:n], case.upper.points + u[n:]]
            worst = max(worst, penetration(case, moved))
            began += time.process_time() - paused
    except am.AmontonsError as error:
        why = str(error)
    return {"steps": len(forces), "newton": newton, "most": most,
            "seconds": time.process_time() - began, "penetration": worst, "forces": forces,
            "reached": reached, "why": why}  # fmt: skip


def child(name, program, limit):
    """One run; its row as JSON on the last line."""
    case = (CASES | MORE)[name]()
    swap = program.endswith("exchanged")
    if program.startswith("amontons"):
        row = by_amontons(case, swap, limit)
    else:
        with tempfile.TemporaryDirectory() as folder:
            row = (by_getfem(case, folder, limit) if program == "GetFEM"
                   else by_calculix(case, folder, swap, limit))  # fmt: skip
    if name in MORE:
        parts = case.model().bodies
        row |= {"facet": 0.0, "late": case.steps / 2, "unknowns": sum(
            body.mesh.points.size for body in parts)}  # fmt: skip
        print(json.dumps({"case": name, "program": program, **row}))
        return
    points = [mesh.points for mesh in (case.lower, case.upper)]
    side = ("lower", "top") if swap else ("upper", "bottom")
    count = len(corners(getattr(case, side[0]), side[1]))
    d = points[0].shape[1]
    extent = np.prod(np.ptp(getattr(case, side[0]).points, axis=0)[: d - 1])
    row["facet"] = float((extent / count) ** (1 / (d - 1)))
    row["late"] = case.presses + case.drags / 2 - 0.5
    row["unknowns"] = d * sum(len(p) for p in points)
    print(json.dumps({"case": name, "program": program, **row}))


def cells(row):
    """A line of the table."""
    forces = np.array(row["forces"]).reshape(-1, 3)
    late = forces[forces[:, 0] > row["late"]]
    whole = "yes" if row["reached"] > 0.999 else f"to {row['reached']:.0%}"
    told = ["", "", ""]  # of a path that ended
    if whole == "yes":
        mean, ripple = np.abs(late[:, 1:].mean(axis=0)), late[:, 1:].std(axis=0)
        told = [f"{mean[1]:.4f}", f"{mean[0]:.4f}", f"{ripple[1] / mean[1]:.1%}"]
    if row["case"] in MORE:
        told = ["", "", ""]
    newton = f"{row['newton'] / max(row['steps'], 1):.1f}"
    most = row.get("most") or ""
    deep = f"{row['penetration'] / row['facet']:.1e}" if row["facet"] else ""
    return [row["case"], row["program"], row["unknowns"], whole, row["steps"], newton, most,
            f"{row['seconds']:.1f}", deep, *told]  # fmt: skip


HEAD = ["case", "program", "unknowns", "whole path", "load steps", "Newton steps each", "most",
        "CPU s", "penetration", "normal force", "horizontal", "ripple"]  # fmt: skip


def main():
    """Run all and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="")
    parser.add_argument("--limit", type=float, default=600.0)
    parser.add_argument("--child", nargs=2)
    asked = parser.parse_args()
    if asked.child:
        child(*asked.child, asked.limit)
        return
    stored = HERE / "results" / "large_sliding.json"
    rows = json.loads(stored.read_text()) if stored.exists() else []
    for name in CASES | MORE:
        for program in PROGRAMS[:2] if name in ALONE else PROGRAMS:
            if asked.only not in f"{name}; {program}" or f"{program}{name[-2:]}" == "GetFEM3D":
                continue
            command = [sys.executable, __file__, "--limit", str(asked.limit)]
            done = subprocess.run([*command, "--child", name, program], capture_output=True,
                                  text=True, check=False)  # fmt: skip
            if done.returncode:
                print(name, program, done.stderr[-400:])
                continue
            row = json.loads(done.stdout.splitlines()[-1])
            rows = [r for r in rows if (r["case"], r["program"]) != (name, program)] + [row]
            print(*cells(row), row.get("why", ""), sep=" | ", flush=True)
            stored.write_text(json.dumps(rows) + "\n")
    order = {name: k for k, name in enumerate(CASES | MORE)}
    rows.sort(key=lambda r: (order[r["case"]], PROGRAMS.index(r["program"])))
    table = [HEAD, ["---"] * len(HEAD), *map(cells, rows)]
    lines = ["# Two bodies that slide far", "", "`python -m benchmarks.large_sliding`", "",
             "; ".join(f"{k} {v}" for k, v in describe().items()), "",
             *(f"| {' | '.join(map(str, line))} |" for line in table), ""]  # fmt: skip
    notes = HERE / "results" / "large_sliding_notes.txt"
    text = "\n".join(lines) + ("\n" + notes.read_text() if notes.exists() else "")
    (HERE / "results" / "large_sliding.md").write_text(text)


if __name__ == "__main__":
    main()
