"""Levels of node blocks for multigrid: given prolongations first, algebraic ones below them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.errors import SingularOperator
from .aggregation import LARGEST, Aggregates, separates
from .chunks import better_numbers
from .coarsest import Factored, factored_at_rest, inverse_at_rest
from .halves import Halves
from .level_matrix import LevelMatrix
from .node_blocks import NodeBlocks
from .patched import PatchedBlocks, PatchedOperator, Rows, patched
from .transfer import Transfer
from .vectors import advance, dot, norm, put_at, take_from, turn
from .work import Work

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Kind = Callable[[LevelMatrix], LevelMatrix]
COARSEST = 120  # nodes of the level that is solved directly, at most
COARSEST_UNITS = 60  # aggregates of such a level


@dataclass(frozen=True, eq=False)
class Nodes:
    """Which node and component an unknown is: place (n,), three to a node; count of nodes.

    plainly: the same with nodes in the order of the unknowns, where their numbers are others.
    """

    place: Index
    count: int
    plainly: Nodes | None = None

    @classmethod
    def of(cls, component: Index) -> Nodes:
        """Unknowns in ascending order of nodes and components; component (n,), 0 to 2."""
        starts = np.ones(len(component), dtype=np.int64)
        starts[1:] = component[1:] <= component[:-1]
        node = np.cumsum(starts) - 1
        return cls(3 * node + component, int(node[-1]) + 1 if len(node) else 0)

    @cached_property
    def plain(self) -> bool:
        """True when every node has its three components, in the order of the unknowns."""
        n = len(self.place)
        return 3 * self.count == n and bool((self.place == np.arange(n)).all())

    def renumbered(self, number: Index) -> Nodes:
        """The same with nodes of other numbers, (count,)."""
        place = 3 * number[self.place // 3] + self.place % 3
        return Nodes(place, self.count, self.plainly or self)

    def blocks(self, matrix: sparse.sparray) -> NodeBlocks:
        """The matrix (n, n) of the unknowns in blocks, with ones at padding."""
        plain = self.plainly or self
        A = NodeBlocks.from_sparse(matrix, None if plain.plain else plain.place, plain.count)
        if self.plainly is None:
            return A
        number = np.empty(self.count, dtype=np.int64)
        number[plain.place // 3] = self.place // 3
        return A.renumbered(number)

    @property
    def idle(self) -> Index:
        """Places without an unknown."""
        used = np.ones(3 * self.count, dtype=bool)
        used[self.place] = False
        return np.flatnonzero(used)

    def spread(self, x: Array) -> Array:
        """Values of the unknowns (n,) at the nodes, (count, 3), zero at idle places."""
        if self.plain:
            return np.array(x, dtype=float).reshape(-1, 3)
        out = np.zeros(3 * self.count)
        put_at(self.place, np.ascontiguousarray(x, dtype=float).reshape(len(self.place)), out)
        return out.reshape(-1, 3)

    def gather(self, x: Array) -> Array:
        """The inverse of `spread`."""
        if self.plain:
            return x.reshape(-1).copy()
        out = np.empty(len(self.place))
        take_from(self.place, x.reshape(3 * self.count), out)
        return out


def components(modes: Array | None, n: int, d: int) -> Index | None:
    """Direction of every unknown, (n,), from the translations among the rigid modes (n, k).

    None where they do not tell.
    """
    if modes is None:
        return np.arange(n) % d if n % d == 0 else None
    translations = np.abs(modes[:, :d])
    out = translations.argmax(axis=1)
    unit = np.isclose(translations.sum(axis=1), 1.0) & np.isclose(translations.max(axis=1), 1.0)
    return out.astype(np.int64) if unit.all() else None


def transfers(
    levels: Sequence[sparse.csr_array], component: Index, finest: Nodes | None = None
) -> list[Transfer]:
    """Given prolongations of unknowns as transfers between nodes, finest first.

    finest: the nodes of the unknowns, where their numbers are others.
    """
    nodes, out = [finest or Nodes.of(component)], []
    for level in levels:
        coo = sparse.coo_array(level)
        if not coo.shape[1]:
            break
        coarse_component = np.zeros(coo.shape[1], dtype=np.int64)
        order = np.argsort(np.abs(coo.data), kind="stable")
        coarse_component[coo.coords[1][order]] = component[coo.coords[0][order]]
        coarse = Nodes.of(coarse_component)
        fine = nodes[-1]
        shape = (3 * fine.count, 3 * coarse.count)
        entries = (coo.data, (fine.place[coo.coords[0]], coarse.place[coo.coords[1]]))
        tiles = sparse.coo_array(entries, shape=shape).tobsr((3, 3))
        out.append(Transfer.of(tiles, fine.idle, coarse.idle))
        nodes.append(coarse)
        component = coarse_component
    return out


@dataclass(eq=False)
class Level:
    """One level: its matrix and the transfer to the next coarser one (None: the coarsest)."""

    A: LevelMatrix
    P: Transfer | None = None
    work: Work = field(init=False)
    free: NDArray[np.bool_] = field(init=False)  # no node is held

    def __post_init__(self) -> None:
        self.work, self.free = Work(self.A.nodes), np.zeros(self.A.nodes, dtype=bool)

    def of(self, A: LevelMatrix | Halves | PatchedBlocks | PatchedOperator) -> Level:
        """The same with another matrix."""
        out = copy(self)
        out.A = A
        return out


@dataclass(eq=False)
class Hierarchy:
    """All levels, finest first, and the inverse of the coarsest matrix.

    geometric: number of levels that come from the given prolongations, the finest included;
    kind: of the matrices, None where it is that of the package.
    Nothing of it changes after it was made, so any number of solves share it.
    """

    levels: list[Level]
    geometric: int
    nodes: Nodes
    kind: Kind | None = None
    coarse_inverse: Array | Factored = field(init=False)
    coarse_size: Array | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        self.invert_coarsest()

    @classmethod
    def of(
        cls,
        A: NodeBlocks,
        component: Index,
        prolongations: Sequence[sparse.csr_array],
        modes: Array | None,
        nodes: Nodes | None = None,
    ) -> Hierarchy:
        """Galerkin levels below A; modes (n, k): near-nullspace for the algebraic ones.

        All are algebraic where the stiffness jumps between nodes: prolongations that know
        nothing of materials then bridge soft layers, and stiff ones become no coarse level's.
        nodes: those of A, where they are not in the order of the unknowns.
        """
        nodes = nodes or Nodes.of(component)
        if prolongations and modes is not None and separates(A):
            prolongations = ()
        return cls.on(A, nodes, transfers(prolongations, component, nodes), modes)

    @classmethod
    def on(
        cls,
        A: LevelMatrix,
        nodes: Nodes,
        given: Sequence[Transfer],
        modes: Array | None,
    ) -> Hierarchy:
        """The same for transfers between nodes."""
        levels, number = [Level(A)], None
        for P in given:
            if A.nodes <= 8:
                break
            number = append_level(levels, P, number)
            A = levels[-1].A
        geometric = len(levels)
        if A.nodes > COARSEST:
            append_aggregates(levels, Aggregates(_coarse_modes(levels, nodes, modes)))
        return cls(levels, geometric, nodes)

    @classmethod
    def of_parts(cls, A: NodeBlocks, nodes: Nodes, modes: Array, part: Index) -> Hierarchy:
        """Algebraic levels below A, not symmetric perhaps, that join no nodes of two parts.

        modes (3 nodes, k): near-nullspace; part (nodes,): of each node.  Raises
        SingularOperator where nodes do not gather into few.
        """
        levels = [Level(A)]
        append_aggregates(levels, Aggregates(modes, part=part))
        coarsest = levels[-1].A.nodes
        if coarsest > LARGEST:
            raise SingularOperator(f"multigrid: {coarsest} nodes do not gather into fewer")
        return cls(levels, 1, nodes)

    def invert_coarsest(self) -> None:
        """The inverse of the coarsest matrix, a pseudo-inverse where it is singular."""
        self.coarse_inverse = inverse_at_rest(*self._coarsest())

    def factor_coarsest(self) -> None:
        """The same in a fourth of the time, for a few cycles that take a little longer each."""
        self.coarse_inverse = factored_at_rest(*self._coarsest())

    def _coarsest(self) -> tuple[Array, Array, Array]:
        """The coarsest matrix, its diagonal blocks and their usual size."""
        A = self.levels[-1].A.stored()
        diagonal = A.diagonal_blocks
        if self.coarse_size is None:
            self.coarse_size = np.asarray(np.abs(diagonal).max(axis=(1, 2), initial=0.0))
        return A.dense(), diagonal, self.coarse_size

    def made_of(self, kind: Kind) -> Hierarchy:
        """The same with kind(A) for the matrix A of every level."""
        out = copy(self)
        out.levels, out.kind = [level.of(kind(level.A)) for level in self.levels], kind
        return out

    def patched(self, rows: Sequence[Rows]) -> Hierarchy:
        """The same with rows of a solve's own on every coarse level."""
        out = copy(self)
        coarse = zip(self.levels[1:], rows, strict=True)
        own = [level.of(patched(level.A, own)) for level, own in coarse]
        out.levels = [self.levels[0], *own]
        return out

    def rest(self) -> None:
        """Give up the vectors in which this thread works; the next cycle makes them anew."""
        for level in self.levels:
            level.work.rest()

    def solve(self, k: int, b: Array, tolerance: float, most: int) -> tuple[Array, int]:
        """(x, iterations) of CG on level k for A x = b with one cycle as preconditioner.

        Ends when |b - A x| <= tolerance |b|, or after `most` iterations.
        """
        r = b.copy()
        x, p, z, Ap = (np.zeros_like(r) for _ in range(4))
        size = norm(b)
        A, old, goal = self.levels[k].A, 1.0, tolerance * size
        for count in range(most):
            if size <= goal:
                return x, count
            self.cycle(k, r, z)
            new = dot(r, z)
            turn(p, new / old, z)
            old = new
            A.times(p, Ap)
            size = advance(x, r, new / dot(p, Ap), p, Ap)
        return x, most if size <= goal else most + 1

    def estimate(self, b: Array, size: int) -> Array:
        """x of A x = b, (nodes, 3), from the first level of at most `size` nodes alone.

        Padding of b becomes zero.
        """
        k = 0
        while self.levels[k].A.nodes > size and self.levels[k].P is not None:
            coarse = np.empty((self.levels[k + 1].A.nodes, 3))
            self.levels[k].P.restrict(b, coarse)  # type: ignore[union-attr]
            b = coarse
            k += 1
        x = self.solve(k, b, 1e-3, 30)[0]
        for level in reversed(self.levels[:k]):
            fine = np.zeros((level.A.nodes, 3))
            level.P.add(x, fine)  # type: ignore[union-attr]
            x = fine
        return x

    def cycle(self, k: int, b: Array, x: Array, *, twice: bool = False) -> None:
        """x = one V(1,1) cycle from zero on level k for A x = b; symmetric if A is.

        twice: with two cycles on the level below.
        """
        level = self.levels[k]
        if level.P is None:
            x[:] = (self.coarse_inverse @ b.reshape(-1)).reshape(-1, 3)
            return
        A, coarse = level.A, self.levels[k + 1]
        r, below = level.work.r, coarse.work
        A.first_smooth(b, x, r)
        level.P.restrict(r, below.b)
        self.cycle(k + 1, below.b, below.x)
        if twice:
            self.improve(k + 1, below.b, below.x)
        level.P.add(below.x, x)
        A.smooth(b, x, level.free, True)

    def improve(self, k: int, b: Array, x: Array) -> None:
        """The same cycle from x instead of zero."""
        level = self.levels[k]
        if level.P is None:  # x is exact
            return
        r, below = level.work.r, self.levels[k + 1].work
        level.A.smooth(b, x, level.free, False)
        level.A.residual(x, b, r)
        level.P.restrict(r, below.b)
        self.cycle(k + 1, below.b, below.x)
        level.P.add(below.x, x)
        level.A.smooth(b, x, level.free, True)


def append_aggregates(levels: list[Level], aggregates: Aggregates) -> None:
    """Add all algebraic levels, until few aggregates are left or nothing more joins."""
    fine = levels[-1].A.stored()
    while fine.nodes > COARSEST_UNITS * aggregates.width:
        found = aggregates.coarsen(fine)
        if found is None:
            return
        P, aggregates = found
        number = append_level(levels, P, None, fine, aggregates.width)
        aggregates = aggregates.renumbered(number)
        fine = levels[-1].A.stored()


def append_level(
    levels: list[Level],
    P: Transfer,
    number: Index | None,
    fine: LevelMatrix | None = None,
    width: int = 1,
) -> Index | None:
    """Add the level below P, with numbers of its nodes that let threads sweep it.

    number: what has become of those of the fine nodes, which P has as they were; returns the
    same of the coarse ones.  fine: the matrix to make the coarse one of, where it is another;
    width: coarse nodes that stay together.
    """
    P = P.renumbered(number, None)
    A = (fine or levels[-1].A).coarse(P)
    number = better_numbers(A.indptr, A.indices, width) if isinstance(A, NodeBlocks) else None
    if number is not None:
        P, A = P.renumbered(None, number), A.renumbered(number)
    levels[-1].P = P
    levels.append(Level(A))
    return number


def _coarse_modes(levels: list[Level], nodes: Nodes, modes: Array | None) -> Array:
    """Near-nullspace at the nodes of the coarsest level, (3 count, k), by least squares."""
    from scipy.sparse import linalg as sparse_linalg

    if modes is None:
        return np.tile(np.eye(3), (levels[-1].A.nodes, 1))
    values = np.stack(
        [nodes.spread(modes[:, k]).ravel() for k in range(modes.shape[1])], axis=1
    )
    for level in levels[:-1]:
        assert level.P is not None
        P = level.P.matrix()
        normal = sparse.csc_array(P.T @ P + 1e-14 * sparse.eye_array(P.shape[1]))
        values = sparse_linalg.splu(normal).solve(P.T @ values)
    return values
