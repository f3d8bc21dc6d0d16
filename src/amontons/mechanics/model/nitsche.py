"""From an assembled model with Nitsche's contact to its discrete problem."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...linear.grid_matrix import GridMatrix
from ...problem.law import Law
from ...problem.nitsche import NitscheMatrices, NitscheProblem
from .assembly import Discretisation

Array = NDArray[np.float64]


def nitsche_matrices(parts: Discretisation, held: bool) -> NitscheMatrices:
    """The matrices on the free dofs; held: supports leave no rigid motion."""
    M = parts.M.tocsc() if isinstance(parts.M, GridMatrix) else parts.M
    terms = [p.nitsche for p in parts.placed if p.nitsche is not None]
    return NitscheMatrices(
        M,
        parts.H,
        sparse.csc_array(_tractions(parts).tocsr()[parts.free]),
        weights=parts.sites.weights,
        kappa=np.concatenate([t.kappa for t in terms]),
        theta=np.concatenate([t.theta for t in terms]),
        stiffness=np.concatenate([t.stiffness for t in terms]),
        held=held,
    )


def nitsche_problem(  # noqa: PLR0913
    parts: Discretisation, matrices: NitscheMatrices, f: Array, w: Array, prescribed: Array,
    law: Law, name: str,
) -> NitscheProblem:  # fmt: skip
    """The problem with a load f (n,), local values w (q, d) and prescribed values (dofs,)."""
    t0 = (_tractions(parts).T @ prescribed).reshape(w.shape)
    return NitscheProblem(matrices, f, w, t0, law, name)


def _tractions(parts: Discretisation) -> sparse.csc_array:
    """Rows of the slaves' tractions in all dofs, as columns (dofs, q d)."""
    terms = [p.nitsche for p in parts.placed if p.nitsche is not None]
    return sparse.csc_array(sparse.hstack([t.traction for t in terms], format="csc"))
