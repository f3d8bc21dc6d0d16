"""How far two meshes are from each other where nodes meet facets, measured before any load.

Nodal contact gives the force of a slave node to the facet that it meets.  A uniform pressure
then arrives as  sum_i w_i N_a(y_i)  at a node of the master, where  int N_a  would be even; and
where surfaces are curved, nodes meet facets, which lie behind the surface that they stand for.
Both vanish where meshes match, and never in general: a force can not be given to the node of a
single facet and be even on all of them, which is why `mortar` spreads it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..elements.traces import facet_traces
from ..meshes.mesh import Mesh
from ..meshes.surfaces import nodal_weights
from .cuts import points_on
from .pairs import meeting
from .segments import Surface, bulge, in_front

Array = NDArray[np.float64]
COUNTS = 1e-9  # shape functions below this do not count
ROUNDING = 1e-14  # of the coordinates: a surface that rises less above its facets is flat
FEWEST = 1  # points per direction: as many as the integrals of shape functions need


@dataclass(frozen=True, eq=False)
class Mismatch:
    """Of the slave nodes (n,) that can have contacts: how uneven a uniform pressure arrives.

    force (n,): of the master's nodes that share area with the node, the one that is farthest
    off, relative to its own area; behind (n,), length: by how much the facet that the node
    meets lies behind the curved surface.
    """

    force: Array
    behind: Array


def mismatch(slave: Mesh, surface: str, master: Mesh, master_surface: str) -> Mismatch:
    """Mismatch of the pairs of `pair_contact`, all slave nodes in its order."""
    nodes, _, hit = meeting(slave, surface, master, master_surface)
    over = Surface.on(slave, surface)
    under = Surface.on(master, master_surface)
    behind = np.linalg.norm(bulge(under, hit.facet, hit.shape), axis=1) * hit.found
    behind[behind <= ROUNDING * np.abs(under.points).max()] = 0.0
    met = in_front(over, under, master, joined=slave is master)
    if not len(met.slave):
        return Mismatch(np.zeros(len(nodes)), behind)
    where, facet, opposite = points_on(over, under, met.slave, met.master, FEWEST)
    own, phi = facet_traces(slave, surface, where.facet, where.at)
    other, psi = facet_traces(master, master_surface, facet, opposite)
    covered = _summed(own, where.weight[:, None] * phi, len(slave.points))
    wanted = _summed(other, where.weight[:, None] * psi, len(master.points))
    given = (covered[nodes] * hit.found)[:, None] * hit.shape
    arriving = _summed(hit.nodes, given, len(master.points))
    whole = nodal_weights(
        master.points, master.surface(master_surface), axisymmetric=master.axisymmetric
    )
    off = np.abs(arriving - wanted) / np.where(whole > 0, whole, 1.0)
    worst = (off[other] * (psi > COUNTS)).max(axis=1)[:, None] * (phi > COUNTS)
    force = np.zeros(len(slave.points))
    np.maximum.at(force, own, worst)
    return Mismatch(force[nodes], behind)


def _summed(nodes: NDArray[np.int64], values: Array, count: int) -> Array:
    """Sums (count,) of values (q, a) at nodes (q, a)."""
    return np.bincount(nodes.ravel(), values.ravel(), minlength=count)  # type: ignore[return-value]  # numpy types only counts
