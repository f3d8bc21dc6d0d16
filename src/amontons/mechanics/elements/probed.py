"""The entries of an operator that another program has, such as a stiffness without a matrix.

Nodes whose columns have no row in common are asked together: the product with the sum of their
unit vectors has all their columns side by side ([CPR]).  Columns reach as far as cells do, so
that some thirty groups times the dimension are enough for any mesh of hexahedra.

[CPR] A. Curtis, M. Powell, J. Reid, "On the estimation of sparse Jacobian matrices",
J. Inst. Maths Applics 13 (1974) 117-119.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import LinearOperator

from ...core.errors import InvalidInput
from ..meshes.mesh import Mesh
from .pattern import node_pattern

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SAME = 1e-9  # of the largest entry: products that are those of the operator


def probed(name: str, operator: LinearOperator, order: Index, mesh: Mesh) -> sparse.csr_array:
    """A stored matrix with the products of an operator (dofs, dofs), in the order of its rows.

    order (dofs,): the row of every dof by node.  Raises InvalidInput for complex operators, and
    for those that couple nodes without a cell in common.
    """
    if np.dtype(operator.dtype).kind not in "fiu":
        raise InvalidInput(
            f"{name}: expected an operator on real numbers, got {operator.dtype}"
        )
    n, dim = mesh.points.shape
    pointers, near = node_pattern(mesh.cells, n)
    near = near.astype(np.int64)
    of = np.repeat(np.arange(n), np.diff(pointers))
    group = _groups(sparse.csr_array((np.ones(len(near)), near, pointers), shape=(n, n)))
    entries = np.zeros((len(near), dim, dim))  # row and column of each pair of nodes
    for number in range(int(group.max(initial=0)) + 1):
        columns, pairs = np.flatnonzero(group == number), np.flatnonzero(group[near] == number)
        for axis in range(dim):
            unit = np.zeros(n * dim)
            unit[order[columns * dim + axis]] = 1.0
            force = _product(name, operator, unit)[order].reshape(n, dim)
            entries[pairs, :, axis] = force[of[pairs]]
    blocks = sparse.bsr_array((entries, near, pointers), shape=(n * dim, n * dim))
    back = np.argsort(order)
    out = sparse.csr_array(blocks.tocsr()[back][:, back])
    trial = np.random.default_rng(0).standard_normal(n * dim)
    off = float(np.abs(out @ trial - _product(name, operator, trial)).max())
    if not off <= SAME * float((abs(out) @ np.abs(trial)).max()):
        raise InvalidInput(
            f"{name}: the operator couples nodes that have no cell of the mesh in common, or "
            "is not linear; give it as a matrix, operator @ np.eye(len(rows))"
        )
    return out


def _product(name: str, operator: LinearOperator, x: Array) -> Array:
    y = np.asarray(operator.matvec(x), dtype=float).ravel()
    if not np.isfinite(y).all():
        raise InvalidInput(f"{name}: expected finite products, its operator gives {y.max()}")
    return y


def _groups(near: sparse.csr_array) -> Index:
    """A number for every node (n,), other than those of all nodes with a row in common."""
    both = sparse.csr_array(near @ near)
    group = np.full(near.shape[0], -1)
    for node in range(len(group)):
        taken = group[both.indices[both.indptr[node] : both.indptr[node + 1]]]
        used = np.zeros(len(taken) + 1, dtype=bool)
        used[taken[(taken >= 0) & (taken < len(used))]] = True
        group[node] = int(used.argmin())
    return group
