"""What the driver asks of a discrete problem: whatever answers this can be solved and judged.

The package has three: `FrictionProblem`, linear; `NitscheProblem`, in displacements alone;
`mechanics.model.large_deformation.LargeDeformation`, nonlinear.  One of your own inherits
`Problem` and says

    law, dimension, unknowns      which contacts there are, in how many dimensions, and n
    rho (nc,)                     unit of r / u, by which statuses are told (`law.regions`)
    error(r, v)                   how far a state is from a solution, unit-free
    motion(r, v)                  (u, v) of a state

with reactions r (nc, d), local motions u (nc, d) and the unknowns v (n,) of that problem.  All
else has a default that fits a problem of which nothing more is known; what it means stands at
the member.  A solver for it names its class in `solves` (`solvers.contract`).
"""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from typing import TYPE_CHECKING, ClassVar, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.arrays import real
from ..core.clock import NEVER, Deadline
from ..core.errors import InvalidInput
from ..core.locks import KeepsLocks
from .judge.measures import Measure, Weakest
from .law import Law
from .settling import Accepted, Motion, settled

if TYPE_CHECKING:
    from .solution import Obstruction

Array = NDArray[np.float64]


class Form(Enum):
    """Which matrices a problem holds, or a solver needs."""

    GLOBAL = "global"
    DELASSUS = "local"
    ANY = "any"  # of these two
    NITSCHE = "nitsche"  # a NitscheProblem: displacements only


class Start(Protocol):
    """What a solve may begin with: a solution, or an iterate."""

    r: Array
    v: Array | None


class Problem(KeepsLocks):
    """A discrete problem of contact, see the module."""

    law: Law
    dimension: int
    unknowns: int
    rho: Array

    name: str = ""
    form: Form = Form.ANY  # which matrices it holds; of all forms where it knows none
    measure: Measure = Measure.RESIDUAL  # what `error` is called in records
    has_v: bool = True  # False where reactions are the only unknowns
    has_q: ClassVar[bool] = False  # True where published measures apply: there is a q
    knows_q: bool = False  # True where q is at hand, without a factorisation of M
    guess: Array | None = None  # some v (n,) near the solution, if better than 0
    gains_energy: bool = False  # True where no method can be expected to come to an end
    judge_flops: float = 0.0  # floating point operations of a judgement where they are counted
    unfit: ClassVar[str] = "it is made for other problems"  # why a solver can not take this one
    no_inertia: ClassVar[str] = ""  # why steps with inertia can not, where they can not
    no_path: ClassVar[str] = ""  # why continuation can not follow its solutions

    # ---------------------------------------------------------------- needed
    def error(self, r: Array, v: Array | None = None) -> float:
        """Unit-free error of a state; infinite of numbers that are not finite."""
        raise NotImplementedError

    def motion(self, r: Array, v: Array | None = None) -> Motion:
        """(u, v) of a state; without v as its reactions move it, or as well as is known."""
        raise NotImplementedError

    def growth(self, v: Array | None) -> Array | float:
        """Areas that stresses of the law act on at a state, over those it knows, (nc,) or 1."""
        return 1.0

    def law_at(self, v: Array | None) -> Law:
        """The law with its stresses on the areas of a state."""
        grown = self.growth(v)
        return self.law if isinstance(grown, float) else self.law.scaled(grown)

    # ---------------------------------------------------------------- sizes, beginning
    @property
    def kind(self) -> type[Problem]:
        """Its class; a model says in advance which it will be."""
        return type(self)

    @property
    def contacts(self) -> int:
        """Number of contacts nc."""
        return len(self.law)

    @property
    def plain(self) -> Problem:
        """The problem that a solver is given after a change of variables; else itself."""
        return self

    def with_law(self, law: Law) -> Self:
        """The same problem under another law of its contacts."""
        return replace(self, law=law)  # type: ignore[type-var]  # problems are dataclasses

    def start(self, given: Start | None = None) -> Motion:
        """(r, v) to begin with: checked copies of what is given, else no reactions.

        Raises InvalidInput naming what does not fit.
        """
        shape = (self.contacts, self.dimension)
        if given is None:
            return np.zeros(shape), None
        r = real("start: r", given.r)
        if r.shape != shape:
            raise InvalidInput(f"expected r of shape {shape}, got {r.shape}", ("start",))
        if not np.isfinite(r).all():
            raise InvalidInput("r holds a number that is not finite", ("start",))
        keep = given.v is not None and self.has_v
        return r, checked_motion(given.v, self.unknowns) if keep else None

    def condensed(self, deadline: Deadline = NEVER) -> Self:
        """The problem in reactions alone, where it has that form; raises TimeUp."""
        return self

    def assembled(self) -> Self:
        """The problem with matrices that are stored, where they may be operators."""
        return self

    def prepare(self, deadline: Deadline = NEVER) -> None:
        """Make what judging needs; raises TimeUp when it is not there in time."""

    @property
    def operations(self) -> float:
        """Of an iteration, roughly: what limits that count operations are told of."""
        return 1000.0 * self.unknowns  # a solve with a matrix; no Newton step, those are few

    # ---------------------------------------------------------------- judging
    def natural_error(self, r: Array, v: Array | None = None) -> float:
        """The published error of `judge.published_natural_error`, where there is a q."""
        return np.inf

    def rounding(self, r: Array) -> float:
        """What rounding alone may hide in `error`, unit-free."""
        return 0.0

    def certain_error(self, r: Array, v: Array | None = None) -> float:
        """The error, or what rounding may hide in it where that is more."""
        return max(self.error(r, v), self.rounding(r))

    def weakest(self, r: Array, v: Array | None = None) -> Weakest | None:
        """The contact farthest from its law on its own scale; None where there is no such."""
        return None

    def accepted(
        self, r: Array, v: Array | None, error: float, tolerance: float
    ) -> Accepted:
        """A state whose error is below the tolerance, with reactions that keep to statuses."""
        moved, told = settled(self.law_at(v), self.rho, r, lambda r: self.motion(r, v))
        if told.r is not r:
            r, error = told.r, self.error(told.r, v)
        weakest = self.weakest(r, v) if error <= tolerance else None
        return Accepted(r, v, error, weakest, moved, told)

    def obstruction(self, u: Array) -> tuple[Obstruction | None, str]:
        """What in the problem may be the reason of a failure, at motions u; also in words."""
        return None, ""

    # ---------------------------------------------------------------- results
    def recover(self, r: Array, v: Array | None = None) -> tuple[Problem, Array, Array | None]:
        """(problem, u, v) of a state: what its solution is of, and how it moves."""
        return self, *self.motion(r, v)

    def lawful(self, u: Array, v: Array | None) -> Array:
        """The motion (nc, d) with which r obeys its law: statuses are told by it."""
        return u


def checked_motion(v: ArrayLike | None, n: int) -> Array:
    """A copy of v, (n,), of a start."""
    v = real("start: v", v)
    if v.shape != (n,):
        raise InvalidInput(f"expected v of {n} entries, got {v.size}", ("start",))
    if not np.isfinite(v).all():
        raise InvalidInput("v holds a number that is not finite", ("start",))
    return v
