"""The Newton equation (A + B W) dr = b on deformable bodies, joint by joint.

W of several deformable bodies is full within a body and empty between bodies that do not touch.
Contacts with the same neighbours (those of a joint between two bodies) form a group, and W is a
strip of dense blocks per group: in single precision for approximate solves, in double for exact
factors of the rows of some contacts (`Joints.exact`, `SomeJoints`).  On the first work

    GMRES        the product with A + B W, bound by memory: strips in single precision
    `Fronts`     a block LU of some earlier A + B W as preconditioner

The LU stays until GMRES has spent as much as a new one takes; from one Newton step, or time
step, to the next only few contacts change their status.  Both numbers are operation counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from threading import local

import numpy as np
from numpy.typing import NDArray

from ...linear.blocks import BlockRows, block_part
from ...linear.multifrontal import FrontLU, Fronts
from ...problem.friction import FrictionProblem

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.int64]
LARGE_GROUP = 6.0  # mean contacts of a group above which blocks are worth it
SINGULAR = 1e-9  # smallest eigenvalue of a group, relative to the largest: rigid bodies
FEW = 40  # contacts below which anything is quick
KRYLOV = 80  # GMRES iterations of one solve
PATIENCE, WORTH = 8, 0.4  # GMRES with a kept factor: iterations, part of a new one's cost
SINGLE = 2e-6  # relative tolerance below which single precision can not go
# Nanoseconds on one core, only their ratio matters: a dense operation, an entry read.
FLOP, ENTRY = 0.04, 0.25


class Memory(local):
    """The LU that solves leave to those that follow in the same thread, and what they took."""

    kept: FrontLU | None = None
    spent: float = 0.0  # on GMRES since that factor, nanoseconds
    flops: float = 0.0  # floating point operations of all solves so far

    def __reduce__(self) -> tuple:
        return Memory, ()


@dataclass(eq=False)
class Joints:
    """W in strips by groups, and the preconditioner kept from one solve to the next.

    contacts: (nc,) in the order of the groups; strips (3 k, 3 m) with their column groups.
    """

    nc: int
    contacts: Index
    columns: list[list[int]]  # groups that a group is coupled with, itself among them
    strips: list[Single] | list[Array]
    fronts: Fronts
    memory: Memory = field(default_factory=Memory, init=False)
    unknowns: Index = field(init=False)

    def __post_init__(self) -> None:
        self.unknowns = (3 * self.contacts[:, None] + np.arange(3)).ravel()
        self.places = [
            dict(zip(columns, np.cumsum([0, *self.fronts.sizes[columns]]), strict=False))
            for columns in self.columns
        ]
        rows = self.fronts.rows
        self.gather = [np.concatenate([rows[h] for h in columns]) for columns in self.columns]

    @classmethod
    def of(cls, problem: FrictionProblem) -> Joints | None:
        """The joints of a problem in Delassus form; None where groups are too small."""
        return problem.kept(_single)

    @classmethod
    def exact(cls, problem: FrictionProblem) -> Joints | None:
        """The same with W in double precision."""
        return problem.kept(_double)

    @classmethod
    def _make(cls, blocks: BlockRows, precision: type) -> Joints | None:
        if len(blocks.diagonal) < FEW:
            return None
        group = _groups(blocks)
        count = group.max(initial=-1) + 1
        if count < 2 or len(group) < LARGE_GROUP * count or not _regular(blocks, group):
            return None
        contacts = np.argsort(group, kind="stable")
        sizes = np.bincount(group)
        starts = np.concatenate([[0], np.cumsum(sizes)])
        inside = np.empty(len(group), dtype=np.int64)
        inside[contacts] = np.arange(len(group)) - starts[group[contacts]]
        columns, strips = [], []
        for g in range(count):
            members = contacts[starts[g] : starts[g + 1]]
            near = blocks.indices[blocks.indptr[members[0]] : blocks.indptr[members[0] + 1]]
            groups = np.unique(group[near])
            offset = np.zeros(count, dtype=np.int64)
            offset[groups] = np.concatenate([[0], np.cumsum(sizes[groups])[:-1]])
            at = offset[group[near]] + inside[near]
            strip = np.zeros((len(members), int(sizes[groups].sum()), 3, 3), dtype=precision)
            for k, i in enumerate(members):
                strip[k, at] = blocks.data[blocks.indptr[i] : blocks.indptr[i + 1]]
            strips.append(
                np.ascontiguousarray(strip.swapaxes(1, 2)).reshape(3 * len(members), -1)
            )
            columns.append(groups.tolist())
        near_sets = [set(c) - {g} for g, c in enumerate(columns)]
        return cls(len(group), contacts, columns, strips, Fronts.of(3 * sizes, near_sets))

    def some(self, contacts: Index, A: Array, B: Array) -> SomeJoints:
        """A + B W of some contacts, in any order, with their A and B (k, 3, 3)."""
        return SomeJoints(self, contacts, A, B)

    # ------------------------------------------------------------------ solves
    def solve(self, A: Array, B: Array, b: Array, tolerance: float) -> tuple[Array, int]:
        """dr with |(A + B W) dr - b| <= tolerance |b| if it can; and the GMRES iterations.

        A, B (nc, 3, 3), b (nc, 3).  Raises SingularOperator when no factor can be made.
        """
        size = float(np.abs(b).max(initial=0.0))
        if size == 0:
            return np.zeros_like(b), 0
        law = _Scaled(self, A, B)
        flat = (b / size).astype(np.float32).ravel()[self.unknowns]
        x, total = np.zeros_like(flat), 0
        patience = int(np.clip(WORTH * self.factor_cost / self.product_cost, PATIENCE, KRYLOV))
        if self.memory.kept is not None and self.memory.spent <= self.factor_cost:
            x, total, done = self._gmres(law, flat, tolerance, patience)
            if done:
                return self._in_order(size, x, b.shape), total
        self.renew(law)  # too much has changed since the kept factor
        left = flat - law.product(x) if total else flat
        scale = float(np.linalg.norm(left)) / float(np.linalg.norm(flat))
        if scale > 0:
            dx, count, _ = self._gmres(law, left, min(tolerance / scale, 0.5), KRYLOV)
            x, total = x + dx, total + count
        return self._in_order(size, x, b.shape), total

    def _gmres(
        self, law: _Scaled, b: Single, tolerance: float, limit: int
    ) -> tuple[Single, int, bool]:
        """x with |(A + B W) x - b| <= tolerance |b|, iterations, and whether it holds."""
        from scipy.sparse import linalg as sparse_linalg

        kept, count = self.memory.kept, 0
        assert kept is not None

        def operator(y: Single) -> Single:
            nonlocal count
            count += 1
            return law.product(kept.solve(y))

        matrix = sparse_linalg.LinearOperator(2 * (b.size,), matvec=operator, dtype=np.float32)
        y, failed = sparse_linalg.gmres(
            matrix, b, rtol=max(tolerance, SINGLE), atol=0.0, restart=limit, maxiter=1
        )
        self.memory.spent += count * self.product_cost
        self.memory.flops += count * 2 * self._entries + 2.0 * count**2 * b.size
        return kept.solve(y), count, not failed

    def _in_order(self, size: float, x: Single, shape: tuple[int, ...]) -> Array:
        """size x in the order of the contacts."""
        dr = np.empty(3 * self.nc)
        dr[self.unknowns] = x
        return size * dr.reshape(shape)

    def newton_cost(self, digits: float) -> float:
        """Nanoseconds that Newton takes for some digits, by what it took on walls."""
        factors = 1.0 if self.memory.kept is None else 0.5
        return factors * self.factor_cost + (20 + 10 * digits) * self.product_cost

    def renew(self, law: _Scaled) -> None:
        """Factorise A + B W of now."""
        self.memory.kept, self.memory.spent = self.fronts.factor(law.front), 0.0
        self.memory.flops += self.fronts.flops + 5.0 * sum(strip.size for strip in self.strips)

    @property
    def factor_cost(self) -> float:
        """Nanoseconds of a factor."""
        return FLOP * self.fronts.flops

    @property
    def product_cost(self) -> float:
        """Nanoseconds of an iteration of GMRES."""
        return ENTRY * self._entries

    @property
    def _entries(self) -> float:
        """Numbers that an iteration of GMRES reads: the factor and W."""
        return self.fronts.entries + sum(strip.size for strip in self.strips)


class SomeJoints:
    """A + B W of some contacts, factorised joint by joint in the precision of the strips."""

    def __init__(self, joints: Joints, contacts: Index, A: Array, B: Array) -> None:
        self.joints = joints
        place = np.full(joints.nc, -1, dtype=np.int64)
        place[contacts] = np.arange(len(contacts))
        ends = np.cumsum(joints.fronts.sizes // 3)
        groups = np.split(place[joints.contacts], ends[:-1])
        self.order = np.concatenate([group[group >= 0] for group in groups])
        live = [np.flatnonzero(group >= 0) for group in groups]
        self.live = [(3 * k[:, None] + np.arange(3)).ravel() for k in live]
        sizes = np.array([len(rows) for rows in self.live])
        self.fronts = Fronts(sizes, joints.fronts.order, joints.fronts.borders)
        self.rows = [
            self._rows(g, A[group[group >= 0]], B[group[group >= 0]])
            for g, group in enumerate(groups)
        ]

    def _rows(self, g: int, A: Array, B: Array) -> dict[int, Array]:
        """The rows of a group in A + B W, by the groups of their columns."""
        j = self.joints
        width = j.strips[g].shape[1]
        strip = j.strips[g][self.live[g]].reshape(len(B), 3, width)
        full = np.matmul(B, strip).reshape(3 * len(B), width)
        out = {h: full[:, j.places[g][h] + self.live[h]] for h in j.columns[g]}
        own, k = out[g].reshape(len(B), 3, len(B), 3), np.arange(len(B))
        own[k, :, k, :] += A
        return out

    def factor(self) -> FrontLU:
        """Raises SingularOperator when a joint has no inverse."""
        return self.fronts.factor(self._front)

    def _front(self, g: int, border: Sequence[int]) -> tuple[Array, Array]:
        """Rows and columns of the front of a group."""
        size = self.fronts.sizes
        none = np.empty((0, size[g]))
        rows = [self.rows[g].get(h, np.zeros((size[g], size[h]))) for h in [g, *border]]
        below = [self.rows[h].get(g, np.zeros((size[h], size[g]))) for h in border]
        return np.concatenate(rows, axis=1), np.concatenate([none, *below])

    def solve(self, factor: FrontLU, b: Array) -> Array:
        """The solution x of (A + B W) x = b, both (k, 3), in the order of the contacts."""
        out = np.empty_like(b)
        out[self.order] = factor.solve(b[self.order].ravel()).reshape(b.shape)
        return out

    @property
    def flops(self) -> float:
        """Floating point operations of forming the rows: five per entry."""
        return 5.0 * sum(part.size for rows in self.rows for part in rows.values())


def _single(problem: FrictionProblem) -> Joints | None:
    return Joints._make(problem.blocks, np.float32)


def _double(problem: FrictionProblem) -> Joints | None:
    return Joints._make(problem.blocks, np.float64)


def _groups(blocks: BlockRows) -> Index:
    """Number of the group of every contact: contacts with the same neighbours, (nc,)."""
    nc = len(blocks.diagonal)
    keys = np.random.default_rng(0).integers(0, 2**62, size=nc, dtype=np.int64)
    if not len(blocks.indices):
        return np.zeros(0, dtype=np.int64)
    sums = np.add.reduceat(keys[blocks.indices], blocks.indptr[:-1].astype(np.int64))
    return np.unique(sums, return_inverse=True)[1]


def _regular(blocks: BlockRows, group: Index) -> bool:
    """Whether W within the largest group is regular: between rigid bodies its rank is 6."""
    members = np.flatnonzero(group == np.bincount(group).argmax())
    own = block_part(blocks, members).data
    if len(own) != len(members) ** 2:  # contacts of one group do not even see each other
        return False
    k = len(members)
    full = own.reshape(k, k, 3, 3).swapaxes(1, 2).reshape(3 * k, 3 * k)
    scale = np.sqrt(np.maximum(full.diagonal(), np.finfo(float).tiny))
    sizes = np.linalg.eigvalsh(0.5 * (full + full.T) / np.outer(scale, scale))
    return bool(sizes[0] > SINGULAR * sizes[-1])


class _Scaled:
    """A + B W of one Newton step, in the order of the joints and in single precision."""

    def __init__(self, joints: Joints, A: Array, B: Array) -> None:
        self.joints = joints
        self.A = A[joints.contacts].astype(np.float32)
        self.B = B[joints.contacts].astype(np.float32)
        self.ends = np.concatenate([[0], np.cumsum(joints.fronts.sizes // 3)])

    def product(self, x: Single) -> Single:
        """(A + B W) x."""
        j = self.joints
        Wx = np.concatenate([s @ x[c] for s, c in zip(j.strips, j.gather, strict=True)])
        rows = np.matmul(self.A, x.reshape(-1, 3, 1)) + np.matmul(self.B, Wx.reshape(-1, 3, 1))
        return rows.ravel()

    def strip(self, g: int, others: Sequence[int]) -> Single:
        """B_g W at some groups, (3 k, …), zero where nothing couples."""
        j = self.joints
        sizes = j.fronts.sizes[list(others)]
        B = self.B[self.ends[g] : self.ends[g + 1]]
        out = np.zeros((len(j.strips[g]), int(sizes.sum())), dtype=np.float32)
        start = 0
        for h, size in zip(others, sizes, strict=True):
            if h in j.places[g]:
                at = j.places[g][h]
                out[:, start : start + size] = j.strips[g][:, at : at + size]
            start += size
        return np.matmul(B, out.reshape(len(B), 3, -1)).reshape(out.shape)

    def front(self, g: int, border: Sequence[int]) -> tuple[Single, Single]:
        """Rows and columns of the front of a group."""
        rows = self.strip(g, [g, *border])
        own = rows[:, : len(rows)].reshape(len(rows) // 3, 3, -1, 3)
        k = np.arange(len(own))
        own[k, :, k, :] += self.A[self.ends[g] : self.ends[g + 1]]
        empty = np.empty((0, len(rows)), dtype=np.float32)
        return rows, np.concatenate([empty, *(self.strip(h, [g]) for h in border)])
