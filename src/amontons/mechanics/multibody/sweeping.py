"""What sweeps solve of a step alone: plain ones, then with momentum while that promises an end.

Momentum goes on in chunks.  With the rate at which the error has fallen in the last one it
would need so many sweeps more; where those are more than are left of MOMENTUM, as on walls
that stand and have more reactions than balances, the solvers are better asked at once.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...core.clock import now
from ...problem.judge.measures import natural_error
from ...problem.law.law import COULOMB, TIED
from ...solvers.judging import BLUR
from .quick import Found, Posed, eliminated_of, solved

Array = NDArray[np.float64]
WORK = 100_000  # blocks of W that plain sweeps multiply at most
FEWEST = 20  # sweeps that are worth to begin with
MOMENTUM = 2000  # sweeps with momentum before the solvers are asked
CHUNK = 250  # of them, after which the rate is told
MORE = 200_000_000  # what they cost at most, in blocks, for many contacts
CONTACT = 15  # blocks that take as long as the solution of a contact


def found_quickly(
    posed: Posed, contacts: int, mu: float, tolerance: float
) -> tuple[Found | None, Array]:
    """What sweeps find, None where they do not meet the tolerance; and how far they came."""
    blocks = max(len(posed.indices), 1)
    plain = WORK // blocks
    plain = plain if plain >= FEWEST else 0
    left = min(MOMENTUM, MORE // (blocks + CONTACT * len(posed.q)))
    goal = tolerance * float(np.linalg.norm(posed.q))
    began, swept, error = now(), 0, math.inf
    while True:
        chunk = min(CHUNK, left) if left >= FEWEST else 0
        r, (u, status, sliding), done, judged, worst, contact = solved(
            *posed, contacts, mu, tolerance, BLUR * tolerance, plain, chunk
        )
        if done >= 0:
            return Found(posed, contacts, mu, tolerance, r, u, status, sliding, swept + done,
                         judged, (worst, contact), now() - began), r  # fmt: skip
        swept, left, plain = swept + plain + chunk, left - chunk, 0
        before, error = error, _error(posed, contacts, mu, r)
        if left < FEWEST or not goal < error < before:
            return None, r
        if before < math.inf:
            needed = CHUNK * math.log(error / goal) / math.log(before / error)
            if needed > left:
                return None, r
        posed = posed._replace(start=r)


def _error(posed: Posed, contacts: int, mu: float, r: Array) -> float:
    """Of impulses r (n, 3), unit of u."""
    n = len(posed.q)
    is_free = np.arange(n) < contacts
    kind = np.where(is_free, np.int8(COULOMB), np.int8(TIED))
    parameters = np.full((n, 2), np.inf)
    parameters[:, 0] = np.where(is_free, mu, 0.0)
    rho = eliminated_of(posed.data, posed.diagonal)[1]
    return float(natural_error(posed.indptr, posed.indices, posed.data, posed.q, kind,
                               parameters, rho, r))  # fmt: skip
