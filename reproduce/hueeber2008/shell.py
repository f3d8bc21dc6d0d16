"""Section 6: a body pressed into a spherical shell, two bodies with meshes that do not match.

The coarsest mesh has the 104 nodes and 241 tetrahedra that the printed numbers of nodes imply
(`meshes`; shapes: `shapes`); each refinement cuts every edge in half and moves new nodes onto
the surfaces.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

import amontons as am
from amontons.solvers import Iterate

from .runs import INEXACT, NESTED, C, Run, fixed_point, run
from .shapes import HIGH, INNER, LOW, OUTER, RADIUS, RIM, TOP

PRESSED = am.Fix("block.top", (0, 0, -0.2))
HERE = Path(__file__).parent


def _round_shell(mesh: am.Mesh) -> am.Mesh:
    """The mesh with its nodes on the spheres that its surfaces stand for; levels stay."""
    x = np.array(mesh.points)
    for name, radius in (("top", INNER), ("bottom", OUTER)):
        nodes = _nodes(mesh, name)
        x[nodes] *= radius / np.linalg.norm(x[nodes], axis=1)[:, None]
    return replace(mesh, points=x)


def _round_block(mesh: am.Mesh) -> am.Mesh:
    """The same with cap, cone and the circles where they end."""
    x = np.array(mesh.points)
    cap, side, top = (_nodes(mesh, name) for name in ("bottom", "side", "top"))
    middle = np.array([0, 0, RADIUS - INNER])
    ray = x[cap] - middle
    x[cap] = middle + RADIUS * ray / np.linalg.norm(ray, axis=1)[:, None]
    ends = (np.intersect1d(side, cap), np.intersect1d(side, top))
    x[ends[0], 2], x[ends[1], 2] = LOW, HIGH
    share = (x[side, 2] - LOW) / (HIGH - LOW)
    wanted = RIM + share * (TOP - RIM)
    x[side, :2] *= (wanted / np.linalg.norm(x[side, :2], axis=1))[:, None]
    return replace(mesh, points=x)


def _nodes(mesh: am.Mesh, surface: str) -> np.ndarray:
    return np.unique(np.concatenate([f.nodes.ravel() for f in mesh.surfaces[surface]]))


@cache
def meshes(level: int) -> tuple[am.Mesh, am.Mesh]:
    """(shell, block), refined `level` times, with their coarser levels."""
    if not level:
        return am.read_mesh(HERE / "shell.msh"), am.read_mesh(HERE / "block.msh")
    shell, block = meshes(level - 1)
    return _round_shell(am.refined(shell)), _round_block(am.refined(block))


@cache
def model(level: int, mu: float, traction: bool = False) -> am.Model:
    """The two bodies, refined `level` times; friction mu.

    traction: the surface traction of the nonsymmetric example instead of the displacement.
    """
    of_shell, of_block = meshes(level)
    shell = am.Body(of_shell, am.LinearElastic(young=400, poisson=0.3), "shell")
    block = am.Body(of_block, am.LinearElastic(young=300, poisson=0.3), "block")
    load = am.Traction(
        "block.top", lambda x: (15, 0, -150 * np.exp(-100 * (x[0] ** 2 + x[1] ** 2)))
    )
    return am.Model(
        [block, shell],
        supports=[am.Fix("shell.bottom", (0, 0, 0)), *([] if traction else [PRESSED])],
        loads=[load] if traction else [],
        contacts=[am.Contact("block.bottom", master="shell.top", mu=mu, method="mortar")],
    )


def first_guess(model: am.Model) -> Iterate:
    """u = 0.1 n and lambda = 0.0001 n at the slave nodes, else 0.

    lambda is a traction: the force at a node is D_p times as large.
    """
    problem = model.assemble()
    (placed,) = model.discretisation.placed
    v = np.zeros(model.discretisation.dofs)
    nodes = placed.rows.nodes
    v[(3 * nodes[:, None] + np.arange(3))] = (
        -0.1 * placed.rows.frames[:, 0]
    )  # block comes first
    r = np.zeros((problem.contacts, 3))
    r[:, 0] = 1e-4 * placed.rows.weights
    return Iterate(r, v[model.discretisation.free])


def table61(levels: list[int], friction: tuple[float, ...] = (0.2, 0.4, 0.6)) -> dict:
    """Algorithm 2 with m = k_f = 1, tolerance 1e-9: {strategy: {mu: {level: run}}}."""
    out: dict[str, dict[str, dict[str, Run]]] = {"zero": {}, "nested": {}}
    for mu in friction:
        for name, runs in out.items():
            runs[str(mu)] = {str(k): _run(model(k, mu), name, k) for k in levels}
    return out


def _run(now: am.Model, strategy: str, level: int) -> Run:
    """From the first guess, or from the solution on the coarser meshes."""
    nested = strategy == "nested" and level > 0
    return run(
        now.assemble(), fixed_point(**(NESTED if nested else INEXACT)), 1e-9, limit=200,
        start=None if nested else first_guess(now),
    )  # fmt: skip


def nodes(level: int) -> int:
    """Of both meshes."""
    return sum(len(mesh.points) for mesh in meshes(level))


def newton(level: int, mu: float) -> dict[str, Run]:
    """Full Newton beside the fixed point with k_f = 1, both exact, tolerance 1e-9."""
    problem, start = model(level, mu).assemble(), first_guess(model(level, mu))
    full = am.ActiveSet(c_normal=C, c_tangential=C)
    return {
        "newton": run(problem, full, 1e-9, start=start),
        "fixed-point": run(problem, fixed_point(), 1e-9, start=start),
    }
