"""What is seen of a model: the outsides of its bodies, and its contact zones, as triangles.

Vertices are the nodes on the boundary (in 2D all nodes), those of all bodies one after another.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...linear.blocks import spatial
from ...mechanics.contact.geometry import Plane
from ...mechanics.meshes import Facets
from ...mechanics.meshes.surfaces import facet_normals
from ...mechanics.model.supports import locate

if TYPE_CHECKING:
    from ...mechanics.model import Contact, Model

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SHARP = 0.87  # cosine between facets below which their common edge is drawn as one of the body
WIDER = 0.15  # of the size of the slave, by which a plane is drawn beyond it
NEAR = 2.0  # lengths of a facet beyond the least gap within which it faces the other side
AROUND = 0.1  # of their area, that is left of normals which turn around
PIECES = {  # facets as lines or triangles of their nodes
    "line": [[0, 1]], "line3": [[0, 2], [2, 1]], "tri": [[0, 1, 2]],
    "tri6": [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]], "quad": [[0, 1, 2], [0, 2, 3]],
    "quad8": [[0, 4, 7], [4, 1, 5], [5, 2, 6], [6, 3, 7], [4, 5, 6], [4, 6, 7]],
    "quad9": [[0, 4, 8], [0, 8, 7], [4, 1, 5], [4, 5, 8], [8, 5, 2], [8, 2, 6], [7, 8, 6],
              [7, 6, 3]],
}  # fmt: skip
RINGS = {"line": [0, 1], "line3": [0, 2, 1], "tri": [0, 1, 2], "tri6": [0, 3, 1, 4, 2, 5],
         "quad": [0, 1, 2, 3], "quad9": [0, 4, 1, 5, 2, 6, 3, 7],
         "quad8": [0, 4, 1, 5, 2, 6, 3, 7]}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Zone:
    """A contact pair: pieces of both sides, (k, d) vertices; a rigid side is points and pieces.

    outward (3,): mean normal, out of its body, of what of the slave lies nearest to the other
    side.  slave, master: names, as a user reads them.
    """

    slave: str
    master: str
    pieces: Index
    master_pieces: Index
    outward: Array
    rigid_points: Array
    rigid_pieces: Index


@dataclass(frozen=True, eq=False)
class Skin:
    """The visible surface of a model, made once for all states of it.

    node, body (V,): mesh node and body of a vertex; triangles (T, 3), of bodies in order,
    ends (bodies,); edges (E, 2) of the mesh, sharp (S, 2) those of the shape.
    """

    model: Model
    node: Index = field(init=False)
    body: Index = field(init=False)
    points: Array = field(init=False)
    triangles: Index = field(init=False)
    ends: Index = field(init=False)
    edges: Index = field(init=False)
    sharp: Index = field(init=False)
    zones: tuple[Zone, ...] = field(init=False)

    def __post_init__(self) -> None:
        bodies = self.model.bodies
        flat = self.model.dimension == 2
        sides = [_fine(b.mesh.cells if flat else b.mesh.boundary) for b in bodies]
        nodes = [np.unique(np.concatenate([f.nodes.ravel() for f in part])) for part in sides]
        starts = np.cumsum([0, *map(len, nodes)])
        vertex = self._vertices(nodes)
        triangles = [vertex[k][_pieces(part)] for k, part in enumerate(sides)]
        edges, sharp = [], []
        for k, part in enumerate(sides):
            every, shape = _edges(bodies[k].mesh.points, part)
            edges.append(vertex[k][every])
            sharp.append(vertex[k][shape])
        values = {
            "node": np.concatenate(nodes),
            "body": np.repeat(np.arange(len(bodies)), np.diff(starts)),
            "points": spatial(np.concatenate(
                [b.mesh.points[n] for b, n in zip(bodies, nodes, strict=True)]
            )),
            "triangles": np.concatenate(triangles),
            "ends": np.cumsum([len(part) for part in triangles]),
            "edges": np.concatenate(edges), "sharp": np.concatenate(sharp),
        }  # fmt: skip
        for name, value in values.items():
            object.__setattr__(self, name, value)
        zones = tuple(self._zone(contact, vertex) for contact in self.model.contacts)
        object.__setattr__(self, "zones", zones)

    @property
    def whole(self) -> Index:
        """Place (V,) of the vertices among the nodes of all bodies one after another."""
        starts = np.cumsum([0, *(len(body.mesh.points) for body in self.model.bodies)])
        return starts[self.body] + self.node

    @property
    def size(self) -> float:
        """Diagonal of the box around all bodies."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    def _vertices(self, nodes: list[Index]) -> list[Index]:
        """Per body the vertex of every node, -1 of those inside."""
        found, first = [], 0
        for body, mine in zip(self.model.bodies, nodes, strict=True):
            table = np.full(len(body.mesh.points), -1)
            table[mine] = first + np.arange(len(mine))
            found.append(table)
            first += len(mine)
        return found

    def _zone(self, contact: Contact, vertex: list[Index]) -> Zone:
        k, surface = locate(self.model.bodies, contact.slave)
        mesh = self.model.bodies[k].mesh
        facets = mesh.surface(surface)
        outward = self._outward(mesh.points, facets, contact)
        pieces = vertex[k][_pieces(facets)]
        nothing = np.zeros((0, self.model.dimension), dtype=np.int64)
        title = f"{surface} of {self.model.bodies[k].name}"
        if contact.master is not None:
            masters, titles = [], []
            for side in contact.masters:
                other, name = locate(self.model.bodies, side)
                body = self.model.bodies[other]
                masters.append(vertex[other][_pieces(body.mesh.surface(name))])
                titles.append(f"{name} of {body.name}")
            return Zone(title, ", ".join(titles), pieces, np.concatenate(masters), outward,
                        np.zeros((0, 3)), nothing)  # fmt: skip
        points, rigid = self._rigid(contact, pieces)
        return Zone(title, "rigid obstacle", pieces, nothing, outward, points,
                    rigid)  # fmt: skip

    def _outward(self, points: Array, facets: tuple[Facets, ...], contact: Contact) -> Array:
        """The mean normal of facets at the least gap or up to two of their lengths farther."""
        middles = np.concatenate([points[f.nodes].mean(axis=1) for f in facets])
        normals = np.concatenate([facet_normals(points, f) for f in facets])
        if contact.master is not None:
            other = [locate(self.model.bodies, side) for side in contact.masters]
            meshes = [self.model.bodies[k].mesh for k, _ in other]
            sides = [m.points[f.nodes].mean(axis=1)
                     for m, (_, name) in zip(meshes, other, strict=True)
                     for f in m.surface(name)]  # fmt: skip
            gaps = cKDTree(np.concatenate(sides)).query(middles)[0]
        else:
            assert contact.obstacle is not None
            gaps = contact.obstacle.gap(middles)
        sizes = np.linalg.norm(normals, axis=1) ** (1 / (points.shape[1] - 1))
        near = gaps <= gaps.min() + NEAR * sizes
        facing: Array = normals[near].sum(axis=0)
        if np.linalg.norm(facing) < AROUND * np.linalg.norm(normals[near], axis=1).sum():
            facing = normals[gaps.argmin()]  # a pin in its bore: any side of it
        return _unit(spatial(facing[None]))[0]

    def _rigid(self, contact: Contact, pieces: Index) -> tuple[Array, Index]:
        """What is drawn of an obstacle: a plane beyond the slave, else the part in front of it.

        Its points are the slave nodes moved along the normal by their gaps.
        """
        obstacle, dim = contact.obstacle, self.model.dimension
        assert obstacle is not None
        nodes, local = np.unique(pieces, return_inverse=True)
        x = self.points[nodes][:, :dim]
        if isinstance(obstacle, Plane):
            return _plane(x - obstacle.gap(x)[:, None] * obstacle.normals(x),
                          obstacle.normals(x)[0])  # fmt: skip
        below = x - obstacle.gap(x)[:, None] * obstacle.normals(x)
        return spatial(below), local.reshape(pieces.shape)


def _plane(points: Array, normal: Array) -> tuple[Array, Index]:
    """A rectangle, in 2D a line, around points of a plane."""
    centre, dim = points.mean(axis=0), points.shape[1]
    if dim == 2:
        along = np.array([[-normal[1], normal[0]]])
    else:
        first = np.eye(3)[int(np.argmin(np.abs(normal)))]
        first = first - (first @ normal) * normal
        first /= np.linalg.norm(first)
        along = np.stack([first, np.cross(normal, first)])
    at = (points - centre) @ along.T
    low, high = at.min(axis=0), at.max(axis=0)
    margin = WIDER * float((high - low).max())
    low, high = low - margin, high + margin
    if dim == 2:
        return spatial(centre + np.array([high, low]) @ along), np.array([[0, 1]])
    corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    return centre + corners @ along, np.array([[0, 1, 2], [0, 2, 3]])


def _fine(blocks: tuple) -> list[Facets]:
    """Cells in 2D, or facets, that have nodes."""
    return [Facets(b.kind, b.nodes) for b in blocks if len(b.nodes)]


def _pieces(facets: list[Facets] | tuple[Facets, ...]) -> Index:
    """Facets as lines or triangles, (k, d) nodes."""
    return np.concatenate([
        block.nodes[:, PIECES[block.kind]].reshape(-1, len(PIECES[block.kind][0]))
        for block in facets
    ])  # fmt: skip


def _edges(points: Array, facets: list[Facets]) -> tuple[Index, Index]:
    """Edges of the facets, each once, and those where the shape has one, (k, 2) nodes."""
    pairs, normals = [], []
    for block in facets:
        ring = block.nodes[:, RINGS[block.kind]]
        pairs.append(np.stack([ring, np.roll(ring, -1, axis=1)], axis=2).reshape(-1, 2))
        normal = _normals(points, block)
        normals.append(np.repeat(normal, ring.shape[1], axis=0))
    edges, index, count = np.unique(
        np.sort(np.concatenate(pairs), axis=1), axis=0, return_inverse=True, return_counts=True
    )
    total = np.zeros((len(edges), 3))
    np.add.at(total, index.ravel(), np.concatenate(normals))
    # two unit normals with an angle a between them have a sum of length 2 cos(a / 2)
    alike = np.linalg.norm(total, axis=1) > 2 * np.sqrt((1 + SHARP) / 2)
    return edges, edges[(count != 2) | ~alike]


def _normals(points: Array, block: Facets) -> Array:
    if points.shape[1] == 2:
        return np.tile([0.0, 0.0, 1.0], (len(block.nodes), 1))
    return _unit(facet_normals(points, block))


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0, length, 1.0)
