"""Is W (or M) indefinite?  A direction in which reactions gain energy, found and named.

W = H^T M^-1 H of bodies is positive semidefinite: d^T W d is twice the energy that reactions d
store.  Where it is negative, of the symmetric part, a contact is pushed apart less the more it
is pressed; solutions may not exist, and methods have nothing to fall along.  A wrong sign, or
rows in another order, does that.

Single contacts first (the blocks on the diagonal of W, the diagonal of M), then a few steps of
Lanczos' method.  What it finds is a proof, the number being evaluated; what it does not find
may still be there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.arrays import Matrix
from .judge.measures import Measure
from .solution import Obstruction

if TYPE_CHECKING:
    from .equations import Equations

Array = NDArray[np.float64]
ROUNDING = 1e-8  # negative values of this size, relative to the matrix or block, are none
STEPS = 60  # of Lanczos' method
ENTRIES = 4_000_000  # of a matrix up to which its products take no time that one notices
SEED = 1  # of its start
MOST = 0.1  # part of the largest share in a direction from which a contact is named
NAMED = 5  # contacts at most


@dataclass(frozen=True)
class NegativeDirection:
    """A unit direction d with d^T A d = value < 0, A being W or M.

    places: contacts (W) or unknowns (M) with the largest parts in d, the largest first; entries
    (d,): the direction at a single contact, in its frame, else None.
    """

    matrix: str
    value: float
    places: tuple[int, ...]
    entries: tuple[float, ...] | None = None

    def __str__(self) -> str:
        name = "contact" if self.matrix == "W" else "unknown"
        at = ", ".join(map(str, self.places))
        where = f"{name}{'s' if len(self.places) > 1 else ''} {at}"
        if self.entries is not None:
            where += f", along ({', '.join(f'{x:.3g}' for x in self.entries)})"
        return (
            f"{self.matrix} is indefinite: d' {self.matrix} d = {self.value:.3g} for a unit "
            f"direction d at {where}"
        )


def negative_direction(problem: Equations) -> NegativeDirection | None:
    """The direction in which W, or M of the global form, is negative; None if none was found.

    Takes some products with the matrix; None also where that would take long.
    """
    if problem.measure is Measure.EXACT:
        local = problem.condensed()
        found = local.kept(negative_contact) or local.kept(_of_whole)
        if found is not None or not problem.has_v:
            return found
    M = problem.M
    if not sparse.issparse(M) or M.nnz > ENTRIES:
        return None
    diagonal = M.diagonal()
    if diagonal.min(initial=0.0) < -ROUNDING * np.abs(diagonal).max(initial=0.0):
        at = int(diagonal.argmin())
        return NegativeDirection("M", float(diagonal[at]), (at,))
    return _found("M", sparse.csr_array(M), np.arange(M.shape[0]))


def negative_contact(problem: Equations) -> NegativeDirection | None:
    """The same of the contacts alone, the blocks on the diagonal of W (Delassus form)."""
    d = problem.dimension
    blocks = problem.blocks.diagonal_blocks[:, :d, :d]
    if not len(blocks):
        return None
    symmetric = (blocks + blocks.swapaxes(1, 2)) / 2
    doubtful = np.flatnonzero(~_surely_semidefinite(symmetric))
    if not len(doubtful):
        return None
    values, vectors = np.linalg.eigh(symmetric[doubtful])
    relative = values[:, 0] / np.maximum(np.abs(values).max(axis=1), np.finfo(float).tiny)
    at = int(relative.argmin())
    if relative[at] >= -ROUNDING:
        return None
    vector = vectors[at, :, 0]
    vector = vector * (1.0 if vector[np.abs(vector).argmax()] > 0 else -1.0) + 0.0
    return NegativeDirection(
        "W", float(values[at, 0]), (int(doubtful[at]),), tuple(map(float, vector))
    )


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def _surely_semidefinite(blocks: Array) -> NDArray[np.bool_]:
    """Symmetric blocks (n, d, d), lifted by half of what counts as rounding, have pivots > 0.

    Takes a tenth of the time of their eigenvalues; others may be semidefinite too.
    """
    rest = blocks + (ROUNDING / 2) * np.abs(blocks).max(axis=(1, 2))[:, None, None] * np.eye(
        blocks.shape[1]
    )
    good = np.ones(len(blocks), dtype=bool)
    while rest.shape[1]:
        good &= rest[:, 0, 0] > 0
        column = rest[:, 1:, :1] / rest[:, :1, :1]
        rest = rest[:, 1:, 1:] - column * rest[:, :1, 1:]
    return good


def gains_energy(problem: Equations) -> bool:
    """True where a contact alone gains energy by its reactions: methods go round there.

    Looks at problems whose W is there to judge, and at no others.
    """
    if problem.measure is not Measure.EXACT:
        return False
    return problem.condensed().kept(negative_contact) is not None


def obstruction(problem: Equations, u: Array) -> tuple[Obstruction | None, str]:
    """What in the problem itself may be the reason of a failure, and the same in words.

    u (nc, d): velocities of the best state that is known.
    """
    fixed = np.flatnonzero((problem.rho == 0) & (u[:, 0] < 0))
    if fixed.size:
        at = int(fixed[u[fixed, 0].argmin()])
        return Obstruction.UNREACTING, (
            f"contact {at} can not react, its own block of W is 0, and closes with "
            f"u_N = {u[at, 0]:.3g}"
        )
    found = negative_direction(problem)
    return (None, "") if found is None else (Obstruction.INDEFINITE, str(found))


def _of_whole(problem: Equations) -> NegativeDirection | None:
    W = problem.W
    assert W is not None
    entries = W.nnz if sparse.issparse(W) else W.size
    if entries > ENTRIES:
        return None
    m = problem.contacts * problem.dimension
    return _found("W", W, np.arange(m) // problem.dimension)


def _found(name: str, A: Matrix, owner: NDArray) -> NegativeDirection | None:
    """From the Ritz vector of the smallest Ritz value of the symmetric part of A (m, m)."""
    from scipy.linalg import eigh_tridiagonal

    m = A.shape[0]
    if not m:
        return None

    symmetric = (A + A.T) * 0.5  # once: a product with A.T takes longer than one with A

    def product(x: Array) -> Array:
        return symmetric @ x

    vectors, diagonal, beside = _lanczos(product, m, min(STEPS, m))
    values, parts = eigh_tridiagonal(diagonal, beside)
    d = vectors.T @ parts[:, 0]
    d /= np.linalg.norm(d)
    value = float(d @ product(d))
    if not value < -ROUNDING * np.abs(values).max():
        return None
    share = np.bincount(owner, d**2)
    order = np.argsort(-share, kind="stable")[:NAMED]
    places = tuple(int(k) for k in order if share[k] >= MOST * share[order[0]])
    return NegativeDirection(name, value, places)


def _lanczos(product, m: int, steps: int) -> tuple[Array, Array, Array]:
    """Orthonormal vectors (k, m) and the tridiagonal matrix (k,), (k-1,) of the operator."""
    vectors, diagonal, beside = np.empty((steps, m)), [], []
    v = np.random.default_rng(SEED).standard_normal(m)
    v /= np.linalg.norm(v)
    for k in range(steps):
        vectors[k] = v
        w, known = product(v), vectors[: k + 1]
        diagonal.append(float(v @ w))
        for _ in range(2):  # orthogonal to all, as rounding is not
            w = w - known.T @ (known @ w)
        length = float(np.linalg.norm(w))
        if length <= 1e-12 * max(map(abs, diagonal)) or k + 1 == steps:
            break
        beside.append(length)
        v = w / length
    return vectors[: len(diagonal)], np.array(diagonal), np.array(beside)
