"""`solve(problem)` against every cone solver of Siconos, in one run.

    python benchmarks/fclib_siconos.py [FOLDER] [--seed 2026] [--siconos /usr/bin/python3]

The problems: the FCLib files of a folder, and walls and packings made here from a seed, on
which nobody has tuned anything (--walls, --packings: how many; change --seed for others).

Both sides get the Delassus form; the clock starts after it stands.  Ours is the whole of
`drive(problem)`, judge and status included, best of 5 to 50 warm runs, one thread.  Siconos is
its driver call, best of as many, started from r = 0 with six solvers, asked for each tolerance
and for 1e-2 and 1e-4 of it, because it stops on another error; the fastest run whose answer
passes our judge counts, chosen in hindsight for each file and tolerance.  Longer runs than the
cap end.  The judge asks both sides for the error in the sum and for that of every contact on
its own scale; what the second condition costs each side stands beside.

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
from generated import packings, walls
from machine import describe
from scipy import sparse

import amontons as am
from amontons.solvers.driver import drive

HERE = Path(__file__).parent
SOLVERS = ("NSGS", "NSGS_UPK", "NSN_AC", "NSN_FB", "NSN_NM", "ADMM")
TOLERANCES = (1e-3, 1e-6, 1e-8, 1e-10)
GROUPS = ("FCLib files", "walls", "packings")
RETIGHTEN = (1.0, 1e-2, 1e-4)
COMPARED = 20  # contacts from which a ratio counts
WARM = 20.0  # seconds up to which a solve is made once more before it is timed
COUNTED_SECONDS = 2e-4  # peers quicker than this measure the call and not the solver


def ours(problem, tolerance, limit, contact_tolerance=None):
    """Best time, error and stage of `drive` at its defaults."""
    best = np.inf
    options = {"tolerance": tolerance, "contact_tolerance": contact_tolerance,
               "time_limit": limit}  # fmt: skip
    solution = drive(problem, **options)
    if solution.convergence.seconds < WARM:  # the first one may have compiled something
        solution = drive(problem, **options)
    seconds = solution.convergence.seconds
    for _ in range(int(np.clip(0.1 / seconds, 5, 50)) if seconds < 1 else 1):
        started = time.perf_counter()
        solution = drive(problem, **options)
        best = min(best, time.perf_counter() - started)
    record = solution.convergence
    return {
        "converged": solution.converged,
        "error": record.error,
        "contact_error": record.contact_error,
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
        runs.append({"solver": solver, **found, "error": problem.error(r),
                     "contact_error": problem.weakest(r).error})  # fmt: skip
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
        in_sum = [x for x in runs if x["error"] <= tolerance]
        passing = [x for x in in_sum if x["contact_error"] <= tolerance**0.5]
        best = min(passing, key=lambda x: x["seconds"], default=None)
        row = {
            "ours": ours(problem, tolerance, limit), "siconos": best,
            "ours_in_sum": ours(problem, tolerance, limit, np.inf),
            "siconos_in_sum": min(in_sum, key=lambda x: x["seconds"], default=None),
        }  # fmt: skip
        counts = best is not None and best["seconds"] > COUNTED_SECONDS
        if counts and row["ours"]["converged"] and problem.contacts >= COMPARED:
            row["ratio"] = row["ours"]["seconds"] / best["seconds"]
        rows[f"{tolerance:g}"] = row
    return {"contacts": problem.contacts, "tolerances": rows, "siconos_runs": runs}


def summarise(results):
    """Geometric mean, worst ratio and number of problems per tolerance."""
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
            "contactwise_costs_amontons": _cost(results, key, "ours"),
            "contactwise_costs_siconos": _cost(results, key, "siconos"),
            "slowest_below_20_contacts_ms": 1e3 * max(small, default=0.0),
        }
    return out


def _cost(results, key, side):
    """Time with the contactwise condition over that without, geometric mean; and losses."""
    pairs = [(f["tolerances"][key][side], f["tolerances"][key][f"{side}_in_sum"])
             for f in results.values()]  # fmt: skip
    solved = [(a, b) for a, b in pairs if _solved(a) and _solved(b)]
    times = [a["seconds"] / b["seconds"] for a, b in solved]
    lost = sum(_solved(b) and not _solved(a) for a, b in pairs)
    return {"times": float(np.exp(np.mean(np.log(times)))) if times else None, "lost": lost}


def _solved(run):
    return run is not None and run.get("converged", True)


HEADER = """# `solve(problem)` against Siconos

Regenerate: `python benchmarks/fclib_siconos.py FOLDER{options}`.

{machine}; one thread.  Siconos: the fastest of six solvers in hindsight, problem by problem.
Solved: error below the tolerance in the sum, and below its root at every contact.  Last two
columns: time with the second condition over that without (geometric mean), and what it loses.

| problems | tolerance | compared | geometric mean ours/Siconos | worst | solved by amontons \
| solved by Siconos | slowest below 20 contacts | second condition: amontons | Siconos |
|---|---|---|---|---|---|---|---|---|---|
"""
CAPTION = """
Milliseconds, ours / Siconos (its solver); `-` not solved within the cap; an unsolved run of
ours shows the error reached.

"""


def table(results, summaries, machine, options):
    """The result as a Markdown page."""
    rows = []
    for group, summary in summaries.items():
        for key, s in summary.items():
            mean = "-" if s["geometric_mean"] is None else f"{s['geometric_mean']:.3f}"
            worst = "-" if s["worst"] is None else f"{s['worst']:.2f}"
            solved = f"{s['solved_by_amontons']} of {s['files']} | {s['solved_by_siconos']}"
            small = f"{s['slowest_below_20_contacts_ms']:.2f} ms"
            compared = s["files_compared"]
            rows.append(
                f"| {group} | {key} | {compared} | {mean} | {worst} | {solved} | {small} | "
                f"{_costs(s['contactwise_costs_amontons'])} | "
                f"{_costs(s['contactwise_costs_siconos'])} |"
            )
    files = ["| problem | contacts | " + " | ".join(f"{t:g}" for t in TOLERANCES) + " |"]
    files += ["|---|---|" + "---|" * len(TOLERANCES)]
    for name, entry in results.items():
        cells = [_cell(entry["tolerances"][f"{t:g}"]) for t in TOLERANCES]
        files.append(f"| {name} | {entry['contacts']} | " + " | ".join(cells) + " |")
    where = "; ".join(f"{k} {v}" for k, v in machine.items())
    head = HEADER.replace("\\\n", "").format(machine=where, options=options)
    return head + "\n".join(rows) + "\n" + CAPTION + "\n".join(files) + "\n"


def _costs(cost):
    times = "-" if cost["times"] is None else f"{cost['times']:.3f}"
    return f"{times}, {cost['lost']} lost"


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
    parser.add_argument("--only", default="", help="part of a name; keep the stored rest")
    parser.add_argument("--walls", type=int, default=10, help="number of walls")
    parser.add_argument("--packings", type=int, default=15, help="number of packings")
    parser.add_argument("--seed", type=int, default=2026, help="of walls and packings")
    options = parser.parse_args()
    (HERE / "results").mkdir(exist_ok=True)
    stored = HERE / "results/fclib_siconos.json"
    kept = options.only and stored.exists()
    results = json.loads(stored.read_text())["files"] if kept else {}
    for group, name, problem in _problems(options):
        found = compare(problem, options.siconos, options.cap, options.limit)
        results[name] = {"group": group, **found}
        print(name, [_cell(x) for x in found["tolerances"].values()], flush=True)
    machine = describe()
    summaries = {
        group: summarise({n: r for n, r in results.items() if r["group"] == group})
        for group in GROUPS
        if any(r["group"] == group for r in results.values())
    }
    print(json.dumps(summaries, indent=1))
    record = {"machine": machine, "summary": summaries, "files": results}
    chosen = f" --cap {options.cap:g} --seed {options.seed} --walls {options.walls}"
    chosen += f" --packings {options.packings}"
    stored.write_text(json.dumps(record, indent=1))
    (HERE / "results/fclib_siconos.md").write_text(table(results, summaries, machine, chosen))


def _problems(options):
    """(group, name, problem in Delassus form) of all that is compared."""
    for path in sorted(options.folder.glob("*.hdf5"), key=lambda p: p.stat().st_size):
        if options.only in path.stem:
            yield GROUPS[0], path.stem, am.read_fclib(path).condensed()
    made = walls(options.walls, options.seed), packings(options.packings, options.seed)
    for group, problems in zip(GROUPS[1:], made, strict=True):
        for name, problem in problems:
            if options.only in name:
                yield group, name, problem.condensed()


if __name__ == "__main__":
    main()
