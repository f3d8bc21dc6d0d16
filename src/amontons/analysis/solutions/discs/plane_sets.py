"""`sets` in 2D: a friction disc of dimension one, which has two directions and no arcs.

Slip of sign s = +1 or -1 is the direction e = -s: r_T = s mu r_N, and s u_T <= 0.  The cone of
a status is spanned by lines (any multiples) and rays (nonnegative ones), two in all; one ray
alone counts as a line, for a form is as negative on -d.  About z0 the cone(C - z0) has the ray
-z0 besides.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...scaled import Scaled
from ...statuses import LETTERS
from ..groups import Form
from .known import Known

Array = NDArray[np.float64]
Generators = list[Array]
Pairs = tuple[tuple[int, int], ...]
FLAT = 1e-4  # angle of -z0 with the plane of the other generators that is too small
SLIGHT = 1e-4  # friction below which a stick cone counts as the half plane r_N >= 0
STATUSES = {".": "fs+-", "c": "s+-", "l": "+-"}


@dataclass(frozen=True, eq=False)
class PlaneLaw:
    """The law of one contact seen from a z0 (4,) that obeys it exactly, or from nothing (None).

    touches: the statuses whose cone holds z0.
    """

    mu: float
    z0: Array | None
    touches: str = ""

    def statuses(self, letter: str) -> str:
        """Those of a region; without friction slip has one status, called +."""
        found = STATUSES.get(letter, letter)
        if self.mu == 0:
            return "".join(status for status in "f+" if status in found)
        return found

    def lies_in(self, letter: str) -> bool:
        """True where the reference lies in a region; also where there is none."""
        return self.z0 is None or any(s in self.touches for s in self.statuses(letter))

    def forms(self, letter: str, rows: list[int]) -> list[Form]:
        """Where a form V on the given rows of d, or (z, 1), has to be negative."""
        found = (self._generators[status] for status in self.statuses(letter))
        return [Form(G[rows], pairs) for G, pairs in found]

    @cached_property
    def _generators(self) -> dict[str, tuple[Array, Pairs]]:
        """(G, products that are >= 0) of every status."""
        out = {}
        for status in self.statuses("."):
            lines, rays = self._seen(status)
            if len(rays) == 1:
                lines, rays = [*lines, *rays], []
            pairs = combinations(range(len(lines), len(lines) + len(rays)), 2)
            out[status] = np.column_stack([*lines, *rays]), tuple(pairs)
        return out

    def _cone(self, status: str) -> tuple[Generators, Generators]:
        """Its lines and rays of length one."""
        r_N, r_T, u_N, u_T = np.eye(5 if self.z0 is None else 4)[:4]
        length = np.sqrt(1 + self.mu**2)
        if status == "f":
            return [u_T], [u_N]
        if self.mu == 0:
            return [u_T], [r_N]
        if status == "s" and self.mu < SLIGHT:
            return [r_T], [r_N]
        if status == "s":
            return [], [(r_N + m * r_T) / length for m in (self.mu, -self.mu)]
        sign = 1.0 if status == "+" else -1.0
        return [], [(r_N + sign * self.mu * r_T) / length, -sign * u_T]

    def _seen(self, status: str) -> tuple[Generators, Generators]:
        """Lines and rays of the cone about the reference, or with an apex at (0, 1)."""
        lines, rays = self._cone(status)
        if self.z0 is None:
            return lines, [*rays, np.eye(5)[4]]
        size = float(np.linalg.norm(self.z0))
        if not size or self._grazes(status):
            return lines, rays
        if status in self.touches:
            return [*lines, *rays], []
        return _with_apex(lines, rays, -self.z0 / size)

    def _grazes(self, status: str) -> bool:
        """Whether -z0 is a ray of the cone, z0 slipping the other way without a reaction."""
        assert self.z0 is not None
        slips = status in "+-" and self.mu > 0 and status not in self.touches
        return slips and not self.z0[:3].any()


def _with_apex(
    lines: Generators, rays: Generators, apex: Array
) -> tuple[Generators, Generators]:
    """One more ray; where it is almost in the plane of the two others a wider cone instead.

    With apex = a g_1 + b g_2 + p, p across, it lies in the sum of all multiples of those g with
    a negative factor, nonnegative ones of the others, and those of p.
    """
    both = np.column_stack([*lines, *rays])
    factors = np.linalg.lstsq(both, apex)[0]
    across = apex - both @ factors
    size = float(np.linalg.norm(across))
    if size > FLAT:
        apex = apex - both[:, : len(lines)] @ factors[: len(lines)]
        return lines, [*rays, apex / np.linalg.norm(apex)]
    turned = [k >= len(lines) and factor < 0 for k, factor in enumerate(factors)]
    own = [*lines, *rays]
    wide = [g for k, g in enumerate(own) if k < len(lines) or turned[k]]
    narrow = [g for k, g in enumerate(own) if k >= len(lines) and not turned[k]]
    return wide, [*narrow, across / size] if size else narrow


def plane_laws(scaled: Scaled, known: Known | None) -> list[PlaneLaw]:
    """The laws of all contacts of a 2D problem about a known solution, or about none."""
    if known is None:
        return [PlaneLaw(float(mu), None) for mu in scaled.mu]
    touches = ["".join(LETTERS[k] for k in np.flatnonzero(row)) for row in known.touches]
    return [PlaneLaw(float(mu), z, own)
            for mu, z, own in zip(scaled.mu, known.z, touches, strict=True)]  # fmt: skip
