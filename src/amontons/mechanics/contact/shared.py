"""What facets of two surfaces share: integrals, dual functions, and which nodes carry force.

Notation is that of `current_mortar`.  On a facet of which a part c faces the master psi of
nodes far from that part extrapolate from it: what is linear rightly, but bulges are told
several times too large, in space up to ten times.  Friction then works on other motions than
it hears, and no state need exist in which nodes stick or slip.  Bulges are averaged by

    chi = theta psi + (1 - theta) phi,    theta = t^2 (3 - 2 t),  t = c^2,                  (1)

phi with the shares of nodes that carry nothing: chi = psi where all of a facet faces the
master, and their sum is 1 everywhere, so that uniform tractions press bulges as they should.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .dual import dual_functions, nodes_with_multiplier, sharing_functions
from .facet_integrals import FacetPairs
from .facing import Skin, aside, candidates, seen_through, shapes
from .layers import Cut, shares

if TYPE_CHECKING:
    from .current_mortar import MortarPair

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
HARDLY = 0.1  # part of a node's area that has to face the master for it to carry force
ROUNDING = 1e-12  # of a facet: what does not face the master where all of it does
SLIVER = 1e-8  # part of a facet; biorthogonal functions on less are lost in rounding


@dataclass(frozen=True, eq=False)
class Shared:
    """k pairs of facets, slave and master (k,), on `facets` (f,) of the slave; of (k,): which.

    own (f, a, a + e), cross (k, a, b + h): integrals with corners and middles of slave and
    master; psi (f, a, a): A of `current_slopes`; kept (f, a): slots that carry force; even
    (f, a, a): phi of (1) in phi; covered (f,): c; opposed (k,): o of `opposed`.  cut: of pairs
    that count by a part, after which stand those that only change with them, without anything
    shared.
    """

    slave: Index
    master: Index
    facets: Index
    of: Index
    own: Array
    cross: Array
    psi: Array
    kept: Mask
    even: Array
    covered: Array
    opposed: Array
    cut: Cut | None = None

    @classmethod
    def at(cls, pair: MortarPair, x: Array, without: Mask) -> Shared:
        """At positions x (nodes, d); without (nodes,): those that have no row."""
        slave, master, fold = pair.slave, pair.master, pair.fold
        of, other = candidates(slave, master, x) if fold is None else fold.candidates(x)
        pairs = FacetPairs.of(slave, of, master, other, x)
        (own, cross), opposed = pairs.integrals(), pairs.opposed
        a = own.shape[1]
        p, q = slave.values(x)[of], master.values(x)[other]
        area = own[:, :, :a].sum(axis=(1, 2))
        vectors = slave.areas(x)
        whole = np.linalg.norm(vectors, axis=1)
        between = np.einsum("kb,kbc->kc", cross.sum(axis=1), q)
        between -= np.einsum("ka,kac->kc", own.sum(axis=1), p)
        gap = np.einsum("kc,kc->k", between, vectors[of])
        gap /= np.where(area > 0, area, 1.0) * whole[of]
        there = np.flatnonzero(area > 0)
        if fold is None and (gap[there] < 0).any():
            length = 2 * shapes(master, x)[2]
            there = there[~seen_through(other[there], gap[there], length)]
            behind = there[gap[there] < 0]
            lost = behind[aside(slave, master, x, of[behind], other[behind])]
            there = np.setdiff1d(there, lost, assume_unique=True)
        piece = np.zeros(len(there), dtype=np.int64) if fold else master.pieces[other[there]]
        seen = area[there] / opposed[there]
        part = shares(of[there], piece, area[there], seen, gap[there], whole)
        reached = np.bincount(of[there], part * seen, minlength=len(whole))
        heeded = (part > 0) & (reached > SLIVER * whole)[of[there]]
        there, part = there[heeded], part[heeded]
        of, other, own, opposed = of[there], other[there], own[there], opposed[there]
        cut, cross = Cut.of(of, part, own), cross[there] * part[:, None, None]
        facets, numbers = np.unique(of, return_inverse=True)
        total = np.zeros((len(facets), *own.shape[1:]))
        np.add.at(total, numbers, own * part[:, None, None])
        if cut is not None:
            more = np.concatenate([np.arange(len(of)), cut.extra])
            of, other, numbers = of[more], other[more], numbers[more]
            opposed = opposed[more]
            cross = np.concatenate([cross, np.zeros((len(cut.extra), *cross.shape[1:]))])
        mass = total[:, :, :a]
        least = HARDLY if pair.areas is None else 0.0
        kept = _carrying(slave, facets, mass, whole, without, least)
        psi = dual_functions(mass, kept, slave.real[facets])
        even = sharing_functions(kept, slave.real[facets])
        covered = mass.sum(axis=(1, 2)) / whole[facets]
        covered = np.where(np.abs(covered - 1) < ROUNDING, 1.0, covered)
        return cls(of, other, facets, numbers, total, cross, psi, kept, even, covered, opposed,
                   cut)  # fmt: skip

    @cached_property
    def leaving(self) -> Mask:
        """Slots (f, a) of nodes that leave their share to others."""
        borne = np.asarray(self.kept.any(axis=1))[:, None]
        return ~self.kept & (self.mass.sum(axis=2) > 0) & borne

    @property
    def mass(self) -> Array:
        """int phi phi, (f, a, a)."""
        return self.own[:, :, : self.own.shape[1]]

    @property
    def weights(self) -> Array:
        """W, (f, a)."""
        return np.where(self.kept, self.mass.sum(axis=2), 0.0)

    @cached_property
    def blend(self) -> tuple[Array, Array]:
        """theta of (1) and its derivative by c, (f,) each."""
        c = np.minimum(self.covered, 1.0)
        t = c * c
        return t * t * (3 - 2 * t), 12 * c * t * (1 - t)

    @cached_property
    def chi(self) -> Array:
        """chi of (1) in phi, (f, a, a)."""
        theta = self.blend[0][:, None, None]
        return theta * self.psi + (1 - theta) * self.even

    @property
    def inverse(self) -> Array:
        """Q, (f, a, a)."""
        return self.psi / np.where(self.kept, self.weights, 1.0)[:, :, None]


def _carrying(  # noqa: PLR0913
    slave: Skin, facets: Index, mass: Array, whole: Array, without: Mask, least: float
) -> Mask:
    """Slots (f, a) of facets (f,) that carry force; whole: areas of all slave facets.

    least: part of a node that has to face the master.
    """
    n = len(without)
    share = (whole / slave.corners)[:, None] * slave.real
    around = np.bincount(slave.nodes.ravel(), share.ravel(), minlength=n)
    nodes, real = slave.nodes[facets], slave.real[facets]
    reached = np.bincount(nodes.ravel(), mass.sum(axis=2).ravel(), minlength=n)
    reached = reached / np.where(around > 0, around, 1.0)
    kept = nodes_with_multiplier(nodes, real, without, reached < least, reached)
    return kept[nodes] & real
