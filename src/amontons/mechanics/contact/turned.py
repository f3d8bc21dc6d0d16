"""Averages over curved slaves of second order, whose frames turn from point to point.

One frame for each node takes a facet of 18 degrees as if all of it faced one way: with
functions of second order the average of a ring that grows is too large by the square of that
angle over 12; gaps and tractions too, in all 2.3 per cent of a press fit's pressure.  Here the
frame of a node is turned by the smallest rotation onto the normal at every point,

    u_p = (1 / D_p) int psi_p (R(x) (v_slave - v_master) + [g n_f . n, 0, 0]),

n_f being the facet's normal, along which g is measured.  Forces on both sides still cancel, as
both have the frame of the point.  Of first order frames stay those of the nodes: the motion of
the slave's node is then the average itself, and errors are a part of those of its facets.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..meshes.cells import CELLS
from .cuts import SIDES, Cuts, cuts, functions
from .distances import distances, raised
from .pairs import KINDS

if TYPE_CHECKING:
    from .segments import Segments, Surface

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
STRAIGHT = 1e-9  # sine of the angle by which normals turn below which a surface is flat
AT_ONCE = 4000  # triangles at a time, for memory
WHOLE = 0.5  # part of an axis that is free above which it counts


def turns(side: Surface) -> bool:
    """Whether normals on facets are others than those of the facets."""
    return side.curved or bool(len(side.shapes.every)) or bool(
        (np.abs(side.slopes) > STRAIGHT).any()
    )  # fmt: skip


class Averages(Protocol):
    """What is needed of averages: facets (f,) with psi (f, 4, 4), nodes, weights (nc,)."""

    @property
    def facets(self) -> Index: ...  # noqa: D102
    @property
    def psi(self) -> Array: ...  # noqa: D102
    @property
    def nodes(self) -> Index: ...  # noqa: D102
    @property
    def weights(self) -> Array: ...  # noqa: D102


class Turned:
    """Sums over the points of segments: rows of both sides, and gaps, of contacts (nc,).

    axes (nc, d, d): the frames at the nodes.
    """

    def __init__(self, over: Surface, under: Surface, average: Averages, axes: Array) -> None:
        self.over, self.under, self.axes, self.average = over, under, axes, average
        self.contact = np.full(len(over.points), -1)  # number of the contact at a node
        self.contact[average.nodes] = np.arange(len(average.nodes))

    def sums(
        self, parts: Segments, fixed: Mask
    ) -> tuple[sparse.csc_array, sparse.csc_array, Array]:
        """H of the slave, H of the master, both (dofs, nc d), and gaps (nc,).

        fixed (nc, d): components that do not count: axes along them are left out.
        """
        nc, d = self.axes.shape[:2]
        free = np.linalg.norm(self.axes * ~fixed[:, None, :], axis=2) > WHOLE
        gap = np.zeros(nc)
        tables: tuple[list, list] = ([], [])
        for of, facet, cut in _chunks(cuts(self.over, self.under, parts.slave, parts.master)):
            one, other = of[cut.pair], facet[cut.pair]
            rows, psi, frame = self._at_points(one, cut)
            far = distances(self.over, self.under, of, facet, cut)
            along = np.einsum("tqac,tc->tqa", frame[:, :, :, 0], -self.over.normal[one])
            values = np.einsum("tq,tqa,tqa->ta", cut.weight * far, psi, along)
            np.add.at(gap, rows.ravel(), np.where(rows >= 0, values, 0.0).ravel())
            frame = frame * free[rows][:, None, :, :, None]
            weighted = (cut.weight[:, :, None] * psi)[..., None, None] * frame
            for table, side, which, at in zip(
                tables, (self.over, self.under), (one, other), (cut.at, cut.opposite),
                strict=True,
            ):  # fmt: skip
                table.append(_entries(side, which, at, weighted, rows))
        slave, master = (
            _matrix(table, side.points.size, self.average.weights, d)
            for table, side in zip(tables, (self.over, self.under), strict=True)
        )
        return slave, master, gap / self.average.weights

    def _at_points(self, one: Index, cut: Cuts) -> tuple[Index, Array, Array]:
        """Contacts (t, a), psi (t, q, a) and turned frames (t, q, a, d, d) of slave facets."""
        n = int(self.over.corners[one].max(initial=2))
        phi = functions(KINDS[n - 2], cut.at)
        where = np.searchsorted(self.average.facets, one)
        psi = phi @ np.swapaxes(self.average.psi[where][:, :n, :n], 1, 2)
        rows = self.contact[self.over.nodes[one, :n]]
        _, normal = raised(self.over, one, cut.at)
        return rows, psi, turned(self.axes[rows][:, None], -normal[:, :, None])


def turned(axes: Array, normal: Array) -> Array:
    """Frames (..., d, d) turned by the smallest rotation that brings first rows to normals.

    normal (..., d), unit; not opposite to the first row.
    """
    first = axes[..., 0, :]
    cosine = np.einsum("...c,...c->...", first, normal)
    along = np.einsum("...ic,...c->...i", axes[..., 1:, :], normal)
    share = along / (1 + cosine)[..., None]
    rest = axes[..., 1:, :] - share[..., None] * (first + normal)[..., None, :]
    normal = np.broadcast_to(normal[..., None, :], rest[..., :1, :].shape)
    return np.concatenate([normal, rest], axis=-2)


def _chunks(groups: Iterator[tuple[Index, Index, Cuts]]) -> Iterator[tuple[Index, Index, Cuts]]:
    for of, facet, cut in groups:
        for start in range(0, len(cut.pair), AT_ONCE):
            part = slice(start, start + AT_ONCE)
            yield of, facet, Cuts(
                cut.pair[part], cut.at[part], cut.opposite[part], cut.weight[part]
            )  # fmt: skip


def _entries(
    side: Surface, which: Index, at: Array, weighted: Array, rows: Index
) -> tuple[Array, Index, Index]:
    """Values (t, a, w, d, d), nodes (t, w) and contacts (t, a) of points on facets (t,)."""
    kind = SIDES[int(side.kind[which].max(initial=0))]
    values = np.einsum("tqaic,tqw->tawic", weighted, functions(kind, at))
    return values, side.all[which, : CELLS[kind].nodes], rows


def _matrix(table: list, size: int, weights: Array, d: int) -> sparse.csc_array:
    """Sum of all entries over the weights of their contacts, (size, nc d)."""
    total = sparse.csc_array((size, len(weights) * d))
    for values, nodes, rows in table:
        counts = np.broadcast_to((rows >= 0)[:, :, None, None, None], values.shape)
        dof = nodes[:, None, :, None, None] * d + np.arange(d)
        column = rows[:, :, None, None, None] * d + np.arange(d)[:, None]
        entries = (values / weights[rows][:, :, None, None, None])[counts]
        where = (np.broadcast_to(dof, values.shape)[counts],
                 np.broadcast_to(column, values.shape)[counts])  # fmt: skip
        total = total + sparse.coo_array((entries, where), shape=total.shape).tocsc()
    return sparse.csc_array(total)
