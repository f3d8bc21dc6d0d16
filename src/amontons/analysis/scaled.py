"""A Coulomb problem in units of its own, made once for all that is asked about it.

Reactions times sqrt|W_ii| and velocities over it, divided by the size of the load: |W_ii| and
|q| are near 1, and no change of units changes an answer.  All factors are powers of two, so
that the scaled problem is the given one without rounding.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..core.clock import NEVER, Deadline
from ..linear.dense import dense
from ..problem.friction import FrictionProblem
from .tolerances import RESOLVED

Array = NDArray[np.float64]
STILL = 1e-10  # of W dr relative to its terms, which counts as no other motion
COPIES = 6  # of a dense W that a question holds at a time
UNRESOLVED = "the loads of contacts differ too much to tell solutions at the least loaded apart"


@dataclass(frozen=True, eq=False)
class Scaled:
    """u = W r + q in scaled variables: r * to_r and u * to_u are those of the problem.

    problem: in Delassus form.  W (nc d, nc d) dense, q (nc, d), mu (nc,).  size (nc,): |W_ii|,
    from 1/2 to 2; reacts (nc,): W_ii != 0.  to_r, to_u (nc, 1).
    """

    problem: FrictionProblem
    W: Array
    q: Array
    mu: Array
    size: Array
    reacts: NDArray[np.bool_]
    to_r: Array
    to_u: Array

    @classmethod
    def of(cls, problem: FrictionProblem | Scaled, deadline: Deadline = NEVER) -> Scaled:
        """The scaled form of a problem, condensed; what is scaled already comes back.

        Raises UnsupportedForm under Tresca's law, InvalidInput where W does not fit into
        memory, TimeUp where it is not there in time.
        """
        if isinstance(problem, Scaled):
            return problem
        mu, local = problem.mu, problem.condensed(deadline)
        assert local.q is not None
        W, root, size = scaled_blocks(dense(local.W, COPIES), local.contacts)
        reacts, root = size > 0, root[:, None]
        q = local.q / root
        unit = float(power_of_two(load_size(q, mu, reacts) or 1.0))
        return cls(local, W, q / unit, mu, np.where(reacts, size, 1.0), reacts, unit / root,
                   unit * root)  # fmt: skip

    @property
    def contacts(self) -> int:
        """nc."""
        return len(self.mu)

    @property
    def dimension(self) -> int:
        """d, 2 or 3."""
        return self.q.shape[1]

    @property
    def shape(self) -> tuple[int, int]:
        """(nc, d)."""
        return self.q.shape  # type: ignore[return-value]

    @property
    def given(self) -> Array:
        """W (nc d, nc d) in the units of the problem, dense."""
        root = np.repeat(np.sqrt(self.to_u / self.to_r), self.shape[1])
        return self.W * root * root[:, None]

    @cached_property
    def symmetric(self) -> Array:
        """(W + W^T) / 2."""
        return (self.W + self.W.T) / 2

    def velocity(self, r: Array) -> Array:
        """u of a stack of reactions, (k, nc, d)."""
        return (r.reshape(len(r), -1) @ self.W.T).reshape(r.shape) + self.q

    # ---------------------------------------------------------------- how loads compare
    def largest(self, *known: Array) -> float:
        """The largest sqrt|W_ii| |r_i| of reactions (nc, d), or |q_i| / sqrt|W_ii| of the load.

        By |W_ii| itself, not by the power of two next to it: both scales would be off by it.
        """
        root = np.sqrt(self.size)[:, None]
        sizes = [float(np.linalg.norm(root * r, axis=1).max(initial=0.0)) for r in known]
        return max([*sizes, load_size(self.q / root, self.mu, self.reacts)]) or 1.0

    def relative(
        self, off: Array | float, *known: Array, largest: float | None = None
    ) -> float:
        """A bound of how far scaled reactions are off, each or (nc, d), over `largest`."""
        root = np.sqrt(self.size)[:, None]
        most = self.largest(*known) if largest is None else largest
        return float((root * off).max(initial=0.0)) / most

    def load_shares(self, r: Array) -> tuple[Array, Array]:
        """(load of every contact, its terms without their signs), (nc,) each, at r scaled.

        The load of contact i is |q_i + sum_{j != i} W_ij r_j|, what it would have to balance
        alone.  Both relative to the largest reaction or load; infinite for a contact that can
        not react, or is not loaded by anything.
        """
        nc, d = self.shape
        root, own = np.sqrt(self.size), np.arange(nc)
        others = self.W.reshape(nc, d, nc, d).copy()
        others[own, :, own] = 0.0
        others = others.reshape(nc * d, nc * d)
        load = np.linalg.norm(self.q + (others @ r.ravel()).reshape(nc, d), axis=1)
        terms = np.abs(self.q) + (np.abs(others) @ np.abs(r).ravel()).reshape(nc, d)
        largest = self.largest(r)
        counts = self.reacts & terms.any(axis=1)
        share = np.where(counts, load / root / largest, np.inf)
        return share, np.where(counts, np.linalg.norm(terms, axis=1) / root / largest, np.inf)

    def resolves(self, r: Array) -> bool:
        """False where a contact is loaded so much less than others that tolerances swallow it.

        The terms of its load may cancel, and what is left of them decides its status.  Where
        all are zero r_i = 0 is known exactly.
        """
        return bool((self.load_shares(r)[0] >= RESOLVED).all())

    def rests(self, dr: Array) -> bool:
        """True where reactions that differ by dr (nc, d), unscaled, move nothing.

        W dr is compared with sqrt|W_ii| sum_j sqrt|W_jj| |dr_j|, so that it does not matter how
        small dr is: solutions of different status that are near to each other do not pass.
        """
        dr, root = dr / self.to_r, np.sqrt(self.size)
        terms = root * (root @ np.abs(dr).sum(axis=1))
        motion = np.abs((self.W @ dr.ravel()).reshape(dr.shape)).max(axis=1, initial=0.0)
        return bool((motion <= STILL * terms).all())


def scaled_blocks(W: Array, contacts: int) -> tuple[Array, Array, Array]:
    """(W / root_i / root_j, root (nc,), its |W_ii|_2 (nc,)), powers of two near sqrt|W_ii|.

    Contacts that can not react, |W_ii| = 0, get the largest root of the others, whatever the
    units.
    """
    d = len(W) // max(contacts, 1)
    own = np.arange(contacts)
    size = np.linalg.norm(W.reshape(contacts, d, contacts, d)[own, :, own], 2, axis=(1, 2))
    largest = size.max(initial=0.0) or 1.0
    root = power_of_two(np.sqrt(np.where(size > 0, size, largest)))
    each = root.repeat(d)
    return W / each / each[:, None], root, size / root**2


def load_size(q: Array, mu: Array, reacts: NDArray[np.bool_]) -> float:
    """Norm of q (nc, d), scaled, over the contacts whose own q can make a reaction.

    With q_N >= mu |q_T| nothing in the cone has q r < 0: an obstacle that is far away would
    set the scale otherwise, and make all solutions of the others look like one.
    """
    tangent = np.linalg.norm(q[:, 1:], axis=1)
    loaded = reacts & (q[:, 0] < mu * tangent)
    return float(np.linalg.norm(q[loaded]) or np.linalg.norm(q))


def power_of_two(x: Array | float) -> Array:
    """The nearest power of two, to multiply by without rounding."""
    return np.exp2(np.round(np.log2(x)))
