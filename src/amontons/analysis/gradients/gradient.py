"""`vjp` and `jvp` of a solved friction problem, and what may be doubted of them.

A derivative is that of the statuses which the solution has.  At a contact on the border of its
piece there are several, one for each side from which data may come: `jvp` then lists all
one-sided ones, found by `paths.first_order`, and both say so in `warnings`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.errors import InvalidInput, SingularOperator, UnsupportedForm
from ...core.faces import Told
from ...core.warned import ResultWarning
from ...problem.solution import FrictionSolution
from .linearised import Linearised
from .systems import System, operator, rows, system_of

Array = NDArray[np.float64]
Index = NDArray[np.int64]
NEAR = 1e-6  # distance to a singular system, relative, from which it is told
LISTED = 8  # contacts that a warning names


@dataclass(frozen=True, eq=False)
class OneSided:
    """The change along one side: dr, du (nc, d), dv (n,) or None, and its pattern."""

    r: Array
    u: Array
    v: Array | None
    piece: str


@dataclass(frozen=True, eq=False, repr=False)
class Derivative(Told):
    """The change of a solution along one direction of its data.

    r, u (nc, d), v (n,) or None: derivatives at the statuses that the solution has.  sides: all
    one-sided ones, a single one where no contact is weak; complete: whether none is missing.
    weak (k,): contacts on the border of their status.  distance: to a singular system.
    """

    r: Array
    u: Array
    v: Array | None
    sides: tuple[OneSided, ...]
    complete: bool
    weak: Index
    warnings: tuple[ResultWarning, ...]
    distance: float | None

    def __str__(self) -> str:
        text = f"derivative along one direction, {len(self.sides)} one-sided"
        return "\n".join([text, *map(str, self.warnings)])


@dataclass(frozen=True, eq=False, repr=False)
class Gradient(Told):
    """The gradient of a number J(r, u, v) with respect to all data of a friction problem.

    load: of f (n,) in the global form, of q (nc, d) in the Delassus form; w (nc, d): of w, in
    the Delassus form the same as load; gap (nc,): of gaps, w's normal part.  mu, bound (nc,):
    of coefficients and of given bounds, zero where a contact has none.  y (nc, d): the adjoint
    of the law.  weak, warnings, distance: as in `Derivative`.
    """

    solution: FrictionSolution
    load: Array
    w: Array
    mu: Array
    bound: Array
    y: Array
    weak: Index
    warnings: tuple[ResultWarning, ...]
    _system: System = field(repr=False)

    @property
    def gap(self) -> Array:
        """Of gaps, (nc,)."""
        return self.w[:, 0]

    @cached_property
    def distance(self) -> float | None:
        """To the nearest singular system, relative and in scaled variables; None: unknown."""
        return self._system.distance

    # J changes by M_left dM M_right + H_left dH H_right + …: entries are products
    def of_M(self, change: Any) -> float:
        """Derivative along a change of M, (n, n), a matrix or anything with @."""
        v = self._v
        return float(-self.load @ (operator("of_M", change, (v.size, v.size)) @ v))

    def of_H(self, change: Any) -> float:
        """Derivative along a change of H, (n, nc d)."""
        v, r = self._v, self.solution.r.ravel()
        change = operator("of_H", change, (v.size, r.size))
        return float(self.load @ (change @ r) + v @ (change @ self.w.ravel()))

    def of_W(self, change: Any) -> float:
        """Derivative along a change of W, (nc d, nc d)."""
        if self.solution.problem.has_v:
            raise UnsupportedForm("of_W: the problem is in its global form; see of_M and of_H")
        r = self.solution.r.ravel()
        return float(self.w.ravel() @ (operator("of_W", change, (r.size, r.size)) @ r))

    @property
    def _v(self) -> Array:
        if self.solution.v is None:
            raise UnsupportedForm("the problem is in its Delassus form, without M, H and v")
        return self.solution.v

    def __str__(self) -> str:
        sizes = ", ".join(
            f"{name} {np.abs(value).max(initial=0.0):.3g}"
            for name, value in (("load", self.load), ("w", self.w), ("mu", self.mu),
                                ("bound", self.bound))
        )  # fmt: skip
        count = self.solution.problem.contacts
        text = f"gradient of {count} contacts, largest entries: {sizes}"
        return "\n".join([text, *map(str, self.warnings)])


class Differentiable:
    """What all derivatives of one solution share: its pieces and the factor of their system."""

    def __init__(self, solution: FrictionSolution) -> None:
        self.at = Linearised.of(solution)
        if self.at.problem.has_v and solution.v is None:
            v = self.at.problem.velocity(solution.r)[1]
            self.at = replace(self.at, solution=replace(solution, v=v))
        self.solution = self.at.solution

    @cached_property
    def system(self) -> System:
        """The system at the statuses; raises SingularOperator where it has no inverse."""
        return system_of(self.at)

    @property
    def warnings(self) -> tuple[ResultWarning, ...]:
        """What may be doubted of all derivatives."""
        out = [] if not len(self.at.weak) else [_weak_warning(self.at.weak)]
        distance = self.system.distance if "system" in self.__dict__ else None
        if distance is not None and distance < NEAR:
            out.append(ResultWarning(
                "near-singular-gradient",
                f"the linearised problem is within {distance:.1e} of a singular one, relative: "
                "a fold or a jump is near, and derivatives hold in that small a neighbourhood",
            ))  # fmt: skip
        return tuple(out)

    def vjp(self, r: Any = None, u: Any = None, v: Any = None) -> Gradient:
        """The gradient for cotangents of r, u (nc, d) and v (n,)."""
        problem, shape = self.at.problem, self.solution.r.shape
        of_v = None
        if v is not None and not problem.has_v:
            raise InvalidInput("v: the problem is in its Delassus form, which has none")
        if problem.has_v:
            of_v = rows("v", v, (problem.unknowns,))
        found = self.system.adjoint(of_v, rows("r", r, shape), rows("u", u, shape))
        load = found.z if found.x is None else found.x
        mu = -(self.at.by_mu * found.y).sum(axis=1)
        bound = -(self.at.by_bound * found.y).sum(axis=1)
        return Gradient(self.solution, load, found.z, mu, bound, found.y, self.at.weak,
                        self.warnings, self.system)  # fmt: skip

    def jvp(
        self, load: Any = None, w: Any = None, mu: Any = None, bound: Any = None,
        M: Any = None, H: Any = None, W: Any = None,
    ) -> Derivative:  # fmt: skip
        """The derivative along changes of the data; see `vjp` for their names."""
        problem, solution = self.at.problem, self.solution
        shape = solution.r.shape
        h = rows("w", w, shape)
        F = None
        if problem.has_v:
            F = rows("load", load, (problem.unknowns,))
            if W is not None:
                raise InvalidInput("W: the problem is in its global form; give M and H")
            if M is not None:
                F = F - operator("M", M, (len(F), len(F))) @ solution.v
            if H is not None:
                H = operator("H", H, (len(F), h.size))
                F = F + H @ solution.r.ravel()
                h = h + (H.T @ solution.v).reshape(shape)
        else:
            if M is not None or H is not None:
                raise InvalidInput("M, H: the problem is in its Delassus form; give W")
            h = h + rows("load", load, shape)
            if W is not None:
                W = operator("W", W, (h.size, h.size))
                h = h + (W @ solution.r.ravel()).reshape(shape)
        of_mu, of_bound = (rows(n, x, shape[:1]) for n, x in (("mu", mu), ("bound", bound)))
        c = -(self.at.by_mu * of_mu[:, None] + self.at.by_bound * of_bound[:, None])
        if not len(self.at.weak):
            found = self.system.change(F, c, h)
            sides = (OneSided(found.r, found.u, found.v, solution.pattern),)
            return Derivative(found.r, found.u, found.v, sides, True, self.at.weak,
                              self.warnings, self.system.distance)  # fmt: skip
        from .one_sided import sides_of

        sides, complete, reason = sides_of(self.at, F, h, of_mu, of_bound)
        distance = None
        try:
            first: Any = self.system.change(F, c, h)
            distance = self.system.distance
        except SingularOperator:
            if not sides:
                raise
            first = sides[0]  # the statuses that were told have no derivative, others have
        warnings = self.warnings
        if reason:
            warnings += (ResultWarning("one-sided-derivatives-incomplete", reason),)
        return Derivative(first.r, first.u, first.v, sides, complete, self.at.weak, warnings,
                          distance)  # fmt: skip


def _weak_warning(weak: Index) -> ResultWarning:
    named = ", ".join(map(str, weak[:LISTED])) + (", …" if len(weak) > LISTED else "")
    return ResultWarning(
        "weak-contacts",
        f"{len(weak)} contacts are on the border of their status ({named}): the solution has "
        "one-sided derivatives there, and this is the one of the statuses that were told; "
        "jvp lists all of them",
        tuple(int(k) for k in weak),
    )


def differentiable(solution: FrictionSolution) -> Differentiable:
    """What derivatives of a solution share, made once."""
    kept = solution.__dict__.get("_differentiable")
    if kept is None:
        kept = Differentiable(solution)
        solution.__dict__["_differentiable"] = kept
    return kept


def vjp(
    solution: FrictionSolution, r: ArrayLike | None = None, u: ArrayLike | None = None,
    v: ArrayLike | None = None,
) -> Gradient:  # fmt: skip
    """See `FrictionSolution.vjp`."""
    return differentiable(solution).vjp(r, u, v)


def jvp(solution: FrictionSolution, **changes: Any) -> Derivative:
    """See `FrictionSolution.jvp`."""
    return differentiable(solution).jvp(**changes)

