"""Hild's triangle on the meshes used here, and what kind of solution a displacement is.

`meshes.json` holds nodes and triangles.  n_c = 1, 3, 4, 5 have both critical coefficients that
the paper prints, n_c = 2 has two triangles and the printed mu_c; the others are as gmsh makes
them with elements of size 1 / n_c and n_c equal edges on AB.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import amontons as am
from amontons.mechanics.ready.hild import (
    free_displacement,
    hild_triangle,
    mesh_of_triangle,
    stick_displacement,
)

Array = NDArray[np.float64]
MESHES = Path(__file__).with_name("meshes.json")
LISTED = 25  # contact nodes up to which all solutions are listed in seconds at mu = 3.5
STARTS = 60  # of Newton's method for the slip solution of finer meshes, without proof
SAME = 1e-8  # energy norm of the error that names a solution; the paper says 1e-10
TOLERANCE = 1e-8  # of the judge
NEAR_KEPT = 1e-4  # energy norm, of a state that was kept
STRICT = 1e-10  # of the judge, and of the error that names a solution, as in the paper


@dataclass(frozen=True)
class Cell:
    """One computation of a table: free, stick, slip, other or fail, and what is known of it.

    error: energy norm of the difference to the nearest exact solution.  unheld: of a failure
    that has the displacements of a solution and forces that do not hold it, its name.
    """

    kind: str
    error: float
    iterations: int = 0
    unheld: str = ""


KINDS = ("free", "stick", "slip", "other", "fail")


def tally(rows: Iterable[Sequence[Cell]]) -> dict[str, list[int]]:
    """How many cells of each row are of each kind."""
    names = [[cell.kind for cell in row] for row in rows]
    return {kind: [row.count(kind) for row in names] for kind in KINDS}


@lru_cache
def mesh(n_c: int) -> am.Mesh:
    """The mesh with n_c contact nodes."""
    stored = json.loads(MESHES.read_text())[str(n_c)]
    points = np.array(stored["points"])
    points[np.abs(points[:, 1]) < 1e-8, 1] = 0.0
    return mesh_of_triangle(points, stored["triangles"])


def _some_solutions(problem: am.FrictionProblem) -> Any:
    return am.multistart(problem, starts=STARTS)


@dataclass(frozen=True)
class Triangle:
    """The problem of the paper with n_c contact nodes at friction mu, delta = 1."""

    n_c: int
    mu: float

    @cached_property
    def model(self) -> am.Model:
        """For `am.solve` and everything that reads surfaces."""
        return hild_triangle(mesh(self.n_c), mu=self.mu)

    @cached_property
    def problem(self) -> am.FrictionProblem:
        """Global form: M is the stiffness of the free unknowns, H picks (u_N, u_T) of nodes."""
        return self.model.assemble()

    @cached_property
    def local(self) -> am.FrictionProblem:
        """Delassus form: W is F_cc, q is u*."""
        return self.problem.condensed()

    def unknowns(self, field: Array) -> Array:
        """Entries (n,) of a nodal displacement (k, 2) that are free."""
        return field.ravel()[self.model.discretisation.free]

    @cached_property
    def exact(self) -> dict[str, Array]:
        """Displacements (n,) by name: free, stick and, above mu = 3, slip."""
        points = mesh(self.n_c).points
        known = {
            "free": self.unknowns(free_displacement(points)),
            "stick": self.unknowns(stick_displacement(points)),
        }
        if self.mu > 3:
            search = am.all_solutions if self.n_c <= LISTED else _some_solutions
            for found in search(self.local).solutions:
                if set(found.pattern) & {"+", "-"}:
                    known["slip"] = self.problem.velocity(found.r)[1]
        return known

    @cached_property
    def named(self) -> dict[str, am.Iterate]:
        """The solutions by which runs are told; at mu = 3 on its rim stick is the slip too."""
        return {name: am.Iterate(self.forces(v), v) for name, v in self.exact.items()}

    def forces(self, v: Array) -> Array:
        """Contact forces (n_c, 2), rows (N, T), that hold a displacement (n,)."""
        rest = self.problem.M @ v - self.problem.f
        return (self.problem.H.T @ rest).reshape(-1, 2)

    @cached_property
    def mass(self) -> Array:
        """G (n_c, n_c): integrals over AB of products of the contacts' shape functions."""
        x = self.places
        order = np.argsort(x)
        length = np.diff(np.append(x[order], 1.0))  # B is no contact
        G = np.zeros((self.n_c, self.n_c))
        for k, h in enumerate(length):
            here = order[k]
            G[here, here] += h / 3
            if k + 1 < self.n_c:
                after = order[k + 1]
                G[after, after] += h / 3
                G[here, after] = G[after, here] = h / 6
        return G

    @cached_property
    def lengths(self) -> Array:
        """Integral over AB of the shape function of each contact, (n_c,)."""
        return self.model.discretisation.placed[0].rows.weights

    @cached_property
    def places(self) -> Array:
        """x of the contacts, (n_c,)."""
        return self.model.discretisation.placed[0].rows.points[:, 0]

    @cached_property
    def integral(self) -> am.FrictionProblem:
        """The problem in tractions lambda: forces r = G lambda, so u = W (G x 1) lambda + q."""
        spread = np.kron(self.mass, np.eye(2))
        return am.FrictionProblem.from_delassus(
            self.local.W @ spread, self.local.q, np.full(self.n_c, self.mu)
        )

    @cached_property
    def size(self) -> float:
        """Energy norm of the largest difference between free and another solution."""
        return max(self.energy(v - self.exact["free"]) for v in self.exact.values())

    def energy(self, v: Array) -> float:
        """Energy norm sqrt(v K v) of a displacement (n,)."""
        return float(np.sqrt(max(v @ (self.problem.M @ v), 0.0)))

    def study(
        self, methods: Sequence[Any], starts: Sequence[am.Iterate], *, within: float = SAME,
        tolerance: float = TOLERANCE, max_iterations: int | None = None,
    ) -> list[list[Cell]]:  # fmt: skip
        """What each method makes of each start, by `am.basins`: a row of cells per method.

        within: energy norm, of the error that names a solution.
        """
        at = {f"start {k}": start for k, start in enumerate(starts)}
        found = am.basins(
            self.problem, methods, starts=at, solutions=self.named, within=within / self.size,
            tolerance=tolerance, max_iterations=max_iterations,
        )  # fmt: skip
        rows: list[list[Cell]] = [[] for _ in methods]
        for run in found.runs:
            kind = "fail" if run.found == "failed" else run.found.split(" ")[0]
            far = run.distance * found.scale
            unheld = run.nearest if kind == "fail" and far <= within else ""
            rows[run.method].append(Cell(kind, far, run.iterations, unheld))
        return rows


@lru_cache(maxsize=8)
def triangle_of(n_c: int, mu: float) -> Triangle:
    """The problem, made once with all that is prepared of it."""
    return Triangle(n_c, mu)
