"""The methods by their names in the paper, table 1, and ours beside them."""

from __future__ import annotations

from dataclasses import dataclass

import amontons as am
from amontons.solvers.base import Solver

SWEEPS = 10  # between two judgements: a judgement costs nearly a sweep, as (13) in the paper
FULL = am.FullStep()
LONGER = {"NSGS-AC": 4.0}  # times the limit on the wall, so that ratios are more than bounds


@dataclass(frozen=True)
class Method:
    """A solver under a name; on the global form (M, H) it never sees W."""

    name: str
    solver: Solver
    text: str
    on_global: bool = False
    printed: bool = False  # as in the paper; else a variant of ours


def _sweeps(local: am.LocalSolver, batch: int = SWEEPS) -> am.GaussSeidel:
    return am.GaussSeidel(local=local, batch=batch)


METHODS = (
    Method("NSN-AC", am.SemismoothNewton(am.AlartCurnier(), line_search=FULL),
           "Newton on (8), full steps", printed=True),
    Method("NSN-JM", am.SemismoothNewton(am.JeanMoreau(), line_search=FULL),
           "Newton on (9), full steps", printed=True),
    Method("NSN-NM", am.SemismoothNewton(am.NaturalMap(), line_search=FULL),
           "Newton on (10), full steps", printed=True),
    Method("NSN-AC-HYBRID",
           am.Hybrid(first=_sweeps(am.LocalSolver.NEWTON, 100),
                     main=am.SemismoothNewton(am.AlartCurnier(), line_search=FULL)),
           "100 sweeps of NSGS-AC, then NSN-AC", printed=True),
    Method("NSGS-AC", _sweeps(am.LocalSolver.NEWTON),
           "Gauss-Seidel, Newton on (8) for one contact", printed=True),
    Method("NSGS-FP-VI-UPK", _sweeps(am.LocalSolver.PROJECTION),
           "Gauss-Seidel, projections for one contact", printed=True),
    Method("NSN-AC line search", am.SemismoothNewton(am.AlartCurnier()),
           "with a non-monotone line search"),
    Method("NSN-JM line search", am.SemismoothNewton(am.JeanMoreau()),
           "with a non-monotone line search"),
    Method("NSN-NM line search", am.SemismoothNewton(am.NaturalMap()),
           "with a non-monotone line search"),
    Method("NSN-AC global", am.SemismoothNewton(linear=am.Direct(threads=1)),
           "line search, sparse LU of [M, -H; B Hᵀ, A], no W", on_global=True),
    Method("NSN-AC inexact", am.InexactNewton(),
           "line search, GMRES with a block LU that is kept while it serves"),
    Method("Auto", am.Auto(), "what `solve(problem)` runs, given W"),
    Method("Auto global", am.Auto(), "the same given M and H", on_global=True),
)  # fmt: skip
NAMES = tuple(method.name for method in METHODS)
PRINTED = tuple(method.name for method in METHODS if method.printed)
NEWTON = ("NSN-AC", "NSN-JM", "NSN-NM")
SWEEPING = ("NSGS-AC", "NSGS-FP-VI-UPK")
HYBRID = "NSN-AC-HYBRID"
