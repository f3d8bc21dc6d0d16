"""Parts of a slave facet that several masters cover, one in front of the other.

Masters of one pair may be bodies side by side, whose ends overlap as they bulge: what faces
both counts once, of the nearer one.  Pieces g of the master are surfaces that hang together;
with A_g what of a slave facet of area A faces g, the nearest first, pairs of facets of g count

    w_g = min(1, (A - sum_{h nearer} A_h) / A_g),   0 where negative,                       (1)

of what they share, which is continuous as ends pass: to leave out pairs that do not fit made
averages jump there, and Newton's steps found no state in between.  By all positions

    dw_g = (dA - sum_{h nearer} dA_h - w_g dA_g) / A_g.                                     (2)

So integrals of a pair change with facets that are none of it: those derivatives stand in pairs
of their own, `extra`, which share nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .facing import TWICE, nearest

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def shares(
    of: Index, piece: Index, area: Array, seen: Array, gap: Array, whole: Array
) -> Array:
    """w of (1), (k,), of pairs; 0 of what is behind others of its own piece, too.

    of, piece (k,): slave facet and piece of the master; area, gap (k,) of what they share,
    seen (k,) the area before it fades by `opposed`; whole: areas of slave facets.
    """
    own, group = np.unique(np.stack([of, piece]), axis=1, return_inverse=True)
    group = group.ravel()
    first = nearest(group, seen, gap, whole[own[0]])
    if own.shape[1] == len(np.unique(of)):
        return first.astype(float)
    covered = np.bincount(group, area * first)
    apart = np.abs(np.bincount(group, area * gap * first)) / covered
    order = np.lexsort((apart, own[0]))
    facet, covered = own[0][order], covered[order]
    total = np.cumsum(covered) - covered
    begins = np.ones(len(order), dtype=bool)
    begins[1:] = np.diff(facet) > 0
    before = total - np.maximum.accumulate(np.where(begins, total, 0.0))
    left = whole[facet] - before
    part = np.where(left > TWICE * whole[facet], np.minimum(left / covered, 1.0), 0.0)
    part = np.where(before + covered <= (1 + TWICE) * whole[facet], 1.0, part)
    by_group = np.empty(len(order))
    by_group[order] = part
    return np.asarray(by_group[group] * first)


@dataclass(frozen=True, eq=False)
class Cut:
    """Of k pairs those of q facets that count by a part, and what their part depends on.

    share (k,): w; facets (q,): which; area, own (q, ...): A_g and the integrals of g on its
    own side; first (q,): one of the pairs of g; pairs, group (l,): those of g and nearer ones,
    and which facet's; owner, link (v,): pairs of g, and which of (l,) they depend on besides.
    """

    share: Array
    facets: Index
    area: Array
    own: Array
    first: Index
    pairs: Index
    group: Index
    owner: Index
    link: Index

    @classmethod
    def of(cls, of: Index, share: Array, own: Array) -> Cut | None:
        """From facets and w (k,) of pairs, and integrals (k, a, a + e); None for w = 1."""
        cut = share < 1
        if not cut.any():
            return None
        facets, first, number = np.unique(of[cut], return_index=True, return_inverse=True)
        total = np.zeros((len(facets), *own.shape[1:]))
        np.add.at(total, number, own[cut])
        area = total[:, :, : own.shape[1]].sum(axis=(1, 2))
        pairs = np.flatnonzero(np.isin(of, facets))
        group = np.searchsorted(facets, of[pairs])
        members = np.flatnonzero(cut)
        order, many = np.argsort(group, kind="stable"), np.bincount(group)
        each = many[number]
        begin = np.repeat((np.cumsum(many) - many)[number] - (np.cumsum(each) - each), each)
        link = order[begin + np.arange(len(begin))]
        owner = np.repeat(members, each)
        return cls(share, facets, area, total, members[first], pairs, group, owner, link)

    @property
    def extra(self) -> Index:
        """Pairs (x,) whose integrals depend on facets of other pairs, each as often."""
        return self.owner[self.owner != self.pairs[self.link]]

    def slopes(self, own: Array, cross: Array, values: Array, whole: Array
               ) -> tuple[Array, Array, Index]:  # fmt: skip
        """Derivatives of own (k, a, a + e, w) and cross (k + x, a, b + h, w), and whose dofs.

        From those without w and values (k, a, b + h), w times cross; whole (q, a d): dA by
        the corners of the facets.
        """
        a = own.shape[1]
        part = self.share[self.pairs]
        grown = own[self.pairs][:, :, :a].sum(axis=(1, 2))
        grown *= -(part / self.area[self.group])[:, None]  # of (2)
        own, cross = (s * self.share[:, None, None, None] for s in (own, cross))
        own[self.pairs] += self.own[self.group][..., None] * grown[:, None, None]
        by = np.zeros((len(self.facets), own.shape[3]))
        by[:, : whole.shape[1]] = whole / self.area[:, None]
        own[self.first] += self.own[..., None] * by[:, None, None]
        without = values / self.share[:, None, None]
        there = np.flatnonzero(self.share < 1)
        at = np.searchsorted(self.facets, self._facet_of(there))
        cross[there] += without[there][..., None] * by[at][:, None, None]
        through = without[self.owner][..., None] * grown[self.link][:, None, None]
        other = self.pairs[self.link]
        mine = self.owner == other
        cross[self.owner[mine]] += through[mine]
        return own, np.concatenate([cross, through[~mine]]), other[~mine]

    def _facet_of(self, pairs: Index) -> Index:
        """The facets of pairs among `pairs`."""
        return self.facets[self.group[np.searchsorted(self.pairs, pairs)]]
