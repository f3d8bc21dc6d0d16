"""A friction problem as a function of its data, which other libraries differentiate through.

Data are {"load", "w", "mu", "bound"}, any of them, the answer is {"r", "u"} and "v" in the
global form, as NumPy arrays.  `with_jax` and `with_torch` make it a function of theirs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, NotConverged, UnsupportedLaw
from ...problem.friction import Form, FrictionProblem
from ...problem.solution import FrictionSolution
from ...solvers.contract import Iterate
from ...solvers.driver import drive
from .systems import rows

Array = NDArray[np.float64]
DATA = ("load", "w", "mu", "bound")
TOLERANCE = 1e-10


@dataclass(eq=False)
class Solved:
    """`forward(data)` solves, `backward(data, slopes)` is the adjoint, one linear solve.

    solver, tolerance: of the solves, each from the solution before.
    """

    problem: FrictionProblem
    solver: Any = None
    tolerance: float = TOLERANCE
    _last: tuple[dict[str, bytes], FrictionSolution] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.problem, FrictionProblem):
            raise InvalidInput(
                "problem: expected a FrictionProblem, such as model.assemble(), got "
                f"{type(self.problem).__name__}"
            )

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Of all data and answers."""
        p = self.problem
        nc, d = p.contacts, p.dimension
        whole = (p.unknowns,) if p.has_v else (nc, d)
        out = {"load": whole, "w": (nc, d), "mu": (nc,), "bound": (nc,), "r": (nc, d),
               "u": (nc, d)}  # fmt: skip
        return out | ({"v": whole} if p.has_v else {})

    @property
    def answers(self) -> tuple[str, ...]:
        """Names of what is returned, in order."""
        return ("r", "u", "v") if self.problem.has_v else ("r", "u")

    def checked(self, data: Mapping[str, Any]) -> None:
        """Raise InvalidInput for data of other names or shapes."""
        for name, value in data.items():
            if name not in DATA:
                raise InvalidInput(f"data: expected {', '.join(DATA)}, got {name!r}")
            if name == "w" and not self.problem.has_v:
                raise InvalidInput("w: the problem is in its Delassus form; give load, its q")
            if tuple(np.shape(value)) != self.shapes[name]:
                raise InvalidInput(
                    f"{name}: expected shape {self.shapes[name]}, got {np.shape(value)}"
                )

    def solution(self, data: Mapping[str, Any]) -> FrictionSolution:
        """The solution of these data; raises NotConverged, which carries the best iterate."""
        given = {name: rows(name, value, self.shapes[name]) for name, value in data.items()}
        key = {name: value.tobytes() for name, value in given.items()}
        if self._last is not None and self._last[0] == key:
            return self._last[1]
        start = None if self._last is None else self._last[1]
        found = drive(
            self._with(given), self.solver, tolerance=self.tolerance,
            start=None if start is None else Iterate(start.r, start.v),
        )  # fmt: skip
        if not found.converged:
            record = found.convergence
            raise NotConverged(f"{record}. {record.advice}", found)
        self._last = key, found
        return found

    def _with(self, given: dict[str, Array]) -> FrictionProblem:
        problem = self.problem
        law = problem.law
        if "mu" in given or "bound" in given:
            if law.plain is not law or law.varies:
                raise UnsupportedLaw(f"data: mu and bound of {law.name} can not be exchanged")
            if "mu" in given:
                law = law.with_mu(given["mu"])
            if "bound" in given:
                law = law.with_bounds(given["bound"])
        changes: dict[str, Any] = {"law": law}
        names = {"load": "f", "w": "w"} if problem.form is Form.GLOBAL else {"load": "q"}
        for name, own in names.items():
            if name in given:
                changes[own] = given[name]
        return replace(problem, **changes, guess=None, blur=None)

    def forward(self, data: Mapping[str, Any]) -> tuple[Array, ...]:
        """r, u and, in the global form, v."""
        found = self.solution(data)
        return tuple(np.array(getattr(found, name)) for name in self.answers)

    def backward(
        self, data: Mapping[str, Any], slopes: Mapping[str, Any]
    ) -> dict[str, Array]:
        """Slopes of J in the data, of those in the answers."""
        given = {name: np.asarray(value, dtype=float) for name, value in slopes.items()}
        g = self.solution(data).vjp(**given)
        return {name: np.array(getattr(g, name)) for name in data}

