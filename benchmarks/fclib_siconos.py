"""`solve(problem)` against every cone solver of Siconos on FCLib files, in one run.

    python benchmarks/fclib_siconos.py [FOLDER] [--siconos /usr/bin/python3] [--cap 6]

Both sides get the Delassus form; the clock starts after it stands.  Ours is the whole of
`drive(problem)`, judge and status included, best of five warm runs, one thread.  Siconos is
its driver call, best of five, started from r = 0 with six solvers, asked for each tolerance
and for 1e-2 and 1e-4 of it, because it stops on another error; the fastest run whose answer
passes our judge counts, chosen in hindsight for each file and tolerance.  Longer runs than the
cap end.

Writes results/fclib_siconos.json and results/fclib_siconos.md beside this file.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import json
import select
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from machine import describe
from scipy import sparse

import amontons as am
from amontons.solve import drive

HERE = Path(__file__).parent
SOLVERS = ("NSGS", "NSGS_UPK", "NSN_AC", "NSN_FB", "NSN_NM", "ADMM")
TOLERANCES = (1e-3, 1e-6, 1e-8)
RETIGHTEN = (1.0, 1e-2, 1e-4)
COMPARED = 20  # contacts from which a ratio counts
COUNTED_SECONDS = 2e-4  # peers quicker than this measure the call and not the solver


def ours(problem, tolerance, limit):
    """Best time, error and stage of `drive` at its defaults."""
    best = np.inf
    solution = drive(problem, tolerance=tolerance, time_limit=limit)
    for _ in range(5 if solution.convergence.seconds < 1 else 1):
        started = time.perf_counter()
        solution = drive(problem, tolerance=tolerance, time_limit=limit)
        best = min(best, time.perf_counter() - started)
    record = solution.convergence
    return {
        "converged": solution.converged,
        "error": record.error,
        "seconds": best,
        "stage": record.detail,
        "iterations": record.iterations,
    }


def theirs(problem, python, cap):
    """Every run of every Siconos solver: solver, asked, seconds, error by our judge."""
    W = sparse.csr_array(problem.W)
    runs = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "problem.npz"
        np.savez(path, data=W.data, indices=W.indices, indptr=W.indptr,
                 q=problem.q.ravel(), mu=problem.mu)  # fmt: skip
        asked = sorted({t * k for t in TOLERANCES for k in RETIGHTEN}, reverse=True)
        for solver in SOLVERS:
            runs += _worker(problem, python, path, solver, asked, cap)
    return runs


def _worker(problem, python, path, solver, asked, cap):
    """One process per solver, killed when a tolerance takes longer than the cap."""
    texts = ",".join(f"{a:g}" for a in asked)
    command = [python, str(HERE / "siconos_worker.py"), str(path), solver, texts]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    runs = []
    for k in range(len(asked)):
        ready, _, _ = select.select([process.stdout], [], [], cap + (10 if k == 0 else 0))
        line = process.stdout.readline() if ready else ""
        if not line:
            break
        found = json.loads(line)
        r = np.array(found.pop("r")).reshape(-1, 3)
        runs.append({"solver": solver, **found, "error": problem.error(r)})
        if found["seconds"] > cap:
            break
    process.kill()
    process.wait()
    return runs


def compare(problem, python, cap, limit):
    """One file: ours and the best of theirs at each tolerance."""
    runs = theirs(problem, python, cap)
    rows = {}
    for tolerance in TOLERANCES:
        passing = [x for x in runs if x["error"] <= tolerance]
        best = min(passing, key=lambda x: x["seconds"], default=None)
        row = {"ours": ours(problem, tolerance, limit), "siconos": best}
        counts = best is not None and best["seconds"] > COUNTED_SECONDS
        if counts and row["ours"]["converged"] and problem.contacts >= COMPARED:
            row["ratio"] = row["ours"]["seconds"] / best["seconds"]
        rows[f"{tolerance:g}"] = row
    return {"contacts": problem.contacts, "tolerances": rows, "siconos_runs": runs}


def summarise(results):
    """Geometric mean, worst ratio and number of files per tolerance."""
    out = {}
    for tolerance in TOLERANCES:
        key = f"{tolerance:g}"
        ratios = [f["tolerances"][key]["ratio"] for f in results.values()
                  if "ratio" in f["tolerances"][key]]  # fmt: skip
        solved = sum(f["tolerances"][key]["ours"]["converged"] for f in results.values())
        peers = sum(f["tolerances"][key]["siconos"] is not None for f in results.values())
        small = [f["tolerances"][key]["ours"]["seconds"] for f in results.values()
                 if f["contacts"] < COMPARED]  # fmt: skip
        out[key] = {
            "files_compared": len(ratios),
            "geometric_mean": float(np.exp(np.mean(np.log(ratios)))) if ratios else None,
            "worst": max(ratios, default=None),
            "solved_by_amontons": solved,
            "solved_by_siconos": peers,
            "files": len(results),
            "slowest_below_20_contacts_ms": 1e3 * max(small, default=0.0),
        }
    return out


HEADER = """# `solve(problem)` against Siconos on FCLib files

Regenerate: `python benchmarks/fclib_siconos.py FOLDER`.

{machine}; one thread.

| tolerance | files compared | geometric mean ours/Siconos | worst | solved by amontons \
| solved by Siconos | slowest below 20 contacts |
|---|---|---|---|---|---|---|
"""
CAPTION = """
Milliseconds, ours / Siconos (its solver); `-` not solved within the cap; an unsolved run of
ours shows the error reached.

"""


def table(results, summary, machine):
    """The result as a Markdown page."""
    rows = []
    for key, s in summary.items():
        mean = "-" if s["geometric_mean"] is None else f"{s['geometric_mean']:.3f}"
        worst = "-" if s["worst"] is None else f"{s['worst']:.2f}"
        solved = f"{s['solved_by_amontons']} of {s['files']} | {s['solved_by_siconos']}"
        small = f"{s['slowest_below_20_contacts_ms']:.2f} ms"
        rows.append(
            f"| {key} | {s['files_compared']} | {mean} | {worst} | {solved} | {small} |"
        )
    files = ["| file | contacts | " + " | ".join(f"{t:g}" for t in TOLERANCES) + " |"]
    files += ["|---|---|" + "---|" * len(TOLERANCES)]
    for name, entry in results.items():
        cells = [_cell(entry["tolerances"][f"{t:g}"]) for t in TOLERANCES]
        files.append(f"| {name} | {entry['contacts']} | " + " | ".join(cells) + " |")
    where = "; ".join(f"{k} {v}" for k, v in machine.items())
    head = HEADER.replace("\\\n", "").format(machine=where)
    return head + "\n".join(rows) + "\n" + CAPTION + "\n".join(files) + "\n"


def _cell(row):
    mine, peer = row["ours"], row["siconos"]
    left = (
        f"{1e3 * mine['seconds']:.3g}" if mine["converged"] else f"(error {mine['error']:.1e})"
    )
    right = f"{1e3 * peer['seconds']:.3g} ({peer['solver']})" if peer else "-"
    return f"{left} / {right}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    shared = Path(os.environ.get("AMONTONS_SHARED", "../shared"))
    parser.add_argument("folder", nargs="?", type=Path, default=shared / "data/fclib")
    parser.add_argument("--siconos", default="/usr/bin/python3", help="Python that has Siconos")
    parser.add_argument("--cap", type=float, default=6.0, help="seconds for one run of Siconos")
    parser.add_argument("--limit", type=float, default=60.0, help="seconds for one run of ours")
    parser.add_argument("--only", default="", help="part of the file name")
    options = parser.parse_args()
    results = {}
    for path in sorted(options.folder.glob("*.hdf5"), key=lambda p: p.stat().st_size):
        if options.only not in path.name:
            continue
        problem = am.read_fclib(path).condensed()
        results[path.stem] = compare(problem, options.siconos, options.cap, options.limit)
        print(
            path.stem, [_cell(x) for x in results[path.stem]["tolerances"].values()], flush=True
        )
    summary, machine = summarise(results), describe()
    (HERE / "results").mkdir(exist_ok=True)
    record = {"machine": machine, "summary": summary, "files": results}
    (HERE / "results/fclib_siconos.json").write_text(json.dumps(record, indent=1))
    (HERE / "results/fclib_siconos.md").write_text(table(results, summary, machine))
    print(json.dumps(summary, indent=1))


if __name__ == "__main__":
    main()
