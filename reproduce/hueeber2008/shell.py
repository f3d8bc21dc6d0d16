"""Section 6: a body pressed into a spherical shell, two bodies with meshes that do not match.

The paper gives r_i = 0.7, r_a = 1, r = 0.6, h = 0.5 and d = 0.3 in a drawing.  Read here as:
half a spherical shell between r_i and r_a, fixed at r_a; a body of height h whose lower side is
a cap of radius r, up to 60 degrees, and whose top is a disc of radius d; both touch at their
lowest points.  With a top as wide as the cap the sideways force of the last example would be
2.7 times the force that presses, and tip the body over.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from scipy import sparse

import amontons as am
from amontons.fem import Cells, Facets
from amontons.solvers import Iterate

from .runs import INEXACT, C, Run, fixed_point, run

INNER, OUTER, RADIUS, HEIGHT, TOP = 0.7, 1.0, 0.6, 0.5, 0.3
ANGLE = np.pi / 3  # polar angle at the rim of the cap
PRESSED = am.Fix("block.top", (0, 0, -0.2))
CORE = 0.5  # half side of the square in the middle of a disc


def _disc(level: int) -> am.Mesh:
    """A prism over [-1, 1]^2 with a square in the middle and four trapezoids around it.

    20 cells in one layer on level 0.
    """
    ring = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
    plane = np.concatenate([CORE * ring, ring])
    around = [[k, k + 4, (k + 1) % 4 + 4, (k + 1) % 4] for k in range(4)]
    flat = am.Mesh(plane, (Cells("quad", np.array([[0, 1, 2, 3], *around])),))
    flat = am.refined(flat)
    n, quads = len(flat.points), flat.cells[0].nodes
    points = np.concatenate([np.c_[flat.points, np.full(n, z)] for z in (0.0, 1.0)])
    hexes = Cells("hex", np.hstack([quads, quads + n]))
    sides = {
        "bottom": (Facets("quad", quads),), "top": (Facets("quad", quads + n),)
    }  # fmt: skip
    return am.refined(am.Mesh(points, (hexes,), sides), level)


def _curved(mesh: am.Mesh, place) -> am.Mesh:
    """The same cells with points (polar radius 0 to 1, direction, z) moved; levels stay."""
    x = mesh.points
    square = np.abs(x[:, :2]).max(axis=1)
    length = np.linalg.norm(x[:, :2], axis=1)
    away = np.clip((square - CORE / 2) / (1 - CORE / 2), 0, 1)  # squares turn into circles
    radius = (1 - away) * length / np.sqrt(2) + away * square
    ray = x[:, :2] / np.where(length > 0, length, 1)[:, None]
    return replace(mesh, points=place(radius, ray, x[:, 2]))


def _shell_points(radius: np.ndarray, ray: np.ndarray, z: np.ndarray) -> np.ndarray:
    angle = radius * np.pi / 2
    size = OUTER + z * (INNER - OUTER)
    return np.column_stack([(size * np.sin(angle))[:, None] * ray, -size * np.cos(angle)])


def _block_points(radius: np.ndarray, ray: np.ndarray, z: np.ndarray) -> np.ndarray:
    angle = radius * ANGLE
    low = RADIUS - INNER - RADIUS * np.cos(angle)
    height = low + z * (HEIGHT - INNER - low)
    wide = (1 - z) * RADIUS * np.sin(angle) + z * TOP * radius
    return np.column_stack([wide[:, None] * ray, height])


@cache
def model(level: int, mu: float, traction: bool = False) -> am.Model:
    """The two bodies, refined `level` times; friction mu.

    traction: the surface traction of the nonsymmetric example instead of the displacement.
    """
    shell = am.Body(
        _curved(_disc(level), _shell_points), am.LinearElastic(young=400, poisson=0.3), "shell"
    )
    block = am.Body(
        _curved(_disc(level), _block_points), am.LinearElastic(young=300, poisson=0.3), "block"
    )
    load = am.Traction(
        "block.top", lambda x: (15, 0, -150 * np.exp(-100 * (x[0] ** 2 + x[1] ** 2)))
    )
    return am.Model(
        [block, shell],
        supports=[am.Fix("shell.bottom", (0, 0, 0)), *([] if traction else [PRESSED])],
        loads=[load] if traction else [],
        contacts=[am.Contact("block.bottom", master="shell.top", mu=mu, method="mortar")],
    )


def first_guess(model: am.Model) -> object:
    """u = 0.1 n and lambda = 0.0001 n at the slave nodes, else 0."""
    problem = model.assemble()
    (placed,) = model.discretisation.placed
    v = np.zeros(model.discretisation.dofs)
    nodes = placed.rows.nodes
    v[(3 * nodes[:, None] + np.arange(3))] = (
        -0.1 * placed.rows.frames[:, 0]
    )  # block comes first
    r = np.zeros((problem.contacts, 3))
    r[:, 0] = 1e-4
    return Iterate(r, v[model.discretisation.free])


def prolonged(coarse: am.Model, found: object, fine: am.Model) -> object:
    """The iterate on the next finer level: displacements and tractions interpolated.

    On the contact zone the local displacements are, gaps included: what is closed stays closed
    although finer facets have other gaps.
    """
    problem = fine.assemble()
    P = problem.levels[0]
    given = coarse.discretisation
    values = np.array(given.prescribed)
    values[given.free] = found.v
    nodal = sparse.block_diag([body.mesh.levels[0] for body in fine.bodies], format="csr")
    v = (nodal @ values.reshape(-1, 3)).ravel()[fine.discretisation.free]
    assert len(v) == P.shape[0]
    (below,), (above,) = given.placed, fine.discretisation.placed

    def interpolated(rows: np.ndarray) -> np.ndarray:
        surface = np.zeros((len(coarse.bodies[0].mesh.points), 3))
        surface[below.rows.nodes] = rows
        return (fine.bodies[0].mesh.levels[0] @ surface)[above.rows.nodes]

    u = interpolated(coarse.assemble().local_velocity(found.v)) - problem.local_velocity(v)
    place = np.full(fine.discretisation.dofs, -1)
    place[fine.discretisation.free] = np.arange(len(v))
    slave = place[3 * above.rows.nodes[:, None] + np.arange(3)]  # the block comes first
    v[slave] += np.einsum("kij,ki->kj", above.rows.frames, u)
    traction = np.einsum("kij,ki->kj", below.rows.frames, found.r)
    spread = interpolated(traction / below.rows.weights[:, None])
    r = np.einsum("kij,kj->ki", above.rows.frames, spread * above.rows.weights[:, None])
    return Iterate(r, v)


def table61(levels: list[int], friction: tuple[float, ...] = (0.2, 0.4, 0.6)) -> dict:
    """Algorithm 2 with m = k_f = 1, tolerance 1e-9: {strategy: {mu: {level: run}}}."""
    out: dict[str, dict[str, dict[str, Run]]] = {"zero": {}, "nested": {}}
    for mu in friction:
        for name in out:
            runs: dict[str, Run] = {}
            for level in levels:
                now = model(level, mu)
                start = first_guess(now)
                if name == "nested" and runs:
                    before = runs[str(levels[levels.index(level) - 1])]
                    start = prolonged(model(level - 1, mu), before.iterates[-1], now)
                runs[str(level)] = run(
                    now.assemble(), fixed_point(**INEXACT), 1e-9, start=start, limit=150
                )
            out[name][str(mu)] = runs
    return out


def newton(level: int, mu: float) -> dict[str, Run]:
    """Full Newton beside the fixed point with k_f = 1, direct solver, tolerance 1e-9."""
    problem, start = model(level, mu).assemble(), first_guess(model(level, mu))
    given = {"c_normal": C, "c_tangential": C}
    fixed = am.ActiveSet(bound=am.FrictionBound.FIXED_POINT, **given)
    return {
        "newton": run(problem, am.ActiveSet(**given), 1e-9, start=start),
        "fixed-point": run(problem, fixed, 1e-9, start=start),
    }
