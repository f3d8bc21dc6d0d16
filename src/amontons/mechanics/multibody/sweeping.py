"""What is solved of a step without the solvers: sweeps, interior points on the bodies.

Few contacts are swept until they are solved.  Many are swept with momentum, in chunks, while
the rate at which the error has fallen in the last chunk promises an end for less than an
interior point costs.  Where it does not, as in walls, which have more reactions than balances,
the law is solved by an interior point on the bodies (`solvers.newton.body_relaxation`), from
anew, which mostly takes some ten steps however many reactions there are to choose from.  Where
that comes to a halt sweeps go on from there, and then convex relaxations with the sliding
velocities of the best reactions, and sweeps in turn, which find the sliding that the next
relaxation is given.  What that does not solve goes to the solvers.

Costs are operations counted, so that a step ends alike on all processors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.clock import now
from ...problem.friction import FrictionProblem
from ...problem.judge.measures import natural_error
from ...problem.law.law import COULOMB, TIED
from ...solvers.judging import BLUR
from ...solvers.newton.body_relaxation import BodyMatrix, body_matrix, relaxed
from ...solvers.sweeps.on_bodies import driven_inplace, felt_inplace
from .quick import Found, Posed, eliminated_of, law_of, solved
from .rows import Mobility, Rows, levers_of

Array = NDArray[np.float64]
WORK = 100_000  # blocks of W that plain sweeps multiply at most
FEWEST = 20  # sweeps that are worth to begin with
CHUNK = 250  # sweeps with momentum, after which the rate is told
LONGEST = 1000  # after relaxations that have not helped
STEPS = 60  # of a relaxation at most
ROUNDS = 30  # relaxations before the solvers are asked
PATIENCE = 5  # of them without halving the error
# Nanoseconds, only ratios count: of a plain sweep per block of W; of a sweep with momentum per
# contact; of a step of an interior point per contact and per product of blocks; of one at most,
# beyond which packings in space fill in.
BLOCK, SWEEP, STEP, PRODUCT, MOST = 30.0, 120.0, 900.0, 12.0, 1e9
USUAL = 10  # steps of an interior point that gets there
FOLLOWED = 0.95  # part of the slope of |u_T| that its steps know
NO_LEVERS, NO_SIDES = np.zeros((0, 2, 3, 6)), np.zeros((0, 2), np.int64)


@dataclass(eq=False)
class Search:
    """The impulses of one problem of a step, and the best that was found so far.

    rows and mobility: what W is made of.
    """

    posed: Posed
    rows: Rows
    mobility: Mobility
    contacts: int
    mu: float
    tolerance: float
    r: Array = field(init=False)
    latest: Array = field(init=False)  # what the last sweeps came to
    error: float = math.inf
    swept: int = 0
    relaxing: int = 0  # steps of relaxations

    def __post_init__(self) -> None:
        self.r = self.latest = self.posed.start
        self.began = now()
        self.goal = self.tolerance * float(np.linalg.norm(self.posed.q))

    # ------------------------------------------------------------------ what it is made of
    @cached_property
    def levers(self) -> Array:
        """(n, 2, 3, 6), see `levers_of`."""
        return levers_of(*self.rows, *self.mobility)

    @cached_property
    def sides(self) -> NDArray[np.int64]:
        """Bodies (n, 2) of each row."""
        return np.ascontiguousarray(np.stack([self.rows.slave, self.rows.master], axis=1))

    @cached_property
    def matrix(self) -> BodyMatrix:
        """Pattern of the relaxation's."""
        return body_matrix(self.sides, len(self.mobility[0]))

    @cached_property
    def law(self) -> tuple[Any, Array, Array]:
        """kind (n,), parameters (n, 2), rho (n,)."""
        n = len(self.posed.q)
        is_free = np.arange(n) < self.contacts
        parameters = np.full((n, 2), np.inf)
        parameters[:, 0] = np.where(is_free, self.mu, 0.0)
        kind = np.where(is_free, np.int8(COULOMB), np.int8(TIED))
        return kind, parameters, eliminated_of(self.posed.data, self.posed.diagonal)[1]

    @property
    def relaxation_cost(self) -> float:
        """Nanoseconds of a usual interior point."""
        return USUAL * (STEP * len(self.posed.q) + PRODUCT * self.matrix.products)

    @property
    def problem(self) -> FrictionProblem:
        """The same for the solvers, who cannot write to it."""
        n = len(self.posed.q)
        return self.posed.problem(law_of(self.contacts, n - self.contacts, self.mu))

    # ------------------------------------------------------------------ what it does
    def sweep(self, start: Array, plain: int, momentum: int) -> Found | None:
        """Sweeps from impulses (n, 3); what they solve, else None with the error noted."""
        given: tuple[Any, ...] = NO_LEVERS, NO_SIDES, 0
        if momentum:
            given = self.levers, self.sides, len(self.mobility[0])
        r, (u, status, sliding), done, judged, worst, contact = solved(
            *self.posed._replace(start=start), self.contacts, self.mu, self.tolerance,
            BLUR * self.tolerance, plain, momentum, *given,
        )  # fmt: skip
        if done >= 0:
            return Found(
                self.posed, self.contacts, self.mu, self.tolerance, r, u, status, sliding,
                self.swept + self.relaxing + done, judged, (worst, contact), now() - self.began,
            )  # fmt: skip
        self.swept += plain + momentum
        self.latest = r
        # sweeps that still change much may have met the goal without being asked
        small = self.offer(r) <= self.goal and plain + momentum > 0
        return self.sweep(r, 0, 0) if small else None

    def offer(self, r: Array) -> float:
        """Keep impulses that are the best so far; their error, unit of u."""
        kind, parameters, rho = self.law
        p = self.posed
        error = natural_error(p.indptr, p.indices, p.data, p.q, kind, parameters, rho, r)
        if error < self.error:
            self.r, self.error = r, float(error)
        return float(error)

    def swept_while_promising(self, start: Array) -> Found | None:
        """Chunks of sweeps with momentum, one at least."""
        cost, before = SWEEP * len(self.posed.q), math.inf
        # two of them cost what an interior point costs, if that is not more than can be paid
        worth = self.relaxation_cost if self.relaxation_cost <= MOST else math.inf
        chunk = int(min(max(0.5 * worth / cost, FEWEST), CHUNK))
        r = start
        while True:
            found = self.sweep(r, 0, chunk)
            if found is not None or not self.goal < self.error < before:
                return found
            if before < math.inf:
                needed = chunk * math.log(self.error / self.goal)
                needed /= math.log(before / self.error)
                if cost * needed > self.relaxation_cost:
                    return None
            before, r = self.error, self.r

    def relax(self, part: float = 0.0) -> Array:
        """Impulses of the relaxation with the sliding of those that were swept last.

        part: of the slope of |u_T|; where it is not 0, those of the law.
        """
        moved, u = np.empty((len(self.mobility[0]), 6)), np.empty_like(self.latest)
        driven_inplace(self.levers, self.sides, self.latest, moved)
        felt_inplace(self.levers, self.sides, moved, u)
        u += self.posed.q
        kind, parameters, rho = self.law
        p = self.posed
        r, steps = relaxed(
            self.levers, self.sides, self.matrix, (p.indptr, p.indices, p.data), p.q,
            (kind, parameters), rho, np.hypot(u[:, 1], u[:, 2]), part, self.goal, STEPS,
        )  # fmt: skip
        self.relaxing += steps
        return r


def found_quickly(search: Search) -> tuple[Found | None, Array]:
    """What is found, None where the tolerance is not met; and the best impulses (n, 3)."""
    blocks = max(len(search.posed.indices), 1)
    plain = WORK // blocks
    if plain >= FEWEST:
        worth = int(USUAL * STEP * len(search.posed.q) / (BLOCK * blocks))
        plain = min(plain, max(FEWEST, worth))  # what a relaxation costs at least
        found = search.sweep(search.r, plain, 0)
        if found is not None:
            return found, found.r
    if not 0.0 < search.goal < math.inf:
        return None, search.r
    found = search.swept_while_promising(search.r)
    mark, waited, chunk = search.error, 0, CHUNK
    for k in range(ROUNDS):
        if found is not None:
            return found, found.r
        if not search.error > search.goal or search.relaxation_cost > MOST:
            break
        before = search.error
        found = search.sweep(search.relax(0.0 if k else FOLLOWED), 0, chunk)
        waited += 1
        if not search.error < before:
            chunk = min(2 * chunk, LONGEST)
        if search.error < 0.5 * mark:
            mark, waited, chunk = search.error, 0, CHUNK
        if waited > PATIENCE:
            break
    return found, search.r if found is None else found.r
