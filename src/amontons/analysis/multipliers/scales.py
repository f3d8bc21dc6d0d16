"""Sizes of contacts and of the load: with them no change of units changes an answer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...dense import dense
from ...problem import FrictionProblem

Array = NDArray[np.float64]
UNRESOLVED = "the loads of contacts differ too much to tell solutions at the least loaded apart"
RESOLVED = 1e-6  # load of a contact relative to the largest load or reaction, scaled


def contact_sizes(W: Array, contacts: int) -> tuple[Array, NDArray[np.bool_]]:
    """(|W_ii|_2 (nc,), W_ii != 0 (nc,)): the scale of every contact, and whether it can react.

    Those that can not get the largest scale of the others, whatever the units.
    """
    d = len(W) // max(contacts, 1)
    own = np.arange(contacts)
    size = np.linalg.norm(W.reshape(contacts, d, contacts, d)[own, :, own], 2, axis=(1, 2))
    reacts = size > 0
    largest = size.max(initial=0.0)
    return np.where(reacts, size, largest if largest > 0 else 1.0), reacts


def load_size(q: Array, mu: Array, reacts: NDArray[np.bool_]) -> float:
    """Norm of q (nc, d), scaled, over the contacts whose own q can make a reaction.

    With q_N >= mu |q_T| nothing in the cone has q r < 0: an obstacle that is far away would
    set the scale otherwise, and make all solutions of the others look like one.
    """
    tangent = np.linalg.norm(q[:, 1:], axis=1)
    loaded = reacts & (q[:, 0] < mu * tangent)
    return float(np.linalg.norm(q[loaded]) or np.linalg.norm(q))


def resolves(problem: FrictionProblem, r: Array) -> bool:
    """False where a contact is loaded so much less than others that tolerances swallow it.

    problem in Delassus form, r (nc, d).  The load of a contact is |q_i| + sum |W_ij| |r_j|.
    """
    assert problem.W is not None and problem.q is not None
    W = dense(problem.W)
    q, (nc, d) = problem.q, r.shape
    size, reacts = contact_sizes(W, nc)
    load = np.linalg.norm(np.abs(q) + (np.abs(W) @ np.abs(r).ravel()).reshape(nc, d), axis=1)
    load /= np.sqrt(size)
    largest = np.linalg.norm(np.sqrt(size)[:, None] * r, axis=1).max(initial=0.0)
    largest = max(largest, load_size(q / np.sqrt(size)[:, None], problem.mu, reacts))
    return not bool((reacts & (load > 0) & (load < RESOLVED * largest)).any())
