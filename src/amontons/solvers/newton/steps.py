"""Steps of Newton's method in the Delassus form: (A + B W) dr = -F, whole and exact.

Contacts with A = 1 and B = 0 (open ones, for the functions that see them so) have dr = -F and
leave the matrix.  The rest is factorised in the way that is least work:

    blocks of contacts    a few contacts coupled with few others (`block_lu`)
    joints                deformable bodies: contacts with the same neighbours are eliminated
                          together, by dense products (`Joints.exact`), in double precision;
                          refined with the residual of the whole equation, which also decides
                          whether the factor, whose pivots stay within a joint, is believed
    sparse                what is large otherwise, by `Direct`
    dense                 what is left

Each tells its floating point operations.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import SingularOperator
from ...linear import Direct
from ...linear.blocks import block_part
from ...linear.dense import dense
from ...problem.friction import FrictionProblem
from ..contract import Iterate
from .block_lu import Symbolic, newton_step_inplace
from .functions import Linearised
from .joints import Joints

Array = NDArray[np.float64]
Index = NDArray[np.int64]
DENSE_UNKNOWNS = 1200  # reactions up to which a dense factor of A + B W beats a sparse one
BLOCK_CONTACTS = 1000  # above, minimum degree itself would take long
BLOCK_WORK, BLOCK_SHARE = 4e6, 0.25  # products of blocks: number, part of those of a full W
TRUSTED = 1e-6  # residual of a step, relative to F, up to which an LU in blocks is believed
REFINED, REFINEMENTS = 1e-12, 3  # residual at which it is not refined any more; how often
PRODUCT_FLOPS = 54.0  # of a product of two 3x3 blocks
BLOCK_FLOPS = 18.0  # of a block and a vector


@dataclass(frozen=True, eq=False)
class State:
    """Reactions r and velocities u, (nc, d), with v, (n,), in the global form.

    flops: floating point operations that finding a step took, None where they are not counted.
    """

    r: Array
    u: Array
    v: Array | None = None
    flops: float | None = None

    def moved(self, t: float, step: State) -> State:
        """This state plus t times a step."""
        v = None if self.v is None or step.v is None else self.v + t * step.v
        return State(self.r + t * step.r, self.u + t * step.u, v)


class Linearisation(Protocol):
    """The Newton equation of one problem; W is hidden in it."""

    def state(self, start: Iterate) -> State:
        """The first state."""
        ...

    def step(self, state: State, linearised: Linearised, forcing: float) -> tuple[State, int]:
        """The Newton step of a state, and the linear iterations it took."""
        ...


def block_diagonal(blocks: Array) -> sparse.csr_array:
    """Sparse matrix with the given (nc, d, d) blocks on its diagonal."""
    nc, d, _ = blocks.shape
    index = np.arange(nc + 1)
    return sparse.csr_array(
        sparse.bsr_array((blocks, index[:-1], index), shape=(nc * d, nc * d))
    )


@dataclass(frozen=True, eq=False)
class Condensed:
    """Newton equation of the Delassus form."""

    problem: FrictionProblem

    def state(self, start: Iterate) -> State:
        """r of the start and its velocity."""
        return State(start.r, self.problem.velocity(start.r)[0])

    def step(self, state: State, linearised: Linearised, forcing: float) -> tuple[State, int]:
        """A factor in blocks, of joints, dense or sparse; see the module."""
        F, A, B = linearised
        W = self.problem.W
        assert W is not None
        dr, flops = self._solved(F, A, B)
        flops += BLOCK_FLOPS * len(self.problem.blocks.indices)
        du = (W @ dr.ravel()).reshape(F.shape)
        return State(dr, du, flops=flops), 0

    def _solved(self, F: Array, A: Array, B: Array) -> tuple[Array, float]:
        """dr (nc, d) and the operations it took."""
        if self.in_blocks(self.problem):
            dr = self._by_blocks(F, A, B)
            if dr is not None:
                return dr, PRODUCT_FLOPS * self._block_products
        dr, left = -F, coupled_contacts(A, B)
        if not left.size:
            return dr, 0.0
        found = self._by_joints(F, A, B, left)
        if found is not None:
            return found
        W = self.problem.W
        large = sparse.issparse(W) and left.size * F.shape[1] > DENSE_UNKNOWNS
        if len(left) < len(F):
            known = np.where(np.isin(np.arange(len(F)), left)[:, None], 0.0, dr)
            F = F + (B @ (W @ known.ravel()).reshape(*F.shape, 1))[..., 0]
        part = F[left], A[left], B[left]
        dr[left], flops = (self._sparse if large else self._dense)(left, *part)
        return dr, flops

    def _by_joints(
        self, F: Array, A: Array, B: Array, left: Index
    ) -> tuple[Array, float] | None:
        """dr and operations by the joints of the whole problem; None where that is no way."""
        whole, contacts = self.problem.whole
        joints = Joints.exact(whole)
        if joints is None or len(left) * F.shape[1] <= DENSE_UNKNOWNS / 2:
            return None
        W, d = self.problem.W, F.shape[1]
        own, law = _spatial_blocks(A[left], 1.0), _spatial_blocks(B[left], 0.0)
        some = joints.some(contacts[left], own, law)
        try:
            factor = some.factor()
        except SingularOperator:
            return None
        size, dr = np.abs(F).max(), -F
        error, flops = np.inf, some.flops + factor.fronts.flops
        dr[left] = 0.0
        for _ in range(1 + REFINEMENTS):
            u = (W @ dr.ravel()).reshape(F.shape)
            residual = F + (A @ dr[..., None] + B @ u[..., None])[..., 0]
            last, error = error, np.abs(residual).max() / size
            flops += BLOCK_FLOPS * len(self.problem.blocks.indices)
            if error <= REFINED or not error < 0.5 * last:
                break
            rows = np.zeros((len(left), 3))
            rows[:, :d] = residual[left]
            dr[left] -= some.solve(factor, rows)[:, :d]
            flops += 2 * factor.fronts.entries
        return (dr, flops) if error <= TRUSTED and np.isfinite(dr).all() else None

    @property
    def _block_products(self) -> int:
        """Products of 3x3 blocks that an LU in blocks takes, with B W."""
        return Symbolic.of(self.problem).products + len(self.problem.blocks.indices)

    def _sparse(self, left: Index, F: Array, A: Array, B: Array) -> tuple[Array, float]:
        """Solution of (A + B W) dr = -F of some contacts by a sparse factor."""
        d = F.shape[1]
        blocks = block_part(self.problem.blocks, left)
        rows = np.repeat(np.arange(len(left)), np.diff(blocks.indptr))
        data = B[rows] @ blocks.data[:, :d, :d]
        data[blocks.diagonal] += A
        matrix = sparse.bsr_array((data, blocks.indices, blocks.indptr), shape=2 * (F.size,))
        factor = Direct().factor(sparse.csc_array(matrix))
        dr = factor.solve(-F.ravel()).reshape(F.shape)
        return dr, (factor.flops or 0.0) + PRODUCT_FLOPS * len(rows)

    def _dense(self, left: Index, F: Array, A: Array, B: Array) -> tuple[Array, float]:
        """The same by a dense factor."""
        full = dense(self.problem.W)
        if F.size < len(full):
            d = F.shape[1]
            unknowns = (d * left[:, None] + np.arange(d)).ravel()
            full = full[np.ix_(unknowns, unknowns)]
        dr = _dense_step(A, B, full, F).reshape(F.shape)
        return dr, 2 / 3 * F.size**3 + PRODUCT_FLOPS * len(F) ** 2

    @staticmethod
    def in_blocks(problem: FrictionProblem, most: float = BLOCK_WORK) -> bool:
        """Whether an LU in blocks of contacts is less work than a dense one and than `most`."""
        nc = problem.contacts
        if nc > BLOCK_CONTACTS or nc < 2:
            return False
        work = Symbolic.of(problem).products
        return work <= min(most, BLOCK_SHARE * nc**3)

    def _by_blocks(self, F: Array, A: Array, B: Array) -> Array | None:
        """dr (nc, d) by block LU; None where its pivots, taken in order, are too small."""
        nc, d = F.shape
        rows, own, law = np.zeros((nc, 3)), np.tile(np.eye(3), (nc, 1, 1)), np.zeros((nc, 3, 3))
        rows[:, :d], own[:, :d, :d], law[:, :d, :d] = F, A, B
        dr = np.empty((nc, 3))
        blocks = self.problem.blocks
        with np.errstate(all="ignore"):
            residual = newton_step_inplace(
                blocks.indptr, blocks.indices, blocks.data, own, law, rows,
                *Symbolic.of(self.problem).arrays, dr,
            )  # fmt: skip
        good = residual <= TRUSTED and np.isfinite(dr).all()
        return np.ascontiguousarray(dr[:, :d]) if good else None


def coupled_contacts(A: Array, B: Array) -> Index:
    """Contacts whose rows are not dr = -F."""
    d = A.shape[1]
    free = ~B.any(axis=(1, 2)) & (A == np.eye(d)).all(axis=(1, 2))
    return np.flatnonzero(~free)


def _spatial_blocks(blocks: Array, third: float) -> Array:
    """(k, 3, 3) blocks of (k, d, d): in 2D a third component stays by itself."""
    out = np.zeros((len(blocks), 3, 3))
    d = blocks.shape[1]
    out[:, 2, 2] = third
    out[:, :d, :d] = blocks
    return out


def _dense_step(A: Array, B: Array, full: Array, F: Array) -> Array:
    """Solution of (A + B W) dr = -F; least squares when the matrix is singular."""
    nc, d = F.shape
    matrix = (B @ full.reshape(nc, d, nc * d)).reshape(nc * d, nc * d)
    own = matrix.reshape(nc, d, nc, d)
    own[np.arange(nc), :, np.arange(nc), :] += A
    scale = np.abs(matrix).max(axis=1, keepdims=True)
    scale[scale == 0] = 1.0  # a row of zeros is for least squares
    matrix, b = matrix / scale, -F.ravel() / scale[:, 0]
    try:
        dr = np.linalg.solve(matrix, b)
        if np.abs(matrix @ dr - b).max() <= 1e-6 * np.abs(b).max():
            return dr
    except np.linalg.LinAlgError:
        pass
    return np.linalg.lstsq(matrix, b, rcond=1e-12)[0]
