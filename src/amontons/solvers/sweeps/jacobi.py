"""Jacobi: all contacts at once, each solved exactly given what all others were.

    r_i <- solution of  u = L W_ii (x - r_i) + (W r + q)_i,  x in K_i     for all i from one r

With L = 1 this is plain Jacobi, which diverges as soon as contacts act on each other more than
on themselves: W of a body with many contacts is not block diagonally dominant.  The safe L is
the largest eigenvalue of D^-1/2 W D^-1/2, D = blockdiag(W_ii): then L D - W is positive
semidefinite, and each iteration is a projected gradient step in the metric L D, which can not
increase the energy of a frictionless or a Tresca problem; from L / 2 on it converges there.  L
is found by power iteration, which comes from below but well above L / 2, and is at most what
block Gershgorin says.  With Coulomb friction there is no such proof, as for Gauss-Seidel; the
driver sees where errors do not fall.

Contacts of an iteration do not wait for each other, which is why parallel codes use it; one
core is quicker with `GaussSeidel`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numba import uint64
from numpy.typing import NDArray

from ...core.compiled import njit
from ...core.options import check_options
from ...linear.blocks import spatial
from ...problem.friction import Form, FrictionProblem
from ...problem.law.single import solve_contact
from ..contract import Iterate, Target, check_at_least, check_positive
from .local_contact import EXACT_FLOPS

Array = NDArray[np.float64]
POWER_STEPS = 30  # products with W to find L
BLOCK_FLOPS, CONTACT_FLOPS = 18, 30  # of an iteration: per block of W, per contact besides


@dataclass(frozen=True)
class Jacobi:
    """Projected block Jacobi on the Delassus form; one iterate per `batch` iterations."""

    form: ClassVar[Form] = Form.DELASSUS
    stiffening: float | None = None  # L of the module; None: the safe one, 1: plain Jacobi
    batch: int = 1  # iterations between two judgements

    def __post_init__(self) -> None:
        check_options(self)
        check_at_least(1, batch=self.batch)
        if self.stiffening is not None:
            check_positive(stiffening=self.stiffening)

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Iterations from `start`, for ever."""
        d, r = problem.dimension, spatial(start.r)
        factor = safe_stiffening(problem) if self.stiffening is None else self.stiffening
        indptr, indices, data, q, kind, parameters, _ = problem.kernel_data
        blocks = problem.blocks
        own = factor * blocks.diagonal_blocks
        each = BLOCK_FLOPS * len(indices) + (CONTACT_FLOPS + EXACT_FLOPS) * len(q)
        u = np.empty_like(r)
        flops = float(each * self.batch)
        if self.stiffening is None:
            flops += POWER_STEPS * BLOCK_FLOPS * len(indices)
        while True:
            jacobi_inplace(indptr, indices, data, q, kind, parameters, own, r, u, self.batch)
            yield Iterate(r[:, :d].copy(), iterations=self.batch, flops=flops)
            flops = float(each * self.batch)


def safe_stiffening(problem: FrictionProblem) -> float:
    """The largest eigenvalue of D^-1/2 W D^-1/2, at least 1, of a problem in Delassus form."""
    return problem.kept(_largest)


def _largest(problem: FrictionProblem) -> float:
    blocks = problem.blocks
    nc, indptr = len(blocks.diagonal), blocks.indptr
    if nc == 0:
        return 1.0
    root = _inverse_root(blocks.diagonal_blocks)
    rows = np.repeat(np.arange(nc), np.diff(indptr))
    scaled = root[rows] @ blocks.data @ root[blocks.indices]
    sizes = np.linalg.norm(scaled, ord="fro", axis=(1, 2))
    own = rows == blocks.indices
    sizes[own] = np.minimum(sizes[own], 1.0)
    bound = np.bincount(rows, weights=sizes, minlength=nc).max()  # block Gershgorin
    x, value = np.random.default_rng(0).standard_normal((nc, 3)), 1.0
    for _ in range(POWER_STEPS):
        size = np.linalg.norm(x)
        if size == 0:
            break
        x = x / size
        image = np.zeros_like(x)
        np.add.at(image, rows, np.einsum("kab,kb->ka", scaled, x[blocks.indices]))
        value, x = float(np.linalg.norm(image)), image
    return float(max(min(value, bound), 1.0))


def _inverse_root(blocks: Array) -> Array:
    """(nc, 3, 3) inverse roots of symmetric blocks, zero in directions without compliance."""
    values, vectors = np.linalg.eigh(0.5 * (blocks + blocks.swapaxes(1, 2)))
    largest = values.max(axis=1, keepdims=True)
    good = values > 1e-12 * np.where(largest > 0, largest, np.inf)
    roots = np.divide(1.0, np.sqrt(np.where(good, values, 1.0))) * good
    return (vectors * roots[:, None, :]) @ vectors.swapaxes(1, 2)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def jacobi_inplace(
    indptr: Any, indices: Any, data: Any, q: Any, kind: Any, parameters: Any, own: Any,
    r: Any, u: Any, iterations: int,
) -> None:  # fmt: skip
    """Iterations on r (nc, 3); own (nc, 3, 3) are the stiffened L W_ii, u (nc, 3) memory."""
    nc = len(r)
    for _ in range(iterations):
        for i in range(nc):
            u0, u1, u2 = q[i, 0], q[i, 1], q[i, 2]
            for k in range(uint64(indptr[i]), uint64(indptr[i + 1])):
                j = uint64(indices[k])
                r0, r1, r2 = r[j, 0], r[j, 1], r[j, 2]
                u0 += data[k, 0, 0] * r0 + data[k, 0, 1] * r1 + data[k, 0, 2] * r2
                u1 += data[k, 1, 0] * r0 + data[k, 1, 1] * r1 + data[k, 1, 2] * r2
                u2 += data[k, 2, 0] * r0 + data[k, 2, 1] * r1 + data[k, 2, 2] * r2
            u[i, 0], u[i, 1], u[i, 2] = u0, u1, u2
        for i in range(nc):
            A, r0, r1, r2 = own[i], r[i, 0], r[i, 1], r[i, 2]
            b0 = u[i, 0] - A[0, 0] * r0 - A[0, 1] * r1 - A[0, 2] * r2
            b1 = u[i, 1] - A[1, 0] * r0 - A[1, 1] * r1 - A[1, 2] * r2
            b2 = u[i, 2] - A[2, 0] * r0 - A[2, 1] * r1 - A[2, 2] * r2
            x0, x1, x2, _ = solve_contact(A, b0, b1, b2, kind[i], parameters[i], r1, r2)
            r[i, 0], r[i, 1], r[i, 2] = x0, x1, x2
