"""Sizes of contacts and of the load: with them no change of units changes an answer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...linear.dense import dense
from ...problem.friction import FrictionProblem

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

    problem in Delassus form, r (nc, d).  The load of contact i is
    |q_i + sum_{j != i} W_ij r_j|, what it would have to balance alone: its terms may cancel,
    and what is left of them decides its status.  Where all are zero r_i = 0 is known exactly.
    """
    share, _ = load_shares(problem, r)
    return bool((share >= RESOLVED).all())


def load_shares(problem: FrictionProblem, r: Array) -> tuple[Array, Array]:
    """(load of every contact, its terms without their signs), (nc,) each.

    Both relative to the largest reaction or load, scaled; infinite for a contact that can not
    react, or is not loaded by anything.
    """
    assert problem.W is not None and problem.q is not None
    W = dense(problem.W)
    q, (nc, d) = problem.q, r.shape
    size, reacts = contact_sizes(W, nc)
    root = np.sqrt(size)
    others = W.reshape(nc, d, nc, d).copy()
    others[np.arange(nc), :, np.arange(nc)] = 0.0
    others = others.reshape(nc * d, nc * d)
    load = np.linalg.norm(q + (others @ r.ravel()).reshape(nc, d), axis=1)
    terms = np.abs(q) + (np.abs(others) @ np.abs(r).ravel()).reshape(nc, d)
    largest = np.linalg.norm(root[:, None] * r, axis=1).max(initial=0.0)
    largest = max(largest, load_size(q / root[:, None], problem.mu, reacts)) or 1.0
    counts = reacts & terms.any(axis=1)
    share = np.where(counts, load / root / largest, np.inf)
    return share, np.where(counts, np.linalg.norm(terms, axis=1) / root / largest, np.inf)


def power_of_two(x: Array | float) -> Array:
    """The nearest power of two, to multiply by without rounding."""
    return np.exp2(np.round(np.log2(x)))
