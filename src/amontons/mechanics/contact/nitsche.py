"""Nitsche's contact: the law at Gauss points of the slave surface, with stresses for reactions.

No multipliers: with the traction t = sigma nu of the slave's own displacement and the local
displacement u (gap included), both in the local frame, the traction that acts at a point is

    p = P(t - kappa u):  p_N = (t_N - kappa u_N)^+, p_T in the disk of radius mu p_N or bound.

The discrete problem reads, for all test displacements z with local parts u(z) and t(z),

    a(v, z) - l(z) = int_slave p . u(z) + theta / kappa (t - p) . t(z).

theta = 0 is the unsymmetric variant of [Rey] section 3.2, theta = 1 the symmetric one, -1 the
skew-symmetric one, [CHR].  Only the slave's stress is used; a master feels -p, so that action
equals reaction.  The method is consistent: a field that solves the continuous problem and lies
in the finite element space solves the discrete one, whatever kappa.  Between meshes that do not
match this needs integrals over the parts of a facet that face one facet of the other side each,
see `cuts`.

kappa is to be large against the stiffness of a cell behind the surface: with the smallest c of
int_F |sigma nu|^2 <= c int_T sigma : epsilon (`elements.traces`), the frictionless problem is
uniquely solvable for kappa > (1 + theta)^2 c / 4.

[CHR] F. Chouly, P. Hild, Y. Renard, "Symmetric and non-symmetric variants of Nitsche's method
for contact problems in elasticity", Math. Comp. 84 (2015);
[Rey] the formulation in 2D with theta = 0; [R] Y. Renard, "Generalized Newton's methods for the
approximation and resolution of frictional contact problems in elasticity", Comput. Methods
Appl. Mech. Eng. 256 (2013).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, within
from ..elements.elasticity import LinearElastic, Materials
from ..elements.traces import (
    SurfacePoints,
    facet_traces,
    gauss_points,
    node_columns,
    surface_points,
)
from ..meshes.mesh import Mesh
from .cuts import points_on
from .distances import distances_at
from .geometry import Obstacle, frames
from .nodal import ContactRows, check_exterior
from .overlap import check_different, not_facing
from .segments import Surface, in_front

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
MOST_POINTS = 10  # Gauss points per direction


@dataclass(frozen=True)
class Nitsche:
    """Options of Nitsche's method.

    kappa: stress per length; by default `scale` times the c of every facet, which grows like
    young / cell size.  theta: 0 unsymmetric with the least terms, 1 symmetric, -1
    skew-symmetric.  points: Gauss points per direction of a facet against an obstacle; half
    as many on each part of it that faces one master facet, but never fewer than shape functions
    need.
    """

    kappa: float | None = None
    scale: float = 2.0
    theta: float = 0.0
    points: int = 4

    def __post_init__(self) -> None:
        for name in ("kappa", "scale"):
            if name == "kappa" and self.kappa is None:
                continue
            value = getattr(self, name)
            if not (_is_number(value) and np.isfinite(value) and value > 0):
                raise InvalidInput(f"expected a finite number > 0, got {value!r}", (name,))
        if not (_is_number(self.theta) and -1 <= self.theta <= 1):
            text = f"expected a number from -1 to 1, got {self.theta!r}"
            raise InvalidInput(text, ("theta",))
        whole = isinstance(self.points, int | np.integer) and not isinstance(self.points, bool)
        if not (whole and 1 <= self.points <= MOST_POINTS):
            text = f"expected a whole number from 1 to {MOST_POINTS}, got {self.points!r}"
            raise InvalidInput(text, ("points",))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


@dataclass(frozen=True, eq=False)
class NitscheTerms:
    """What Nitsche's method needs beside `ContactRows`, q points.

    traction (n_dofs, q d): rows of the slave's traction in the local frames; kappa, theta and
    stiffness (q,), the last being c of the module, the stress per length of the body itself.
    """

    traction: sparse.csc_array
    kappa: Array
    theta: Array
    stiffness: Array

    def symmetric_force(self, displacement: Array, weights: Array, r: Array) -> Array:
        """Forces (n_dofs,) of theta / kappa (t - p), which do no work on rigid motions.

        weights (q,): areas; r (q, d): reactions.
        """
        if not self.theta.any():
            return np.zeros_like(displacement)
        t = (self.traction.T @ displacement).reshape(r.shape)
        share = (self.theta / self.kappa)[:, None] * (weights[:, None] * t - r)
        return self.traction @ share.ravel()

    def at(self, kept: Mask) -> NitscheTerms:
        """A selection of these points."""
        columns = np.repeat(kept, self.traction.shape[1] // len(kept))
        return NitscheTerms(
            sparse.csc_array(self.traction[:, columns]), self.kappa[kept], self.theta[kept],
            self.stiffness[kept],
        )  # fmt: skip


def nitsche_obstacle(
    mesh: Mesh, surface: str, obstacle: Obstacle, material: LinearElastic | Materials,
    options: Nitsche,
) -> tuple[ContactRows, NitscheTerms]:  # fmt: skip
    """Gauss points of a surface against a rigid obstacle, in the mesh's own dofs."""
    check_exterior(mesh, surface)
    where = gauss_points(mesh, surface, options.points)
    at = surface_points(mesh, surface, material, where)
    with within("obstacle"):
        axes, gap = frames(obstacle.normals(at.points)), obstacle.gap(at.points)
    return _rows(at, gap, axes, mesh.points.size, options)


def nitsche_pair(  # noqa: PLR0913
    slave: Mesh, surface: str, master: Mesh, master_surface: str,
    material: LinearElastic | Materials, options: Nitsche,
) -> tuple[ContactRows, NitscheTerms, sparse.csc_array]:  # fmt: skip
    """Gauss points on the parts of the slave that face one master facet each, see `cuts`.

    Rows and terms in the dofs of the slave, and the part of H in those of the master.  A point
    meets the one opposite, along the normal of its facet; the gap is that of the curved
    surfaces for which the facets stand, see `distances`.
    """
    check_exterior(slave, surface)
    check_exterior(master, master_surface, "master")
    check_different(slave, surface, master, master_surface)
    over = Surface.on(slave, surface)
    under = Surface.on(master, master_surface)
    met = in_front(over, under, master, joined=slave is master)
    if not len(met.slave):
        raise not_facing(slave, surface, master, master_surface)
    points = (options.points + 1) // 2
    where, facet, opposite = points_on(over, under, met.slave, met.master, points)
    at = surface_points(slave, surface, material, where)
    nodes, shape = facet_traces(master, master_surface, facet, opposite)
    axes = frames(-(at.normals if over.curved else over.normal[where.facet]))
    far = distances_at(over, under, (where.facet, where.at), (facet, opposite))
    gap = -far * np.einsum("qc,qc->q", axes[:, 0], over.normal[where.facet])
    rows, terms = _rows(at, gap, axes, slave.points.size, options)
    values = np.einsum("qa,qkc->qack", shape, -axes)
    return rows, terms, node_columns(nodes, values, master.points.size)


def _rows(
    at: SurfacePoints, gap: Array, axes: Array, size: int, options: Nitsche
) -> tuple[ContactRows, NitscheTerms]:
    q = len(gap)
    nearest = at.nodes[np.arange(q), at.shape.argmax(axis=1)]
    rows = ContactRows(nearest, at.points, at.weights, gap, axes, at.displacement(axes, size))
    kappa = options.scale * at.stiffness if options.kappa is None else options.kappa
    terms = NitscheTerms(
        at.traction(axes, size),
        np.broadcast_to(kappa, q).astype(float),
        np.full(q, float(options.theta)),
        at.stiffness,
    )
    return rows, terms
