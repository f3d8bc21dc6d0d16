"""What a model knows of the unknowns of its problem; else it is guessed of M and H."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import expect_shape

Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Structure:
    """Node, component and body of every unknown, and the slave node of every contact.

    place (n,), node by node: dimension * node + component; piece (nodes,): number of the
    connected body that a node belongs to; slave (nc,): node that no other contact moves.
    """

    place: Index
    dimension: int
    piece: NDArray[np.int32]
    slave: Index

    @property
    def node(self) -> Index:
        """Node of every unknown, (n,)."""
        return self.place // self.dimension

    @property
    def component(self) -> Index:
        """Direction of every unknown, (n,), from 0 on."""
        return self.place % self.dimension

    @property
    def body(self) -> NDArray[np.int32]:
        """Body of every unknown, (n,)."""
        return self.piece[self.node]

    def at(self, contacts: Index, unknowns: Index | None = None) -> Structure:
        """That of a problem with some of the contacts, (k,), and of the unknowns, if given."""
        place = self.place if unknowns is None else self.place[unknowns]
        return replace(self, place=place, slave=self.slave[contacts])

    def check(self, unknowns: int, contacts: int) -> None:
        """Raise InvalidInput unless it is that of a problem of this size."""
        expect_shape("structure.place", self.place.shape, (unknowns,))
        expect_shape("structure.slave", self.slave.shape, (contacts,))
