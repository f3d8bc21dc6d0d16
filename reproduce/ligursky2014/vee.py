"""Section 3.2.1: the V-shaped body on 2220, 8880 and 35520 triangles; `vee_curves` draws."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import amontons as am
from amontons.mechanics.ready.vee import vee

from .mixed import full_problem

HERE = Path(__file__).parent
LEVELS = {0: 555, 1: 2220, 2: 8880, 3: 35520}
GAMMA = 0.38
FRICTION = (0.6, 1.0, 1.4, 1.6, 1.8, 2.0)  # figure 11
PAPER = {  # section 3.2.1
    "step": 5e-4, "min_step": 5e-7, "max_step": 0.1, "grow": 1.3, "shrink": 0.5,
    "residual": 5e-12, "change": 5e-12, "min_cosine": 0.99999, "corrections": 5, "quick": 4,
}  # fmt: skip
METHODS = {
    "event tracking": None,
    "algorithm 1, first-order system": am.Continuation(),
    "algorithms 1 and 2, their settings": am.Continuation(**PAPER, switch=am.Switch.TANGENT),
}
FULL = "algorithms 1 and 2, H in full"  # as a user writes it, on the coarsest mesh only
LARGEST = 555  # triangles of that


@cache
def mesh(level: int) -> am.Mesh:
    """The paper's mesh: that of 555 triangles, refined."""
    data = json.loads((HERE / "mesh.json").read_text())
    surfaces = {
        name: (am.Facets("line", np.array(data[name])),) for name in ("clamped", "contact")
    }
    cells = (am.Cells("tri", np.array(data["triangles"])),)
    return am.refined(am.Mesh(np.array(data["points"]), cells, surfaces), level)


def follow(level: int, options: am.Continuation | None, mu: float = 1.8) -> am.Branch:
    """The whole curve, gamma from 0 to 1."""
    return am.follow(vee(mesh(level), mu=mu), "load", (0.0, 1.0), options=options)


def coarsest(levels: Sequence[int]) -> int:
    """The coarsest of the paper's meshes among some, if there is one."""
    return min((level for level in levels if level > 0), default=0)


def corner(branch: am.Branch) -> int:
    """The contact at the most left node."""
    body = vee(branch_mesh(branch))
    return int(
        np.argmin(body.recover(branch.problem.solution(branch[0].state, 0.0)).points[:, 0])
    )


def branch_mesh(branch: am.Branch) -> am.Mesh:
    """The mesh on which a branch was computed, by the number of its contacts."""
    contacts = branch.problem.start.contacts
    return next(mesh(k) for k in range(6) if len(mesh(k).surface_nodes("contact")) == contacts)


def record(branch: am.Branch, cpu: float) -> dict[str, Any]:
    """Folds, the solutions at gamma = 0.38, and what it took."""
    left, path = corner(branch), branch.problem
    rows = []
    for y in branch.at(GAMMA):
        solution = path.solution(y, GAMMA)
        rows.append({
            "status": solution.pattern[left], "error": solution.convergence.error,
            "u_n": -float(solution.u[left, 0]), "u_t": float(solution.u[left, 1]),
            "lam_n": -float(solution.r[left, 0]), "lam_t": float(solution.r[left, 1]),
        })  # fmt: skip
    return record_of(branch, cpu, rows)


def record_of(branch: am.Branch, cpu: float, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """What is stored of a curve."""
    return {
        "folds": [e.parameter for e in branch.folds], "points": len(branch),
        "status changes": sum(e.kind is am.EventKind.STATUS for e in branch.events),
        "stops": [s.name.lower() for s in branch.stops], "cpu": cpu, "corner at 0.38": rows,
    }  # fmt: skip


def run(levels: Sequence[int], out: Path) -> dict[str, Any]:
    """All methods on the levels."""
    found: dict[str, Any] = {}
    for level in levels:
        found[str(LEVELS[level])] = {}
        for name, options in METHODS.items():
            follow(level, options) if level == levels[0] else None  # compile before timing
            began = time.process_time()
            branch = follow(level, options)
            cpu = time.process_time() - began
            found[str(LEVELS[level])][name] = record(branch, cpu)
            if options is None:
                tracked = branch
        if LEVELS[level] <= LARGEST:
            found[str(LEVELS[level])][FULL] = in_full(tracked)
    return found


def run_friction(levels: Sequence[int], out: Path) -> dict[str, Any]:
    """The folds for several coefficients of friction, on the coarsest level."""
    level = coarsest(levels)
    branches = {mu: follow(level, None, mu) for mu in FRICTION}
    return {f"{mu:g}": [e.parameter for e in branch.folds] for mu, branch in branches.items()}


def in_full(branch: am.Branch) -> dict[str, Any]:
    """The same of the function H in displacements and forces, which names its pieces only."""
    problem, start = full_problem(branch)
    began = time.process_time()
    found = am.follow(problem, start=start, at=0.0)
    cpu = time.process_time() - began
    rows = [
        path_state(problem, y, GAMMA, corner(branch)) | {"error": 0.0} for y in found.at(GAMMA)
    ]
    return record_of(found, cpu, rows) | {"unknowns": len(start)}


def path_state(problem: Any, y: np.ndarray, p: float, left: int) -> dict[str, Any]:
    """Status, displacement and force of a contact of the problem in full."""
    u, r = problem.local(y, p)
    return {
        "status": "fs+-"[problem.piece(y, p)[left]],
        "u_n": -float(u[left, 0]), "u_t": float(u[left, 1]),
        "lam_n": -float(r[left, 0]), "lam_t": float(r[left, 1]),
    }  # fmt: skip
