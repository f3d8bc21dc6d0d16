"""A case of verification: what is computed, what is expected, and when it passes.

One rule of tolerances for all cases.  EXACT: the discrete problem has the answer of theory,
and only rounding and the tolerance of the solver are left.  CLOSE: a mesh, a step or a
finite domain approximates it; the finest is within one percent, and finer ones have smaller
errors.  Where the smallest size alone is computed, the tolerance grows by the order that theory
expects.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

EXACT, CLOSE = 1e-6, 1e-2
ROUNDING = 1e-9  # errors below it need not fall any more


@dataclass(frozen=True)
class Value:
    """One number of a case.  scale: by which its error is divided, by default |expected|.

    known: relative accuracy of the expected number for the computed model; errors below it need
    not fall any more.
    """

    name: str
    computed: float
    expected: float
    scale: float | None = None
    known: float = ROUNDING

    @property
    def error(self) -> float:
        """Relative error, >= 0; infinite for what is no number."""
        size = abs(self.expected) if self.scale is None else self.scale
        error = abs(self.computed - self.expected) / size
        return float(error) if np.isfinite(error) else float("inf")


@dataclass(frozen=True)
class Case:
    """One problem at several sizes.

    compute(size): its values, the same names at every size.  sizes: of the default, ascending,
    mesh width or step go like 1 / size; fine: those added by --fine.  order: of the errors in
    1 / size that theory expects, None where the case is exact at every size.  remarks: what the
    computed model does otherwise than the problem.  close: the tolerance where it is another.
    """

    name: str
    title: str
    problem: str
    source: str
    compute: Callable[[int], list[Value]]
    sizes: tuple[int, ...]
    fine: tuple[int, ...] = ()
    order: float | None = None
    remarks: str = ""
    close: float | None = None

    @property
    def tolerance(self) -> float:
        """Of all values, at the largest size."""
        if self.close is not None:
            return self.close
        return EXACT if self.order is None else CLOSE


@dataclass(frozen=True)
class Outcome:
    """All values of a case by size, and the CPU seconds of each size."""

    case: Case
    values: dict[int, list[Value]]
    seconds: dict[int, float]

    @property
    def last(self) -> list[Value]:
        """The values of the largest size."""
        return self.values[max(self.values)]

    def errors(self, name: str) -> list[float]:
        """Errors of a value by size, ascending."""
        return [v.error for size in sorted(self.values) for v in self.values[size]
                if v.name == name]  # fmt: skip

    def order(self, name: str) -> float | None:
        """Slope of the errors between the smallest and the largest size; None for rounding."""
        errors, sizes = self.errors(name), sorted(self.values)
        if self.case.order is None or len(sizes) < 2:
            return None
        if min(errors) < ROUNDING or not np.isfinite(errors).all():
            return None
        return float(np.log(errors[0] / errors[-1]) / np.log(sizes[-1] / sizes[0]))

    @property
    def tolerance(self) -> float:
        """Of the largest computed size: a coarse mesh has what the expected order leaves it."""
        case = self.case
        if case.order is None:
            return case.tolerance
        return case.tolerance * max(1.0, case.sizes[-1] / max(self.values)) ** case.order

    def failure(self, value: Value) -> str | None:
        """What is wrong with a value, in words; None where it is right.

        It is at the largest size within the tolerance, an exact one at all sizes, and errors
        do not grow with size.
        """
        errors, sizes = self.errors(value.name), sorted(self.values)
        if self.case.order is None:
            worst = int(np.argmax(errors))
            if errors[worst] > self.tolerance:
                return (f"error {errors[worst]:.1e} at size {sizes[worst]}, and "
                        f"{self.tolerance:.1e} is allowed")  # fmt: skip
            return None
        if not errors[-1] <= self.tolerance:
            return (f"error {errors[-1]:.1e} at size {sizes[-1]}, and {self.tolerance:.1e} "
                    "is allowed")  # fmt: skip
        if len(errors) > 1 and errors[-1] > max(*errors[:-1], value.known):
            return (f"error {errors[-1]:.1e} at size {sizes[-1]} is larger than those of the "
                    f"smaller sizes, {', '.join(f'{error:.1e}' for error in errors[:-1])}")
        return None

    def passes(self, value: Value) -> bool:
        """Whether a value is right."""
        return self.failure(value) is None

    @property
    def passed(self) -> bool:
        """Whether all values do."""
        return all(self.passes(value) for value in self.last)


def run(case: Case, *, fine: bool = False, quick: bool = False) -> Outcome:
    """Compute a case at its sizes; fine: also at the larger ones; quick: the smallest alone."""
    values, seconds = {}, {}
    for size in case.sizes[:1] if quick else case.sizes + (case.fine if fine else ()):
        begun = time.process_time()
        values[size] = case.compute(size)
        seconds[size] = time.process_time() - begun
    return Outcome(case, values, seconds)
