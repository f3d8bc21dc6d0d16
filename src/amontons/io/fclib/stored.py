"""Names in the files, and what a file holds beyond its problem, to write it again exactly."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...problem.equalities import Equalities, GlobalEqualities, LocalEqualities
from ...problem.friction import Form, FrictionProblem
from ...problem.solution import FrictionSolution

GROUPS = {"fclib_local": Form.DELASSUS, "fclib_global": Form.GLOBAL}
TEXTS = ("title", "description", "math_info")
WITH_ATTRIBUTES = ("info", "W", "M", "H", "V", "R", "G")


@dataclass(frozen=True, eq=False)
class StoredMatrix:
    """A sparse group as it stands in the file, and the matrix made of it."""

    matrix: sparse.csc_array | sparse.csr_array
    nz: int
    nzmax: int
    p: NDArray
    i: NDArray
    x: NDArray


@dataclass(frozen=True)
class StoredText:
    """A text of fixed length as it stands in the file; type in HDF5's encoding."""

    type: bytes
    shape: tuple[int, ...]
    raw: bytes


@dataclass(frozen=True, eq=False)
class FclibProblem(FrictionProblem):
    """A problem read from a file, with what is needed to write that file again bit by bit.

    equalities: constraints of the file, which the arrays of the problem hold eliminated.
    """

    texts: dict[str, bytes] = field(default_factory=dict, repr=False)
    stored: dict[str, StoredMatrix] = field(default_factory=dict, repr=False)
    stored_texts: dict[str, StoredText] = field(default_factory=dict, repr=False)
    attributes: dict[str, dict[str, Any]] = field(default_factory=dict, repr=False)
    equalities: Equalities | None = field(default=None, repr=False)
    _held: tuple[Any, ...] = field(default=(), repr=False)

    @classmethod
    def of_equalities(cls, equalities: Equalities) -> FclibProblem:
        """The problem without constraints that has the solutions of one with them."""
        problem = equalities.eliminated()
        assert isinstance(problem, FclibProblem)
        return replace(problem, equalities=equalities, _held=_arrays(problem))

    @property
    def holds_equalities(self) -> bool:
        """Whether its arrays still are what the constraints of the file have made them."""
        return self.equalities is not None and all(
            ours is theirs for ours, theirs in zip(_arrays(self), self._held, strict=True)
        )

    def multipliers(self, solution: FrictionSolution) -> NDArray[np.float64]:
        """l, (p,), of the equality constraints of the file: forces that keep them, unit of r.

        Empty without such constraints.  Where these depend on each other, l is one of many.
        """
        if self.equalities is None or not self.holds_equalities:
            return np.zeros(0)
        return self.equalities.multipliers(solution.r, solution.v)

    @property
    def in_file(self) -> dict[str, Any]:
        """M, H, f, w or W, q, as the file has them, and its constraints."""
        kept = self.equalities if self.holds_equalities else None
        plain = self if kept is None else kept.bare
        found = {name: getattr(plain, name) for name in ("f", "w", "q", "M", "H", "W")}
        if isinstance(kept, GlobalEqualities):
            found |= {"G": kept.G, "b": kept.b}
        elif isinstance(kept, LocalEqualities):
            found |= {"V": kept.V, "R": kept.R, "s": kept.s}
        return found


def _arrays(problem: FrictionProblem) -> tuple[Any, ...]:
    return problem.M, problem.H, problem.f, problem.w, problem.W, problem.q
