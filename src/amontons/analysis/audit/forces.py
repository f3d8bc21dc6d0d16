"""Nodal forces that displacements need, and how well they can be known.

At displacements u the bodies need the forces K u.  Where neither a contact nor a support acts,
they are those of the loads; elsewhere the difference is what contacts and supports give.  A
displacement that was printed with few digits may be off by half a unit of its last one, which
moves a force by at most |K| times that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...mechanics.model.supports import external_load
from .turning import Turning, straightened, turned_forces

if TYPE_CHECKING:
    from ...mechanics.model import Model

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
DOUBLE = 1e-15  # relative error of a displacement that was not printed
QUADRATIC = 1.5  # strains and rotations of size g change stresses by up to this part of g^2


@dataclass(frozen=True, eq=False)
class NodalForces:
    """Forces (dofs,) that contacts and supports give: K u less the loads.

    bound (dofs,): by how much rounding of the displacements may have moved them; large (dofs,):
    what small strains and constraints miss of large ones.  blur (dofs,): of the
    displacements.  work: u . K u, twice the elastic energy; is_held (dofs,): supports act.
    gradient: largest one of the displacements, 0 where they are small;
    size: largest force that they need one by one.
    """

    missing: Array
    bound: Array
    large: Array
    blur: Array
    work: float
    is_held: Mask
    gradient: float
    size: float

    @property
    def known(self) -> Array:
        """All that a force may be off by, (dofs,)."""
        return self.bound + self.large


def nodal_forces(
    model: Model, u: Array, blur: Array, *, large: bool, turning: Sequence[Turning] = ()
) -> NodalForces:  # fmt: skip
    """The forces at displacements u (dofs,) of nodes, known up to blur (dofs,), both lengths.

    large: the displacements are those of large strains and rotations; turning:
    constraints that turn with their nodes.  What references do is that which their nodes say:
    springs on them act on nodes too.
    """
    parts, nodes = model.discretisation, len(u)
    load = model.load_factor * external_load(model.bodies, model.loads, parts.beside)[:nodes]
    inner = (parts.K @ followed(model, u))[:nodes]
    held = np.zeros(parts.dofs, dtype=bool)
    held[parts.held] = True
    held = held[:nodes]
    K = parts.stored_stiffness
    if parts.dofs > nodes:
        K = sparse.csr_array(K[:nodes, :nodes])
    sizes = sparse.csr_array((np.abs(K.data), K.indices, K.indptr), shape=K.shape)
    bound = sizes @ np.maximum(blur, DOUBLE * np.abs(u))
    gradient, change = 0.0, np.zeros_like(bound)
    if large:  # looks at all pairs of nodes, which takes as long as all the rest
        gradient, change = _large(sizes, _points(model), u)
    if turning:
        rows = (-1, model.dimension)
        change = change + turned_forces(
            turning, _points(model), u.reshape(rows), (inner - load).reshape(rows)
        ).ravel()
    return NodalForces(
        inner - load, bound, change, blur,
        float(u @ inner), held, gradient,
        float((sizes @ np.abs(u)).max(initial=0.0)),
    )  # fmt: skip


def followed(model: Model, u: Array) -> Array:
    """Displacements of all unknowns, those beside the nodes (dofs,) too, as constraints allow.

    u (dofs of nodes,) itself where nothing is beside the nodes; else followed by the nearest
    motion of references and bolts.
    """
    parts = model.discretisation
    if parts.dofs == len(u):
        return u
    near = allowed(model, u)
    assert near is not None
    return np.concatenate([u, near[len(u) :]])


def allowed(model: Model, u: Array) -> Array | None:
    """The motion (dofs,) next to u that constraints and supports allow; None without them."""
    parts = model.discretisation
    if parts.eliminated is None:
        return None
    whole = np.concatenate([u, np.zeros(parts.dofs - len(u))])
    return parts.eliminated.nearest(whole, model.load_factor * parts.prescribed)


def misplaced(
    model: Model, u: Array, blur: Array, turning: Sequence[Turning] = ()
) -> tuple[float, int]:  # fmt: skip
    """How far held dofs are from what supports and constraints ask, over the largest; node."""
    parts = model.discretisation
    wanted = (model.load_factor * parts.prescribed)[: len(u)]
    size = max(float(np.abs(u).max(initial=0.0)), float(np.abs(wanted).max(initial=0.0)))
    off = np.where(parts.is_fixed[: len(u)], np.abs(u - wanted) - 2 * blur, 0.0)
    if turning:
        u = straightened(turning, _points(model), u.reshape(-1, model.dimension)).ravel()
    near = allowed(model, u)
    if near is not None:
        tied = parts.held[parts.held < len(u)]
        off[tied] = np.maximum(off[tied], np.abs(u - near[: len(u)])[tied] - 4 * blur.max())
    worst = int(off.argmax()) if len(off) else 0
    return (float(max(off[worst], 0.0)) / size if size > 0 else 0.0), worst // model.dimension


def _points(model: Model) -> Array:
    return np.concatenate([body.mesh.points for body in model.bodies])


def _large(sizes: sparse.csr_array, points: Array, u: Array) -> tuple[float, Array]:
    """Largest gradient of u between neighbours, and what its square may change of forces.

    sizes (dofs, dofs): |K|; a stress of E g^2 where strain and rotation are g.
    """
    n, d = points.shape
    counts = np.diff(sizes.indptr)
    row = np.repeat(np.arange(n * d, dtype=np.int64), counts) // d
    first = sizes.indices % d == 0
    first &= np.repeat(np.arange(n * d) % d == 0, counts)
    own, other = row[first], sizes.indices[first] // d
    apart = own != other
    own, other = own[apart], other[apart]
    moved = u.reshape(n, d)
    length = np.linalg.norm(points[own] - points[other], axis=1)
    slope = np.linalg.norm(moved[own] - moved[other], axis=1) / np.where(length > 0, length, 1)
    steepest = np.zeros(n)
    np.maximum.at(steepest, own, slope)
    distance = np.linalg.norm(points[row] - points[sizes.indices // d], axis=1)
    unit = np.zeros(n * d)
    np.add.at(unit, np.repeat(np.arange(n * d), counts), sizes.data * distance)
    change = QUADRATIC * unit * np.repeat(steepest, d) ** 2
    return float(steepest.max(initial=0.0)), change
