"""What is seen of a deformed model: its visible sides and joints, and how much it is magnified.

Bodies in 3D are seen from the front along the thinnest direction of the whole; joints are the
slave edges on that side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...mechanics.model import Model
from ...mechanics.steps import TimeStep
from .style import round_below

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SHOWN = 0.12  # size that the largest displacement gets, relative to the whole
FRONT = 1e-6  # part of the depth within which nodes lie on the side that is seen


@dataclass(frozen=True, eq=False)
class Frame:
    """What a picture of a step needs: time, displacement per body, status of all contacts.

    stamp: why the step is no solution, "" for one that has converged.
    """

    time: float
    displacement: tuple[Array, ...]
    status: NDArray[np.int8]
    stamp: str = ""

    @classmethod
    def of(cls, step: TimeStep) -> Frame:
        """The frame of a step."""
        return cls(step.time, step.displacement, step.status, step.solution.convergence.stamp)


@dataclass(frozen=True, eq=False)
class Scene:
    """The visible sides and joints of a model, found once for all pictures."""

    model: Model
    axes: tuple[int, int] = field(init=False)
    sides: list[tuple[int, Index]] = field(init=False)  # body, nodes of its visible facets
    joints: list[tuple[int, Index, Index]] = field(init=False)  # body, edges, contacts at ends

    def __post_init__(self) -> None:
        points = np.concatenate([body.mesh.points for body in self.model.bodies])
        spread = np.ptp(points, axis=0)
        depth = int(np.argmin(spread)) if self.model.dimension == 3 else None
        kept = [k for k in range(self.model.dimension) if k != depth]
        near = None if depth is None else points[:, depth].min() + FRONT * spread[depth]
        object.__setattr__(self, "axes", (kept[0], kept[1]))
        object.__setattr__(self, "sides", self._sides(depth, near))
        object.__setattr__(self, "joints", self._joints(depth, near))

    def _seen(self, body: int, depth: int | None, near: float | None) -> NDArray[np.bool_]:
        """Nodes of a body that lie on the visible side; all of them in 2D."""
        points = self.model.bodies[body].mesh.points
        if depth is None or near is None:
            return np.ones(len(points), dtype=bool)
        return points[:, depth] <= near

    def _sides(self, depth: int | None, near: float | None) -> list[tuple[int, Index]]:
        found = []
        for k, body in enumerate(self.model.bodies):
            seen = self._seen(k, depth, near)
            blocks = body.mesh.cells if depth is None else body.mesh.boundary
            for block in blocks:
                nodes = block.nodes[:, : _corners(block.kind)]
                found.append((k, nodes[seen[nodes].all(axis=1)]))
        return found

    def _joints(self, depth: int | None, near: float | None) -> list[tuple[int, Index, Index]]:
        """Visible edges of the slave surfaces, both ends of which have a contact."""
        bodies = self.model.bodies
        at = [np.full(len(body.mesh.points), -1) for body in bodies]
        surfaces: dict[tuple[int, str], None] = {}
        first = 0
        for contact, placed in zip(
            self.model.contacts, self.model.discretisation.placed, strict=True
        ):
            at[placed.body][placed.rows.nodes] = first + np.arange(len(placed.rows.nodes))
            first += len(placed.rows.nodes)
            surfaces[placed.body, contact.slave.rpartition(".")[2]] = None
        found = []
        for k, name in surfaces:
            seen = self._seen(k, depth, near) & (at[k] >= 0)
            for facets in bodies[k].mesh.surface(name):
                edges = _edges(facets.nodes[:, : _corners(facets.kind)])
                edges = edges[seen[edges].all(axis=1)]
                found.append((k, edges, at[k][edges]))
        return found

    @property
    def size(self) -> float:
        """Length of the diagonal of the picture."""
        points = np.concatenate([body.mesh.points for body in self.model.bodies])
        return float(np.linalg.norm(np.ptp(points[:, list(self.axes)], axis=0)))


def _corners(kind: str) -> int:
    """Corner nodes of a cell or facet."""
    return {"line": 2, "tri": 3, "quad": 4}[kind.rstrip("0123456789")]


def _edges(nodes: Index) -> Index:
    """Sides of facets as pairs of nodes, each once."""
    if nodes.shape[1] == 2:
        return nodes
    pairs = np.stack([nodes, np.roll(nodes, -1, axis=1)], axis=2).reshape(-1, 2)
    return np.unique(np.sort(pairs, axis=1), axis=0)


def magnification(scene: Scene, frames: Sequence[Frame]) -> float:
    """A round factor that makes the largest displacement a visible part of the picture."""
    largest = room_needed(scene, frames)
    if largest == 0:
        return 1.0
    return round_below(SHOWN * scene.size / largest)


def room_needed(scene: Scene, frames: Sequence[Frame]) -> float:
    """The largest displacement in the plane of the picture, unit of length."""
    return max(
        (float(np.abs(u[:, list(scene.axes)]).max()) for f in frames for u in f.displacement),
        default=0.0,
    )
