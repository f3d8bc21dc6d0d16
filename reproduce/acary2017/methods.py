"""The methods by their names in the paper, table 1, and ours beside them."""

from __future__ import annotations

from dataclasses import dataclass

import amontons as am
from amontons.solvers.contract import Solver

SWEEPS = 10  # between two judgements: a judgement costs nearly a sweep, as (13) in the paper
FULL = am.FullStep()
FEW = 3  # projections for one contact at a visit
NEWTON_LOCAL, PROJECTION_LOCAL = am.LocalSolver.NEWTON, am.LocalSolver.PROJECTION


@dataclass(frozen=True)
class Method:
    """A solver under a name; on the global form (M, H) it never sees W."""

    name: str
    solver: Solver
    text: str
    on_global: bool = False
    printed: bool = False  # as in the paper; else a variant of ours


def _sweeps(
    local: am.LocalSolver, batch: int = SWEEPS, steps: int | None = None
) -> am.GaussSeidel:
    return am.GaussSeidel(local=local, batch=batch, local_steps=steps)


METHODS = (
    Method("NSN-AC", am.SemismoothNewton(am.AlartCurnier(), line_search=FULL),
           "Newton on (8), full steps", printed=True),
    Method("NSN-JM", am.SemismoothNewton(am.JeanMoreau(), line_search=FULL),
           "Newton on (9), full steps", printed=True),
    Method("NSN-NM", am.SemismoothNewton(am.NaturalMap(), line_search=FULL),
           "Newton on (10), full steps", printed=True),
    Method("NSN-AC-HYBRID",
           am.Hybrid(first=_sweeps(NEWTON_LOCAL, 100),
                     main=am.SemismoothNewton(am.AlartCurnier(), line_search=FULL)),
           "100 sweeps of NSGS-AC, then NSN-AC", printed=True),
    Method("NSGS-AC", _sweeps(NEWTON_LOCAL),
           "Gauss-Seidel, Newton on (8) for one contact", printed=True),
    Method("NSGS-FP-VI-UPK", _sweeps(PROJECTION_LOCAL, steps=FEW),
           f"Gauss-Seidel, {FEW} projections for one contact at a visit", printed=True),
    Method("NSGS-FP-VI-UPK 100", _sweeps(PROJECTION_LOCAL),
           "the same with up to 100 projections, to 1e-14"),
    Method("NSN-AC line search", am.SemismoothNewton(am.AlartCurnier()),
           "with a non-monotone line search"),
    Method("NSN-FB", am.SemismoothNewton(am.FischerBurmeister()),
           "Newton on Fischer and Burmeister's function, with a line search"),
    Method("NSN-AC global", am.SemismoothNewton(linear=am.Direct(threads=1)),
           "line search, sparse LU of [M, -H; B Hᵀ, A], no W", on_global=True),
    Method("NSN-AC inexact", am.InexactNewton(),
           "line search, GMRES with a block LU that is kept while it serves"),
    Method("Jacobi", am.Jacobi(batch=SWEEPS), "all contacts at once, stiffened to be safe"),
    Method("Auto", am.Auto(), "what `solve(problem)` runs, given W"),
    Method("Auto global", am.Auto(), "the same given M and H", on_global=True),
)  # fmt: skip
NAMES = tuple(method.name for method in METHODS)
PRINTED = tuple(method.name for method in METHODS if method.printed)
NEWTON = ("NSN-AC", "NSN-JM", "NSN-NM")
SWEEPING = ("NSGS-AC", "NSGS-FP-VI-UPK")
HYBRID = "NSN-AC-HYBRID"
WALL = (*PRINTED, "NSN-AC inexact", "Auto")
FINE = ("NSN-AC", "NSGS-AC", HYBRID, "NSN-AC global", "NSN-AC inexact", "Auto", "Auto global")
FCLIB = (*PRINTED, "NSN-AC line search", "NSN-FB", "Jacobi", "Auto")
VARIANTS = ("NSN-AC", "NSN-AC line search", "NSN-FB", "NSN-AC global", "Auto global",
            *SWEEPING, "NSGS-FP-VI-UPK 100", "Jacobi")  # fmt: skip  # on a few problems
