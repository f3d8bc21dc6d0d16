"""Contact pairs where the bodies are now: gap, normal, motion, and who takes the force.

A pair is a set of slave nodes and another side.  At the positions x of all nodes it says of
each slave node p, with the averages B of `current_mortar`,

    gap g_p(x), normal n_p(x), motion s_p(x) since the last step;
    a force lambda_p acts on p and -B_pj lambda_p on the other nodes j, and               (1)
    what `couples` add on the master.

An obstacle is a pair whose other side has no unknowns: B is 1 at p, nobody takes -lambda.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...linear.sums import by_components
from .carried import TiedMeeting, TiedPair
from .current_mortar import MortarMeeting, MortarPair
from .fading import Fading, Mixture
from .geometry import Obstacle, frames
from .grown_areas import GrownAreas
from .surface_axes import carried_frames

if TYPE_CHECKING:
    from .current import CurrentContact

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]


class Pair(Protocol):
    """Slave nodes (nc,) and another side."""

    @property
    def slaves(self) -> Index:
        """Nodes with a row."""
        ...

    def at(self, positions: Array) -> AnyMeeting:
        """Where they meet at the positions (nodes, d) of all nodes of the model."""
        ...


@dataclass(frozen=True, eq=False)
class Meeting:
    """A pair with an obstacle `side` at some positions.

    slaves (nc,): nodes; positions (nodes, d): of all nodes; offset (nc,): of the gaps; axes,
    along: of `Meetings`, None for none; areas: around the slaves, None where they stay.
    """

    side: Obstacle
    slaves: Index
    positions: Array
    offset: Array | float = 0.0
    axes: sparse.csr_array | None = None
    along: Array | None = None
    areas: GrownAreas | None = None

    @cached_property
    def x(self) -> Array:
        """Where the slaves are, (nc, d)."""
        return self.positions[self.slaves]

    @property
    def nodes(self) -> int:
        """Of the model."""
        return len(self.positions)

    @cached_property
    def growth(self) -> Array:
        """(1) of `grown_areas`, (nc,)."""
        if self.areas is None:
            return np.ones(len(self.slaves))
        return self.areas.at(self.positions)

    @property
    def growth_slopes(self) -> sparse.csr_array:
        """Of these, (nc, nodes d)."""
        if self.areas is None:
            return sparse.csr_array((len(self.slaves), self.positions.size))
        return self.areas.slopes(self.positions)

    @property
    def met(self) -> Mask:
        """All slaves, (nc,)."""
        return np.ones(len(self.slaves), dtype=bool)

    @property
    def passed(self) -> Array:
        """Parts of the forces that the slave's side gets, (nc,): all."""
        return np.ones(len(self.slaves))

    @property
    def averages(self) -> sparse.csr_array:
        """B, (nc, nodes)."""
        nc = len(self.slaves)
        entries = (np.ones(nc), (np.arange(nc), self.slaves))
        return sparse.csr_array(entries, shape=(nc, self.nodes))

    @cached_property
    def gap(self) -> Array:
        """(nc,)."""
        return self.side.gap(self.x) + self.offset

    @cached_property
    def normals(self) -> Array:
        """(nc, d)."""
        return self.side.normals(self.x)


AnyMeeting = Meeting | MortarMeeting | TiedMeeting


def between_bodies(pair: Pair) -> MortarPair | None:
    """The mortar pair that a pair of two bodies is or comes from; None with an obstacle."""
    if isinstance(pair, TiedPair):
        return pair.pair
    return pair if isinstance(pair, MortarPair) else None


@dataclass(frozen=True, eq=False)
class ObstaclePair:
    """Slave nodes (nc,) of the model in front of an obstacle; offset (nc,): of their gaps.

    axes (2 nc, nodes): c of `surface_axes`, of tangents that the slave carries; None for none.
    areas: around the slaves, None where they stay.
    """

    obstacle: Obstacle
    slaves: Index
    offset: Array | float = 0.0
    axes: sparse.csr_array | None = None
    areas: GrownAreas | None = None

    def at(self, positions: Array) -> Meeting:
        """The slaves and where they are."""
        along = None if self.axes is None else (self.axes @ positions).reshape(-1, 2, 3)
        return Meeting(self.obstacle, self.slaves, positions, self.offset, self.axes, along,
                       self.areas)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Meetings:
    """All pairs of a model at some positions, one after another: nc contacts."""

    parts: Sequence[AnyMeeting]
    _last: list[Any] = field(default_factory=list, init=False, repr=False)  # of `motion`

    @property
    def only_obstacles(self) -> bool:
        """True where derivatives are those by the place of the slave alone."""
        return self.axes is None and self.all_at_obstacles

    @property
    def all_at_obstacles(self) -> bool:
        """True where no body meets another."""
        return all(isinstance(part, Meeting) for part in self.parts)

    @cached_property
    def gap(self) -> Array:
        """(nc,)."""
        return np.concatenate([part.gap for part in self.parts])

    @cached_property
    def normals(self) -> Array:
        """(nc, d)."""
        return np.concatenate([part.normals for part in self.parts])

    @cached_property
    def axes(self) -> sparse.csr_array | None:
        """c of `surface_axes`, (2 nc, nodes), zero where there are none; None without any."""
        nodes = [part.axes.shape[1] for part in self.parts if part.axes is not None]
        if not nodes:
            return None
        return sparse.csr_array(sparse.vstack([
            sparse.csr_array((2 * len(part.slaves), nodes[0])) if part.axes is None
            else part.axes for part in self.parts
        ]))  # fmt: skip

    @cached_property
    def along(self) -> Array:
        """E of `surface_axes`, (nc, 2, 3), zero where there is none."""
        return np.concatenate([
            np.zeros((len(part.slaves), 2, 3)) if part.along is None else part.along
            for part in self.parts
        ])  # fmt: skip

    @cached_property
    def frames(self) -> Array:
        """Rows n, t1(, t2) of every contact, (nc, d, d)."""
        normals = self.normals
        return frames(normals) if self.axes is None else carried_frames(normals, self.along)

    @cached_property
    def met(self) -> Mask:
        """Contacts that meet their other side, (nc,); the others are open."""
        return np.concatenate([part.met for part in self.parts])

    @cached_property
    def growth(self) -> Array:
        """Areas that stresses act on over the undeformed ones, (nc,), of `grown_areas`."""
        return np.concatenate([part.growth for part in self.parts])

    @cached_property
    def stretch(self) -> Array:
        """Areas of now that lambda acts on over the undeformed ones, (nc,): of bonds, too."""
        return np.concatenate([
            part.stretch if isinstance(part, TiedMeeting) else part.growth
            for part in self.parts
        ])  # fmt: skip

    @cached_property
    def passed(self) -> Array:
        """All forces on the slave's side over lambda, (nc,)."""
        return np.concatenate([part.passed for part in self.parts])

    @cached_property
    def averages(self) -> sparse.csr_array:
        """B of (1), (nc, nodes).

        Its transpose times forces lambda (nc, d) are those on all nodes without `couples`.
        """
        if len(self.parts) == 1:
            return self.parts[0].averages
        return sparse.csr_array(sparse.vstack([part.averages for part in self.parts]))

    @cached_property
    def others(self) -> sparse.csr_array:
        """B^T without 1 at p: forces on the other nodes, (nodes, nc)."""
        slaves = np.concatenate([part.slaves for part in self.parts])
        found = self.averages
        rows = np.repeat(np.arange(len(slaves)), np.diff(found.indptr))
        data = found.data - (found.indices == slaves[rows])
        rest = sparse.csr_array((data, found.indices, found.indptr), shape=found.shape)
        return sparse.csr_array(rest.T)

    @cached_property
    def _fading(self) -> list[Fading | None]:
        """Those of the parts."""
        return [part.fading if isinstance(part, MortarMeeting) else None for part in self.parts]

    def mixture(
        self, contact: CurrentContact, force: Array, motion: Array, drawn: Array | None
    ) -> Mixture | None:
        """Of `fading` at forces and motions (nc, d), q drawn (nc, d-1); None: nothing fades."""
        parts = self._fading
        if not any(parts):
            return None
        weights, passed, start = np.ones(len(force)), np.zeros(force.shape), 0
        theta = weights.copy()
        for part, fading in zip(self.parts, parts, strict=True):
            mine = slice(start, start + len(part.slaves))
            start = mine.stop
            if fading is not None:
                weights[mine], theta[mine] = fading.weights, fading.theta
                passed[mine] = fading.shares @ force[mine]
        if drawn is not None:
            drawn = np.einsum("pk,pkc->pc", drawn, self.frames[:, 1:]) * contact.heard
        return Mixture(weights, theta, passed, contact.rho, contact.give, contact.law.offset,
                       contact.free, force, motion, self.gap, self.normals, drawn)  # fmt: skip

    @cached_property
    def shares(self) -> sparse.csr_array:
        """Mean forces of neighbours per force, (nc, nc), of `fading`."""
        blocks = [sparse.csr_array((len(part.slaves),) * 2) if fading is None else fading.shares
                  for part, fading in zip(self.parts, self._fading, strict=True)]  # fmt: skip
        return sparse.csr_array(sparse.block_diag(blocks, format="csr"))

    def distances(self) -> Array:
        """Mean distances of ties, (nc, d); zero of others."""
        return np.concatenate([
            part.distances if isinstance(part, TiedMeeting) else np.zeros_like(part.normals)
            for part in self.parts
        ])  # fmt: skip

    def turned(self, x: Array) -> sparse.csr_array | None:
        """Forces of `couples` with nodes at x (nodes, d), (nodes d, nc d); None without any."""
        nodes, d = x.shape
        if not any(isinstance(part, MortarMeeting) for part in self.parts):
            return None
        found = [
            part.couples.about(x).matrix if isinstance(part, MortarMeeting)
            else sparse.csr_array((nodes * d, len(part.slaves) * d)) for part in self.parts
        ]  # fmt: skip
        return found[0] if len(found) == 1 else sparse.csr_array(sparse.hstack(found))

    @cached_property
    def turned_here(self) -> sparse.csr_array | None:
        """`turned` where the nodes are."""
        xs = [part.x for part in self.parts if isinstance(part, MortarMeeting)]
        return self.turned(xs[0]) if xs else None

    def returned(self, counts: Array) -> sparse.csr_array:
        """Forces on other nodes per force lambda times counts (nc, d), (nodes d, nc d)."""
        out = by_components(self.others, counts)
        if self.turned_here is None:
            return out
        more = self.turned_here
        data = more.data * counts.ravel()[more.indices]
        more = sparse.csr_array((data, more.indices, more.indptr), shape=more.shape)
        return sparse.csr_array(out + more)

    def given(self, force: Array) -> Array:
        """Forces (nodes d,) on other nodes of forces lambda (nc, d)."""
        out = (self.others @ force).ravel()
        return out if self.turned_here is None else out + self.turned_here @ force.ravel()

    def relative(self, v: Array) -> Array:
        """Motions (nc, d) of the slaves, of all nodes v (nodes, d), against the other side.

        What forces lambda work on.
        """
        out = self.averages @ v
        if self.turned_here is None:
            return out
        return out + (self.turned_here.T @ v.ravel()).reshape(out.shape)

    def pushed(self, axes: Array, r: Array) -> Array:
        """Forces (nodes d,) of reactions r (nc, d) in the frames axes (nc, d, d): H r."""
        force = np.einsum("pkc,pk->pc", axes, r)
        out = (self.averages.T @ force).ravel()
        return out if self.turned_here is None else out + self.turned_here @ force.ravel()

    def columns(self, axes: Array) -> sparse.csc_array:
        """H (nodes d, nc d): column p d + k holds the forces of a unit along axis k of p.

        axes (nc, d, d): the frames of the contacts.
        """
        nc, d = axes.shape[:2]
        spread = sparse.kron(self.averages.T, np.eye(d), format="csr")
        if self.turned_here is not None:
            spread = spread + self.turned_here
        local = (axes.swapaxes(1, 2), np.arange(nc), np.arange(nc + 1))
        return sparse.csc_array(spread @ sparse.bsr_array(local, shape=(nc * d,) * 2).tocsr())

    def motion(self, u: Array, before: Array, earlier: Meetings) -> Array:
        """s, (nc, d), from displacements `before` to u (nodes, d), where earlier met then.

        u: of this meeting; the last answer is kept.
        """
        if self._last and self._last[0] is earlier:
            return self._last[1].copy()
        out = []
        for part, old in zip(self.parts, earlier.parts, strict=True):
            if isinstance(part, MortarMeeting) and isinstance(old, MortarMeeting):
                out.append(part.motion(old))
            elif isinstance(part, TiedMeeting):
                out.append(part.motion(old))
            else:
                out.append(u[part.slaves] - before[part.slaves])
        self._last[:] = earlier, np.concatenate(out)
        return self._last[1].copy()

    # ------------------------------------------- derivatives by the place of the slave
    def _joined(self, name: str) -> Array:
        sides = [part for part in self.parts if isinstance(part, Meeting)]
        return np.concatenate([getattr(part.side, name)(part.x) for part in sides])

    @cached_property
    def gap_slopes(self) -> Array:
        """Of the gaps, (nc, d), with obstacles only."""
        return self._joined("gap_slopes")

    @cached_property
    def normal_slopes(self) -> Array:
        """Of the normals, (nc, d, d), with obstacles only."""
        return self._joined("normal_slopes")
