"""The portfolio on the Delassus form: what `Auto` runs there, one stage after another.

    Coulomb   Gauss-Seidel sweeps with Anderson acceleration as long as their measured rate
              promises an end before smoothing Newton would be there, or until they have cost
              as much; where Newton is dear, relaxed sweeps in a race (`race`)
              worth one Newton; semismooth Newton where W is dense (deformable bodies);
              interior point on the convex relaxation, sweeps from there; smoothing Newton
              from the best point and from zero; proximal point; relaxed sweeps worth the cost
              of Newton so far; every method alone from the start; again from the interior
              point, the methods alone from a disturbed reaction
    Tresca    the same sweeps, then semismooth Newton

Every stage starts from the best reaction so far, and is dropped when it does not help.  Costs
are operation counts, so that the same problem takes the same path on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ...core.errors import SingularOperator
from ...linear.blocks import spatial
from ...problem.friction import FrictionProblem
from ...problem.judge.measures import natural_error
from ...problem.law.cones import Tresca
from ..contract import Breakdown, Iterate, Patience, Solver, Target
from ..newton.functions import JeanMoreau, NaturalMap
from ..newton.interior_point import STAGE, InteriorPoint, sliding_speed
from ..newton.semismooth import SemismoothNewton
from ..newton.smoothing import ProximalPoint, SmoothingNewton, Workspace
from ..sweeps.gauss_seidel import GaussSeidel
from ..sweeps.kernels import Acceleration, SweepOrder, sweep_data, sweeps_inplace, watch_for
from .race import Race

Array = NDArray[np.float64]
FIRST_SWEEPS = 10  # plain sweeps that every problem gets first
DEPTH = 10  # past sweeps that Anderson acceleration combines
CHUNK = 40  # sweeps between two looks at their rate
LONGEST = 6000  # sweeps after which Newton gets its chance whatever the rate promises
HOPELESS = 8.0  # sweeps that promise to cost this many times Newton are left at once
NEWTON_STEPS = 120
INTERIOR_STEPS = 60
NEARLY = 30.0  # error, in goals, from which Newton alone is the shorter way
PATIENCE = 20  # Newton steps without halving the error
SEMISMOOTH_CONTACTS = 600  # above, a dense factor costs more than it brings
DENSE = 0.5  # share of blocks of W above which it comes from a mesh
ROUNDS = 12  # repetitions of the last stages before Auto gives up
# Nanoseconds measured on one core: only their ratios matter, and only roughly.
SWEEP_BLOCK = 2.0
SWEEP_CONTACT = 30.0
HISTORY_CONTACT = 35.0
PRODUCT = 5.4
NEWTON_CONTACT = 500.0
NEWTON_START, NEWTON_PER_DIGIT = 20, 8  # steps that smoothing Newton takes, typically
RACE_PATIENCE = 249  # times 100 sweeps without progress; fewer than the driver allows
RACE_FIRST = 50.0  # sweeps that a Newton step costs, from which relaxed sweeps come first
# Methods from the start, and the iterates without halving their error after which they end.
ALONE_SMALL: tuple[tuple[Solver, int], ...] = (
    (SemismoothNewton(function=NaturalMap()), 15),
    (SemismoothNewton(function=JeanMoreau()), 15),
)
ALONE: tuple[tuple[Solver, int], ...] = (
    (SmoothingNewton(batch=5), 6),
    (ProximalPoint(), 25),
    (InteriorPoint(), 8),
    (GaussSeidel(batch=2000, relaxation=1.3), 40),
    (GaussSeidel(batch=2000, relaxation=0.9), 40),
)


@dataclass(eq=False)
class Portfolio:
    """One run on the Delassus form; r is the best reaction so far, (nc, 3)."""

    problem: FrictionProblem
    target: Target
    r: Array
    error: float = math.inf  # of r, unit of u
    latest: float = math.inf  # of the last reaction tried
    budget: float = 0.0  # cost of Newton steps not yet matched by sweeps

    def __post_init__(self) -> None:
        self.start = self.r
        self.error = self._judge(self.r) if self.r.any() else math.inf
        self.goal = self.target.tolerance * self.problem.q_norm
        self.data = sweep_data(self.problem, order=SweepOrder.APPROACH)

    def stages(self) -> Iterator[Iterate]:
        """All stages in the order of the module's text."""
        yield from self._sweeping()
        if isinstance(self.problem.law, Tresca):
            yield from self._semismooth()
            return
        if self.problem.blocks.density > DENSE:  # deformable bodies: W is regular
            yield from self._semismooth(steps=15)
        for round_ in range(ROUNDS):
            if self.error > NEARLY * self.goal:
                yield from self._interior_point(round_)
            yield from self._newton(round_)
            yield from self._proximal(round_)
            if round_ and self.problem.contacts <= SEMISMOOTH_CONTACTS:
                yield from self._semismooth(steps=15)
            yield from self._patient_sweeps()
            if round_ % 2 == 0:
                yield from self._alone(round_)

    # ---------------------------------------------------------------- stages
    def _sweeping(self) -> Iterator[Iterate]:
        """Accelerated sweeps while they promise an end, then relaxed ones worth one Newton."""
        memory = Acceleration(self.data, self.r, DEPTH)
        done, spent, last = 0, 0.0, self.error
        watch = watch_for(self.goal)
        while done < LONGEST:
            count = memory.sweep(max(CHUNK, done // 4), watch)
            yield self._offer(memory.r.copy(), count, "Anderson Gauss-Seidel", watch[2])
            done, spent = done + count, spent + self.costs["accelerated"] * count
            promise = self.costs["accelerated"] * self._sweeps_left(last, count)
            last, newton = self.latest, self._newton_cost()
            if promise > (1.0 if spent > newton else HOPELESS) * newton:
                break
        left = (self._newton_cost() - spent) / self.costs["sweep"]
        race = self.costs["newton"] > RACE_FIRST * self.costs["sweep"]
        patience = Patience(RACE_PATIENCE, 0.7, self.error)
        while race and left > 0 and self.error > self.goal:
            iterate = self._relaxed(100)
            left -= iterate.iterations
            yield iterate
            if patience.over(self.error):
                return

    def _relaxed(self, sweeps: int) -> Iterate:
        """Sweeps of the race between relaxations (see `Race`)."""
        track, count = self.race.run(sweeps, self.goal)
        return self._offer(
            track.r.copy(), count, f"Gauss-Seidel, relaxation {track.relaxation:g}", track.error
        )

    @cached_property
    def race(self) -> Race:
        """Over-relaxed sweeps from the first point: accelerated ones keep the slow modes."""
        r = spatial(self.start)
        sweeps_inplace(self.data, r, FIRST_SWEEPS, watch_for(0.0))
        return Race(self.problem, r)

    def _sweeps_left(self, before: float, count: int) -> float:
        """Sweeps to the goal at the rate of the last `count`, infinite without progress."""
        if before == math.inf:  # no rate yet
            return 0.0
        if not math.isfinite(self.latest):
            return math.inf
        rate = math.log(max(before, 1e-300) / max(self.latest, 1e-300)) / count
        left = math.log(max(self.latest / self.goal, 1.0))
        return left / rate if rate > 0 else math.inf

    def _patient_sweeps(self) -> Iterator[Iterate]:
        """Relaxed sweeps worth what Newton has cost, until 2000 of them gain nothing."""
        self.race.enter(self.r)
        mark, count = self.error, 0
        while self.budget > 0 and count < 2000 and self.error > self.goal:
            iterate = self._relaxed(100)
            count += iterate.iterations
            self.budget -= iterate.iterations * self.costs["sweep"]
            yield iterate
            if self.error < 0.7 * mark:
                mark, count = self.error, 0
        self.budget = 0.0

    @cached_property
    def work(self) -> Workspace:
        """Symbolic factor, made when Newton is first thought of."""
        return Workspace.of(self.problem)

    @cached_property
    def costs(self) -> dict[str, float]:
        """Nanoseconds of a sweep, an accelerated sweep and a Newton step, by operations."""
        blocks, contacts = len(self.problem.blocks.indices), self.problem.contacts
        if isinstance(self.problem.law, Tresca):
            newton = 0.3 * float(3 * contacts) ** 3
        else:
            newton = PRODUCT * self.work.symbolic.products + NEWTON_CONTACT * contacts
            newton += 2 * SWEEP_BLOCK * blocks
        return {
            "sweep": self.sweep_cost,
            "accelerated": self.accelerated_cost,
            "newton": newton,
        }

    @property
    def sweep_cost(self) -> float:
        """Nanoseconds of a sweep."""
        blocks, contacts = len(self.problem.blocks.indices), self.problem.contacts
        return SWEEP_BLOCK * blocks + SWEEP_CONTACT * contacts

    @property
    def accelerated_cost(self) -> float:
        """Nanoseconds of an accelerated sweep."""
        return self.sweep_cost + HISTORY_CONTACT * self.problem.contacts

    def _newton_cost(self) -> float:
        """Nanoseconds that Newton will take from here."""
        digits = math.log10(max(self.error / self.goal, 1.0))
        return self.costs["newton"] * (NEWTON_START + NEWTON_PER_DIGIT * digits)

    def _newton(self, round_: int) -> Iterator[Iterate]:
        """Smoothing Newton from the best point and from zero, in several variants."""
        root = math.sqrt(self.problem.contacts)
        nearby = max(self.error, self.goal) / root
        afar = 0.1 * self.problem.q_norm / root
        zero = np.zeros_like(self.r)
        starts = [(self.r, 10 * nearby, 0.3), (zero, afar, 0.3)]
        if self.problem.contacts <= 300 or round_:  # variants are cheap there
            starts += [(self.r, nearby, 0.3), (zero, 10 * afar, 0.5)]
        for origin, sigma, shrink in starts:
            count, _, _, found = self.work.newton(
                origin.copy(), sigma, SmoothingNewton(shrink=shrink), goal=0.5 * self.goal,
                steps=self._affordable(NEWTON_STEPS), patience=PATIENCE,
            )  # fmt: skip
            self.budget += abs(count) * self.costs["newton"]
            yield self._offer(found, abs(count), "smoothing Newton")

    def _interior_point(self, round_: int) -> Iterator[Iterate]:
        """Convex relaxations and sweeps from them, until two of both bring nothing.

        The first time without sliding: that of an unfinished reaction is mostly noise.
        """
        solver = InteriorPoint(steps=self._affordable(INTERIOR_STEPS))
        slip = np.zeros(self.problem.contacts)
        if round_:
            slip = sliding_speed(self.problem, self.r[:, : self.problem.dimension])
        patience = Patience(3, 0.1, self.error)
        for iterate in solver.relaxations(self.work, slip, self.target):
            if iterate.stage == STAGE:
                self.budget += iterate.iterations * self.costs["newton"]
            yield self._offer(spatial(iterate.r), iterate.iterations, iterate.stage)
            if patience.over(self.error):
                return

    def _proximal(self, round_: int) -> Iterator[Iterate]:
        """Proximal point while it makes progress."""
        x = self.r.copy()
        self.work.sweeps(x, 10)
        patience = Patience(25, mark=self.error)
        for iterate in ProximalPoint(alpha=1e-2 * 0.1**round_).steps(
            self.work, x, self.target.deadline
        ):
            self.budget += iterate.iterations * self.costs["newton"]
            yield self._offer(spatial(iterate.r), iterate.iterations, "proximal point")
            if patience.over(self.error):
                return

    def _alone(self, round_: int) -> Iterator[Iterate]:
        """Every method by itself, from the start and then from disturbed best reactions.

        The best reaction may be a trap in which whatever starts from it stays.
        """
        r = self.start
        if round_:
            random = np.random.default_rng(round_)
            r = self.r * random.uniform(0.0, 2.0, (len(self.r), 1))
        start = Iterate(r[:, : self.problem.dimension].copy())
        small = self.problem.contacts <= SEMISMOOTH_CONTACTS
        for solver, most in (ALONE_SMALL if small else ()) + ALONE:
            patience = Patience(most)
            try:
                for iterate in solver.iterates(self.problem, start, self.target):
                    yield self._offer(
                        spatial(iterate.r), iterate.iterations, type(solver).__name__
                    )
                    if patience.over(self.latest):
                        break
            except (Breakdown, SingularOperator):
                continue

    def _semismooth(self, steps: int = 60) -> Iterator[Iterate]:
        start = Iterate(self.r[:, : self.problem.dimension].copy())
        try:
            newton = SemismoothNewton().iterates(self.problem, start, self.target)
            for iterate in islice(newton, steps):
                yield self._offer(spatial(iterate.r), 1, "semismooth Newton")
        except (Breakdown, SingularOperator):
            return

    # ---------------------------------------------------------------- bookkeeping
    def _affordable(self, steps: int) -> int:
        """Newton steps of one compiled call that still fit before the driver's deadline."""
        left = self.target.seconds_left
        return (
            steps
            if math.isinf(left)
            else max(1, min(steps, int(1e9 * left / self.costs["newton"])))
        )

    def _judge(self, r: Array) -> float:
        return natural_error(*self.problem.kernel_data, r)

    def _offer(self, x: Array, iterations: int, stage: str, error: float = math.inf) -> Iterate:
        """Keep x if it is better, and hand out the best; error of x, unit of u, if known."""
        self.latest = error = error if error < math.inf else self._judge(x)
        if error < self.error:
            self.r, self.error = x, error
        return Iterate(
            self.r[:, : self.problem.dimension].copy(), iterations=iterations, stage=stage
        )
