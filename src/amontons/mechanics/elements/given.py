"""Bodies of other programs: a stiffness, a mass and a load that were assembled elsewhere.

Rows come in any order: `rows[node, axis]` is the row of K that holds that component of that
node.  From there on everything is by node, x1 y1 z1 x2 …, as in the rest of the package.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import LinearOperator

from ...core.arrays import integers, read_only, real, sparse_matrix
from ...core.errors import InvalidInput, shown
from ..meshes.mesh import Mesh
from .probed import probed

Array = NDArray[np.float64]
Index = NDArray[np.int64]
ORDERS = NODES, COMPONENTS = ("nodes", "components")
ASYMMETRIC = 1e-9  # of the largest entry: more is another law, less is rounding of a file
RESISTS = 1e-6  # of the forces that cancel in a rigid motion: files have six digits or more


@dataclass(frozen=True, eq=False)
class GivenMatrices:
    """What stands in the place of a material where another program has assembled a body.

    K (dofs, dofs): force per length; mass (dofs, dofs) or None; load (dofs,): forces that act
    at load factor 1, besides those of the model.  All by node, dofs = nodes * dim.
    held: K resists rigid motions, as parts of it are held already.
    """

    K: sparse.csr_array
    mass: sparse.csr_array | None
    load: Array
    held: bool = False

    @staticmethod
    def of(
        mesh: Mesh, K: Any, load: Any, mass: Any, rows: str | Any, held: bool  # noqa: FBT001
    ) -> GivenMatrices:
        """The matrices in the order of the nodes; raises InvalidInput for what is none.

        rows: "nodes", "components" or the row (nodes, dim) of every component of every node.
        """
        if not isinstance(mesh, Mesh):
            raise InvalidInput(f"mesh: expected a Mesh, got {shown(mesh)}")
        if mesh.axisymmetric:
            raise InvalidInput("mesh: expected one in 2D or 3D, an axisymmetric one has no K")
        if not isinstance(held, bool):
            raise InvalidInput(f"held: expected True or False, got {shown(held)}")
        order = rows_of(mesh, rows)
        dofs = mesh.points.size
        force = np.zeros(dofs) if load is None else real("load", load)
        if force.shape != (dofs,):
            raise InvalidInput(
                f"load: expected {dofs} numbers in the order of the rows of K, got shape "
                f"{force.shape}"
            )
        if not np.isfinite(force).all():
            at = int(np.flatnonzero(~np.isfinite(force))[0])
            raise InvalidInput(f"load[{at}]: expected a finite number, got {force[at]}")
        stiffness = _ordered("K", K, order, mesh)
        if not held:
            _check_free(stiffness, mesh, rows)
        return GivenMatrices(
            stiffness, None if mass is None else _ordered("mass", mass, order, mesh),
            read_only(force[order]), held,
        )  # fmt: skip

    def check(self, mesh: Mesh) -> None:
        """Raise InvalidInput for a mesh of another size."""
        if self.K.shape[0] != mesh.points.size:
            raise InvalidInput(
                f"mesh: expected {self.K.shape[0]} nodes times dimensions, as K has rows, got "
                f"{mesh.points.size}; another order of the displacement is another K"
            )

    def resisted(self, modes: Array, dofs: Index) -> list[int] | None:
        """Which of the rigid modes (k, m) of a piece K does not resist; None for all of them.

        Raises InvalidInput where combinations of them alone are free.
        """
        if not self.held:
            return None
        part = self.K[dofs][:, dofs]
        energy = modes.T @ (part @ modes)
        size = np.abs(modes).T @ (abs(part) @ np.abs(modes))
        limit = RESISTS * float(np.abs(size).max(initial=0.0))
        free = np.flatnonzero(np.abs(energy).max(axis=1, initial=0.0) <= limit).tolist()
        loose = int((np.linalg.eigvalsh(0.5 * (energy + energy.T)) <= limit).sum())
        if loose != len(free):
            raise InvalidInput(
                "K: supports in it leave a rigid motion free that is neither along an axis nor "
                "about one; expected a free body (held=False), held by Fix in the model"
            )
        return free


def rows_of(mesh: Mesh, rows: Any) -> Index:
    """The row of K of every dof by node, (dofs,)."""
    n, dim = mesh.points.shape
    if isinstance(rows, str):
        if rows not in ORDERS:
            raise InvalidInput(
                f"rows: expected {NODES!r} (x1 y1 …, x2 y2 …), {COMPONENTS!r} (x1 x2 …, y1 y2 "
                f"…) or a table (nodes, {dim}) of rows, got {rows!r}"
            )
        table = np.arange(n * dim)
        return table if rows == NODES else table.reshape(dim, n).T.ravel()
    table = integers("rows", rows)
    if table.shape != (n, dim):
        raise InvalidInput(f"rows: expected shape {(n, dim)}, got {table.shape}")
    if not np.array_equal(np.sort(table.ravel()), np.arange(n * dim)):
        raise InvalidInput(
            f"rows: expected every number from 0 to {n * dim - 1} once; unknowns of other "
            "kinds, such as rotations, have to be eliminated from K before"
        )
    return table.ravel()


def _ordered(name: str, matrix: Any, order: Index, mesh: Mesh) -> sparse.csr_array:
    """A symmetric matrix by node."""
    n, dim = mesh.points.shape
    operator = isinstance(matrix, LinearOperator)
    found = matrix if operator else sparse_matrix(name, matrix)
    if found.shape != (n * dim, n * dim):
        raise InvalidInput(
            f"{name}: expected shape {(n * dim, n * dim)} of {n} nodes in {dim}D, got "
            f"{found.shape}; unknowns that are no displacement of a node of the mesh have to "
            "be eliminated before"
        )
    if operator:
        found = probed(name, matrix, order, mesh)
    out = sparse.csr_array(found)[order][:, order]
    size = float(np.abs(out.data).max(initial=0.0))
    apart = abs(out - out.T).max() if out.nnz else 0.0
    if apart > ASYMMETRIC * size:
        raise InvalidInput(
            f"{name}: expected a symmetric matrix, entries differ from those across the "
            f"diagonal by {apart / size:.1e} of the largest"
        )
    if out.diagonal().min(initial=np.inf) <= 0:
        at = int(out.diagonal().argmin())
        raise InvalidInput(
            f"{name}: expected positive entries on the diagonal, got {out.diagonal()[at]:g} at "
            f"node {at // dim}, component {at % dim}"
        )
    return sparse.csr_array(0.5 * (out + out.T))


def _check_free(K: sparse.csr_array, mesh: Mesh, rows: Any) -> None:
    """Raise InvalidInput unless K lets go of the body: else its rows are in another order."""
    if _lets_go(K, mesh):
        return
    fits = [
        word for word in ORDERS if isinstance(rows, str) and word != rows
        and _lets_go(_again(K, mesh, rows, word), mesh)
    ]  # fmt: skip
    hint = f"rows={fits[0]!r} does fit" if fits else (
        "if its rows belong to other nodes give rows, if supports are in it already held=True"
    )  # fmt: skip
    raise InvalidInput(
        f"K: expected the stiffness of a free body, it resists motions of the whole; {hint}"
    )


def _again(K: sparse.csr_array, mesh: Mesh, rows: str, word: str) -> sparse.csr_array:
    """K, whose rows were taken as `rows`, with them taken as `word`."""
    back = np.argsort(rows_of(mesh, rows))
    order = back[rows_of(mesh, word)]
    return sparse.csr_array(K[order][:, order])


def _lets_go(K: sparse.csr_array, mesh: Mesh) -> bool:
    """Whether translations and rotations of the whole need no force."""
    n, dim = mesh.points.shape
    x = mesh.points - mesh.points.mean(axis=0)
    motions = [np.tile(axis, (n, 1)) for axis in np.eye(dim)]
    if dim == 2:
        motions.append(np.stack([-x[:, 1], x[:, 0]], axis=1))
    else:
        motions += [np.cross(axis, x) for axis in np.eye(3)]
    both = np.stack([motion.ravel() for motion in motions], axis=1)
    force, size = np.abs(K @ both), abs(K) @ np.abs(both)
    return bool((force.max(axis=0) <= RESISTS * size.max(axis=0)).all())
