"""Laws that are another law under a change of variables, contact by contact.

    r = T s - c n,    u' = T (u + C r + o n)    T = 1 in the normal, symmetric, > 0 in tangents

Without C r.u + c u_N = s.u', and always what the plain law says of (s, u') is said of (r, u):

    u = W r + q               u' = T W T s + T (q - W c n)
    M v = H r + f             M v = H T s + (f - H c n),    u' = (H T)^T v + T w

is the same problem for s with another H or W and another load (`FrictionProblem.plain`), which
all solvers take, and what is known of the plain law holds for it.  With a compliance C it is
W + C that stands for W, or a spring at each contact in the global form.  c, a tension, is
that of `cohesive`, T that of `orthotropic`, C and o, an offset of the gap, those of
`compliant`; a contact may have all.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import UnsupportedLaw
from .law import Array, Kinds, Law, Mask


class Changed(Law):
    """A law that is `plain` in s and u'; a class of it has `plain`, `cohesion` or `stretch`."""

    @property
    def kind(self) -> Kinds:  # type: ignore[override]
        """Kinds of the plain law."""
        return self.plain.kind

    @property
    def parameters(self) -> Array:  # type: ignore[override]
        """Parameters of the plain law."""
        return self.plain.parameters

    @cached_property
    def _inverse(self) -> Array:
        """Inverse of the stretch, (nc, 2, 2)."""
        assert self.stretch is not None
        inverse: Any = np.linalg.inv(self.stretch)
        return inverse

    def pressed(self, r: Array) -> Array:
        """s, (nc, d)."""
        out = np.array(r, dtype=float)
        out[:, 0] += self.cohesion
        return out if self.stretch is None else _tangents(self._inverse, out)

    def released(self, s: Array) -> Array:
        """r = T s - c n, (nc, d)."""
        out = np.array(s, dtype=float)
        out[:, 0] -= self.cohesion
        return out if self.stretch is None else _tangents(self.stretch, out)

    def stretched(self, u: Array, r: Array | None = None) -> Array:
        """u' = T (u + C r + o n), (nc, d); without r, T u."""
        if self.give is not None and r is not None:
            u = u + self.give[:, : u.shape[1]] * r
        if r is not None:
            u = self._shifted(u, 1.0)
        return u if self.stretch is None else _tangents(self.stretch, np.array(u, dtype=float))

    def unstretched(self, u: Array, r: Array) -> Array:
        """u of u', (nc, d)."""
        if self.stretch is not None:
            u = _tangents(self._inverse, np.array(u, dtype=float))
        if self.give is not None:
            u = u - self.give[:, : u.shape[1]] * r
        return self._shifted(u, -1.0)

    def _shifted(self, u: Array, sign: float) -> Array:
        """The normal parts moved by the offset of the gap; u itself where there is none."""
        if np.any(self.offset):
            u = np.array(u, dtype=float)
            u[:, 0] += sign * self.offset
        return u

    def given(self, r: Array) -> Mask:
        """As of the plain law, at s."""
        return self.plain.given(self.pressed(r))

    def bound(self, r: Array) -> Array:
        """Largest |r_T| allowed at r in the direction of r_T, (nc,); in all where r_T = 0."""
        s = self.pressed(r)
        return self.plain.bound(s) * self._lengthening(r, s)

    def bound_slope(self, r: Array) -> Array:
        """Derivative of the bound in r_N, (nc,)."""
        s = self.pressed(r)
        return self.plain.bound_slope(s) * self._lengthening(r, s)

    def _lengthening(self, r: Array, s: Array) -> Array | float:
        """|r_T| / |s_T|, (nc,)."""
        if self.stretch is None:
            return 1.0
        length, of = (np.linalg.norm(x[:, 1:], axis=1) for x in (r, s))
        least = np.linalg.eigvalsh(self.stretch)[:, 0]
        return np.divide(length, of, out=least, where=of > 0)

    def excess(self, r: Array) -> Array:
        """|s_T| beyond its bound, or tension beyond c, (nc,), unit of r."""
        return self.plain.excess(self.pressed(r))

    def natural_map(self, r: Array, u: Array, rho: Array) -> Array:
        """Residual of the law, (nc, d), unit of r; zero exactly at a solution."""
        return self.plain.natural_map(self.pressed(r), self.stretched(u, r), rho)

    def regions(self, r: Array, u: Array, rho: Array) -> tuple[Mask, Mask]:
        """Masks (closed, sliding), (nc,)."""
        return self.plain.regions(self.pressed(r), self.stretched(u, r), rho)

    def augmented_reaction(self, x: Array) -> Array:
        """As of the plain law, of s; (nc, d).

        Raises UnsupportedLaw with T or C: r - rho u alone does not tell s - rho u'.
        """
        self._refuse()
        return self.released(self.plain.augmented_reaction(self.pressed(x)))

    def augmented_reaction_jacobian(self, x: Array) -> Array:
        """One element of its generalised Jacobian, (nc, d, d)."""
        self._refuse()
        return self.plain.augmented_reaction_jacobian(self.pressed(x))

    def _refuse(self) -> None:
        if self.stretch is not None or self.give is not None or np.any(self.offset):
            raise UnsupportedLaw(f"{self.name} needs reactions and small strains")


@dataclass(frozen=True, eq=False)
class Stretched(Changed):
    """Any law without cohesion under a stretch T of tangents, (nc, 2, 2), r_T = T s_T."""

    law: Law
    stretch: Array  # type: ignore[assignment]

    @property
    def name(self) -> str:  # type: ignore[override]
        """The name of the plain law, with what is changed."""
        return f"orthotropic {self.law.name}"

    @property
    def plain(self) -> Law:
        """The law without the stretch."""
        return self.law

    def at(self, index: NDArray[np.integer]) -> Stretched:
        """The law of a selection of contacts."""
        return Stretched(self.law.at(index), self.stretch[index])

    def scaled(self, force: float | Array) -> Stretched:
        """The law in another unit of r."""
        return Stretched(self.law.scaled(force), self.stretch)

    def with_bounds(self, bounds: Array) -> Stretched:
        """The law with other bounds tau of s_T, (nc,)."""
        return Stretched(self.law.with_bounds(bounds), self.stretch)


def _tangents(of: Array, x: Array) -> Array:
    """The rows x (nc, 3) with `of` (nc, 2, 2) times their tangents; x is written to."""
    x[:, 1:] = np.einsum("cij,cj->ci", of, x[:, 1:])
    return x
