"""Tractions averaged over the facets around each contact.

The traction of a contact is its nodal force over its area, t_p = f_p / w_p: forces add up, but
where cells give rough forces it scatters from node to node.  Tetrahedra of first order do: the
error of their stresses, of first order in the mesh width and of either sign, is all in f.
With the shape functions phi of the slave's facets,

    mean t_p = sum_q M_pq t_q / sum_q M_pq,   M_pq = int phi_p phi_q,   q contacts of the pair,

is the mean of the interpolated traction, weighted with phi_p.  What is even stays even, also
beside rims and nodes without a contact.  Means are no recovery of higher order: they smear the
edge of a contact by a facet.  (The consistent one, M t = f, amplifies the scatter instead.)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, shown
from ..contact.clipping import line_rule, square_rule, triangle_rule
from ..meshes.cells import CELLS
from ..meshes.facets import Facets, corner_facets
from ..meshes.mesh import Mesh
from ..meshes.surfaces import facet_normals
from .matching import pairs_of

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
RULES = {"line": line_rule(2), "tri": triangle_rule(2), "quad": square_rule(2)}


class Solved(Protocol):
    """A solved model, or a step in time."""

    @property
    def model(self) -> Model:
        """What was solved."""
        ...

    @property
    def fields(self) -> Any:
        """Its `ContactFields`."""
        ...


def mean_tractions(solved: Solved) -> Array:
    """Tractions on the slaves averaged around each contact, (nc, d), in global axes.

    solved: what `solve` returns of a model, or a step of `evolve`.  `pressure` and `shear` are
    force over area of each node alone; with tetrahedra of first order out of a mesh generator
    these scatter, and means have half of the error where a contact is ten facets wide or more.
    Elsewhere (hexahedra, second order) nodes are better.  Areas are those of the fields, M that
    of undeformed facets.  Contacts that do not sit on corners of facets, one at each (those of
    Nitsche, nodal ones of second order), keep their own.  Raises InvalidInput without a model.
    """
    if not (hasattr(solved, "model") and hasattr(solved, "fields")):
        raise InvalidInput(
            f"mean_tractions: expected the solution of a model, or a step, got {shown(solved)}"
        )
    model, fields = solved.model, solved.fields
    out = fields.force / fields.areas[:, None]
    for (body, facets), (_, _, numbers) in zip(fields.facets, pairs_of(model), strict=True):
        blocks = [corner_facets(block) for block in facets]
        nodes = fields.node[numbers]
        corners = np.unique(np.concatenate([block.nodes.ravel() for block in blocks]))
        if len(np.unique(nodes)) < len(nodes) or not np.isin(nodes, corners).all():
            continue
        mass = _mass(model.bodies[body].mesh, blocks)[nodes][:, nodes]
        out[numbers] = mass @ out[numbers] / mass.sum(axis=1)[:, None]
    return out


def _mass(mesh: Mesh, blocks: list[Facets]) -> sparse.csr_array:
    """M, (n, n), of facets of first order."""
    n = len(mesh.points)
    total = sparse.csr_array((n, n))
    for block in blocks:
        cell = CELLS[block.kind]
        for at, weight in zip(*RULES[block.kind], strict=True):
            vectors = facet_normals(mesh.points, block, at, axisymmetric=mesh.axisymmetric)
            phi = cell.shape(at)
            area = weight * np.linalg.norm(vectors, axis=1)
            values = area[:, None, None] * np.outer(phi, phi)
            rows = np.broadcast_to(block.nodes[:, :, None], values.shape)
            columns = np.broadcast_to(block.nodes[:, None, :], values.shape)
            where = (rows.ravel(), columns.ravel())
            total = total + sparse.csr_array((values.ravel(), where), shape=(n, n))
    return sparse.csr_array(total)
