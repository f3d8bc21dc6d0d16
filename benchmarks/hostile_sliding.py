"""Two bodies that slide far, at worst: overlaps, folds, needles, ends, energies of no number.

    python benchmarks/hostile_sliding.py [--only TEXT] [--cells hex tet] [--orders 1] [...]

Every case is run with quadrilaterals, triangles, hexahedra and tetrahedra, of first and second
order, with either side as the slave, by the solver that `evolve` takes by default.  A finding
is an exception that is not the library's, a warning of Python, a number that is not finite,
no end within the limit, an end without the words that name its place, an end where there is a
solution, a warning that is missing; and after an end a last state that is not kept: the step
that led there is made again from the one before it, by a model that was made anew, and has to
be the same to the last bit.

Writes results/hostile_sliding.md, unless --only chooses cases whose name holds a text.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import re
import sys
import time
import warnings
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np
from hostile_sliding_models import CASES, KINDS, Kind
from machine import describe, options

import amontons as am
from amontons.core.clock import Deadline

HERE = Path(__file__).resolve().parent
STEP = 0.25


@dataclass
class Run:
    """What a case came to; states: how many were kept, words: how it ended."""

    case: str
    kind: Kind
    states: int = 0
    words: str = ""
    kept: bool | None = None
    seconds: float = 0.0
    told: set = field(default_factory=set)
    findings: list = field(default_factory=list)


def path(model, until, deadline, start=None):
    """Steps of a path that ends by the deadline."""
    return am.evolve(model, am.QuasiStatic(STEP), until=until, start=start, deadline=deadline)


def run(name, kind, limit):
    """One case, checked."""
    found = Run(name, kind)
    began = time.process_time()
    steps = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            case = CASES[name](kind)
            try:
                for step in path(case.model(), case.until, Deadline.after(limit)):
                    steps.append(step)  # noqa: PERF402  # it may end on the way
            except am.AmontonsError as error:
                found.words = str(error)
                last = getattr(error, "solution", None)
                if last is not None and not np.isfinite(last.v).all():
                    found.findings.append("what the error brings along is not finite")
            found.seconds = time.process_time() - began
            judge(found, case, steps, limit)
        except Exception as error:  # noqa: BLE001  that is what is looked for
            found.findings.append(f"{type(error).__name__}: {error}")
    found.states = len(steps)
    return found


def judge(found, case, steps, limit):
    """Add what is wrong."""
    add = found.findings.append
    if found.words and not case.ends:
        add(f"ended at {steps[-1].time if steps else 0:g}: {found.words}")
    if case.ends and not re.search(case.ends, found.words, re.DOTALL):
        add(f"not told: {case.ends!r} in {found.words!r}")
    if found.seconds > limit * 2:  # what does not heed it
        add(f"{found.seconds:.0f} s")
    for step in steps:
        found.told |= {warning.name for warning in step.warnings}
        arrays = step.state.displacement, step.state.force, step.reaction
        if not all(np.isfinite(array).all() for array in arrays):
            add(f"not finite at {step.time:g}")
    if case.told and case.told not in found.told:
        add(f"no warning {case.told}")
    if not case.ends and steps and not found.words:
        force = np.abs(steps[-1].state.force[:, 0]).sum()
        if case.presses != bool(force > 1e-9):
            add(f"force at the end {force:.3g}")
    if len(steps) > 1:
        found.kept = again(case, steps, limit)
        if not found.kept:
            add("the last step made again is not the same")


def again(case, steps, limit):
    """Whether the last step comes out bit-equal from the state before it."""
    before, last = steps[-2].state, steps[-1]
    fresh = next(path(case.model(), last.time + 1.0, Deadline.after(limit), start=before))
    return (np.array_equal(fresh.state.displacement, last.state.displacement)
            and np.array_equal(fresh.state.force, last.state.force))  # fmt: skip


def row(name, runs):
    """A line of the table."""
    whole = sum(not r.words for r in runs)
    kept = [r.kept for r in runs if r.kept is not None]
    words = next((r.words for r in runs if r.words), "")
    told = ", ".join(sorted(set().union(*(r.told for r in runs)))) or "-"
    seconds = max(r.seconds for r in runs)
    states = f"{min(r.states for r in runs)} to {max(r.states for r in runs)}"
    given = (CASES[name].__doc__ or "as above").split("\n")[0]
    return (f"| {name} | {given} | {whole} of {len(runs)} | {states} | {short(words)} | "
            f"{told} | {sum(kept)} of {len(kept)} | {seconds:.1f} | "
            f"{sum(bool(r.findings) for r in runs)} |")  # fmt: skip


def short(words, most=260):
    """Words in one cell of a table."""
    words = " ".join(words.replace("|", "/").split())
    return (words[: most - 4] + " ..." if len(words) > most else words) or "-"


def page(runs, command):
    """The page."""
    machine = "; ".join(f"{key} {value}" for key, value in describe().items())
    about = " ".join(" ".join(part.split()) for part in __doc__.split("\n\n")[2:3])
    lines = ["# Two bodies that slide far, at worst", "",
             f"Regenerate: `{command}`.", "",
             f"{machine}; one thread.", "", about, "",
             "Whole: runs that went the whole way; states: kept by a run; kept: last steps "
             "that come out to the last bit; seconds: CPU of the longest run, kernels that are "
             "compiled in it counted.", "",
             "| case | given | whole | states | words of an end | warnings | kept | seconds | "
             "findings |", "|---|---|---|---|---|---|---|---|---|"]  # fmt: skip
    names = dict.fromkeys(r.case for r in runs)
    lines += [row(name, [r for r in runs if r.case == name]) for name in names]
    found = [(r, text) for r in runs for text in r.findings]
    lines += ["", f"## Findings: {len(found)}", ""]
    lines += [f"- {r.case}, {r.kind}: {short(text, 400)}" for r, text in found]
    return "\n".join(lines).rstrip() + "\n"


def main():
    """Run what is asked for."""
    parser = options(__doc__)
    parser.add_argument("--only", default="", help="cases whose name holds this text")
    parser.add_argument("--cells", nargs="*", default=[c for k in KINDS.values() for c in k])
    parser.add_argument("--orders", nargs="*", type=int, default=[1, 2])
    parser.add_argument("--limit", type=float, default=60.0, help="seconds of one case")
    asked = parser.parse_args()
    runs = []
    for name in CASES:
        for dim, order, swap in product(KINDS, (1, 2), (False, True)):
            for cells in KINDS[dim]:
                kind = Kind(dim, cells, order, swap)
                if asked.only in name and cells in asked.cells and order in asked.orders:
                    runs.append(run(name, kind, asked.limit))
                    one = runs[-1]
                    print(name, kind, one.states, f"{one.seconds:.1f} s", short(one.words, 120),
                          one.findings, sep=" | ", flush=True)  # fmt: skip
    if not asked.only:
        command = " ".join(["python benchmarks/hostile_sliding.py", *sys.argv[1:]])
        (HERE / "results" / "hostile_sliding.md").write_text(page(runs, command))


if __name__ == "__main__":
    main()
