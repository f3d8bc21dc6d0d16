"""Dual mortar contact of two deforming bodies where they are now.

A pair has slave nodes p and a master surface.  All is taken at the positions x of all nodes:
n_p is the unit normal at p, out of the master into the slave, that of `faced_normals`: the
area average of the facets around it where they face the master, at a ridge nearer to that of a
straight master (`agreed_normals`); of a node that faces nobody, in dynamics, of ties and under
a given bound (Tresca's law) that of whole facets.  On every slave facet psi are the dual
functions of `dual` on that part of it that faces the master ([PSG]), D_p = int psi_p over all
facets, and

    B_pp = 1,   B_pq = - int psi_p N_q / D_p  of master nodes q,   sum_j B_pj = 0,         (1)
    G_p = sum_j B_pj x_j / pi_p,      g_p = n_p . G_p,                                      (2)
    s_p = sum_j B'_pj x_j / pi'_p - G_p,                                                    (3)

pi_p = int psi_p / D_p, G the mean distance vector, g the gap, and s the motion since the last
step, whose B is B' ([PL]):
what slides is the change of B, not of x.  Rotations of everything leave B as it is: s = 0.
A force lambda_p acts on p, and -B_pj lambda_p on the other nodes j: together no force, and a
moment pi_p G_p x lambda_p, none where the sides touch all along, which `couples` take away.
A node that met nobody at the end of the last step has the motion of `newcomers`, one that faded
then some of both; one that meets nobody now has none.  One that was open then, by g' > 0, met
the point over there along its normal n', but both sides turn towards each other until they
touch: they come closer without a slip along the mean of n' and the master's normal n_M, towards
the point d beside that one,

    d_p = g' (n' - m (n' . n_M) / (m . n_M)) = sum_j A'_pj x'_j,    m = n' + n_M,
    s_p = sum_j (B' - (1 - g_p / g') A')_pj x_j / pi'_p - G_p,                            (3')

A' on master nodes by gradients of their functions.  With (3) alone slips of nodes that close
have errors of first order in the load step, opposite for both sides as slaves.

Nodes without a row carry no force of their own: the others of their facets take their share,
pi > 1 and B_ps > 0 at such a node s ([PW]).  Nodes of which hardly anything faces the master
get the mean pressure of their neighbours, see `fading`; in dynamics and ties, where who carries
stays for a step or for good, and under a given bound they are like nodes without a row.
A node that does not meet is open, its gap the distance from the closest master node.

Facets of second order have multipliers at their corners, psi dual to the functions of first
order there; integrals are those over the facets through the corners ([PW]).  Bulges at the
other nodes m, from the mean of corners c with parts w_mc, enter B as

    B_pm = int chi_p N_m / D_p,    B_pc -> B_pc - w_mc B_pm,    of the master with -N_m,    (4)

chi = psi where all of a facet faces the master, see `shared`.  The force lambda_p then acts at
p and at these; what a body needs of it at the corner is sum_j C_pj (f_int - f)_j, C_pp = 1 and
C_pm = w_mp, as moving p without a bulge takes m along.

One surface against itself falls into two sides, see `folds`; nodes that are of no slave facet
alone are open like those that do not meet.

[PL] M. Puso, T. Laursen, CMAME 193 (2004) 601-629 and 4891-4913 (friction).
[PSG] A. Popp, A. Seitz, M. Gee, W. Wall, "Improved robustness and consistency of 3D contact
algorithms based on a dual mortar approach", CMAME 264 (2013).
[PW] A. Popp, B. Wohlmuth, M. Gee, W. Wall, SIAM J. Sci. Comput. 34 (2012).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...linear.sums import sum_of_blocks, sum_of_products
from .agreed_normals import AgreedNormals
from .couples import Couples
from .current_slopes import MortarSlopes
from .facing import Skin, shapes
from .fading import Fading
from .folds import Fold
from .grown_areas import LEAST
from .newcomers import Newcomers
from .shared import Shared

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
ACROSS = 0.5  # m . n_M of (3') below which sides hardly face each other: d is zero


@dataclass(frozen=True, eq=False)
class MortarPair:
    """Slave nodes (nc,) of the model, those of the slave facets that have a row, and a master.

    free (nc, d): components of the slaves without a support; normals lie in these.
    names: of both surfaces, for messages.  fold: of one surface against itself, whose sides
    slave and master are then, and all nodes of which have a row.  offset (nc,): what is added
    to gaps, of a clearance that is not that of the meshes.  axes (2 nc, nodes): c of
    `surface_axes`, of tangents that the slave carries; None for none.  areas (nc,): undeformed,
    around the slaves, of `fading`; None: nodes that hardly anything faces drop out.  whole
    (nc,): undeformed, those that stresses of the law were made forces with; None: they stay.
    ridges (nc,): of `contact.ridges`, undeformed; None for none.
    """

    slaves: Index
    slave: Skin
    master: Skin
    free: Mask
    names: tuple[str, str] = ("slave", "master")
    fold: Fold | None = None
    offset: Array | float = 0.0
    axes: sparse.csr_array | None = None
    areas: Array | None = None
    whole: Array | None = None
    ridges: Array | None = None

    @cached_property
    def both(self) -> Skin:
        """Both sides as one, which may share middles."""
        return Skin.joined([self.slave, self.master])

    @property
    def around(self) -> tuple[Skin, Mask]:
        """The facets whose areas make the normals, and of which of their nodes, (f, a)."""
        if self.fold is None:
            return self.slave, self.slave.real
        return self.fold.skin, self.fold.heeded

    def divided(self, positions: Array) -> MortarPair:
        """The same with the sides of a fold at the positions (nodes, d)."""
        if self.fold is None:
            return self
        fold = self.fold.at(positions)
        if (fold.side == self.fold.side).all():
            return self
        return replace(self, slave=fold.skins[0], master=fold.skins[1], fold=fold)

    def at(self, positions: Array) -> MortarMeeting:
        """Where they meet at the positions (nodes, d) of all nodes of the model."""
        return MortarMeeting(self, positions)


def folded(
    slaves: Index, skin: Skin, free: Mask, x: Array, names: tuple[str, str] = ("slave", "slave")
) -> MortarPair:
    """One surface against itself, slaves (nc,) its nodes, undeformed at x (nodes, d)."""
    fold = Fold.of(skin, x, slaves)
    return MortarPair(slaves, *fold.skins, free, names, fold)


@dataclass(frozen=True, eq=False)
class MortarMeeting:
    """A pair at positions x (nodes, d); arrays are made when they are asked for."""

    pair: MortarPair
    x: Array

    @property
    def slaves(self) -> Index:
        """Nodes with a row, (nc,)."""
        return self.pair.slaves

    @property
    def axes(self) -> sparse.csr_array | None:
        """Those of the pair."""
        return self.pair.axes

    @cached_property
    def along(self) -> Array | None:
        """E of `surface_axes`, (nc, 2, 3); None for none."""
        return None if self.axes is None else (self.axes @ self.x).reshape(-1, 2, 3)

    @cached_property
    def facing(self) -> AgreedNormals:
        """What normals come from."""
        return AgreedNormals(self)

    @property
    def normals(self) -> Array:
        """n, (nc, d); zero where all facets around have shrunk to points."""
        return self.facing.unit

    # ---------------------------------------------------------------- averages
    @cached_property
    def row(self) -> Index:
        """Row of every node that may carry a force, (nodes,), -1 for none."""
        out, pair = np.full(len(self.x), -1, dtype=np.int64), self.pair
        out[pair.slaves] = np.arange(len(pair.slaves))
        if pair.fold is not None:
            out[pair.slaves[~pair.fold.carries(pair.slaves)]] = -1
        return out

    @cached_property
    def shared(self) -> Shared:
        """What the facets share."""
        return Shared.at(self.pair, self.x, self.row < 0)

    @cached_property
    def weights(self) -> Array:
        """D, (nc,), zero where nobody meets."""
        parts = self.shared
        nodes = self.pair.slave.nodes[parts.facets]
        weights = np.where(self.rows >= 0, parts.weights, 0.0)
        found = np.bincount(nodes.ravel(), weights.ravel(), minlength=len(self.x))
        return np.asarray(found[self.pair.slaves], dtype=np.float64)

    @property
    def met(self) -> Mask:
        """Slaves that meet the master, (nc,)."""
        return self.weights > 0

    @cached_property
    def growth(self) -> Array:
        """(1) of `grown_areas`, (nc,); 1 where nobody meets."""
        if self.pair.whole is None:
            return np.ones(len(self.slaves))
        return np.where(self.met, np.maximum(self.weights / self.pair.whole, LEAST), 1.0)

    @property
    def growth_slopes(self) -> sparse.csr_array:
        """Of these, (nc, nodes d)."""
        if self.pair.whole is None:
            return sparse.csr_array((len(self.slaves), self.x.size))
        return sparse.csr_array(sparse.diags_array(self.met / self.pair.whole)
                                @ self.slopes.weights.matrix)  # fmt: skip

    @cached_property
    def by_weight(self) -> Array:
        """1 / D, (nc,), zero where nobody meets."""
        return np.where(self.met, 1.0, 0.0) / np.where(self.met, self.weights, 1.0)

    @cached_property
    def rows(self) -> Index:
        """Rows of the slots that carry, (f, a), -1 for the others."""
        parts = self.shared
        of = np.append(self.row, -1)  # the last one: of none
        return of[np.where(parts.kept, self.pair.slave.nodes[parts.facets], -1)]

    @cached_property
    def averages(self) -> sparse.csr_array:
        """B, (nc, nodes); of nodes that do not meet nothing but 1 at the slave."""
        parts, pair = self.shared, self.pair
        nc, shape = len(pair.slaves), (len(pair.slaves), len(self.x))
        row, slave, master = self.rows, pair.slave, pair.master
        if not nc:  # all are held
            return sparse.csr_array(shape)
        scale = np.where(row >= 0, self.by_weight[row], 0.0)[:, :, None]
        left = scale * (parts.psi @ parts.mass) * ~parts.kept[:, None, :]
        a, b = left.shape[1], master.nodes.shape[1]
        onto = (scale * parts.psi)[parts.of] @ parts.cross[..., :b]
        own = np.ones((nc, 1, 1)), np.arange(nc)[:, None], pair.slaves[:, None]
        beside = left, row, slave.nodes[parts.facets]
        across = -onto, row[parts.of], master.nodes[parts.master]
        out = sum_of_blocks([own, beside, across], shape)
        if not self.has_bulges:
            return out
        raised = scale * (parts.chi @ parts.own[:, :, a:]), row, slave.middles[parts.facets]
        bent = (scale * parts.chi)[parts.of] @ parts.cross[..., b:]
        facing = -bent, row[parts.of], master.middles[parts.master]
        bent = sum_of_blocks([raised, facing], shape)
        return sum_of_products([(None, out), (bent, self.bulges)], shape)

    @property
    def has_bulges(self) -> bool:
        """True with facets of second order."""
        return any(skin.middles.shape[1] for skin in (self.pair.slave, self.pair.master))

    @cached_property
    def bulges(self) -> sparse.csr_array:
        """Bulges of middles of both sides by positions, (nodes, nodes)."""
        return self.pair.both.bulges(len(self.x))

    @cached_property
    def passed(self) -> Array:
        """pi, how much of lambda_p all nodes of the slave side get, (nc,): more beside an edge.

        There nodes without a force of their own leave their share to others.
        """
        if not self.shared.leaving.any():
            return np.ones(len(self.slaves))
        parts, row = self.shared, self.rows
        borne = (parts.psi @ parts.mass.sum(axis=2)[:, :, None])[:, :, 0]
        borne = np.bincount(row[row >= 0], borne[row >= 0], minlength=len(self.slaves))
        return np.where(self.met, borne * self.by_weight, 1.0)

    @property
    def met_averages(self) -> sparse.csr_array:
        """B without the rows of nodes that do not meet, (nc, nodes)."""
        if self.met.all():
            return self.averages
        found = self.averages
        data = found.data * np.repeat(self.met, np.diff(found.indptr))
        return sparse.csr_array((data, found.indices, found.indptr), shape=found.shape)

    @cached_property
    def closest(self) -> Index:
        """The master node closest to each slave, (nc,)."""
        from scipy.spatial import cKDTree

        if self.pair.fold is not None:
            return self.pair.fold.closest(self.pair.slaves, self.x)
        nodes = self.pair.master.all
        nearby = cKDTree(self.x[nodes]).query(self.x[self.pair.slaves])[1]
        return nodes[np.asarray(nearby, dtype=np.int64)]

    @cached_property
    def references(self) -> sparse.csr_array:
        """B, (nc, nodes), of nodes that do not meet: 1 at the slave, -1 at the closest."""
        away = np.flatnonzero(~self.met)
        if not len(away):
            return self.averages
        entries = (-np.ones(len(away)), (away, self.closest[away]))
        return sparse.csr_array(
            self.averages + sparse.csr_array(entries, shape=self.averages.shape)
        )

    @cached_property
    def approach(self) -> sparse.csr_array:
        """A' of (3') for the next step, (nc, nodes); no entries where nobody is open."""
        beside = self._beside
        shape = len(beside), len(self.x)
        if not beside.any():
            return sparse.csr_array(shape)
        parts, master = self.shared, self.pair.master
        share = (parts.psi[parts.of] @ parts.cross).sum(axis=2)  # (k, a)
        row = self.rows[parts.of]
        there = np.where((row >= 0)[:, :, None], (self.by_weight[:, None] * beside)[row], 0.0)
        slopes = master.gradients(self.x, parts.master)
        moved = share[:, :, None] * (there @ slopes.swapaxes(1, 2))
        found = sum_of_blocks([(moved, row, master.nodes[parts.master])], shape)
        return sparse.csr_array(sparse.diags_array(1 / self.passed) @ found)

    @cached_property
    def by_opening(self) -> Array:
        """1 / g' of (3'), (nc,), zero where a node is not open or meets nobody."""
        opened = self.met & (self.gap > 0)
        return np.where(opened, 1.0, 0.0) / np.where(opened, self.gap, 1.0)

    @cached_property
    def _beside(self) -> Array:
        """d of (3'), (nc, d)."""
        parts, n, row = self.shared, self.normals, self.rows[self.shared.of]
        opened = np.where(self.met, np.maximum(self.gap, 0.0), 0.0)
        _, facing, _ = shapes(self.pair.master, self.x)
        share = (parts.psi[parts.of] @ parts.cross).sum(axis=2)
        theirs, kept = np.zeros(n.shape), row >= 0
        np.add.at(theirs, row[kept], (share[:, :, None] * facing[parts.master][:, None])[kept])
        size = np.linalg.norm(theirs, axis=1)
        theirs /= np.where(size > 0, size, 1.0)[:, None]
        mean = n + theirs
        along = (mean * theirs).sum(axis=1)
        turned = np.where(along > ACROSS, along, np.inf)
        way = n - mean * ((n * theirs).sum(axis=1) / turned)[:, None]
        return np.where((along > ACROSS)[:, None], opened[:, None] * way, 0.0)

    def closed_by(self, earlier: MortarMeeting) -> Array:
        """1 - g / g' of (3'), (nc,), zero where nobody was open or is met no more."""
        both = self.met & earlier.met & (earlier.by_opening > 0)
        return np.where(both, 1 - self.gap * earlier.by_opening, 0.0)

    @cached_property
    def distances(self) -> Array:
        """G, (nc, d)."""
        return self.references @ self.x / self.passed[:, None]

    @cached_property
    def gap(self) -> Array:
        """g, (nc,); of nodes that do not meet their distance."""
        along = (self.normals * self.distances).sum(axis=1) + self.pair.offset
        return np.where(self.met, along, np.linalg.norm(self.distances, axis=1))

    def motion(self, earlier: MortarMeeting) -> Array:
        """s of (3), (nc, d), since `earlier`, at the end of the last step; 0 of the lone."""
        known = (self.met * earlier.remembered)[:, None]
        out = earlier.averages @ self.x / earlier.passed[:, None] - self.distances
        if earlier.approach.nnz:
            out -= self.closed_by(earlier)[:, None] * (earlier.approach @ self.x)
        out = np.where(known > 0, known * out, 0.0)
        newcomers = self.newcomers(earlier)
        return out if newcomers is None else out + newcomers.motion

    @cached_property
    def remembered(self) -> Array:
        """Part (nc,) of the motion since here that averages tell: w of `fading`, 0 of none."""
        return np.where(self.met, 1.0 if self.fading is None else self.fading.weights, 0.0)

    def newcomers(self, earlier: MortarMeeting) -> Newcomers | None:
        """Nodes that meet now, and hardly did at the end of the last step; None for none."""
        return Newcomers.between(self, earlier)

    @cached_property
    def fading(self) -> Fading | None:
        """What fades of nodes that hardly anything faces; None for none."""
        if self.pair.areas is None or not len(self.slaves):
            return None
        found = Fading(self, self.pair.areas)
        return found if found.hardly.any() else None

    @cached_property
    def couples(self) -> Couples:
        """What leaves the forces without a moment."""
        return Couples(self, self.x)

    @cached_property
    def slopes(self) -> MortarSlopes:
        """Derivatives by the positions of all nodes."""
        return MortarSlopes(self)
