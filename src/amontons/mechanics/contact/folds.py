"""One surface in contact with itself: which of its facets are slaves, and of which masters.

At given positions facets *face* each other where their normals oppose, one lies in front of the
other and they overlap seen along the normals; at most FAR of their radii away.  Facets that
share a node do not, nor do those that see each other through the body, whose depth below each
facet is known of the undeformed state.  Two sides of a gap shall get different sides of
contact, and facets beside each other the same one.  Both at once is not always possible (where
a fold ends): pairs are heeded in the order of their distance, neighbours in that of the farther
one's distance from what it faces, each unless what was decided before contradicts: a spanning
tree of least weight, coloured from its first facet.  So what is in contact is of one side as
far as it goes, whatever it sees far away; else sides there would change as bodies move on.
Nodes of facets of both sides carry no force of their own.

The sides are those of the positions at the beginning of a step, so that they do not change
within it; they depend on nothing else.

[YL] B. Yang, T. Laursen, "A large deformation mortar formulation of self contact with finite
sliding", CMAME 197 (2008) 756-772: sides by the distance too, without through-body distances.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .facing import THROUGH, Skin, candidates, shapes

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
REACHES = (4.0, 16.0, 64.0)  # radii of facets in which others are sought, one after another
FAR = REACHES[-1]
CHUNK = 2000  # facets at a time, for memory
BESIDE = 4.0  # sizes of two facets by which they may pass each other within a step
SLAVE, MASTER, NEITHER = 0, 1, -1


@dataclass(frozen=True, eq=False)
class Fold:
    """A surface with its sides.

    skin; depth (f,): of the body below its facets; held (f,): nodes of these that can carry no
    force, as supports hold them; side (f,).
    """

    skin: Skin
    depth: Array
    held: Index
    side: Index

    @classmethod
    def of(cls, skin: Skin, x: Array, carrying: Index | None = None) -> Fold:
        """The surface at the undeformed positions x (nodes, d).

        carrying: nodes that may carry forces, all of them by default.
        """
        depth = np.full(len(skin.nodes), np.inf)
        for found in _opposite(skin, x, FAR):
            behind = (found.ahead < 0) & (found.back < 0) & (found.aside < 1)
            np.minimum.at(depth, found.one[behind], -found.ahead[behind])
        held = np.zeros_like(skin.real)
        if carrying is not None:
            held = skin.real & ~np.isin(skin.nodes, carrying)
        none = np.zeros(len(skin.nodes), dtype=np.int64)
        return cls(skin, depth, held.sum(axis=1), none).at(x)

    def at(self, x: Array) -> Fold:
        """The same with the sides of the positions x (nodes, d)."""
        one, other, apart, takes_part = self._facing(x)
        beside = self._beside
        distance = np.concatenate([apart, self._apart_as(x, one, other, apart)])
        rows = np.concatenate([one, beside[0]])
        columns = np.concatenate([other, beside[1]])
        unlike = np.arange(len(rows)) < len(one)
        order = np.lexsort((columns, rows, ~unlike, distance))
        rows, columns, unlike = rows[order], columns[order], unlike[order]
        rank = np.arange(1, len(rows) + 1)  # none twice: one tree of least weight
        f = len(self.skin.nodes)
        tree = sparse.csgraph.minimum_spanning_tree(
            sparse.csr_array(sparse.coo_array((rank, (rows, columns)), shape=(f, f)))
        ).tocoo()
        differs = sparse.coo_array(
            (unlike[tree.data.astype(np.int64) - 1], (tree.row, tree.col)), shape=(f, f)
        )
        side = _coloured(sparse.csr_array(tree), sparse.csr_array(differs), self.held)
        return replace(self, side=np.where(takes_part, side, NEITHER))

    def _apart_as(self, x: Array, one: Index, other: Index, apart: Array) -> Array:
        """Distances at which neighbours are heeded, (k,) of `_beside`; infinite: last.

        That of the farther one of both from what it faces; more the more they are bent.
        """
        near = np.full(len(self.skin.nodes), np.inf)
        np.minimum.at(near, one, apart)
        np.minimum.at(near, other, apart)
        first, second = self._beside
        _, normal, _ = shapes(self.skin, x)
        flat = np.maximum((1 + (normal[first] * normal[second]).sum(axis=1)) / 2, 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.maximum(near[first], near[second]) / flat

    def _facing(self, x: Array) -> tuple[Index, Index, Array, Mask]:
        """Pairs of facets (k,), (k,), every pair once, that face each other; their distance.

        And which facets (f,) do so, or would where they are moved along by BESIDE.
        """
        todo = np.ones(len(self.skin.nodes), dtype=bool)
        takes_part = np.zeros(len(todo), dtype=bool)
        parts = [np.zeros((0, 2), dtype=np.int64)]
        for reach in REACHES:
            for found in _opposite(self.skin, x, reach, np.flatnonzero(todo)):
                least = -THROUGH * np.minimum(self.depth[found.one], self.depth[found.other])
                ahead = (found.ahead > least) & (found.back > least)
                pairs = np.stack([found.one, found.other], axis=1)
                takes_part[pairs[ahead]] = True
                parts.append(pairs[ahead & (found.aside < 1)])
                todo[parts[-1]] = False
        pairs = np.unique(np.sort(np.concatenate(parts), axis=1), axis=0)
        centre, _, _ = shapes(self.skin, x)
        apart = np.linalg.norm(centre[pairs[:, 1]] - centre[pairs[:, 0]], axis=1)
        return pairs[:, 0], pairs[:, 1], apart, takes_part

    @cached_property
    def _beside(self) -> tuple[Index, Index]:
        """Pairs of facets that share a side, in 2D a node; every pair once."""
        skin, f = self.skin, len(self.skin.nodes)
        a = skin.nodes.shape[1]
        facet = np.broadcast_to(np.arange(f)[:, None], skin.nodes.shape)[skin.real]
        on = sparse.csr_array((np.ones(len(facet)), (facet, skin.nodes[skin.real])))
        common = sparse.coo_array(sparse.triu(on @ on.T, 1))
        shared = common.data >= (1 if a == 2 else 2)
        return tuple(np.asarray(k[shared], dtype=np.int64) for k in common.coords)  # type: ignore[return-value]

    @cached_property
    def heeded(self) -> Mask:
        """Nodes of facets, (f, a), in whose normals these have a part."""
        nodes, takes_part = self.skin.nodes, self.side != NEITHER
        alone = ~np.isin(nodes, nodes[takes_part])
        return self.skin.real & (takes_part[:, None] | alone)

    @cached_property
    def halves(self) -> tuple[Index, Index]:
        """Facets of slave and master."""
        return np.flatnonzero(self.side == SLAVE), np.flatnonzero(self.side == MASTER)

    @cached_property
    def skins(self) -> tuple[Skin, Skin]:
        """The two sides."""
        slave, master = self.halves
        return self.skin.part(slave), self.skin.part(master)

    def candidates(self, x: Array) -> tuple[Index, Index]:
        """Facets (k,) and (k,) of both `skins` that may share something, as in `facing`."""
        (slave, master), (over, under) = self.halves, self.skins
        if not (len(slave) and len(master)):
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        first, second = candidates(over, under, x)
        (centre, normal, _), (there, facing, _) = shapes(over, x), shapes(under, x)
        way = there[second] - centre[first]
        least = -THROUGH * np.minimum(self.depth[slave[first]], self.depth[master[second]])
        kept = (way * normal[first]).sum(axis=1) > least
        kept &= -(way * facing[second]).sum(axis=1) > least
        return first[kept], second[kept]

    def carries(self, slaves: Index) -> Mask:
        """Which nodes (nc,) may carry forces: those of no master facet."""
        over, under = self.skins
        return np.isin(slaves, over.all) & ~np.isin(slaves, under.all)

    def closest(self, slaves: Index, x: Array) -> Index:
        """The closest node of the other side for each of the nodes (nc,); else the farthest."""
        from scipy.spatial import cKDTree

        carries = self.carries(slaves)
        sides = (self.skins[1].all, slaves[carries])
        nodes = self.skin.all
        away = np.linalg.norm(x[nodes] - x[slaves].mean(axis=0), axis=1).argmax()
        out = np.full(len(slaves), nodes[away])
        for mine, theirs in zip((carries, ~carries), sides, strict=True):
            if mine.any() and len(theirs):
                near = cKDTree(x[theirs]).query(x[slaves[mine]])[1]
                out[mine] = theirs[np.asarray(near, dtype=np.int64)]
        return out


@dataclass(frozen=True, eq=False)
class _Opposite:
    """Pairs of facets one, other (k,).

    ahead, back (k,): how far each lies ahead of the other's plane; aside (k,): how far they are
    beside each other, over their sizes: overlapping below 1.
    """

    one: Index
    other: Index
    ahead: Array
    back: Array
    aside: Array


def _opposite(
    skin: Skin, x: Array, reach: float, chosen: Index | None = None
) -> Iterator[_Opposite]:
    """Pairs of facets without common nodes whose normals oppose, beside each other by BESIDE.

    reach: of the search, in radii of the chosen facets (all).
    """
    from scipy.spatial import cKDTree

    centre, normal, radius = shapes(skin, x)
    chosen = np.arange(len(centre)) if chosen is None else chosen
    tree = cKDTree(centre)
    for start in range(0, len(chosen), CHUNK):
        some = chosen[start : start + CHUNK]
        lists = tree.query_ball_point(centre[some], reach * radius[some], return_sorted=True)
        one = np.repeat(some, [len(near) for near in lists])
        other = np.concatenate([np.asarray(near, dtype=np.int64) for near in lists])
        kept = (normal[one] * normal[other]).sum(axis=1) < 0
        one, other = one[kept], other[kept]
        way = centre[other] - centre[one]
        ahead = (way * normal[one]).sum(axis=1)
        back = -(way * normal[other]).sum(axis=1)
        aside = np.linalg.norm(way - ahead[:, None] * normal[one], axis=1)
        aside = aside / (radius[one] + radius[other])
        kept = aside < BESIDE
        kept &= ~(skin.nodes[one][:, :, None] == skin.nodes[other][:, None]).any(axis=(1, 2))
        yield _Opposite(one[kept], other[kept], ahead[kept], back[kept], aside[kept])


def _coloured(tree: sparse.csr_array, differs: sparse.csr_array, held: Index) -> Index:
    """SLAVE or MASTER (f,) along a forest, the first facet of each tree a slave.

    differs: edges of it whose ends are of different sides; held (f,): nodes that carry nothing,
    more of which a master has.
    """
    f = tree.shape[0]
    out = np.full(f, -1, dtype=np.int64)
    other_way = (differs + differs.T).tolil()
    for first in range(f):
        if out[first] >= 0:
            continue
        order, before = sparse.csgraph.breadth_first_order(tree, first, directed=False)
        out[first] = SLAVE
        for facet in order[1:]:
            out[facet] = out[before[facet]] ^ int(other_way[facet, before[facet]])
        borne = out[order] == SLAVE
        if held[order][borne].sum() > held[order][~borne].sum():
            out[order] ^= 1
    return out
