"""Nodal contact: every node of the slave surface is one contact with a lumped weight.

The reaction of a contact is a nodal force; divided by the weight, the integral of the node's
shape function over the surface, it is a traction.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, within
from ..meshes.facets import inner_facets
from ..meshes.mesh import Mesh
from ..meshes.surfaces import nodal_weights
from .geometry import Obstacle, frames

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Field = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class ContactRows:
    """Contacts of one slave surface, in the order of its nodes.

    nodes (nc,); points (nc, d); weights (nc,), area; gap (nc,), length; frames (nc, d, d), rows
    n, t1(, t2); H (n_dofs, nc d): local displacements are H^T v + [gap, 0, 0].
    average: the mean of a function of points (k, d) at every contact, (nc,), with the weights
    that gaps and displacements have there; None where these are values at the points.
    """

    nodes: Index
    points: Array
    weights: Array
    gap: Array
    frames: Array
    H: sparse.csc_array
    average: Callable[[Field], Array] | None = None

    def mean(self, field: Field) -> Array:
        """A function of points (k, d), seen by the contacts, (nc,)."""
        return field(self.points) if self.average is None else self.average(field)

    def force(self, r: Array) -> Array:
        """Forces on the slave in global axes, (nc, d), of reactions r (nc, d) in the frames.

        Averages may act on several nodes: their sum, so that all forces balance the loads.
        """
        return np.einsum("pkc,pk->pc", self.sums, r)

    @cached_property
    def sums(self) -> Array:
        """Sums of the columns of H over all nodes, (nc, d, d): axes times total weights."""
        nc, d = len(self.nodes), self.points.shape[1]
        rows = self.H.tocsr()
        sums = np.stack([np.asarray(rows[c::d].sum(axis=0)).ravel() for c in range(d)], axis=1)
        return sums.reshape(nc, d, d)

    def at(self, kept: NDArray[np.bool_]) -> ContactRows:
        """A selection of these contacts."""
        columns = np.repeat(kept, self.points.shape[1])
        average = None if self.average is None else partial(_part, self.average, kept)
        return ContactRows(self.nodes[kept], self.points[kept], self.weights[kept],
                           self.gap[kept], self.frames[kept],
                           sparse.csc_array(self.H[:, columns]), average)  # fmt: skip


def _part(average: Callable[[Field], Array], kept: NDArray[np.bool_], field: Field) -> Array:
    """Averages at a selection of contacts; no closure, so that models can be pickled."""
    return average(field)[kept]


def forces(pairs: Sequence[ContactRows], r: Array) -> Array:
    """Forces on the slaves in global axes, (nc, d), of the reactions r of several pairs."""
    out, begin = np.empty_like(r), 0
    for rows in pairs:
        end = begin + len(rows.nodes)
        out[begin:end] = rows.force(r[begin:end])
        begin = end
    return out


def nodal_contact(mesh: Mesh, surface: str, obstacle: Obstacle) -> ContactRows:
    """Contacts between the nodes of a surface and a rigid obstacle, in the mesh's own dofs."""
    check_exterior(mesh, surface)
    nodes, weights = contact_nodes(mesh, surface)
    points = mesh.points[nodes]
    with within("obstacle"):
        axes, gap = frames(obstacle.normals(points)), obstacle.gap(points)
    H = contact_columns(nodes, axes, len(mesh.points) * mesh.dim)
    return ContactRows(nodes, points, weights, gap, axes, H)


def contact_nodes(mesh: Mesh, surface: str) -> tuple[Index, Array]:
    """Nodes that get a contact, and their weights: those of a surface whose weight is positive.

    It is zero at the corners of triangles of second order; only their middles get contacts.
    """
    facets = mesh.surface(surface)
    weights = nodal_weights(mesh.points, facets, axisymmetric=mesh.axisymmetric)
    nodes = np.flatnonzero(weights > 0)
    return nodes, weights[nodes]


def check_exterior(mesh: Mesh, surface: str, side: str = "slave") -> None:
    """Raise InvalidInput, of a side of a contact, when a facet lies between two cells."""
    facets = mesh.surface(surface)
    total = sum(len(block.nodes) for block in facets)
    inner = inner_facets(mesh.cells, facets, len(mesh.points))
    if inner:
        raise InvalidInput(
            f"{inner} of its {total} facets lie between two cells, contact needs an outer "
            "surface; parts of a mesh that share nodes are bonded there: read it with "
            "glue=False, in a case file glue = false under mesh, and they touch",
            (side,), f"surface {surface!r}",
        )  # fmt: skip


def contact_columns(nodes: Index, axes: Array, size: int) -> sparse.csc_array:
    """H (size, nc d): column i d + k holds axis k of contact i at the dofs of its node."""
    nc, d = axes.shape[:2]
    rows = np.broadcast_to((nodes[:, None] * d + np.arange(d))[:, None, :], (nc, d, d))
    columns = np.broadcast_to(np.arange(nc * d).reshape(nc, d, 1), (nc, d, d))
    entries = (axes.ravel(), (rows.ravel(), columns.ravel()))
    return sparse.coo_array(entries, shape=(size, nc * d)).tocsc()
