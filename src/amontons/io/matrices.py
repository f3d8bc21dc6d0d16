"""Matrices that CalculiX stores: `*FREQUENCY, SOLVER=MATRIXSTORAGE` writes .sti, .mas and .dof.

A line of .sti and .mas is row, column (both from 1) and value of the upper triangle; line k of
.dof says which node and direction row k is, as node.direction.  Degrees of freedom that
supports hold and constraints bind have no row.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.errors import FileFormatError, InvalidInput
from ..core.files import check_is_regular
from ..mechanics.meshes import Mesh
from ..mechanics.model import Body

Array = NDArray[np.float64]
Index = NDArray[np.int64]
STIFFNESS, MASS, ROWS = ".sti", ".mas", ".dof"
ROW = re.compile(r"\s*(\d+)\.(\d+)\s*")


@dataclass(frozen=True, eq=False)
class StoredMatrices:
    """K and mass (rows, rows), force per length and mass, None without; of which dofs.

    node (rows,): the number of the node in the deck; axis (rows,): its direction, from 0 on.
    """

    path: Path
    K: sparse.csr_array
    mass: sparse.csr_array | None
    node: Index
    axis: Index

    def rows(self, labels: NDArray) -> Index:
        """The row (nodes, dim) of every component of the nodes with these numbers (nodes,).

        Raises InvalidInput where one has no row, and for rows of other nodes.
        """
        wanted = np.asarray(labels, dtype=np.int64)
        dim = int(self.axis.max(initial=0)) + 1
        key = self.node * dim + self.axis
        order = np.argsort(key, kind="stable")
        keys = wanted[:, None] * dim + np.arange(dim)
        at = np.minimum(np.searchsorted(key[order], keys), len(key) - 1)
        found = order[at]
        missing = np.argwhere(key[found] != keys)
        if missing.size:
            node, axis = (int(k) for k in missing[0])
            raise InvalidInput(
                f"{self.path}: has no row for {len(missing)} of {keys.size} components, such "
                f"as node {wanted[node]}, direction {axis + 1}: supports hold them or "
                "constraints bind them, as those that make bricks of plane elements; store the "
                "matrices of the free body in 3D, and hold it with Fix"
            )
        if len(key) != keys.size:
            other = np.setdiff1d(self.node, wanted)
            raise InvalidInput(
                f"{self.path}: has {len(key)} rows for {keys.size} components of the mesh"
                + (f", such as those of node {other[0]}" if len(other) else "")
                + ": they belong to another mesh, or are inner ones of incompatible elements"
            )
        return found

    def body(self, mesh: Mesh | None = None, labels: NDArray | None = None, *,
             name: str = "", held: bool = False) -> Body:  # fmt: skip
        """A body with this stiffness and mass, as `Body.from_matrix` makes it.

        mesh: by default that of the deck beside, .inp; labels (nodes,): the numbers of its
        nodes in the deck, by default those in the deck, else from 1 on.  held: springs in the
        deck keep it in its place.  Raises InvalidInput where both do not fit.
        """
        if mesh is None:
            from .decks.mesh_file import read_numbered_mesh

            deck = self.path.with_suffix(".inp")
            mesh, own = read_numbered_mesh(deck)
            labels = own if labels is None else labels
        numbers = np.arange(1, len(mesh.points) + 1) if labels is None else np.asarray(labels)
        if numbers.shape != (len(mesh.points),):
            raise InvalidInput(
                f"labels: expected {len(mesh.points)} numbers, one for each node of the mesh, "
                f"got shape {numbers.shape}"
            )
        rows = self.rows(numbers)
        if rows.shape[1] != mesh.dim:
            raise InvalidInput(f"mesh: expected one in {rows.shape[1]}D as {self.path}, got "
                               f"one in {mesh.dim}D")  # fmt: skip
        return Body.from_matrix(mesh, self.K, mass=self.mass, rows=rows, held=held, name=name)


def read_matrices(path: str | os.PathLike[str]) -> StoredMatrices:
    """The matrices that CalculiX has stored: path of the .sti, .mas or .dof, or of the deck.

    The .sti and the .dof have to be there, the .mas may be; one of zeros is none.  Raises
    FileFormatError naming file and line of what is missing, can not be read, or belongs to
    another run.
    """
    given = Path(path)
    node, axis = _dofs(given.with_suffix(ROWS))
    stiffness = given.with_suffix(STIFFNESS)
    K = _matrix(stiffness, len(node))
    mass = given.with_suffix(MASS)
    M = _matrix(mass, len(node)) if mass.is_file() else None
    if M is not None and not M.data.any():  # without *DENSITY
        M = None
    return StoredMatrices(stiffness, K, M, node, axis)


def _text(path: Path) -> str:
    check_is_regular(path)
    try:
        return path.read_text(encoding="latin-1")
    except OSError as reason:
        raise FileFormatError(
            f"{path}: can not be read: {reason.strerror}; *FREQUENCY, SOLVER=MATRIXSTORAGE of "
            f"CalculiX writes {STIFFNESS}, {MASS} and {ROWS}"
        ) from None


def _dofs(path: Path) -> tuple[Index, Index]:
    """Node and direction from 0 on of every row."""
    found = []
    for number, line in enumerate(_text(path).splitlines(), 1):
        at = ROW.fullmatch(line)
        if at is None or not 1 <= int(at[2]) <= 3:
            raise FileFormatError(
                f"{path}: line {number}: expected node.direction with a direction from 1 to 3, "
                f"got {line[:40]!r}; unknowns that are no displacements are not read"
            )
        found.append((int(at[1]), int(at[2]) - 1))
    if not found:
        raise FileFormatError(f"{path}: expected a line for each row, got none")
    table = np.array(found, dtype=np.int64)
    again = len(table) - len(np.unique(table, axis=0))
    if again:
        raise FileFormatError(f"{path}: {again} rows have a node and direction of others")
    return table[:, 0], table[:, 1]


def _matrix(path: Path, size: int) -> sparse.csr_array:
    """A symmetric matrix of which the upper triangle is there, or all of one."""
    lines = _text(path).splitlines()
    try:
        table = np.array(" ".join(lines).split(), dtype=np.float64).reshape(-1, 3)
        whole = len(table) == len(lines)
    except ValueError:
        whole, table = False, np.zeros((0, 3))
    if not whole or not np.isfinite(table).all():
        raise _bad_line(path, lines)
    place = table[:, :2].astype(np.int64) - 1
    outside = np.flatnonzero((place < 0).any(axis=1) | (place >= size).any(axis=1))
    if outside.size or not len(table):
        at = int(outside[0]) if outside.size else 0
        raise FileFormatError(
            f"{path}: line {at + 1}: expected rows and columns from 1 to {size}, as "
            f"{path.with_suffix(ROWS).name} has lines, got "
            f"{lines[at].strip() if lines else 'an empty file'!r}"
        )
    row, column = place.T
    out = sparse.csr_array((table[:, 2], (row, column)), shape=(size, size))
    if (row > column).any():
        return out
    return sparse.csr_array(out + sparse.triu(out, 1).T)


def _bad_line(path: Path, lines: list[str]) -> FileFormatError:
    for number, line in enumerate(lines, 1):
        try:
            row, column, value = line.split()
            if int(row) > 0 and int(column) > 0 and np.isfinite(float(value)):
                continue
        except ValueError:
            pass
        return FileFormatError(
            f"{path}: line {number}: expected row, column and a finite value, got "
            f"{line[:60]!r}"
        )
    return FileFormatError(f"{path}: expected three numbers in every line")
