"""What the stages of the portfolio share: the best reaction so far, and what work costs.

Costs are operation counts, so that the same problem takes the same path on every machine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ...linear.block_kernels import is_full
from ...linear.chunks import LEAST_ENTRIES
from ...problem.friction import FrictionProblem
from ...problem.judge.measures import natural_error
from ...problem.law import Coulomb
from ..contract import Iterate, Target
from ..newton.faces import are_shared
from ..newton.inexact import InexactNewton
from ..newton.joints import Joints
from ..newton.semismooth import Condensed, SemismoothNewton
from ..newton.smoothing import Workspace
from ..sweeps.chunks import SPARSE
from ..sweeps.kernels import SweepOrder, by_approach, sweep_data

Array = NDArray[np.float64]
EXACT_WORK = 1e6  # products of blocks in an LU up to which an exact step costs no more
# Nanoseconds measured on one core: only their ratios matter, and only roughly.
SWEEP_BLOCK = 2.0
FULL_BLOCK = 0.8  # of a W by full rows, `BlockRows.rows`
SWEEP_CONTACT = 30.0
HISTORY_CONTACT, DEEP_CONTACT = 35.0, 105.0
MOMENTUM_CONTACT = 4.0
PRODUCT = 5.4
NEWTON_CONTACT = 500.0
LINEARISED = 3e5  # of a step whose function and derivatives are not compiled, besides
DENSE_STEP = 0.05  # per cube of the unknowns
LIGHT = 1e6  # nanoseconds of a step up to which its cost is told without looking for faces
DENSE = 0.5  # share of blocks of W above which it comes from a mesh
SHORT = 5e3  # nanoseconds of a sweep of a problem that is brief whatever its tolerance
LIGHT_SWEEP = 2.5e5  # nanoseconds of a sweep up to which a chunk is no time to press Ctrl-C
COARSE, BLOCKS = 1e-4, 10_000  # tolerance from which, blocks of W to which larger ones are
SIZES = 4096  # of problems whose counts are kept: time steps have the same again and again
FIRST_CHUNKS = 3  # of the first track before its rate counts
FEW = 30  # contacts up to which W may be full as all are on one rigid body


@njit(cache=True, error_model="numpy", nogil=True)
def is_meshed(blocks: int, contacts: int) -> bool:
    """True where so many stored blocks of W come from deformable bodies, all coupled."""
    return contacts > FEW and blocks > DENSE * contacts * contacts


@njit(cache=True, error_model="numpy", nogil=True)
def visits(q: Array, blocks: int) -> NDArray[np.int64]:
    """Contacts in the order in which accelerated sweeps visit them; q (nc, 3).

    By their approach, but on meshes as they are numbered: neighbours one after another, which
    takes down to a quarter of the sweeps there, and a shuffled mesh half of them.
    """
    return np.arange(len(q)) if is_meshed(blocks, len(q)) else by_approach(q)


def nanoseconds_of_sweep(blocks: int, contacts: int, more: float = 0.0) -> float:
    """Cost of a sweep with so many stored blocks of W; more: per contact, for acceleration."""
    each = FULL_BLOCK if is_full(blocks, contacts) else SWEEP_BLOCK
    return each * blocks + (SWEEP_CONTACT + more) * contacts


def is_brief(problem: FrictionProblem, tolerance: float) -> bool:
    """True where the first chunks of the first track are likely to be all that a problem needs.

    No stack is looked for then: where they are few and as cheap as the calls of the race, or
    where the goal is so near that most problems reach it in them.
    """
    blocks = len(problem.blocks.indices)
    if _is_short(blocks, problem.contacts):
        return True
    return tolerance >= COARSE and blocks <= BLOCKS


@lru_cache(maxsize=SIZES)
def _is_short(blocks: int, contacts: int) -> bool:
    """Whether a sweep costs no more than SHORT."""
    return nanoseconds_of_sweep(blocks, contacts, HISTORY_CONTACT) <= SHORT


def is_light(problem: FrictionProblem) -> bool:
    """True where the first chunks of the first track are made compiled, in one thread."""
    return _is_light(len(problem.blocks.indices), problem.contacts)


@lru_cache(maxsize=SIZES)
def _is_light(blocks: int, contacts: int) -> bool:
    shared = blocks >= LEAST_ENTRIES and blocks <= SPARSE * contacts**2
    return not shared and nanoseconds_of_sweep(blocks, contacts, HISTORY_CONTACT) <= LIGHT_SWEEP


def is_stacked(problem: FrictionProblem) -> bool:
    """True under Coulomb's law where most contacts share faces of rigid bodies.

    At rest the relaxation of the interior point is solved in a few steps there.
    """
    has_relaxations = isinstance(problem.law, Coulomb) and not problem.gains_energy
    return has_relaxations and are_shared(problem)


class Swept(NamedTuple):
    """A chunk of sweeps: r (nc, 3), how many, their operations, the error of r, unit of u."""

    r: Array
    sweeps: int
    flops: float
    error: float


class Begun(NamedTuple):
    """The first chunks of accelerated sweeps from a start, (nc, 3), and where they are.

    x (nc, 3), history, gram, stored: as of `anderson_inplace`, stored being its count; watch:
    see `watch_for`.
    """

    start: Array
    chunks: list[Swept]
    x: Array
    history: Array
    gram: Array
    stored: NDArray[np.int64]
    watch: Array


@dataclass(eq=False)
class State:
    """One run on the Delassus form; r is the best reaction so far, (nc, 3)."""

    problem: FrictionProblem
    target: Target
    r: Array
    error: float = math.inf  # of r, unit of u
    latest: float = math.inf  # of the last reaction tried
    unsaid: float = 0.0  # operations that no iterate has told yet
    begun: Begun | None = None  # what the first track has done already

    def __post_init__(self) -> None:
        self.start = self.swept = self.r  # swept: the best reaction of sweeps
        if np.count_nonzero(self.r):
            self.error, self.unsaid = self.judge(self.r), self.problem.judge_flops
        self.swept_error = self.error
        self.first_error = self.error if self.error < math.inf else self.problem.q_norm
        self.goal = self.target.tolerance * self.problem.q_norm
        meshed = is_meshed(len(self.problem.blocks.indices), self.problem.contacts)
        order = SweepOrder.STORED if meshed else SweepOrder.APPROACH
        self.data = sweep_data(self.problem, order=order)

    # ---------------------------------------------------------------- kind of the problem
    @property
    def is_coulomb(self) -> bool:
        """True under Coulomb's law, which has a cone and relaxations."""
        return isinstance(self.problem.law, Coulomb)

    @cached_property
    def joints(self) -> Joints | None:
        """Joints between deformable bodies, where there are and they are not too small."""
        return Joints.of(self.problem.whole[0])

    @cached_property
    def newton_kind(self) -> type[SemismoothNewton]:
        """Newton with approximate steps; with exact ones where an LU in blocks is quick."""
        exact = Condensed.in_blocks(self.problem, EXACT_WORK)
        return SemismoothNewton if exact else InexactNewton

    @cached_property
    def is_stacked(self) -> bool:
        """See `is_stacked`."""
        return is_stacked(self.problem)

    # ---------------------------------------------------------------- tools
    @cached_property
    def work(self) -> Workspace:
        """Symbolic factor, made when Newton is first thought of."""
        return Workspace.of(self.problem)

    # ---------------------------------------------------------------- costs
    @cached_property
    def step_cost(self) -> float:
        """Nanoseconds of a Newton step, by operations."""
        blocks, contacts = len(self.problem.blocks.indices), self.problem.contacts
        if not self.is_coulomb:
            return self.dense_step_cost
        products = PRODUCT * self.work.symbolic.products + NEWTON_CONTACT * contacts
        return products + 2 * SWEEP_BLOCK * blocks

    @cached_property
    def relaxation_cost(self) -> float:
        """Nanoseconds of a step of the interior point, less than Newton's by shared faces.

        Of light steps faces are looked for when they are taken, which may never be, unless
        there are any.
        """
        if self.step_cost < LIGHT and not self.is_stacked:
            return self.step_cost
        less = self.work.symbolic.products - self.work.sharing.products
        return self.step_cost - PRODUCT * less

    @cached_property
    def alternation_cost(self) -> float:
        """Nanoseconds of a Newton step in turn with sweeps, the calls about it included."""
        return self.step_cost + LINEARISED

    @cached_property
    def dense_step_cost(self) -> float:
        """Nanoseconds of a Newton step that factorises the whole of W as a full matrix."""
        return DENSE_STEP * float(3 * self.problem.contacts) ** 3

    @cached_property
    def sweep_cost(self) -> float:
        """Nanoseconds of a sweep."""
        return self._cost()

    @cached_property
    def accelerated_cost(self) -> float:
        """Nanoseconds of an accelerated sweep."""
        return self._cost(HISTORY_CONTACT)

    @cached_property
    def deep_cost(self) -> float:
        """Nanoseconds of a sweep with a deep memory."""
        return self._cost(DEEP_CONTACT)

    @cached_property
    def momentum_cost(self) -> float:
        """Nanoseconds of a sweep with momentum."""
        return self._cost(MOMENTUM_CONTACT)

    def _cost(self, more: float = 0.0) -> float:
        return nanoseconds_of_sweep(
            len(self.problem.blocks.indices), self.problem.contacts, more
        )

    def affordable(self, steps: int) -> int:
        """Newton steps of one compiled call that still fit before the driver's deadline."""
        left = self.target.seconds_left
        return (
            steps
            if math.isinf(left)
            else max(1, min(steps, int(1e9 * left / self.step_cost)))
        )

    # ---------------------------------------------------------------- bookkeeping
    def aim(self, tolerance: float) -> None:
        """Go on to another error, unit-free."""
        self.target = replace(self.target, tolerance=tolerance)
        self.goal = tolerance * self.problem.q_norm

    def judge(self, r: Array) -> float:
        """Error of r, (nc, 3), unit of u."""
        return natural_error(*self.problem.product_data, r)

    def offer(
        self, x: Array, iterations: int, stage: str, flops: float | None = None,
        error: float = math.inf, linear_iterations: int = 0,
    ) -> Iterate:  # fmt: skip
        """Keep x if it is better, and hand out the best.

        flops: floating point operations that x took, None where they are not counted; error of
        x, unit of u, if known.
        """
        self.take(x, error)
        return self.best(iterations, stage, flops, linear_iterations)

    def take(self, x: Array, error: float = math.inf) -> None:
        """Keep x, (nc, 3), if it is better; error of x, unit of u, if known."""
        if error == math.inf:
            error = self.judge(x)
            self.unsaid += self.problem.judge_flops
        self.latest = error
        if error < self.error:
            self.r, self.error = x, error

    def best(
        self, iterations: int, stage: str, flops: float | None = None,
        linear_iterations: int = 0,
    ) -> Iterate:  # fmt: skip
        """The best reaction as an iterate, with what was done since the last one."""
        if flops is not None:
            flops, self.unsaid = flops + self.unsaid, 0.0
        return Iterate(
            self.r[:, : self.problem.dimension].copy(), iterations=iterations, stage=stage,
            flops=flops, linear_iterations=linear_iterations, goes_on=True,
        )  # fmt: skip

    def iterate(self, r: Array) -> Iterate:
        """A start for other solvers from r, (nc, 3)."""
        return Iterate(r[:, : self.problem.dimension].copy())


def chunks_alone(problem: FrictionProblem) -> int:
    """Chunks that the first track has before any other, whatever it promises."""
    short = _is_short(len(problem.blocks.indices), problem.contacts)
    return 1 if not short and is_stacked(problem) else FIRST_CHUNKS
