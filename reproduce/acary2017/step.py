"""One warm-started time step against every solver of Siconos on the same file, in one run.

All start from the impulses of the step before and from the velocities these give.  Siconos
stops on its own error, so it is asked for the tolerance and for 1e-2 and 1e-4 of it; the
fastest run whose reactions pass our judge counts.  Two clocks: *given W*, the solver alone, and
*given M and H*, everything from the global form to the answer; a Siconos solver of the Delassus
form is charged our own time to form W there.  A column of ours can be measured again beside the
quickest solvers of Siconos only; the rows of the others stay.
"""

from __future__ import annotations

import json
import math
import os
import select
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

import amontons as am
from amontons.solvers.contract import Iterate
from amontons.solvers.driver import drive

from .race import fresh

TOLERANCE = 1e-6
RETIGHTEN = (1.0, 1e-2, 1e-4)
LONG = 5.0  # seconds above which our own solve is not repeated
POLL, PATIENT = 0.2, 30.0  # seconds between two looks; the wall's clock beside the processor's
START_UP = 60.0  # seconds for a worker to read its problem
LOCAL = ("NSGS", "NSGS_UPK", "NSGSV", "NSN_AC", "NSN_AC_TEST", "NSN_FB", "NSN_NM", "ADMM",
         "PROX", "TFP", "DSFP", "VI_FPP", "VI_EG", "FPP", "EG", "HP", "SOCLCP", "ACLMFP",
         "PFP")  # fmt: skip
GLOBAL = ("GLOBAL_NSN_AC", "GLOBAL_NSN_AC_WR", "GLOBAL_NSGS", "GLOBAL_NSGS_WR",
          "GLOBAL_NSGSV_WR", "GLOBAL_ADMM", "GLOBAL_ADMM_WR", "GLOBAL_IPM", "GLOBAL_PROX_WR",
          "GLOBAL_TFP_WR", "GLOBAL_DSFP_WR", "GLOBAL_ACLMFP", "GLOBAL_VI_FPP",
          "GLOBAL_VI_EG")  # fmt: skip
QUICKEST = 5  # solvers of Siconos of each form that run again when ours do
OURS = {
    "Auto": am.Auto(),
    "NSN-AC inexact": am.InexactNewton(),
    "NSN-AC line search": am.SemismoothNewton(),
    "Gauss-Seidel, Anderson": am.GaussSeidel(anderson_depth=10, batch=10),
}
OURS_GLOBAL = {
    "Auto": am.Auto(),
    "NSN-AC global": am.SemismoothNewton(linear=am.Direct(threads=1)),
}


def compare(
    path: Path, python: str, cap: float, report: Callable[[str], None] = print,
    methods: Sequence[str] | None = None, stored: dict[str, Any] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Ours and theirs on one file of `write_problems`; cap: seconds for one run of Siconos.

    methods: those of ours to measure, all if None; with `stored`, the result of a call before,
    they run beside the quickest solvers of Siconos only, and all other rows are kept.
    """
    problem = am.read_fclib(path)
    began = time.process_time()
    condensed = problem.condensed()
    condensing = time.process_time() - began
    r = np.load(path.with_suffix(".npz"))["r"]
    kept = stored if methods is not None and stored is not None else {}
    parts = []
    for name, solvers, given in (
        ("ours", OURS, condensed), ("ours_global", OURS_GLOBAL, problem),
    ):  # fmt: skip
        rows = dict(kept.get(name, {}))
        for who, solver in solvers.items():
            if methods is None or _column(name, who) in methods:
                rows[who] = row = _ours(given, solver, r)
                took = f"{row['seconds']:.3g} s, " if row["seconds"] is not None else ""
                report(f"  {who}: {took}{row['outcome']}, error {row['error']:.1e}")
        parts.append(rows)
    theirs = dict(kept.get("siconos", {}))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "problem.npz"
        write_problem(file, problem, condensed, r)
        for name in _quickest(theirs) if theirs else (*LOCAL, *GLOBAL):
            theirs[name] = best = worker(condensed, python, file, name, cap)
            report(f"  Siconos {name}: {_said(best)}")
    sizes = {"contacts": problem.contacts, "unknowns": problem.unknowns}
    return sizes | {"condensing": condensing, "ours": parts[0], "ours_global": parts[1],
                    "siconos": theirs}  # fmt: skip


def _column(form: str, who: str) -> str:
    """The name of a solver of ours in `methods`."""
    return f"{who} global" if form == "ours_global" and who == "Auto" else who


def _quickest(theirs: dict[str, dict[str, Any]]) -> list[str]:
    """The quickest solvers of a stored run, of each form."""
    solved = sorted((n for n, row in theirs.items() if row["seconds"] is not None),
                    key=lambda n: theirs[n]["seconds"])  # fmt: skip
    local = [n for n in solved if n in LOCAL]
    return local[:QUICKEST] + [n for n in solved if n not in LOCAL][:QUICKEST]


def _ours(problem: am.FrictionProblem, solver: Any, r: np.ndarray) -> dict[str, Any]:
    """Best time of three warm runs, judged as theirs: by the exact measure."""
    best = math.inf
    for k in range(4):
        again = fresh(problem)
        began = time.process_time()
        found = drive(again, solver, tolerance=TOLERANCE, start=Iterate(r), time_limit=60)
        seconds = time.process_time() - began
        best = min(best, seconds) if k else best  # the first may compile
        if k and seconds > LONG:
            break
    return {
        "seconds": best if found.converged else None,
        "outcome": found.convergence.outcome.name.lower(),
        "error": problem.condensed().exact_error(found.r),
        "iterations": found.convergence.iterations,
    }


def write_problem(
    path: Path, problem: am.FrictionProblem, condensed: am.FrictionProblem, r: np.ndarray
) -> None:
    """The problem in the forms it has with its warm start, for the workers."""
    matrices = {"W": sparse.csr_array(condensed.W)}
    u, v = problem.velocity(r)
    arrays = {"mu": problem.mu, "q": condensed.q.ravel(), "r0": r.ravel(), "u0": u.ravel()}
    if problem.form is am.Form.GLOBAL:
        matrices |= {"M": problem.M, "H": problem.H}
        arrays |= {"f": problem.f, "w": problem.w.ravel(), "v0": v}
    for name, matrix in matrices.items():
        for part in ("data", "indices", "indptr"):
            arrays[f"{name}_{part}"] = getattr(matrix, part)
    np.savez(path, **arrays)


def worker(
    condensed: am.FrictionProblem, python: str, file: Path, solver: str, cap: float,
    tolerance: float = TOLERANCE, retighten: Sequence[float] = RETIGHTEN,
    measure: Callable[[np.ndarray], float] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """The best run of one solver that passes our judge, or why there is none.

    cap: processor seconds of a call; measure: of reactions (nc, 3) in place of the judge.  Of a
    run that fails "spent" is what it really took.
    """
    runs, why, spent = calls(
        python, file, solver, cap, [tolerance * k for k in retighten],
        measure or condensed.exact_error, tolerance,
    )  # fmt: skip
    passing = [x for x in runs if x["error"] <= tolerance]
    if passing:
        return min(passing, key=lambda x: x["seconds"])
    if runs:
        return {
            "seconds": None,
            "error": min(x["error"] for x in runs),
            "why": "misses the tolerance",
            "spent": max(x["seconds"] for x in runs),
        }
    return {"seconds": None, "why": why, "spent": spent}


def calls(
    python: str, file: Path, solver: str, cap: float, asked: Sequence[float],
    measure: Callable[[np.ndarray], float], enough: float,
) -> tuple[list[dict[str, Any]], str, float]:  # fmt: skip
    """Calls of one solver with one tolerance after another, in one process.

    Ends where the error is small enough or a call takes longer than cap; returns what the calls
    gave with their "error", why they ended, and the processor seconds of the last one.
    """
    script = str(Path(__file__).parent / "siconos_worker.py")
    texts = ",".join(f"{tolerance:g}" for tolerance in asked)
    process = subprocess.Popen([python, script, str(file), solver, texts],
                               stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                               text=True)  # fmt: skip
    runs, why, spent = [], "ended without an answer", 0.0
    for k in range(len(asked) + 1):
        line, spent = _line(process, cap if k else START_UP)
        if not line:
            why = f"over {cap:g} s" if spent >= cap and k else why
            break
        found = json.loads(line)
        if k == 0:
            continue
        r = np.array(found.pop("r")).reshape(-1, 3)
        runs.append({**found, "error": measure(r)})
        if runs[-1]["error"] <= enough or found["seconds"] > cap:
            break  # a tighter one takes no less
    process.kill()
    process.wait()
    return runs, why, spent


def _line(process: subprocess.Popen, cap: float) -> tuple[str, float]:
    """The next line, "" at the end or after so many processor seconds; and those it took."""
    began, waited = _processor(process.pid), time.monotonic()
    while True:
        ready, _, _ = select.select([process.stdout], [], [], POLL)
        spent = _processor(process.pid) - began
        if ready:
            return process.stdout.readline(), spent
        if spent >= cap or time.monotonic() - waited > PATIENT * cap:
            return "", spent


def _processor(pid: int) -> float:
    """Processor seconds of a process so far, 0 where the system does not tell."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _said(row: dict[str, Any]) -> str:
    if row["seconds"] is not None:
        return f"{row['seconds']:.3g} s"
    reached = f", error {row['error']:.0e}" if "error" in row else ""
    return row["why"] + reached


def table(results: dict[str, dict[str, Any]]) -> str:
    """Markdown: one block for each wall."""
    return "\n\n".join(_block(name, entry) for name, entry in results.items())


def _block(name: str, entry: dict[str, Any]) -> str:
    forming, theirs = entry["condensing"], entry["siconos"]
    rows = [
        f"### {name}: {entry['contacts']} contacts, {entry['unknowns']} unknowns",
        "",
        f"Forming W takes {_cell(forming)}.",
        "",
        "| solver | given W | given M and H | error |",
        "|---|---|---|---|",
    ]
    for who in dict.fromkeys((*entry["ours"], *entry["ours_global"])):
        local, whole = entry["ours"].get(who), entry["ours_global"].get(who)
        given = None if local is None else local["seconds"]
        total = whole["seconds"] if whole else None if given is None else given + forming
        error = (whole or local)["error"]
        rows.append(f"| **{who}** | {_cell(given)} | {_cell(total)} | {error:.1e} |")
    solved = {who: row for who, row in theirs.items() if row["seconds"] is not None}
    for who, row in sorted(solved.items(), key=lambda x: x[1]["seconds"]):
        given = None if who.startswith("GLOBAL_") else row["seconds"]
        total = row["seconds"] if given is None else given + forming
        rows.append(f"| {who} | {_cell(given)} | {_cell(total)} | {row['error']:.1e} |")
    failed: dict[str, list[str]] = {}
    for who, row in theirs.items():
        if who not in solved:
            failed.setdefault(row["why"], []).append(who)
    missing = [f"Siconos, {why}: {', '.join(names)}." for why, names in failed.items()]
    return "\n".join([*rows, "", "\n\n".join([*missing, *_verdict(entry)])])


def _verdict(entry: dict[str, Any]) -> list[str]:
    """Ours against the best of theirs, on both clocks."""
    forming = entry["condensing"]
    local, theirs = _solved(entry["ours"]), _solved(entry["siconos"])
    peers = {s: t for s, t in theirs.items() if not s.startswith("GLOBAL_")}
    whole = {f"{s} and W": t + forming for s, t in local.items()}
    whole |= _solved(entry["ours_global"])
    others = {s if s not in peers else f"{s} and W": t + forming * (s in peers)
              for s, t in theirs.items()}  # fmt: skip
    lines = []
    for clock, mine, rivals in (("W", local, peers), ("M and H", whole, others)):
        if mine and rivals:
            best, peer = min(mine, key=mine.__getitem__), min(rivals, key=rivals.__getitem__)
            auto, quickest = mine.get("Auto", math.inf), rivals[peer]
            lines.append(
                f"Given {clock}: the best of Siconos is {peer}, {_cell(quickest)}; Auto takes "
                f"{_cell(auto)}, {auto / quickest:.2g} of it, and our best, {best}, "
                f"{_cell(mine[best])}, {mine[best] / quickest:.2g} of it."
            )
    return lines


def _solved(rows: dict[str, dict[str, Any]]) -> dict[str, float]:
    """Seconds of those that met the tolerance."""
    return {name: row["seconds"] for name, row in rows.items() if row["seconds"] is not None}


def _cell(value: float | None) -> str:
    if value is None or math.isinf(value):
        return "-"
    return f"{value:.3g} s" if value >= 1 else f"{1e3 * value:.3g} ms"
