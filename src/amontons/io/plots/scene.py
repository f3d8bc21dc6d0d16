"""What is seen of a deformed model: its surfaces and joints, and how much it is magnified.

Bodies in 3D are seen from above, a little aside from the direction in which they are thinnest;
joints are the edges of the slave surfaces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .camera import Camera
from .style import round_below

if TYPE_CHECKING:
    from ...mechanics.model import Model
    from ...mechanics.steps import TimeStep

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SHOWN = 0.12  # size that the largest displacement gets, relative to the whole


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
    """The surfaces and joints of a model, found once for all pictures.

    Nodes are those of all bodies one after another.  sides: tables of nodes, cells in 2D and
    facets outwards in 3D; outline (k, 2): sides of the boundary in 2D, empty in 3D; body_of
    (nodes,); contact_of (nodes,): the contact at a node, the last of several, or -1; joints:
    edges (k, 2) of the slave surfaces, and the contacts at their ends.
    """

    model: Model
    camera: Camera
    points: Array = field(init=False)
    body_of: Index = field(init=False)
    sides: list[Index] = field(init=False)
    outline: Index = field(init=False)
    contact_of: Index = field(init=False)
    joints: list[tuple[Index, Index]] = field(init=False)

    @classmethod
    def of(cls, model: Model, camera: Camera | None = None) -> Scene:
        """The scene of a model, by default in its usual view."""
        points = np.concatenate([body.mesh.points for body in model.bodies])
        return cls(model, Camera.of(points) if camera is None else camera)

    def __post_init__(self) -> None:
        meshes = [body.mesh for body in self.model.bodies]
        counts = [len(mesh.points) for mesh in meshes]
        first = np.cumsum([0, *counts])
        flat = self.model.dimension == 2
        sides = [
            first[k] + block.nodes[:, : _corners(block.kind)]
            for k, mesh in enumerate(meshes)
            for block in (mesh.cells if flat else mesh.boundary)
        ]
        lines = [first[k] + block.nodes[:, :2] for k, mesh in enumerate(meshes) if flat
                 for block in mesh.boundary]  # fmt: skip
        outline = np.concatenate(lines) if lines else np.empty((0, 2), dtype=np.int64)
        object.__setattr__(self, "outline", outline)
        object.__setattr__(self, "points", np.concatenate([mesh.points for mesh in meshes]))
        object.__setattr__(self, "body_of", np.repeat(np.arange(len(meshes)), counts))
        object.__setattr__(self, "sides", sides)
        contact_of, joints = self._joints(first)
        object.__setattr__(self, "contact_of", contact_of)
        object.__setattr__(self, "joints", joints)

    def _joints(self, first: Index) -> tuple[Index, list[tuple[Index, Index]]]:
        """The contact at every node, and the edges both ends of which have one."""
        at = np.full(len(self.points), -1)
        surfaces: dict[tuple[int, str], None] = {}
        start = 0
        for contact, placed in zip(
            self.model.contacts, self.model.discretisation.placed, strict=True
        ):
            nodes = placed.rows.nodes
            at[first[placed.body] + nodes] = start + np.arange(len(nodes))
            start += len(nodes)
            surfaces[placed.body, contact.slave.rpartition(".")[2]] = None
        found = []
        for k, name in surfaces:
            for facets in self.model.bodies[k].mesh.surface(name):
                edges = first[k] + _edges(facets.nodes[:, : _corners(facets.kind)])
                edges = edges[(at[edges] >= 0).all(axis=1)]
                found.append((edges, at[edges]))
        return at, found

    @property
    def size(self) -> float:
        """Length of the diagonal of the picture."""
        return float(np.linalg.norm(np.ptp(self.camera.project(self.points), axis=0)))

    def moved(self, displacement: Sequence[Array], factor: float) -> Array:
        """All nodes after magnified displacements, (nodes, dim)."""
        return self.points + factor * np.concatenate(list(displacement))


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
    """A round factor that makes the largest displacement a visible part of the picture.

    Not below 1, which hides how large strains are, unless the bodies go out of sight.
    """
    largest = room_needed(scene, frames)
    if largest == 0:
        return 1.0
    factor = round_below(SHOWN * scene.size / largest)
    return factor if largest > scene.size else max(1.0, factor)


def room_needed(scene: Scene, frames: Sequence[Frame]) -> float:
    """The largest displacement in the plane of the picture, unit of length."""
    return max(
        (float(np.abs(scene.camera.project(u)).max()) for f in frames for u in f.displacement),
        default=0.0,
    )
