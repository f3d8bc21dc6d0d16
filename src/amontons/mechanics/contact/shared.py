"""What facets of two surfaces share: integrals, dual functions, and which nodes carry force.

Notation is that of `current_mortar`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .dual import dual_functions, nodes_with_multiplier
from .facet_integrals import FacetPairs
from .facing import Skin, candidates, nearest, seen_through, shapes

if TYPE_CHECKING:
    from .current_mortar import MortarPair

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
HARDLY = 0.1  # part of a node's area that has to face the master for it to carry force
SLIVER = 1e-8  # part of a facet; biorthogonal functions on less are lost in rounding


@dataclass(frozen=True, eq=False)
class Shared:
    """k pairs of facets, slave and master (k,), on `facets` (f,) of the slave; of (k,): which.

    own (f, a, a + e), cross (k, a, b + h): integrals with corners and middles of slave and
    master; psi (f, a, a): A of `current_slopes`; kept (f, a): slots that carry force.
    """

    slave: Index
    master: Index
    facets: Index
    of: Index
    own: Array
    cross: Array
    psi: Array
    kept: Mask

    @classmethod
    def at(cls, pair: MortarPair, x: Array, without: Mask) -> Shared:
        """At positions x (nodes, d); without (nodes,): those that have no row."""
        slave, master, fold = pair.slave, pair.master, pair.fold
        of, other = candidates(slave, master, x) if fold is None else fold.candidates(x)
        own, cross = FacetPairs.of(slave, of, master, other, x).integrals()
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
        there = there[nearest(of[there], area[there], gap[there], whole)]
        reached = np.bincount(of[there], area[there], minlength=len(whole))
        there = there[(reached > SLIVER * whole)[of[there]]]
        of, other, cross = of[there], other[there], cross[there]
        facets, numbers = np.unique(of, return_inverse=True)
        total = np.zeros((len(facets), *own.shape[1:]))
        np.add.at(total, numbers, own[there])
        mass = total[:, :, :a]
        least = HARDLY if pair.areas is None else 0.0
        kept = _carrying(slave, facets, mass, whole, without, least)
        psi = dual_functions(mass, kept, slave.real[facets])
        return cls(of, other, facets, numbers, total, cross, psi, kept)

    @property
    def mass(self) -> Array:
        """int phi phi, (f, a, a)."""
        return self.own[:, :, : self.own.shape[1]]

    @property
    def weights(self) -> Array:
        """W, (f, a)."""
        return np.where(self.kept, self.mass.sum(axis=2), 0.0)

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
