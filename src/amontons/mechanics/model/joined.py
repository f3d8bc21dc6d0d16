"""Rigid motions that supports and constraints together leave to the bodies of a model.

Pieces that constraints join move together, or not at all: they become one piece with the
motions of all its members, of which a basis is left.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from ...core.errors import SingularOperator
from .elimination import Elimination
from .rigid import Piece, null_space

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
ROUNDING = 1e-11  # part of a unit motion that is none
ZERO = 1e-6  # part of a motion, relative to the whole, that is none


@dataclass(frozen=True, eq=False)
class _Columns:
    """Motions that are looked at: those of pieces, one after another, then some of z."""

    starts: Index
    motions: sparse.csr_array
    z: Index


def joined_loose(
    parts: list[Piece], eliminated: Elimination, is_fixed: Mask, stretched: sparse.csr_array
) -> list[tuple[Piece, Array]]:
    """As `loose_modes`, with pieces joined; raises SingularOperator for a loose reference.

    stretched (k, dofs): springs, as rows.
    """
    columns = _columns(parts, eliminated)
    z_of = _independent_motions(columns, eliminated)
    rows = _conditions(columns, z_of, eliminated, is_fixed, stretched)
    return _left(parts, columns, rows, eliminated)


def sprung_loose(
    parts: list[Piece], is_fixed: Mask, stretched: sparse.csr_array
) -> list[tuple[Piece, Array]]:
    """As `loose_modes`, with pieces that springs hold, stretched (k, dofs) by rows, or join."""
    starts, entries = _of_pieces(parts)
    shape = (stretched.shape[1], int(starts[-1]))
    motions = sparse.csr_array(sparse.coo_array(entries, shape=shape))
    columns = _Columns(starts, motions, np.zeros(0, dtype=np.int64))
    rows = [motions[np.flatnonzero(is_fixed)], _lengths(stretched) @ motions]
    return _left(parts, columns, sparse.csr_array(sparse.vstack(rows, format="csr")), None)


def _lengths(rows: sparse.csr_array) -> sparse.csr_array:
    """Rows of length 1."""
    size = np.sqrt(np.asarray(rows.multiply(rows).sum(axis=1)).ravel())
    return sparse.csr_array(sparse.diags_array(1.0 / np.where(size > 0, size, 1.0)) @ rows)


def _left(
    parts: list[Piece], columns: _Columns, rows: sparse.csr_array,
    eliminated: Elimination | None,
) -> list[tuple[Piece, Array]]:  # fmt: skip
    """Pieces with the motions for which all rows are zero, those that rows join as one."""
    rows = sparse.csr_array(sparse.vstack([rows, _straining(parts, columns)], format="csr"))
    count = rows.shape[1]
    starts, ends = columns.starts[:-1], columns.starts[1:]
    chain = np.concatenate([np.arange(a, b - 1) for a, b in zip(starts, ends, strict=True)])
    together = sparse.coo_array((np.ones(len(chain)), (chain, chain + 1)), shape=(count, count))
    graph = sparse.csr_array(abs(rows).T @ abs(rows)) + together
    _, label = csgraph.connected_components(graph, directed=False)
    out = []
    for one in np.unique(label):
        mine = np.flatnonzero(label == one)
        own = rows[:, mine]
        dense = own[np.diff(own.indptr) > 0].toarray()
        square: Array = np.linalg.qr(dense, mode="r") if len(dense) else dense  # type: ignore[assignment]
        null = null_space(square)
        members = [k for k, a in enumerate(starts) if label[a] == one]
        of_pieces = null[mine < columns.starts[-1]]
        if not null.size:
            continue
        u, s, _ = np.linalg.svd(of_pieces, full_matrices=False)
        rank = int((s > ZERO).sum())
        if rank < null.shape[1]:
            assert eliminated is not None  # pieces alone have all motions that are left
            _refuse(mine, columns, null, eliminated)
        basis = np.where(np.abs(u) > ROUNDING, u, 0.0)[:, :rank]  # else contacts would feel it
        out.append((_joined([parts[k] for k in members]), basis))
    return out


def _columns(parts: list[Piece], eliminated: Elimination) -> _Columns:
    """All motions, and those of the nodes, (dofs, columns)."""
    found, first = eliminated.independent, eliminated.beside.first
    starts, entries = _of_pieces(parts)
    z = np.flatnonzero((found.own < 0) | (found.own >= first))
    z = np.setdiff1d(z, eliminated.idle)
    shape = (eliminated.beside.total, int(starts[-1]) + len(z))
    return _Columns(starts, sparse.csr_array(sparse.coo_array(entries, shape=shape)), z)


def _of_pieces(parts: list[Piece]) -> tuple[Index, Any]:
    """Where the motions of each piece begin, and their entries as those of a matrix."""
    starts = np.cumsum([0, *(piece.count for piece in parts)])
    i = [np.repeat(piece.dofs, piece.count) for piece in parts]
    j = [np.tile(a + np.arange(piece.count), len(piece.dofs))
         for a, piece in zip(starts[:-1], parts, strict=True)]  # fmt: skip
    values = np.concatenate([piece.modes.ravel() for piece in parts])
    return starts, (values, (np.concatenate(i), np.concatenate(j)))


def _independent_motions(columns: _Columns, eliminated: Elimination) -> sparse.csr_array:
    """z (nz, columns) in these motions: displacements of nodes, and those that are columns."""
    found, first = eliminated.independent, eliminated.beside.first
    nodes = np.flatnonzero((found.own >= 0) & (found.own < first))
    n, total = len(found.own), columns.motions.shape[1]
    put = sparse.coo_array(
        (1 / found.scale[nodes], (nodes, found.own[nodes])), shape=(n, columns.motions.shape[0])
    )
    own = sparse.coo_array(
        (np.ones(len(columns.z)), (columns.z, columns.starts[-1] + np.arange(len(columns.z)))),
        shape=(n, total),
    )
    return sparse.csr_array(put.tocsr() @ columns.motions + own)


def _conditions(
    columns: _Columns, z_of: sparse.csr_array, eliminated: Elimination, is_fixed: Mask,
    stretched: sparse.csr_array,
) -> sparse.csr_array:  # fmt: skip
    """Rows that are zero for motions that supports, constraints and springs allow."""
    found, first = eliminated.independent, eliminated.beside.first
    moved = sparse.csr_array(found.map @ z_of)
    follow = np.ones(first, dtype=bool)
    own = found.own[(found.own >= 0) & (found.own < first)]
    follow[own] = False
    follow = np.flatnonzero(follow)
    differ = sparse.csr_array(columns.motions[follow] - moved[follow])
    held = [moved[np.flatnonzero(is_fixed)], _lengths(stretched) @ moved]
    return sparse.csr_array(sparse.vstack([differ, *held], format="csr"))


def _straining(parts: list[Piece], columns: _Columns) -> sparse.csr_array:
    """Rows that are zero for motions without those modes of pieces that strain them."""
    numbers = [
        a + k
        for piece, a in zip(parts, columns.starts[:-1], strict=True) if piece.rigid is not None
        for k in range(piece.count) if k not in piece.rigid
    ]  # fmt: skip
    entries = (np.ones(len(numbers)), (np.arange(len(numbers)), numbers))
    shape = (len(numbers), columns.motions.shape[1])
    return sparse.csr_array(sparse.coo_array(entries, shape=shape))


def _joined(members: list[Piece]) -> Piece:
    """One piece of several."""
    if len(members) == 1:
        return members[0]
    names = list(dict.fromkeys(piece.name for piece in members))
    modes = sparse.block_diag([piece.modes for piece in members]).toarray()
    dofs = np.concatenate([piece.dofs for piece in members])
    rigid, first = [], 0
    for piece in members:
        count = piece.count
        rigid += [first + k for k in (range(count) if piece.rigid is None else piece.rigid)]
        first += count
    some = None if all(piece.rigid is None for piece in members) else rigid
    none = np.zeros((0, members[0].points.shape[1]))
    return Piece(" + ".join(names), dofs, none, some, tuple(members), modes)


def _refuse(mine: Index, columns: _Columns, null: Array, eliminated: Elimination) -> None:
    """Raise SingularOperator for a reference that turns or moves without its nodes."""
    of_z = null[mine >= columns.starts[-1]]
    k = int(np.abs(of_z).max(axis=1).argmax())
    z = columns.z[mine[mine >= columns.starts[-1]][k] - columns.starts[-1]]
    dof = int(eliminated.independent.own[z])
    raise SingularOperator(
        f"{eliminated.beside.where(dof)} can move without any node: hold it by a support, or "
        "couple more nodes to it", ("constraints",), "",
    )  # fmt: skip
