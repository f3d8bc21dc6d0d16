"""What a study of basins runs: solvers with values of their fields, on one problem or another.

A method of your own has a `label`, its `parameters`, `within`, and `run`; see `Runs`.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.arrays import real
from ...core.clock import Deadline
from ...core.errors import InvalidInput, shown
from ...problem.friction import Form, FrictionProblem
from ...problem.protocol import Problem
from ...problem.solution import FrictionSolution, Outcome
from ...solvers import METHODS, Iterate
from ...solvers.contract import Solver, taken_by
from ...solvers.driver import drive_from

Array = NDArray[np.float64]
MOST = 10_000  # variants of all methods


@dataclass(frozen=True)
class RunLimits:
    """What ends a run: the error to reach, iterations, and a time."""

    tolerance: float
    max_iterations: int | None
    deadline: Deadline


@dataclass(frozen=True, eq=False)
class Ended:
    """How a run ended.

    r (nc, d) and v (n,): its solution, or its last state where it found none, in the contacts
    and displacements of the problem that is studied; one may be None.  converged: by a judge,
    the balance of r and v included.  outcome: in words.  by_user: Ctrl-C ended it.
    """

    r: Array | None
    v: Array | None
    converged: bool
    error: float
    iterations: int
    outcome: str
    pattern: str = ""
    by_user: bool = False


class Runs(Protocol):
    """A method that can be studied."""

    @property
    def label(self) -> str:
        """One for each variant."""
        ...

    @property
    def method(self) -> str:
        """The same for all variants of one method."""
        ...

    @property
    def parameters(self) -> Mapping[str, Any]:
        """Values by name."""
        ...

    @property
    def within(self) -> float | None:
        """How near a solution is told by, where it is another than of others."""
        ...

    def run(self, problem: FrictionProblem, start: Iterate, limits: RunLimits) -> Ended:
        """What becomes of a start."""
        ...


@dataclass(frozen=True, eq=False)
class BasinMethod:
    """A solver that is studied.

    problem: another discretisation of the same body in which it runs, with the same v
    (Nitsche's form, other contact points); reactions (nc d, k): then those of the problem that
    is studied as linear functions of its own, if there are, and starts are led back by them.
    within: how near a solution is told by, relative as in `basins`.
    """

    solver: Solver
    name: str = ""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    problem: Problem | None = None
    reactions: ArrayLike | None = None
    within: float | None = None

    def __post_init__(self) -> None:
        if isinstance(self.solver, type) or not hasattr(self.solver, "iterates"):
            raise InvalidInput(
                f"methods: expected a solver such as Uzawa(), got {shown(self.solver)}"
            )
        if self.within is not None and not self.within > 0:
            raise InvalidInput(f"methods: within: expected a number > 0, got {self.within}")

    @property
    def method(self) -> str:
        """Its name, that of the solver if none is given."""
        return self.name or name_of(self.solver)

    @property
    def label(self) -> str:
        """Name and parameters."""
        values = (f"{key}={_short(value)}" for key, value in self.parameters.items())
        return " ".join([self.method, *values])

    def run(self, problem: FrictionProblem, start: Iterate, limits: RunLimits) -> Ended:
        """What becomes of a start."""
        own = self.problem if self.problem is not None else problem
        if isinstance(own, FrictionProblem) and taken_by(self.solver).form is Form.DELASSUS:
            own = own.condensed(limits.deadline)
        last: list[Iterate] = []
        found = drive_from(
            self._start(problem, own, start), own, self.solver, tolerance=limits.tolerance,
            max_iterations=limits.max_iterations, time_limit=limits.deadline,
            callback=lambda step, iterate: last.__setitem__(slice(None), [iterate]),
        )  # fmt: skip
        state = found if found.converged or not last else last[0]
        return self._ended(problem, own, found, state)

    def _start(
        self, problem: FrictionProblem, own: Problem, start: Iterate
    ) -> Iterate:
        """The start in the problem in which the method runs."""
        r, v = start.r, start.v
        if self.reactions is not None:
            columns = real("reactions", self.reactions)
            back: Any = np.linalg.lstsq(columns, r.ravel(), rcond=None)[0]
            r = back.reshape(own.contacts, -1)
        elif r.shape != (own.contacts, own.dimension):
            r = np.zeros((own.contacts, own.dimension))  # other points: only v leads there
            v = problem.velocity(start.r)[1] if v is None else v
        return Iterate(r, v if own.has_v else None)

    def _ended(
        self, problem: FrictionProblem, own: Problem,
        found: FrictionSolution, state: FrictionSolution | Iterate,
    ) -> Ended:  # fmt: skip
        r: Array | None = state.r
        if self.reactions is not None:
            r = (real("reactions", self.reactions) @ state.r.ravel()).reshape(
                problem.contacts, problem.dimension
            )
        elif own.contacts != problem.contacts or not isinstance(own, FrictionProblem):
            r = None
        v = state.v if problem.form is Form.GLOBAL else None
        record = found.convergence
        return Ended(
            r, v, record.outcome is Outcome.CONVERGED, record.error, record.iterations,
            record.outcome.name.lower(), found.pattern, record.by_user,
        )  # fmt: skip


def name_of(solver: Solver) -> str:
    """Name on the command line of a solver, or its class."""
    kind = type(solver)
    return next((name for name, known in METHODS.items() if known is kind), kind.__name__)


@dataclass(frozen=True)
class Maker:
    """How methods of a name are made: fields, and a function of values for some of them."""

    fields: Sequence[str]
    make: Callable[[dict[str, Any]], Runs]


def methods_of(
    methods: Any, parameters: Mapping[str, Any] | None,
    makers: Mapping[str, Maker] | None = None,
) -> list[Runs]:
    """All variants: each method with all combinations of the values of its parameters.

    methods: names, solvers, or what has `run`; one, several, or a mapping of labels to them.
    parameters: values by field, for all methods that have it, or by "method.field".  makers:
    of names that are no solvers.
    """
    makers = makers or {}
    named = _named(methods)
    grid = _checked_grid(parameters or {})
    used: set[str] = set()
    found: list[Runs] = []
    for name, method in named:
        if hasattr(method, "run"):
            found.append(method)
            continue
        maker = _maker(name, method, makers)
        label = name or (method if isinstance(method, str) else name_of(method))
        known = [key for key in grid if _key(key, label) in maker.fields]
        used.update(known)
        keys = {_key(key, label): key for key in sorted(known, key=lambda key: "." in key)}
        axes = [[(part, value) for value in grid[key]] for part, key in keys.items()]
        for values in itertools.product(*axes):
            found.append(maker.make(dict(values)))
            if len(found) > MOST:
                raise InvalidInput(f"parameters: expected at most {MOST} variants, got more")
    _check_used(grid, used, list(dict.fromkeys(method.method for method in found)))
    _check_labels(found)
    return found


def _named(methods: Any) -> list[tuple[str, Any]]:
    """(name or "", method) of what the user gives."""
    if isinstance(methods, Mapping):
        pairs = [(name, method) for name, method in methods.items()]
    elif isinstance(methods, Sequence) and not isinstance(methods, str):
        pairs = [("", method) for method in methods]
    else:
        pairs = [("", methods)]
    for name, method in pairs:
        if not isinstance(name, str):
            raise InvalidInput(f"methods: expected a name, got {shown(name)}")
        known = isinstance(method, str | Maker) or any(
            hasattr(method, name) for name in ("iterates", "run")
        )
        if isinstance(method, type) or not known:
            raise InvalidInput(
                "methods: expected names of solvers, or solvers such as Uzawa(), got "
                f"{shown(method)}"
            )
    if not pairs:
        raise InvalidInput("methods: expected at least one, got none")
    return pairs


def _maker(name: str, method: Any, makers: Mapping[str, Maker]) -> Maker:
    """That of a solver, or of a name."""
    if isinstance(method, Maker):
        return method
    if isinstance(method, str) and method in makers:
        return makers[method]
    if isinstance(method, str) and method not in METHODS:
        known = ", ".join((*METHODS, *makers))
        raise InvalidInput(f"methods: expected one of {known}, got {method!r}")
    solver = METHODS[method]() if isinstance(method, str) else method
    label = name or name_of(solver)
    return Maker(
        fields_of(solver), lambda values: BasinMethod(_with(solver, values), label, values)
    )


def fields_of(solver: Any) -> list[str]:
    """Names of the fields of a solver, or of its class."""
    if not dataclasses.is_dataclass(solver):
        return []
    return [f.name for f in dataclasses.fields(solver) if f.init]


def _with(solver: Solver, values: dict[str, Any]) -> Solver:
    try:
        return dataclasses.replace(solver, **values) if values else solver  # type: ignore[type-var]
    except InvalidInput as reason:
        raise InvalidInput(f"parameters: {name_of(solver)}: {reason}") from None
    except TypeError as reason:
        raise InvalidInput(
            f"parameters: {name_of(solver)}: {', '.join(values)}: {reason}"
        ) from None


def _checked_grid(parameters: Any) -> dict[str, list[Any]]:
    if not isinstance(parameters, Mapping):
        raise InvalidInput(
            f"parameters: expected fields with values, got {type(parameters).__name__}"
        )
    grid: dict[str, list[Any]] = {}
    for key, values in parameters.items():
        if not isinstance(key, str):
            raise InvalidInput(f"parameters: expected the name of a field, got {shown(key)}")
        single = isinstance(values, str) or not hasattr(values, "__iter__")
        grid[key] = [values] if single else list(values)
        if not grid[key]:
            raise InvalidInput(f"parameters: {key}: expected at least one value, got none")
    return grid


def _key(key: str, label: str) -> str:
    """The field that a key means for a method; "" for another method's."""
    owner, dot, name = key.rpartition(".")
    return name if not dot or owner == label else ""


def _check_used(grid: Mapping[str, Any], used: set[str], methods: Sequence[str]) -> None:
    for key in grid:
        if key not in used:
            raise InvalidInput(f"parameters: {key}: no such field of {', '.join(methods)}")


def _check_labels(methods: Sequence[Runs]) -> None:
    labels = [method.label for method in methods]
    for label in labels:
        if labels.count(label) > 1:
            raise InvalidInput(f"methods: expected different names, got {label!r} twice")


def _short(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(getattr(value, "value", value))
