"""Rigid-body modes of connected pieces: which of them supports and contacts hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import SingularOperator
from ...linear.rigid_modes import rigid_modes
from ..elements.given import GivenMatrices
from ..meshes.mesh import Mesh

Array = NDArray[np.float64]
Index = NDArray[np.int64]
RANK = 1e-9  # singular values below this part of the largest possible one count as zero
ALONG_AXIS = [1]  # the only mode of axisymmetric bodies without strain
UNNAMED = "default"  # the region of cells without a name
NAMES = {
    2: ("translation along x", "translation along y", "rotation in the plane"),
    3: ("translation along x", "translation along y", "translation along z",
        "rotation about x", "rotation about y", "rotation about z"),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Piece:
    """A connected part of a body: name, dofs (k,) in the whole model, its points (n, dim).

    rigid: which of its rigid modes strain nothing, None for all.
    members: where constraints join several, those, without points; the modes of these, (k, …),
    side by side are its `joined` ones.
    """

    name: str
    dofs: Index
    points: Array
    rigid: list[int] | None = None
    members: tuple[Piece, ...] = ()
    joined: Array | None = None

    @property
    def count(self) -> int:
        """Number of rigid modes."""
        if self.joined is not None:
            return self.joined.shape[1]
        return 3 if self.points.shape[1] == 2 else 6

    @property
    def modes(self) -> Array:
        """Rigid modes (k, count), made anew at every call: they are long."""
        return rigid_modes(self.points) if self.joined is None else self.joined

    def modes_at(self, chosen: NDArray[np.bool_]) -> Array:
        """Their rows at some of the dofs, chosen (k,)."""
        if self.joined is not None:
            return self.joined[chosen]
        own = chosen.reshape(self.points.shape)
        near: NDArray[np.bool_] = np.asarray(own.any(axis=1))
        return rigid_modes(self.points, near)[own[near].ravel()]

    def moving(self, motion: Array) -> Array:
        """Of a motion (modes, ...) the part of the member that moves most, (3 or 6, ...)."""
        if not self.members:
            return motion
        parts = np.split(motion, len(self.members))
        return parts[int(np.argmax([np.abs(part).max(initial=0.0) for part in parts]))]


def pieces(mesh: Mesh, name: str, offset: int, material: object = None) -> list[Piece]:
    """Connected pieces of a mesh whose dofs start at `offset`; material: of its body."""
    labels = piece_labels(mesh)
    titles = piece_titles(mesh, name, labels)
    out = []
    for label, title in enumerate(titles):
        nodes = np.flatnonzero(labels == label)
        dofs = offset + (nodes[:, None] * mesh.dim + np.arange(mesh.dim)).ravel()
        rigid = ALONG_AXIS if mesh.axisymmetric else None
        points = mesh.points if len(titles) == 1 else mesh.points[nodes]
        if isinstance(material, GivenMatrices):
            rigid = material.resisted(rigid_modes(points), dofs - offset)
        out.append(Piece(title, dofs, points, rigid))
    return out


def piece_titles(mesh: Mesh, name: str, labels: Index) -> list[str]:
    """A name for every piece: of its regions where these are its alone, else a number.

    The name of the body stands before it where the user gave one.
    """
    count = int(labels.max()) + 1
    if count == 1:
        return [name]
    regions: list[dict[str, None]] = [{} for _ in range(count)]
    for block in mesh.cells:
        for label in np.unique(labels[block.nodes[:, 0]]):
            regions[label][block.region] = None
    titles = []
    for label, own in enumerate(regions):
        number = f"part {label + 1} of {count}"
        others = {region for k, some in enumerate(regions) if k != label for region in some}
        if UNNAMED in own or others & set(own):
            titles.append(f"{name} ({number})")
            continue
        title = " and ".join(own)
        title = title if name.startswith("body") else f"{name}.{title}"
        titles.append(f"{title} ({number})" if UNNAMED in others else title)
    return titles


def piece_labels(mesh: Mesh) -> Index:
    """Number of the connected piece of every node, (n,)."""
    if mesh.grid is not None:
        return np.zeros(len(mesh.points), dtype=np.int64)
    from scipy.sparse import csgraph

    links = [
        np.stack([np.repeat(b.nodes[:, 0], b.nodes.shape[1] - 1), b.nodes[:, 1:].ravel()])
        for b in mesh.cells
    ]
    start, end = np.concatenate(links, axis=1)
    n = len(mesh.points)
    graph = sparse.coo_array((np.ones(len(start)), (start, end)), shape=(n, n))
    return csgraph.connected_components(graph, directed=False)[1].astype(np.int64)


def loose_modes(parts: list[Piece], fixed: NDArray[np.bool_]) -> list[tuple[Piece, Array]]:
    """Pieces with the modes that supports leave free: bases (6, k), orthonormal, k > 0."""
    out = []
    for piece in parts:
        held = piece.modes_at(fixed[piece.dofs])
        basis = null_space(held if piece.rigid is None else held[:, piece.rigid])
        if piece.rigid is not None:
            basis = np.eye(held.shape[1])[:, piece.rigid] @ basis
        if basis.shape[1]:
            out.append((piece, basis))
    return out


def check_held(
    loose: list[tuple[Piece, Array]], H: sparse.csc_array, dofs: int, acting: NDArray[np.bool_]
) -> None:
    """Raise SingularOperator when a loose mode could not be held even by closed contacts.

    H (dofs, nc d); acting (nc d,): contact rows that can carry a force, no shear if mu = 0.
    """
    if not loose:
        return
    motion, spread = rigid_motions(loose, dofs)
    left = null_space((H.T @ motion)[acting])
    if not left.shape[1]:
        return
    texts = []
    for k, (piece, basis) in enumerate(loose):
        modes = basis @ left[spread == k]
        if np.abs(modes).max(initial=0.0) > 1e-6:
            words = describe(piece.moving(modes))
            texts.append(f"body {piece.name!r} is free to move: {words}")
    raise SingularOperator(
        "; ".join(texts) + "; hold it with a support (Fix), friction or another contact",
        ("supports",), "",
    )  # fmt: skip


def rigid_motions(loose: list[tuple[Piece, Array]], dofs: int) -> tuple[Array, Index]:
    """Loose modes of all pieces as columns (dofs, k), and the piece of each, (k,)."""
    of = np.concatenate([np.full(basis.shape[1], k) for k, (_, basis) in enumerate(loose)])
    motion = np.zeros((dofs, len(of)))
    for k, (piece, basis) in enumerate(loose):
        motion[np.ix_(piece.dofs, of == k)] = piece.modes @ basis
    return motion, of


def describe(modes: Array) -> str:
    """Rigid modes (3 or 6, k) in words: the axis modes among them, or mixed ones."""
    names = NAMES[2 if len(modes) == 3 else 3]
    u, s, _ = np.linalg.svd(modes, full_matrices=False)
    span = u[:, s > 1e-6 * max(s.max(initial=0.0), 1e-300)]
    inside = np.linalg.norm(span, axis=1) > 1 - 1e-6
    words = [name for name, is_in in zip(names, inside, strict=True) if is_in]
    mixed = span.shape[1] - len(words)
    if mixed:
        involved = np.flatnonzero(~inside & (np.linalg.norm(span, axis=1) > 1e-6))
        words.append(
            f"{mixed} combination{'s' if mixed > 1 else ''} of "
            + " and ".join(names[k] for k in involved)
        )
    return ", ".join(words)


def near_nullspace(parts: list[Piece], free: Index | slice, dofs: int) -> Array:
    """Rigid modes of every piece on the free dofs, (len(free), 3 or 6): for multigrid.

    Pieces share the columns: multigrid groups coupled nodes only, so it never mixes them.
    """
    out = np.zeros((dofs, max((piece.count for piece in parts), default=0)))
    for piece in parts:
        out[piece.dofs, : piece.count] = piece.modes
    return out[free]


def null_space(matrix: Array) -> Array:
    """Orthonormal basis (columns) of the null space of matrix (rows, k)."""
    k = matrix.shape[1]
    if not matrix.shape[0]:
        return np.eye(k)
    _, s, vt = np.linalg.svd(matrix, full_matrices=matrix.shape[0] < k)
    rank = int((s > RANK * max(float(s[0]), RANK)).sum())
    return vt[rank:].T
