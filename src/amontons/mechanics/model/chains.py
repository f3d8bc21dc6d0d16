"""Equations in which the dependent of one is independent in another, substituted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from ...core.errors import InvalidInput
from .beside import Beside
from .constraint_rows import Rows
from .constraints import Axes, Constraint, Coupling, Equation, Pretension

Mask = NDArray[np.bool_]
NOTHING = 1e-14  # coefficient relative to the largest of its row that terms leave of each other


def dependence(
    rows: Rows, constraints: Sequence[Constraint], beside: Beside, is_fixed: Mask
) -> sparse.csr_array:
    """A (m, dofs) with u[dependent] = A u, whose columns at all dependents are zero.

    Raises InvalidInput, with the address of a constraint, where two prescribe one dof, where a
    support prescribes what an equation does, and for equations that go round in a circle.
    """
    _check_once(rows, constraints, beside)
    _check_free(rows, constraints, beside, is_fixed)
    m = len(rows.dependent)
    if not m:
        return rows.matrix
    own = rows.matrix[:, rows.dependent].diagonal()
    size = abs(rows.matrix).max(axis=1).toarray().ravel()
    lost = np.flatnonzero(np.abs(own) <= NOTHING * size)
    if lost.size:
        k = int(rows.owner[lost[0]])
        raise InvalidInput(
            f"the coefficients of {beside.where(int(rows.dependent[lost[0]]))}, which is to be "
            "eliminated, add up to 0; put another term first", ("constraints", k), "",
        )  # fmt: skip
    scaled = sparse.csr_array(sparse.diags_array(1 / own) @ rows.matrix)
    eliminated = np.zeros(beside.total, dtype=bool)
    eliminated[rows.dependent] = True
    among = sparse.csr_array(scaled[:, rows.dependent] - sparse.eye_array(m))
    among.eliminate_zeros()
    term = sparse.csr_array(-(scaled @ sparse.diags_array((~eliminated).astype(float))))
    term.eliminate_zeros()
    total = term
    _check_ends(among, rows, constraints, beside)
    while among.nnz and term.nnz:
        term = sparse.csr_array(-(among @ term))
        term.eliminate_zeros()
        total = sparse.csr_array(total + term)
    return total


def _check_ends(
    among: sparse.csr_array, rows: Rows, constraints: Sequence[Constraint], beside: Beside
) -> None:
    """Raise InvalidInput for a dof that depends on itself through others."""
    count, label = csgraph.connected_components(among, connection="strong")
    if count == among.shape[0]:
        return
    first = int(np.flatnonzero(np.bincount(label)[label] > 1)[0])
    k = int(rows.owner[first])
    raise InvalidInput(
        f"{beside.where(int(rows.dependent[first]))} depends on itself through other "
        "constraints; put other terms first", ("constraints", k), title(constraints[k], k),
    )  # fmt: skip


def _check_once(rows: Rows, constraints: Sequence[Constraint], beside: Beside) -> None:
    order = np.argsort(rows.dependent, kind="stable")
    same = np.flatnonzero(np.diff(rows.dependent[order]) == 0)
    if not same.size:
        return
    first, second = (int(rows.owner[order[same[0] + k]]) for k in (0, 1))
    raise InvalidInput(
        f"{beside.where(int(rows.dependent[order[same[0]]]))} is eliminated by "
        f"{title(constraints[first], first)} already; a dof can depend on others only once",
        ("constraints", second), title(constraints[second], second),
    )  # fmt: skip


def _check_free(
    rows: Rows, constraints: Sequence[Constraint], beside: Beside, is_fixed: Mask
) -> None:
    """Supports may hold what couplings move, but not what equations prescribe."""
    for i in np.flatnonzero(is_fixed[rows.dependent]):
        k = int(rows.owner[i])
        if isinstance(constraints[k], Equation):
            raise InvalidInput(
                f"{beside.where(int(rows.dependent[i]))} is eliminated here, and a support "
                "prescribes it too; put another term first, or leave one of them out",
                ("constraints", k), title(constraints[k], k),
            )  # fmt: skip


def title(part: Constraint, number: int) -> str:
    """What a constraint is called in messages."""
    if isinstance(part, Coupling):
        return f"coupling of {part.on!r}"
    if isinstance(part, Pretension):
        return f"pretension {part.name!r}"
    if isinstance(part, Axes):
        return f"axes {part.name!r}"
    return f"equation {part.name!r}" if part.name else f"equation {number}"
