"""Contact pairs where the bodies are now: gap, normal, and who takes the force.

A pair is a set of slave nodes and another side.  At the positions x of all nodes it says of
each slave node p, with N_a the shape functions of the nodes that stand in front of it,

    gap g_p(x), normal n_p(x); a force lambda_p acts on p and -N_a lambda_p on node a.     (1)

An obstacle is a pair whose other side has no unknowns: nobody takes -lambda.  Another side that
deforms needs a second `Pair`, and rows of its nodes in `LargeDeformation`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .geometry import Obstacle

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Pair(Protocol):
    """Slave nodes and another side."""

    def at(self, positions: Array) -> Meeting:
        """Where they meet at the positions (nodes, d) of all nodes of the model."""
        ...


@dataclass(frozen=True, eq=False)
class Meeting:
    """A pair at some positions; side: the other side at rest, as an obstacle.

    slaves (nc,), masters (nc, a): nodes; x (nc, d): where the slaves are; shapes (nc, a): N_a.
    """

    side: Obstacle
    slaves: Index
    x: Array
    masters: Index
    shapes: Array


@dataclass(frozen=True, eq=False)
class ObstaclePair:
    """Slave nodes (nc,) of the model in front of an obstacle."""

    obstacle: Obstacle
    slaves: Index

    def at(self, positions: Array) -> Meeting:
        """Without masters."""
        none = np.zeros((len(self.slaves), 0))
        return Meeting(
            self.obstacle, self.slaves, positions[self.slaves], none.astype(np.int64), none
        )


@dataclass(frozen=True, eq=False)
class Meetings:
    """All pairs of a model at some positions, one after another: nc contacts."""

    parts: Sequence[Meeting]

    def _joined(self, name: str) -> Array:
        return np.concatenate([getattr(part.side, name)(part.x) for part in self.parts])

    @cached_property
    def gap(self) -> Array:
        """(nc,)."""
        return self._joined("gap")

    @cached_property
    def normals(self) -> Array:
        """(nc, d)."""
        return self._joined("normals")

    @cached_property
    def gap_slopes(self) -> Array:
        """Derivatives of the gaps by the place of the slave, (nc, d)."""
        return self._joined("gap_slopes")

    @cached_property
    def normal_slopes(self) -> Array:
        """Derivatives of the normals by the place of the slave, (nc, d, d)."""
        return self._joined("normal_slopes")

    def shares(self, nodes: int) -> sparse.csr_array:
        """(1) as a matrix (nc, nodes): 1 at the slave, -N_a at the nodes in front of it.

        Times displacements (nodes, d) the motion against the other side; its transpose times
        forces lambda (nc, d) those on all nodes.
        """
        values, columns, counts = [], [], []
        for part in self.parts:
            own = np.ones((len(part.slaves), 1))
            values.append(np.hstack([own, -part.shapes]).ravel())
            columns.append(np.hstack([part.slaves[:, None], part.masters]).ravel())
            counts.append(np.full(len(own), 1 + part.shapes.shape[1]))
        pointers = np.concatenate([[0], np.cumsum(np.concatenate(counts))])
        entries = (np.concatenate(values), np.concatenate(columns), pointers)
        return sparse.csr_array(entries, shape=(len(pointers) - 1, nodes))

    def columns(self, axes: Array, nodes: int) -> sparse.csc_array:
        """H (nodes d, nc d): column p d + k holds the forces of a unit along axis k of p.

        axes (nc, d, d): the frames of the contacts.
        """
        nc, d = axes.shape[:2]
        spread = sparse.kron(self.shares(nodes).T, np.eye(d), format="csr")
        local = (axes.swapaxes(1, 2), np.arange(nc), np.arange(nc + 1))
        return sparse.csc_array(spread @ sparse.bsr_array(local, shape=(nc * d,) * 2).tocsr())
