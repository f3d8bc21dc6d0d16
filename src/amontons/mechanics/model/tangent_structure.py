"""What multigrid has to know of tangents of large deformations: nodes, parts, rigid motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from ...linear.condensed import Structure

if TYPE_CHECKING:
    from ..elements.hyperelasticity import HyperelasticBody
    from ..elements.linear_body import LinearBody
    from .nonlinear_parts import NonlinearParts

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Numbering:
    """What the free dofs (n,) are.

    unknown (dofs,): number of every dof among them, -1 for others; place (n,): 3 node +
    component; part (nodes,): number of the piece that a node belongs to, cells joining nodes.
    """

    unknown: Index
    place: Index
    part: Index

    @classmethod
    def of(cls, parts: NonlinearParts) -> Numbering:
        """Of all bodies."""
        n, d = parts.X.shape
        unknown = np.full(n * d, -1)
        unknown[parts.free] = np.arange(len(parts.free))
        entries = (np.ones(len(parts.columns)), parts.columns, parts.pointers)
        graph = sparse.csr_array(entries, shape=(n, n))
        part = csgraph.connected_components(graph, directed=False)[1]
        return cls(unknown, 3 * (parts.free // d) + parts.free % d, part.astype(np.int64))


def structure_of(
    parts: NonlinearParts, u: Array, by_force: Array, returned: sparse.csr_array
) -> Structure:
    """Of a tangent at displacements u (nodes, d); arrays as in `linear.condensed`."""
    of = parts.numbering
    modes = free_modes(parts, u)
    return Structure(parts.dimension, of.place, of.part, modes, of.unknown[parts.at], by_force,
                     sparse.csr_array(returned))  # fmt: skip


def free_modes(parts: NonlinearParts, u: Array) -> Array:
    """Rigid modes of all pieces at displacements u (nodes, d) on free dofs, (n, 3 or 6)."""
    return rigid_modes(parts.X + u, parts.numbering.part)[parts.free]


def rigid_modes(x: Array, part: Index) -> Array:
    """Translations and rotations (dofs, 3 or 6) of places x (nodes, d), about each part's mean.

    part (nodes,): numbers from 0.
    """
    n, d = x.shape
    counts = np.bincount(part)
    means = np.stack([np.bincount(part, x[:, c]) / counts for c in range(d)], axis=1)
    y = (x - means[part]) / np.ptp(x, axis=0).max()
    planes = [(0, 1)] if d == 2 else [(0, 1), (1, 2), (2, 0)]
    out = np.zeros((n, d, d + len(planes)))
    out[:, range(d), range(d)] = 1.0
    for k, (i, j) in enumerate(planes, d):
        out[:, i, k], out[:, j, k] = -y[:, j], y[:, i]
    return out.reshape(n * d, -1)


def pattern_of(bodies: Sequence[HyperelasticBody | LinearBody]) -> tuple[Index, Index]:
    """Rows and columns (nodes) of all blocks."""
    rows, columns, start = [], [], 0
    for body in bodies:
        count = len(body.mesh.points)
        rows.append(np.repeat(np.arange(count), np.diff(body.pointers)) + start)
        columns.append(body.columns.astype(np.int64) + start)
        start += count
    return np.concatenate(rows), np.concatenate(columns)
