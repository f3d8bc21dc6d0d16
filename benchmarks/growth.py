"""How time and memory of a plain solve grow with the problem: walls and sphere packings.

    python benchmarks/growth.py [--sizes 500,2000,8000,32000] [--tolerances 1e-4,1e-8]
                                [--limit 60] [--only wall|spheres]

A wall is one time step of blocks of 8 x 4 x 4 cells under its weight and a plate, from rest; a
packing is one time step of rigid spheres under their weight, from rest: cold starts both.  Each
case is built and solved in global form by `solve(problem)` in a process of its own, whose peak
resident memory is that of the whole process (Python, meshes and packing included).  The
exponent is the slope of a straight line through log(seconds) over log(contacts), solved cases
only.  `--limit`: seconds of a solve.

Writes results/growth.md, growth.json and growth.png beside this file.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import json
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from generated import wall_step
from machine import describe

import amontons as am
from amontons.mechanics.ready.packings import SpherePacking

HERE = Path(__file__).parent
KINDS = ("wall", "spheres")


def wall(contacts):
    """The first time step of a wall of about that many contacts, half as wide as high."""
    blocks = max(1, round(np.sqrt(contacts / 114)))
    rows = max(2, round(contacts / (57 * blocks)))
    return wall_step(rows, blocks)


def spheres(contacts):
    """The first time step of a packing of about that many contacts."""
    return SpherePacking(max(2, round(contacts / 2.95)), spread=0.2, seed=1).problem()


def child(kind, contacts, tolerance, limit):
    """Build and solve one case; the row as JSON on the last line."""
    began = time.perf_counter()
    problem = globals()[kind](contacts)
    built = time.perf_counter() - began
    used = time.process_time()
    solution = am.solve(problem, tolerance=tolerance, time_limit=limit, check=False)
    record = solution.convergence
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    row = {
        "kind": kind, "contacts": problem.contacts, "unknowns": problem.unknowns,
        "tolerance": tolerance, "solved": record.outcome is am.Outcome.CONVERGED,
        "outcome": record.outcome.name.lower(), "error": record.error,
        "seconds": record.seconds, "cpu_seconds": time.process_time() - used,
        "build_seconds": built, "peak_gb": peak, "iterations": record.iterations,
        "measure": record.measure.value, "stage": record.detail,
    }  # fmt: skip
    print(json.dumps(row))


def measure(kind, contacts, tolerance, limit):
    """One case in a process of its own."""
    arguments = ["--child", kind, str(contacts), str(tolerance), str(limit)]
    run = subprocess.run(
        [sys.executable, __file__, *arguments], capture_output=True, text=True, check=False
    )
    if run.returncode:
        error = (run.stderr.strip().splitlines() or ["no message"])[-1]
        return {"kind": kind, "contacts": contacts, "tolerance": tolerance, "solved": False,
                "outcome": f"exit code {run.returncode}: {error}"}  # fmt: skip
    return json.loads(run.stdout.strip().splitlines()[-1])


def exponent(rows, key="seconds"):
    """Slope of log(key) over log(contacts) of the solved cases; None for fewer than two."""
    good = [(r["contacts"], r[key]) for r in rows if r["solved"]]
    if len(good) < 2:
        return None
    x, y = np.log(np.array(good)).T
    return float(np.polyfit(x, y, 1)[0])


def table(record):
    """The result as a Markdown page."""
    lines = ["# Growth of a plain solve with the problem", ""]
    lines += [f"Regenerate: `python benchmarks/growth.py --limit {record['limit']:g}`.", ""]
    lines += ["; ".join(f"{k} {v}" for k, v in record["machine"].items()) + ".", ""]
    lines += [
        "Cold start, global form, `solve(problem)`; each case in a process of its own. CPU "
        "time leaves out most of what other programs did to it, the time limit does not.",
        "", "| problem | contacts | unknowns | tolerance | solved | error | seconds | CPU s | "
        "peak GB | last stage |", "|---|---|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for r in record["rows"]:
        if "error" not in r:
            size = f"{r['kind']} | {r['contacts']} | | {r['tolerance']:.0e}"
            lines.append(f"| {size} | no | | | | | {r['outcome']} |")
            continue
        solved = "yes" if r["solved"] else r["outcome"].replace("_", " ")
        lines.append(
            f"| {r['kind']} | {r['contacts']} | {r['unknowns']} | {r['tolerance']:.0e} | "
            f"{solved} | {r['error']:.1e} | {r['seconds']:.3g} | {r['cpu_seconds']:.3g} | "
            f"{r['peak_gb']:.2f} | {r['stage']} |"
        )
    lines += [
        "",
        "![time and memory over contacts](growth.png)",
        "",
        "Exponents of CPU time:",
        "",
    ]
    for name, value in record["exponents"].items():
        text = "fewer than two cases solved" if value is None else f"{value:.2f}"
        lines.append(f"- {name}: {text}")
    return "\n".join(lines) + "\n"


def draw(record, path):
    """Time and memory over contacts, both axes logarithmic; hollow marks were not solved."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
    styles = {
        ("wall", 1e-4): ("#0072B2", "o"), ("wall", 1e-8): ("#56B4E9", "s"),
        ("spheres", 1e-4): ("#D55E00", "^"), ("spheres", 1e-8): ("#E69F00", "v"),
    }  # fmt: skip
    series = sorted({(r["kind"], r["tolerance"]) for r in record["rows"]}, reverse=True)
    for name in series:
        rows = [
            r for r in record["rows"] if (r["kind"], r["tolerance"]) == name and "error" in r
        ]
        colour, mark = styles.get(name, ("#000000", "x"))
        for axis, key in zip(axes, ("cpu_seconds", "peak_gb"), strict=True):
            axis.plot([r["contacts"] for r in rows], [r[key] for r in rows], color=colour, lw=1)
            for solved in (True, False):
                some = [r for r in rows if r["solved"] is solved]
                axis.plot(
                    [r["contacts"] for r in some], [r[key] for r in some], mark, color=colour,
                    fillstyle="full" if solved else "none", ls="",
                    label=f"{name[0]}, {name[1]:.0e}" if solved else None,
                )  # fmt: skip
    for axis, text in zip(axes, ("CPU time of the solve, s", "peak memory, GB"), strict=True):
        axis.set(xscale="log", yscale="log", xlabel="contacts", ylabel=text)
        axis.grid(alpha=0.3)
    axes[0].legend(title="problem, tolerance", fontsize=8, title_fontsize=8)
    figure.suptitle("Growth with the problem; hollow: not solved", fontsize=10)
    figure.savefig(path, dpi=130)


def _place(row):
    return KINDS.index(row["kind"]), -row["tolerance"], row["contacts"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--sizes", default="500,2000,8000,32000")
    parser.add_argument("--tolerances", default="1e-4,1e-8")
    parser.add_argument("--limit", type=float, default=60.0)
    parser.add_argument("--only", choices=KINDS)
    parser.add_argument("--child", nargs=4)
    options = parser.parse_args()
    if options.child:
        kind, contacts, tolerance, limit = options.child
        child(kind, int(contacts), float(tolerance), float(limit))
        return
    rows = []
    for kind in KINDS if options.only is None else (options.only,):
        measure(kind, 300, 1e-4, 60.0)  # compiled code warm
        for tolerance in (float(t) for t in options.tolerances.split(",")):
            for contacts in (int(s) for s in options.sizes.split(",")):
                rows.append(measure(kind, contacts, tolerance, options.limit))
                print(json.dumps(rows[-1]), flush=True)
    stored = HERE / "results/growth.json"
    if options.only is not None and stored.exists():  # the rest stays as it was measured
        old = json.loads(stored.read_text())["rows"]
        rows = sorted([*rows, *(r for r in old if r["kind"] != options.only)], key=_place)
    groups = sorted({(r["kind"], r["tolerance"]) for r in rows}, reverse=True)
    exponents = {
        f"{kind}, {tolerance:.0e}": exponent(
            [r for r in rows if (r["kind"], r["tolerance"]) == (kind, tolerance)], "cpu_seconds"
        )
        for kind, tolerance in groups
    }
    record = {
        "machine": describe(),
        "limit": options.limit,
        "rows": rows,
        "exponents": exponents,
    }
    stored.write_text(json.dumps(record, indent=1) + "\n")
    (HERE / "results/growth.md").write_text(table(record))
    draw(record, HERE / "results/growth.png")
    print(table(record))


if __name__ == "__main__":
    main()
