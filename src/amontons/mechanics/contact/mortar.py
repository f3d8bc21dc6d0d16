"""Dual mortar contact: gaps and displacements compared on average, one average per slave node.

With the dual basis psi of the slave surface ([HSW] section 2, see `dual`) and

    D_p = int psi_p,    M_pq = int psi_p phi_q^master,

    u_p = R_p (v_p - sum_q (M_pq / D_p) v_q) + [gap_p, 0, 0],    gap_p = (1 / D_p) int g psi_p,

R_p with rows n, t1(, t2), n out of the master into the slave, g > 0 where they are apart.  The
reaction r_p = D_p lambda_p is a nodal force, lambda_p a traction.  All integrals are sums over
segments: a uniform pressure then passes between flat meshes that do not match, and the forces
on both sides cancel.  g is the gap of the curved surfaces (`curvature`), all else is of the
facets.  Small strains: all is taken once, in the reference configuration.

No multiplier is there for nodes that supports hold in the normal direction, and for those of
which hardly anything faces the other side; their neighbours take their share, and feel their
displacement: u_p then has the terms R_p (int psi_p phi_s / D_p) v_s of such nodes s and
R_p (int psi_p phi_p / D_p) v_p, which together are a mean; r_p acts on all of them.
Components of the displacement that supports hold on both sides for good (planes of symmetry)
are left out of u, and of the normals.  For good means to one value that does not depend on
time: sides that are held at first and then moved apart slide, and friction acts.

[HSW] S. Hüeber, G. Stadler, B. Wohlmuth, "A primal-dual active set algorithm for
three-dimensional contact problems with Coulomb friction", SIAM J. Sci. Comput. 30 (2008).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import within
from ..meshes.cells import CELLS, FIRST
from ..meshes.check import around
from ..meshes.facets import corner_facets, turned
from ..meshes.mesh import Mesh
from ..meshes.surfaces import nodal_weights
from .clipping import line_rule, square_rule, triangle_rule
from .cuts import SIDES
from .distances import raised
from .dual import dual_functions, nodes_with_multiplier
from .geometry import Obstacle, frames
from .held_averages import (
    NO_MOTION,
    at_end,
    held_along,
    held_together,
    lasting_values,
    within_free,
)
from .nodal import ContactRows, Field, check_exterior, contact_nodes
from .overlap import check_different, not_facing
from .pairs import KINDS, MAX_NODES
from .segments import Segments, Surface, in_front
from .slave_normals import slave_normals
from .turned import Turned, turns

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
EXACT = 1e-9  # the same for the normals of obstacles
HARDLY = 0.1  # covered part of a node's weight below which it gets no multiplier
ROUNDING = 1e-14  # averages below this are zeros with rounding errors
COVERED = 1e-6  # part of a facet that may be missing where it faces the other side as a whole
RULES = {"line": line_rule(4), "tri": triangle_rule(4), "quad": square_rule(4)}


def mortar_obstacle(
    mesh: Mesh, surface: str, obstacle: Obstacle, *, held: Mask | None = None
) -> tuple[ContactRows, Mask]:
    """Contacts of a surface with a rigid obstacle in the mesh's own dofs, and found.

    held (n, dim): components that supports prescribe, by default none.
    found, (slave nodes,): nodes with a multiplier; only these have rows.
    """
    check_exterior(mesh, surface)
    slave = Surface.on(mesh, surface)
    n, dim = mesh.points.shape
    normals = np.zeros((n, dim))
    on = np.unique(slave.nodes)
    with within("obstacle"):
        normals[on] = obstacle.normals(mesh.points[on])
        mass, own, moment = _against(slave, obstacle)
    without = held_along(normals, held, EXACT)
    average = _Average.of(slave, np.arange(len(slave.nodes)), mass, own, without)
    nodes = average.nodes
    gap = average.of_moments(np.arange(len(moment)), moment[:, :, None])[:, 0]
    axes = frames(normals[nodes])
    H = coupled_columns(average.onto_slave, axes, np.zeros(axes.shape[:2], dtype=bool))
    rows = average.rows(axes, gap, H)
    return rows, np.isin(mortar_nodes(mesh, surface), nodes)


def mortar_contact(
    slave: Mesh,
    surface: str,
    master: Mesh,
    master_surface: str,
    *,
    held: Mask | None = None,
    lasting: Array | None = None,
    master_lasting: Array | None = None,
    tied: bool = False,
) -> tuple[ContactRows, sparse.csc_array, Mask]:
    """Contacts of a slave with a master surface: rows, their part on the master, and found.

    As `pair_contact`: rows.H in the dofs of the slave mesh, the second matrix (n_master, nc d)
    in those of the master; found, (slave nodes,): nodes with a multiplier.  held (n, dim):
    components of the slave that supports prescribe; lasting, master_lasting (n, dim): values
    that they prescribe at all times, NaN elsewhere.  tied: sides that look the same way are
    met too, where none face each other.
    Raises InvalidInput when the bodies do not face each other, for a surface in contact with
    itself, and for facets without area.  Cost linear in the facets.
    """
    check_exterior(slave, surface)
    check_exterior(master, master_surface, "master")
    check_different(slave, surface, master, master_surface)
    over, under = Surface.on(slave, surface), Surface.on(master, master_surface)
    parts = in_front(over, under, master, joined=slave is master)
    if tied and not len(parts.slave):
        behind = turned(master.surface(master_surface))
        under = Surface.of(
            master.points, behind, master_surface, axisymmetric=master.axisymmetric
        )
        parts = in_front(over, under, master, joined=slave is master)
    if not len(parts.slave):
        raise not_facing(slave, surface, master, master_surface)
    facets, of = np.unique(parts.slave, return_inverse=True)
    normals = -slave_normals(over, facets)
    mass = np.zeros((len(facets), MAX_NODES, MAX_NODES))
    own: Array | None = None
    np.add.at(mass, of, parts.mass)
    if over.is_second:
        own = np.zeros((len(facets), *parts.own.shape[1:]))
        np.add.at(own, of, parts.own)
    average = _Average.of(over, facets, mass, own, held_along(normals, held, NO_MOTION))
    across = average.onto(parts, of, under)
    fixed = held_together(
        average.nodes, across, (slave.points, lasting_values(lasting, slave)),
        (master.points, lasting_values(master_lasting, master)), at_end(over),
    )  # fmt: skip
    axes = frames(within_free(normals[average.nodes], fixed))
    apart = average.of_moments(of, -parts.apart[:, :, None] * over.normal[parts.slave, None])
    gap = np.einsum("pc,pc->p", axes[:, 0], apart)
    on_slave = coupled_columns(average.onto_slave, axes, fixed)
    on_master = coupled_columns(across, axes, fixed)
    if over.is_second and turns(over):
        on_slave, on_master, gap = Turned(over, under, average, axes).sums(parts, fixed)
    if over.is_second:
        gap = _without_overshoot(gap, over, parts, average.nodes)
    size = max(np.abs(mesh.points).max(initial=0.0) for mesh in (slave, master))
    gap[np.abs(gap) < ROUNDING * size] = 0.0
    found = np.isin(mortar_nodes(slave, surface), average.nodes)
    return average.rows(axes, gap, on_slave), -on_master, found


def mortar_nodes(mesh: Mesh, surface: str) -> Index:
    """Nodes of a surface that can get a multiplier: all, of second order those at corners."""
    facets = mesh.surface(surface)
    if all(block.kind in KINDS for block in facets):
        return contact_nodes(mesh, surface)[0]
    return np.unique(np.concatenate([corner_facets(block).nodes.ravel() for block in facets]))


@dataclass(frozen=True, eq=False)
class _Average:
    """Averages of nodal values over the slave surface, one for each node with multiplier.

    nodes (nc,); weights (nc,): D_p; facets (f,) that take part, mass (f, 4, 4): int phi phi on
    what faces the other side, psi (f, 4, 4): dual functions; onto_slave (nc, n): means of the
    slave's own values, of the node alone but where others without multiplier are beside it.
    """

    surface: Surface
    facets: Index
    mass: Array
    nodes: Index
    weights: Array
    psi: Array
    onto_slave: sparse.csr_array

    @classmethod
    def of(
        cls, surface: Surface, facets: Index, mass: Array, own: Array | None, held: Mask
    ) -> _Average:
        """From int phi phi (f, 4, 4) on some facets (f,); held (n,): no multiplier wanted.

        own (f, 4, w): int phi N with the functions of displacements of second order, else None.
        """
        n = len(surface.points)
        nodes, real = surface.nodes[facets], surface.real[facets]
        whole = nodal_weights(
            surface.points, surface.blocks, axisymmetric=surface.axisymmetric
        )
        reached = _scatter(n, nodes, mass.sum(axis=2)) / np.where(whole > 0, whole, 1.0)
        kept = nodes_with_multiplier(nodes, real, held, reached < HARDLY, reached)
        psi = dual_functions(mass, kept[nodes] & real, real)
        chosen = np.unique(nodes[kept[nodes] & real])
        own_part = _scatter(n, nodes, np.einsum("faa->fa", psi @ mass))[chosen]
        left = (real & ~kept[nodes]).astype(float)
        shared = _scatter(n, nodes, (psi @ mass @ left[:, :, None])[:, :, 0])
        weights = own_part + shared[chosen]
        if own is not None:
            product = _between(nodes, psi @ own, surface.all[facets], (n, n))[chosen]
            onto = _cleaned(product, weights)
            return cls(surface, facets, mass, chosen, weights, psi, onto)
        product = _between(nodes, psi @ mass, nodes, (n, n))[chosen]
        extra = product @ sparse.diags_array(np.where(kept, 0.0, 1.0))
        itself = sparse.csr_array(
            (own_part / weights, (np.arange(len(chosen)), chosen)), shape=(len(chosen), n)
        )
        return cls(surface, facets, mass, chosen, weights, psi,
                   itself + _cleaned(extra, weights))  # fmt: skip

    @property
    def points(self) -> Array:
        """Points of the mesh, (n, dim)."""
        return self.surface.points

    @property
    def facet_nodes(self) -> Index:
        """Nodes of the facets that take part, (f, 4)."""
        return self.surface.nodes[self.facets]

    def of_function(self, field: Field) -> Array:
        """int f psi_p / int psi_p, (nc,); f is interpolated on facets that face it in part."""
        at_nodes = np.zeros(len(self.points))
        used = np.unique(self.facet_nodes)
        at_nodes[used] = field(self.points[used])
        moments = np.einsum("fab,fb->fa", self.mass, at_nodes[self.facet_nodes])
        exact = np.zeros((len(self.surface.nodes), MAX_NODES))
        for of, _, phi, _, area, x in _gauss_points(self.surface):
            exact[of, : len(phi)] += (area * field(x))[:, None] * phi
        covered = self.mass.sum(axis=(1, 2))
        whole = covered > (1 - COVERED) * self.surface.area[self.facets]
        moments[whole] = exact[self.facets[whole]]
        both = np.stack([moments, self.mass.sum(axis=2)], axis=2)
        field_and_one = self.of_moments(np.arange(len(self.facets)), both)
        return field_and_one[:, 0] / field_and_one[:, 1]

    def onto(self, parts: Segments, of: Index, master: Surface) -> sparse.csr_array:
        """Averages of the master's nodal values, (nc, n_master); of: facet of every segment."""
        shape = (len(self.points), len(master.points))
        moments = self.psi[of] @ parts.cross
        product = _between(self.facet_nodes[of], moments, master.all[parts.master], shape)
        return _cleaned(product[self.nodes], self.weights)

    def of_moments(self, of: Index, moments: Array) -> Array:
        """Averages (nc, c) of a field given as int phi_a field (k, 4, c); of: facets (k,)."""
        values, where, n = self.psi[of] @ moments, self.facet_nodes[of], len(self.points)
        sums = [_scatter(n, where, values[:, :, c]) for c in range(values.shape[2])]
        return np.stack(sums, axis=1)[self.nodes] / self.weights[:, None]

    def rows(self, axes: Array, gap: Array, H: sparse.csc_array) -> ContactRows:
        """Contacts with given frames, gaps and H in the dofs of the slave."""
        return ContactRows(
            self.nodes, self.points[self.nodes], self.weights, gap, axes, H, self.of_function
        )


def coupled_columns(weights: sparse.csr_array, axes: Array, fixed: Mask) -> sparse.csc_array:
    """H (n d, nc d) of averages weights (nc, n), seen in frames (nc, d, d).

    fixed (nc, d): components that do not count.
    """
    entries = weights.tocoo()
    contact, node = entries.coords
    d = axes.shape[1]
    values = entries.data[:, None, None] * (axes * ~fixed[:, None, :])[contact]
    rows = np.broadcast_to((node[:, None] * d + np.arange(d))[:, None, :], values.shape)
    columns = np.broadcast_to((contact[:, None] * d + np.arange(d))[:, :, None], values.shape)
    shape = (weights.shape[1] * d, weights.shape[0] * d)
    out = sparse.coo_array(
        (values.ravel(), (rows.ravel(), columns.ravel())), shape=shape
    ).tocsc()
    out.eliminate_zeros()
    return out


# -------------------------------------------------------------------- the two sides
def _against(slave: Surface, obstacle: Obstacle) -> tuple[Array, Array | None, Array]:
    """int phi phi (f, 4, 4), int phi N (f, 4, w), int g phi (f, 4): whole facets, g the gap.

    The second is None of first order.
    """
    mass = np.zeros((len(slave.nodes), MAX_NODES, MAX_NODES))
    own = np.zeros((len(slave.nodes), MAX_NODES, slave.all.shape[1]))
    moment = np.zeros((len(slave.nodes), MAX_NODES))
    for of, at, phi, whole, area, _ in _gauss_points(slave):
        n = len(phi)
        mass[of, :n, :n] += area[:, None, None] * np.outer(phi, phi)
        own[of, :n, : len(whole)] += area[:, None, None] * np.outer(phi, whole)
        on_surface, _ = raised(slave, of, np.broadcast_to(at, (len(of), 1, len(at))))
        gap = obstacle.gap(on_surface[:, 0])
        moment[of, :n] += (area * gap)[:, None] * phi
    return mass, own if slave.is_second else None, moment


def _gauss_points(side: Surface) -> Iterator[tuple[Index, Array, Array, Array, Array, Array]]:
    """Point after point: facets (k,), reference point, functions, weights (k,), places (k, d).

    Functions of the corners (a,), and of displacements (w,).
    """
    for number in np.unique(side.kind):
        cell, of = CELLS[SIDES[number]], np.flatnonzero(side.kind == number)
        first = CELLS[FIRST.get(cell.kind, cell.kind)]
        x = side.points[side.all[of, : cell.nodes]]
        for at, weight in zip(*RULES[first.kind], strict=True):
            jac, shape = cell.jacobians(x, at), cell.shape(at)
            area = weight * np.sqrt(np.linalg.det(np.swapaxes(jac, 1, 2) @ jac))
            where = shape @ x
            area = area * around(where, axisymmetric=side.axisymmetric)
            yield of, at, first.shape(at), shape, area, where


def _without_overshoot(
    gap: Array, over: Surface, parts: Segments, nodes: Index
) -> Array:
    """Averaged gaps (nc,) that lie below all distances on the facets around nodes (nc,) raised.

    Averages with functions that change their sign may do so: where facets are long and part
    quickly, they would overlap without a reason.  Where distances differ by less than they are,
    as in a press fit, averages of gaps and displacements belong together.
    """
    n = len(over.points)
    least, most = np.full(n, np.inf), np.full(n, -np.inf)
    around = over.nodes[parts.slave]
    np.minimum.at(least, around, parts.between[:, :1].repeat(around.shape[1], axis=1))
    np.maximum.at(most, around, parts.between[:, 1:].repeat(around.shape[1], axis=1))
    low = least[nodes]
    return np.where(most[nodes] - low > np.abs(low), np.maximum(gap, low), gap)


# -------------------------------------------------------------------- sums over facets
def _scatter(n: int, nodes: Index, values: Array) -> Array:
    """Sums (n,) of values (f, a) at nodes (f, a)."""
    return np.bincount(nodes.ravel(), values.ravel(), minlength=n)  # type: ignore[return-value]  # numpy types only counts


def _between(rows: Index, values: Array, columns: Index, shape: tuple) -> sparse.csr_array:
    """Sum of blocks (f, a, b) at nodes rows (f, a) and columns (f, b)."""
    where = (np.broadcast_to(rows[:, :, None], values.shape).ravel(),
             np.broadcast_to(columns[:, None, :], values.shape).ravel())  # fmt: skip
    return sparse.coo_array((values.ravel(), where), shape=shape).tocsr()


def _cleaned(product: sparse.csr_array, weights: Array) -> sparse.csr_array:
    """Rows over their weights, without rounding errors of zero."""
    out = sparse.csr_array(sparse.diags_array(1 / weights) @ product)
    out.data[np.abs(out.data) < ROUNDING] = 0.0
    out.eliminate_zeros()
    return out
