"""`solve(problem)` against every cone solver of Siconos, in one run.

    python benchmarks/fclib_siconos.py [FOLDER] [--seed 2026] [--siconos /usr/bin/python3]
                                       [--anew]

The problems are those of `classes.py`: the FCLib files of a folder, and packings, rigid blocks,
walls of meshed blocks and two meshed bodies made from a seed, on which nobody has tuned
anything (change --seed for others).

Both sides get the Delassus form.  Ours is the whole of `drive(problem)`, judge and status
included, of a problem that is kept, and of one that is made of arrays each time; best of 3 to
50 warm runs, one thread.  Siconos is its driver call, and with its own conversion of the
arrays, best of as many, started from r = 0 with six solvers, asked for each tolerance and for
1e-2 and 1e-4 of it, because it stops on another error; the fastest run whose answer passes our
judge counts, chosen in hindsight for each file and tolerance.  CPU seconds on both sides.  Runs
longer than the cap end, and those longer than another solver of theirs took to the tightest
tolerance, since they can not be the fastest: where no solver of theirs is there by then,
nothing is compared.  The judge asks both sides for the error in the sum and for that of every
contact on its own scale; what the second condition costs each side stands beside.

Writes results/fclib_siconos.json and results/fclib_siconos.md beside this file, after each
problem; what the file has of the same machine, seed and cap is not run again without --anew.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import contextlib
import json
import select
import signal
import subprocess
import tempfile
import time
from collections import Counter
from itertools import chain
from pathlib import Path

import numpy as np
from classes import classes, fclib
from machine import describe
from scipy import sparse

import amontons as am
from amontons.solvers.driver import drive

HERE = Path(__file__).parent
SOLVERS = ("NSGS", "NSGS_UPK", "NSN_AC", "NSN_FB", "NSN_NM", "ADMM")
TOLERANCES = (1e-3, 1e-6, 1e-8)
GROUPS = {  # of `classes`
    "FCLib": "FCLib files", "packings": "packings", "lattices": "packings",
    "rolling": "packings", "rigid blocks": "rigid blocks", "elastic walls": "elastic walls",
    "two bodies": "two bodies",
}  # fmt: skip
ENDED = b'{"process": null}'  # the last line of a process
RETIGHTEN = (1.0, 1e-2, 1e-4)
COMPARED = 20  # contacts from which a ratio counts
WARM = 1.0  # seconds up to which a solve is made more often than once
COUNTED_SECONDS = 2e-4  # peers quicker than this measure the call and not the solver


def ours(problem, tolerance, limit, contact_tolerance=None):
    """Best times of `drive` at its defaults, kept and from arrays; error and stage."""
    options = {"tolerance": tolerance, "contact_tolerance": contact_tolerance,
               "time_limit": limit}  # fmt: skip
    best, fresh = np.inf, np.inf
    began = time.process_time()
    solution = drive(problem, **options)
    seconds = time.process_time() - began
    if solution.convergence.compiling:
        seconds = min(timed(lambda: drive(problem, **options)) for _ in range(2))
    for _ in range(int(np.clip(0.1 / seconds, 2, 50)) if seconds < WARM else 0):
        best = min(best, timed(lambda: drive(problem, **options)))
        if contact_tolerance is None:
            fresh = min(fresh, timed(lambda: drive(again(problem), **options)))
    record = solution.convergence
    return {
        "converged": solution.converged,
        "error": record.error,
        "contact_error": record.contact_error,
        "seconds": min(best, seconds),
        "fresh": min(fresh, seconds),
        "stage": record.detail,
        "iterations": record.iterations,
    }


def timed(run):
    """CPU seconds."""
    began = time.process_time()
    run()
    return time.process_time() - began


def again(problem):
    """The problem made of its arrays."""
    return am.FrictionProblem.from_delassus(problem.W, problem.q, problem.mu)


class Siconos:
    """The solvers of Siconos, in processes of one that has imported it."""

    def __init__(self, python):
        command = [python, str(HERE / "siconos_worker.py")]
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self.buffer = b""

    def runs(self, problem, cap):
        """Every run of every solver: solver, asked, seconds, error by our judge."""
        W = sparse.csr_array(problem.W)
        runs = []
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "problem.npz"
            np.savez(path, data=W.data, indices=W.indices, indptr=W.indptr,
                     q=problem.q.ravel(), mu=problem.mu)  # fmt: skip
            asked = sorted({t * k for t in TOLERANCES for k in RETIGHTEN}, reverse=True)
            for solver in SOLVERS:
                runs += self._of_solver(problem, path, solver, asked, cap)
                there = [x["seconds"] for x in runs if _passes(x, min(TOLERANCES))]
                cap = min(cap, *there) if there else cap
        return runs

    def _of_solver(self, problem, path, solver, asked, cap):
        """One process, killed when a tolerance takes longer than the cap."""
        texts = ",".join(f"{a:g}" for a in asked)
        self.process.stdin.write(f"{path} {solver} {texts}\n".encode())
        self.process.stdin.flush()
        child = json.loads(self._line())["process"]
        # Quick runs are made again, and before the first the problem is made.
        runs, killed, most = [], False, 2 * cap + 2.0
        while True:
            line = self._line(child, most)
            if line is None:
                _kill(child)
                killed, most = True, np.inf
            elif line == ENDED:
                return runs
            elif not killed:
                found = json.loads(line)
                r = np.array(found.pop("r")).reshape(-1, 3)
                runs.append({"solver": solver, **found, "error": problem.error(r),
                             "contact_error": problem.weakest(r).error})  # fmt: skip
                most = _cpu(child) + 2 * max(cap, 0.1)
                if found["seconds"] > cap:
                    _kill(child)
                    killed, most = True, np.inf

    def _line(self, child=0, most=np.inf):
        """The next line; None where the child takes more CPU seconds than that before."""
        while True:
            line, end, rest = self.buffer.partition(b"\n")
            if end:
                self.buffer = rest
                if line:
                    return line
            elif select.select([self.process.stdout], [], [], 0.1)[0]:
                more = os.read(self.process.stdout.fileno(), 1 << 20)
                if not more:
                    raise SystemExit("the worker has ended: does this Python have Siconos?")
                self.buffer += more
            elif most < np.inf and _cpu(child) > most:
                return None


def _passes(found, tolerance):
    """True for a run whose answer our judge takes, in the sum and contact by contact."""
    return found["error"] <= tolerance and found["contact_error"] <= tolerance**0.5


def _kill(child):
    """End a process, which may have ended in the meantime."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(child, signal.SIGKILL)


def _cpu(pid):
    """CPU seconds of a process, Linux; 0 of one that has ended."""
    try:
        after = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except FileNotFoundError:
        return 0.0
    return (int(after[11]) + int(after[12])) / os.sysconf("SC_CLK_TCK")


def compare(problem, siconos, cap, limit):
    """One file: ours and the best of theirs at each tolerance."""
    runs = siconos.runs(problem, cap)
    rows = {}
    for tolerance in TOLERANCES:
        in_sum = [x for x in runs if x["error"] <= tolerance]
        passing = [x for x in runs if _passes(x, tolerance)]
        best = min(passing, key=lambda x: x["seconds"], default=None)
        mine = ours(problem, tolerance, limit)
        quick = mine["seconds"] < WARM
        row = {
            "ours": mine, "siconos": best,
            "ours_in_sum": ours(problem, tolerance, limit, np.inf) if quick else mine,
            "siconos_in_sum": min(in_sum, key=lambda x: x["seconds"], default=None),
        }  # fmt: skip
        counts = best is not None and best["seconds"] > COUNTED_SECONDS
        if counts and row["ours"]["converged"] and problem.contacts >= COMPARED:
            row["ratio"] = row["ours"]["seconds"] / best["seconds"]
            row["fresh"] = row["ours"]["fresh"] / (best["seconds"] + best["conversion"])
        rows[f"{tolerance:g}"] = row
    return {"contacts": problem.contacts, "tolerances": rows, "siconos_runs": runs}


def summarise(results):
    """Geometric mean, worst ratio and number of problems per tolerance."""
    out = {}
    for tolerance in TOLERANCES:
        key = f"{tolerance:g}"
        ratios = [f["tolerances"][key]["ratio"] for f in results.values()
                  if "ratio" in f["tolerances"][key]]  # fmt: skip
        fresh = [f["tolerances"][key]["fresh"] for f in results.values()
                 if "fresh" in f["tolerances"][key]]  # fmt: skip
        solved = sum(f["tolerances"][key]["ours"]["converged"] for f in results.values())
        peers = sum(f["tolerances"][key]["siconos"] is not None for f in results.values())
        small = [f["tolerances"][key]["ours"]["seconds"] for f in results.values()
                 if f["contacts"] < COMPARED]  # fmt: skip
        out[key] = {
            "files_compared": len(ratios),
            "geometric_mean": float(np.exp(np.mean(np.log(ratios)))) if ratios else None,
            "worst": max(ratios, default=None),
            "from_arrays": float(np.exp(np.mean(np.log(fresh)))) if fresh else None,
            "worst_from_arrays": max(fresh, default=None),
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

| problems | tolerance | compared | geometric mean ours/Siconos | worst | from arrays | worst \
| solved by amontons | solved by Siconos | slowest below 20 contacts \
| second condition: amontons | Siconos |
|---|---|---|---|---|---|---|---|---|---|---|---|
"""
CAPTION = """
Milliseconds, ours / Siconos (its solver); `-` not solved within the cap; an unsolved run of
ours shows the error reached.  The command goes on with problems that are not in the table.

"""


def table(results, summaries, machine, options):
    """The result as a Markdown page."""
    rows = []
    for group, summary in summaries.items():
        for key, s in summary.items():
            mean, fresh = (_number(s[k], 3) for k in ("geometric_mean", "from_arrays"))
            worst, worse = (_number(s[k], 2) for k in ("worst", "worst_from_arrays"))
            solved = f"{s['solved_by_amontons']} of {s['files']} | {s['solved_by_siconos']}"
            small = f"{s['slowest_below_20_contacts_ms']:.2f} ms"
            compared = s["files_compared"]
            rows.append(
                f"| {group} | {key} | {compared} | {mean} | {worst} | {fresh} | {worse} | "
                f"{solved} | {small} | "
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


def _number(value, digits):
    return "-" if value is None else f"{value:.{digits}f}"


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
    parser.add_argument("--cap", type=float, default=3.0, help="CPU seconds of one of its runs")
    parser.add_argument("--limit", type=float, default=30.0, help="seconds for one run of ours")
    parser.add_argument("--only", default="", help="parts of names, a,b: run again too")
    parser.add_argument("--anew", action="store_true", help="run all, whatever is stored")
    parser.add_argument("--most", type=int, default=1000, help="problems of a class")
    parser.add_argument("--seed", type=int, default=2026, help="of what is made here")
    options = parser.parse_args()
    (HERE / "results").mkdir(exist_ok=True)
    stored = HERE / "results/fclib_siconos.json"
    chosen = f" --cap {options.cap:g} --seed {options.seed}"
    chosen += f" --most {options.most}" if options.most < 1000 else ""
    machine = describe()
    before = json.loads(stored.read_text()) if stored.exists() else {}
    same = before.get("options") == chosen and before.get("machine") == machine
    results = before["files"] if same and not options.anew else {}
    siconos = Siconos(options.siconos)
    for group, name, problem in _problems(options):
        if name in results and not options.only:
            continue
        found = compare(problem, siconos, options.cap, options.limit)
        results[name] = {"group": group, **found}
        print(name, [_cell(x) for x in found["tolerances"].values()], flush=True)
        _write(results, machine, chosen, stored)


def _write(results, machine, chosen, stored):
    """The record and the page, of what there is so far."""
    summaries = {
        group: summarise({n: r for n, r in results.items() if r["group"] == group})
        for group in dict.fromkeys(GROUPS.values())
        if any(r["group"] == group for r in results.values())
    }
    record = {
        "machine": machine, "options": chosen, "summary": summaries, "files": results
    }  # fmt: skip
    stored.write_text(json.dumps(record, indent=1))
    (HERE / "results/fclib_siconos.md").write_text(table(results, summaries, machine, chosen))


def _problems(options):
    """(group, name, problem in Delassus form) of all that is compared."""
    small = (("small", name, problem) for name, problem in fclib(options.folder, least=1)
             if problem.contacts < COMPARED)  # fmt: skip
    counts = Counter()
    for kind, name, problem in chain(small, classes(options.folder, options.seed)):
        few = problem.contacts < COMPARED
        chosen = any(part in name for part in options.only.split(","))
        if chosen and few == (kind == "small") and counts[kind] < options.most:
            counts[kind] += 1
            yield GROUPS.get(kind, GROUPS["FCLib"]), name, problem


if __name__ == "__main__":
    main()
