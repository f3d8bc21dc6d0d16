"""Contact on meshes for little more than one linear solve: W compressed, then corrected.

W = H^T M^-1 H of a meshed body is dense, and forming it costs a solve per reaction.  But

    W = W_near + W_far,   W_near = H_s^T M_s^-1 H_s,

where M_s holds only the unknowns within a few layers of the contact (the rest clamped): a thin
slab, cheap to factorise.  W_far is symmetric, positive semidefinite and smooth, as a contact
force acts on the far body only through its long waves: a Nyström approximation from a random
block Z of `rank` columns,

    W_far ~ Y (Z^T Y)^+ Y^T,   Y = W_far Z,   one block solve with M,

is accurate to three or four digits.  The contact problem is solved with this W_c by the
portfolio, and the remaining error is removed by correction with the true operator,

    r <- solution of the law with u = W_c r + (u_k - W_c r_k),   u_k = true velocity of r_k,

one solve with M per correction, accelerated by Anderson mixing; three to six corrections give
eight digits.  Mixing is free: velocities of mixed reactions are mixed velocities.  When the
corrections stall, Z gets more columns.

[N] N. Halko, P.-G. Martinsson, J. Tropp, "Finding structure with randomness", SIAM Review 53
(2011), section 5.5.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import NEVER, Deadline
from ...core.options import check_options
from ...linear import Direct
from ...linear.blocks import spatial
from ...linear.dense import DENSE_LIMIT
from ...problem.condensation import SOLVE_COLUMNS
from ...problem.friction import Form, FrictionProblem
from ..contract import Breakdown, Iterate, Iterates, Target, check_at_least, check_positive
from .portfolio import Portfolio

Array = NDArray[np.float64]
TRUNCATION = 1e-12  # eigenvalues of Z^T Y dropped, relative to the largest


@dataclass(frozen=True)
class CompressedDelassus:
    """Corrections by the true operator around contact solves with a compressed W."""

    form: ClassVar[Form] = Form.GLOBAL
    layers: int = 4  # of unknowns around the contact that W_near sees exactly
    rank: int = 64  # columns of Z, added again whenever the corrections stall
    max_rank: int = 512
    depth: int = 5  # past corrections that Anderson mixing combines
    inner_reduction: float = 1e-3  # tolerance of a contact solve relative to the current error
    seed: int = 0

    def __post_init__(self) -> None:
        check_options(self)
        check_at_least(1, layers=self.layers, rank=self.rank, depth=self.depth)
        check_at_least(self.rank, max_rank=self.max_rank)
        check_positive(inner_reduction=self.inner_reduction)

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterates:
        """Corrections from `start`; raises Breakdown when M is unsymmetric or W too large."""
        _check_fits(problem)
        far = _FarField.of(problem, self, target.deadline)
        compressed = far.problem()
        mixing = _Mixing(self.depth)
        r = start.r
        v = problem.velocity(r)[1]
        assert v is not None
        error, mark, waited = 1.0, 1.0, 0
        while True:
            u = problem.local_velocity(v)
            moved = u - (compressed.W @ r.ravel()).reshape(u.shape)
            tolerance = max(self.inner_reduction * error, 0.1 * target.tolerance)
            local = Target(tolerance, target.deadline)
            found = _contact_solve(compressed.with_load(moved), r, local)
            v_found = problem.velocity(found)[1]
            assert v_found is not None
            next_one = Iterate(found, v_found, linear_iterations=1, stage=f"rank {far.rank}")
            error = target.error(problem, next_one, (yield next_one))
            mark, waited = (error, 0) if error < 0.3 * mark else (mark, waited + 1)
            if waited == 4 and far.rank < self.max_rank:
                far.extend()
                compressed, mixing, mark, waited = far.problem(), _Mixing(self.depth), error, 0
                r, v = found, v_found
            else:
                r, v = mixing.next(r, found, v_found)


def _check_fits(problem: FrictionProblem) -> None:
    m = problem.contacts * problem.dimension
    M = problem.M
    assert M is not None
    if abs(M - M.T).max() > 1e-12 * abs(M).max():
        raise Breakdown("M is not symmetric, its far field has no Nyström approximation")
    if 2 * 8.0 * m * m > DENSE_LIMIT:
        raise Breakdown(f"the compressed W would take {16e-9 * m * m:.1f} GB")


def _contact_solve(problem: FrictionProblem, r: Array, target: Target) -> Array:
    """Reaction of the contact problem with the compressed W."""
    found, stages = r, Portfolio(problem, target, spatial(r)).iterates()
    while problem.error(found) > target.tolerance and not target.deadline.passed:
        iterate = next(stages, None)
        if iterate is None:
            break
        found = iterate.r
    return found


@dataclass(eq=False)
class _FarField:
    """W_near, and the block Z with Y = (W - W_near) Z."""

    source: FrictionProblem
    near: Array
    options: CompressedDelassus
    random: np.random.Generator
    Z: Array
    Y: Array
    deadline: Deadline

    @classmethod
    def of(
        cls, problem: FrictionProblem, options: CompressedDelassus, deadline: Deadline = NEVER
    ) -> _FarField:
        """Factorise the slab and probe the far field once."""
        near = _near_field(problem, options.layers, deadline)
        empty = np.empty((len(near), 0))
        random = np.random.default_rng(options.seed)
        far = cls(problem, near, options, random, empty, empty, deadline)
        far.extend()
        return far

    @property
    def rank(self) -> int:
        """Columns of Z."""
        return self.Z.shape[1]

    def extend(self) -> None:
        """Add `rank` random columns to Z, orthogonal to those there."""
        m = len(self.near)
        Z = self.random.standard_normal((m, min(self.options.rank, m)))
        Z = np.linalg.qr(np.column_stack([self.Z, Z]))[0][:, self.rank :]
        H = self.source.H
        assert H is not None
        Y = -self.near @ Z
        for part in self.source.matrices.column_parts(Z.shape[1]):
            self.deadline.check()
            Y[:, part] += H.T @ self.source.solve_M(H @ Z[:, part])
        self.Z, self.Y = np.column_stack([self.Z, Z]), np.column_stack([self.Y, Y])

    def problem(self) -> FrictionProblem:
        """The problem in Delassus form with the compressed W (its q is a placeholder)."""
        core = self.Z.T @ self.Y
        size, vectors = np.linalg.eigh(0.5 * (core + core.T))
        kept = size > TRUNCATION * max(size.max(initial=0.0), np.finfo(float).tiny)
        L = self.Y @ (vectors[:, kept] / np.sqrt(size[kept]))
        W = self.near + L @ L.T
        return FrictionProblem.from_delassus(
            W, np.zeros((self.source.contacts, self.source.dimension)), self.source.law
        )


def _near_field(problem: FrictionProblem, layers: int, deadline: Deadline) -> Array:
    """H_s^T M_s^-1 H_s with M_s the unknowns within `layers` couplings of the contact."""
    assert problem.M is not None and problem.H is not None
    H = sparse.csc_array(problem.H)
    inside = np.zeros(H.shape[0], dtype=bool)
    inside[H.indices] = True
    index, part = _slab(problem.M, inside, layers)
    slab = Direct().factor(sparse.csc_array(part))
    Hs = sparse.csc_array(sparse.csr_array(problem.H)[index])
    m = H.shape[1]
    W = np.empty((m, m))
    for first in range(0, m, SOLVE_COLUMNS):
        deadline.check()
        columns = Hs[:, first : first + SOLVE_COLUMNS].toarray()
        W[:, first : first + SOLVE_COLUMNS] = Hs.T @ slab.solve(columns)
    return 0.5 * (W + W.T)


def _slab(
    M: sparse.csc_array, inside: NDArray[np.bool_], layers: int
) -> tuple[NDArray[np.int64], sparse.csr_array]:
    """Unknowns within `layers` couplings of those inside, (n,), and their rows and columns."""
    rows = sparse.csr_array(M)
    pattern = sparse.csr_array((np.ones(rows.nnz), rows.indices, rows.indptr), shape=M.shape)
    for _ in range(layers):
        inside = pattern @ inside.astype(float) > 0
    index = np.flatnonzero(inside)
    return index, rows[index][:, index]


@dataclass
class _Mixing:
    """Anderson mixing of a fixed-point map whose velocities depend linearly on r."""

    depth: int
    images: list[Array] = field(default_factory=list)
    residuals: list[Array] = field(default_factory=list)
    velocities: list[Array] = field(default_factory=list)

    def next(self, r: Array, image: Array, v: Array) -> tuple[Array, Array]:
        """The next point and its v, from r, its image and the image's v."""
        self.images = [*self.images, image][-self.depth - 1 :]
        self.residuals = [*self.residuals, (image - r).ravel()][-self.depth - 1 :]
        self.velocities = [*self.velocities, v][-self.depth - 1 :]
        if len(self.images) == 1:
            return image, v
        differences = np.diff(np.array(self.residuals), axis=0).T
        weights = np.linalg.lstsq(differences, self.residuals[-1], rcond=1e-10)[0]
        mixed, mixed_v = image.copy(), v.copy()
        for k, weight in enumerate(weights):
            mixed -= weight * (self.images[k + 1] - self.images[k])
            mixed_v -= weight * (self.velocities[k + 1] - self.velocities[k])
        return mixed, mixed_v
