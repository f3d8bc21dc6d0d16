"""Status of every contact, by one exact local solve about the solution: no threshold decides."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .blocks import spatial
from .cones import Tresca
from .one_contact import OPEN, STICK, classify_contacts
from .problem import Form, FrictionProblem

Array = NDArray[np.float64]


def classify(
    problem: FrictionProblem, r: Array, u: Array
) -> tuple[NDArray[np.int8], NDArray[np.bool_], Array]:
    """(status, sliding, margin), each (nc,), of reactions r and velocities u, (nc, d).

    margin is the distance to the nearest change of status, in the unit of r_N: rho u_N for an
    open contact, the smaller of r_N and the slack of the friction bound for a sticking one, the
    smaller of r_N and rho |u_T| for a slipping one.
    """
    status = np.zeros(problem.contacts, dtype=np.int8)
    sliding = np.zeros(problem.contacts, dtype=np.bool_)
    stiffness = _local_operator(problem)
    r3, u3 = spatial(r), spatial(u)
    law = problem.law
    tresca = isinstance(law, Tresca)
    classify_contacts(stiffness, u3, r3, law.coefficient, tresca, status, sliding)
    return status, sliding, _margin(problem, r, u, status)


def _local_operator(problem: FrictionProblem) -> Array:
    """Any positive definite local operator gives the same state at a solution: take W_ii."""
    if problem.form is Form.DELASSUS:
        return problem.blocks.diagonal_blocks
    if problem.dimension == 3:
        return problem.local_stiffness
    out = np.zeros((problem.contacts, 3, 3))
    out[:, :2, :2] = problem.local_stiffness
    out[:, 2, 2] = np.maximum(out[:, 1, 1], np.finfo(float).tiny)
    return out


def _margin(problem: FrictionProblem, r: Array, u: Array, status: NDArray[np.int8]) -> Array:
    slack = problem.law.bound(r) - np.linalg.norm(r[:, 1:], axis=1)
    slide = problem.rho * np.linalg.norm(u[:, 1:], axis=1)
    closed = np.minimum(r[:, 0], np.where(status == STICK, slack, slide))
    return np.maximum(np.where(status == OPEN, problem.rho * u[:, 0], closed), 0.0)
