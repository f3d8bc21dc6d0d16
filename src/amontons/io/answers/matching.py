"""The nodes of a model in a file of results: by their numbers, or where they lie.

CalculiX makes bricks of plane elements: unless OUTPUT=2D is asked for, its files then hold
nodes of its own, in front of and behind those of the deck; around an axis, one degree to both
sides of it.  What is asked for is the mean of both.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...core.errors import FileFormatError
from .frd import Results

Array = NDArray[np.float64]
Index = NDArray[np.int64]
NEAR = 2e-5  # of the model's size: how far a printed point may be from its node
SECTOR = np.radians(1.0)  # between the plane of a deck and the front of CalculiX' bricks
MOVED = 5e-2  # of it: by how much nodes may have been moved onto the master before the start


def by_label(path: Path, labels: Index, wanted: Index) -> Index:
    """Rows of a table with any order of labels for the nodes wanted; all must be there."""
    order = np.argsort(labels, kind="stable")
    at = np.searchsorted(labels[order], wanted)
    at = np.minimum(at, len(labels) - 1)
    rows = order[at]
    missing = np.flatnonzero(labels[rows] != wanted)
    if missing.size:
        shown = ", ".join(str(n) for n in wanted[missing[:5]])
        raise FileFormatError(
            f"{path}: has no displacements of {missing.size} of the {len(wanted)} nodes of the "
            f"deck, such as node {shown}; is it the result of another deck, or printed for a "
            "set of nodes only?"
        )
    return rows


def check_points(path: Path, points: Array, wanted: Array, names: Index) -> None:
    """Raise FileFormatError where nodes lie elsewhere than in the deck, (n, d) both."""
    size = float(np.ptp(wanted, axis=0).max(initial=0.0)) or 1.0
    far = np.linalg.norm(points[:, : wanted.shape[1]] - wanted, axis=1)
    off = np.flatnonzero(far > MOVED * size)
    if off.size:
        k = int(off[0])
        raise FileFormatError(
            f"{path}: node {names[k]} lies at {points[k].tolist()}, in the deck at "
            f"{wanted[k].tolist()}, and {off.size - 1} more are elsewhere: it is the result of "
            "another deck"
        )


def by_place(path: Path, points: Array, wanted: Array, plane: str) -> tuple[Index, Index]:
    """Pairs (node wanted, row of the file) of points (n, 3) for nodes (m, d); all have one."""
    flat = _flat(points, wanted.shape[1], plane)
    size = float(np.abs(wanted).max(initial=0.0)) or 1.0
    distance, node = cKDTree(wanted).query(flat)
    rows = np.flatnonzero(distance <= NEAR * size)
    node = node[rows]
    missing = np.setdiff1d(np.arange(len(wanted)), node)
    if missing.size:
        where = wanted[missing[0]].tolist()
        raise FileFormatError(
            f"{path}: has no node at {where} of the model, and lacks {missing.size} of "
            f"{len(wanted)}: it is the result of another model"
        )
    if plane != "axisymmetric" and wanted.shape[1] == 3:
        left = len(points) - len(rows)
        if left:
            raise FileFormatError(
                f"{path}: has {left} nodes that the model lacks: it is that of another one"
            )
    return node, rows


def by_element(
    path: Path, found: Results, wanted: Array, cells: Sequence[tuple[Index, Index]], plane: str
) -> tuple[Index, Index]:
    """Pairs (node wanted, row of the file) by elements of the same number.

    cells: numbers (k,) of elements and their nodes (k, n).  Two bodies that touch have nodes at
    one place, which only their elements tell apart.
    """
    order = np.argsort(found.labels)
    labels, flat = found.labels[order], _flat(found.points, wanted.shape[1], plane)[order]
    near = NEAR * (float(np.abs(wanted).max(initial=0.0)) or 1.0)
    node: list[Index] = []
    rows: list[Index] = []
    for numbers, nodes in cells:
        for number, own in zip(numbers.tolist(), nodes, strict=True):
            given = np.array(found.elements.get(number, []), dtype=np.int64)
            at = np.minimum(np.searchsorted(labels, given), len(labels) - 1)
            off = np.abs(flat[at][None] - wanted[own][:, None]).max(axis=2, initial=0.0)
            which, slot = np.nonzero(off <= near)
            node.append(own[which])
            rows.append(order[at[slot]])
    pairs = np.unique(np.stack([np.concatenate(node), np.concatenate(rows)]), axis=1)
    missing = np.setdiff1d(np.arange(len(wanted)), pairs[0])
    if missing.size:
        raise FileFormatError(
            f"{path}: the elements of the deck have other nodes there: none at "
            f"{wanted[missing[0]].tolist()}, and {missing.size} of {len(wanted)} lack; it is "
            "the result of another deck"
        )
    return pairs[0], pairs[1]


def _flat(points: Array, dim: int, plane: str) -> Array:
    """Points (n, 3) in the plane of a model, (n, dim)."""
    if plane == "axisymmetric":
        return np.column_stack([np.hypot(points[:, 0], points[:, 2]), points[:, 1]])
    return points[:, :dim]


def mean_of(pairs: tuple[Index, Index], points: Array, values: Array, count: int, plane: str
            ) -> Array:  # fmt: skip
    """Means (count, d) of displacements (n, 3) at the rows of each node; 2D drops the third."""
    node, rows = pairs
    given = values[rows]
    if plane == "axisymmetric":
        x, z = points[rows, 0], points[rows, 2]
        radius = np.hypot(x, z)
        on_axis = radius == 0
        radial = (given[:, 0] * x + given[:, 2] * z) / np.where(on_axis, 1.0, radius)
        given = np.column_stack([np.where(on_axis, given[:, 0], radial), given[:, 1]])
    elif plane:
        given = given[:, :2]
    out = np.zeros((count, given.shape[1]))
    np.add.at(out, node, given)
    return out / np.bincount(node, minlength=count)[:, None]


def shortened(cells: Sequence[tuple[Index, Index]], count: int) -> Array:
    """What CalculiX makes of a radial displacement 1 at the nodes of a plane deck, (count,).

    Nodes that stand for a front one and a back one have the mean of both, corners of second
    order have one between them too, and Simpson's mean.  cells: as in `by_element`.
    """
    out = np.full(count, np.cos(SECTOR))
    for _, nodes in cells:
        size = nodes.shape[1]
        if size > 4:  # quadrilaterals and triangles of second order, corners first
            out[nodes[:, : size // 2]] = (2.0 + np.cos(SECTOR)) / 3.0
    return out
