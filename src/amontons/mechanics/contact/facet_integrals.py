"""Integrals over what two facets share where they are now, with exact derivatives.

The master facet is projected along the normal of the slave facet onto it ([PL]); with phi, N
functions of first order of both and the integrals over the part they share, on the slave facet,

    mass_rt = int phi_r phi_t,    cross_rb = int phi_r N_b.                                (1)

Facets of second order are projected as those on their corners are; behind phi and N stand then
the functions of their other nodes, which move the surface by the bulges of `facing`.
The integrals depend on the corners of the two facets alone; those of facets that do not face
each other fade, see `opposed`, and of a warped one that is seen all but edge-on, see `edge_on`:
they are taken times o w.  Derivatives between lines are those of a complex
step: the real parts decide where parts end, imaginary ones of 1e-100 carry the derivative
through, exact to rounding as nothing is subtracted.

[PL] M. Puso, T. Laursen, "A mortar segment-to-segment contact method for large deformation
solid mechanics", Comput. Methods Appl. Mech. Engrg. 193 (2004) 601-629.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .edge_on import visible, visible_slopes
from .facing import Skin
from .opposed import STEP, cosine, opposed, steps
from .plane_integrals import plane_integrals, plane_slopes, rules

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Values = NDArray[Any]  # real, or complex in the search for derivatives
BESIDE = 0.5 / np.sqrt(3.0)
WHOLE = np.sqrt(0.5)  # cosine from which on o is 1
GAUSS = ((0.5 - BESIDE, 0.5), (0.5 + BESIDE, 0.5))  # exact, as (1) is cubic at most


def line_integrals(
    slave: Values, master: Values, bent: bool = False, facing: bool = False
) -> tuple[Values, Values]:
    """(1) of lines with ends (..., 2, 2): mass and cross, each (..., 2, 2).

    bent, facing: slave and master have a middle, and (..., 2, 3) with it.
    """
    edge = slave[..., 1, :] - slave[..., 0, :]
    square = (edge * edge).sum(axis=-1)
    from_start = master - slave[..., :1, :]
    ends = (from_start * edge[..., None, :]).sum(axis=-1) / square[..., None]
    first, second = ends[..., 0], ends[..., 1]
    swapped = first.real > second.real
    low, high = np.where(swapped, second, first), np.where(swapped, first, second)
    low = np.where(low.real > 0, np.where(low.real < 1, low, 1), 0)
    high = np.where(high.real < 1, np.where(high.real > 0, high, 0), 1)
    across = np.where(first.real == second.real, 1, second - first)
    length = np.sqrt(square) * (high - low)
    mass = np.zeros((*slave.shape[:-1], 2 + bent), dtype=slave.dtype)
    cross = np.zeros((*slave.shape[:-1], 2 + facing), dtype=slave.dtype)
    for place, weight in GAUSS:
        at = low + place * (high - low)
        opposite = (at - first) / across
        own, shape = _on_line(at, bent), _on_line(opposite, facing)
        area = (weight * length)[..., None, None]
        mass += area * own[..., :2, None] * own[..., None, :]
        cross += area * own[..., :2, None] * shape[..., None, :]
    return mass, cross


def _over(factors: Array, values: Array) -> Array:
    """Factors (k,) in the shape of values (k, ...)."""
    return factors.reshape(-1, *[1] * (values.ndim - 1))


def _on_line(at: Values, bent: bool) -> Values:
    """Functions of a line at places (...) between its ends, (..., 2) or (..., 3)."""
    middle = [4 * at * (1 - at)] if bent else []
    return np.stack([1 - at, at, *middle], axis=-1)


@dataclass(frozen=True, eq=False)
class FacetPairs:
    """k pairs of facets: corners at slave (k, a, d), master (k, b, d), padded by the last.

    corners, facing (k,): how many of them are real; bent, opposite (k,): nodes beside them, in
    tables of widths (e, h).
    """

    slave: Array
    corners: Index
    master: Array
    facing: Index
    bent: Index
    opposite: Index
    widths: tuple[int, int]

    @classmethod
    def of(cls, slave: Skin, of: Index, master: Skin, other: Index, x: Array) -> FacetPairs:
        """Facets (k,) of both at positions x (nodes, d)."""
        return cls(x[slave.nodes[of]], slave.corners[of], x[master.nodes[other]],
                   master.corners[other], slave.bent[of], master.bent[other],
                   (slave.middles.shape[1], master.middles.shape[1]))  # fmt: skip

    def integrals(self) -> tuple[Array, Array]:
        """mass (k, a, a + e) and cross (k, a, b + h)."""
        mass, cross = self._seen
        return _over(self.opposed, mass) * mass, _over(self.opposed, cross) * cross

    def slopes(self) -> tuple[Array, Array]:
        """Their derivatives by all corners, (k, a, a + e, (a + b) d) and (k, a, b + h, ...)."""
        return self._slopes_times(self._visible * self.opposed, FacetPairs._slopes_of_both)

    # ---------------------------------------------------------------- what fades
    @cached_property
    def _visible(self) -> Array:
        """w of `edge_on`, (k,), 1 for lines and triangles."""
        out, quads = np.ones(len(self.facing)), self.facing == 4
        if quads.any():
            out[quads] = visible(self.slave[quads], self.master[quads])
        return out

    def _visible_slopes(self) -> Array:
        """Its derivatives by all corners, (k, (a + b) d)."""
        out, quads = np.zeros((len(self.facing), self._ways)), self.facing == 4
        if quads.any():
            out[quads] = visible_slopes(self.slave[quads], self.master[quads])
        return out

    @cached_property
    def _seen(self) -> tuple[Array, Array]:
        """Integrals over what the slave's facet sees, times w alone."""
        return self._times(self._visible)

    @cached_property
    def _turned(self) -> Index:
        """Pairs that share something, of which o may be below 1."""
        some = np.flatnonzero(cosine(self.slave, self.master) < WHOLE)
        return some[self._seen[0][some].any(axis=(1, 2))] if len(some) else some

    @cached_property
    def opposed(self) -> Array:
        """o of `opposed`, (k,); 1 of what shares nothing."""
        out, some = np.ones(len(self.facing)), self.part(self._turned)
        if len(self._turned):
            back = some._other_way
            seen = back._times(back._visible)[0].sum(axis=(1, 2))
            out[self._turned] = opposed(some.slave, some.master, seen)
        return out

    def opposed_slopes(self) -> Array:
        """Its derivatives by all corners, (k, (a + b) d)."""
        out, some = np.zeros((len(self.facing), self._ways)), self.part(self._turned)
        if len(self._turned):
            back, theirs = some._other_way, math.prod(self.master.shape[1:])
            seen = back._times(back._visible)[0].sum(axis=(1, 2))
            by = back._slopes_times(back._visible, FacetPairs._visible_slopes)[0]
            by = np.roll(by.sum(axis=(1, 2)), -theirs, axis=1)  # of the slave first
            moved = (seen[:, None] + 1j * STEP * by).ravel()
            found = opposed(*steps(some.slave, some.master), moved)
            out[self._turned] = found.imag.reshape(by.shape) / STEP
        return out

    def _slopes_of_both(self) -> Array:
        """Derivatives of w o by all corners, (k, (a + b) d)."""
        w, o = self._visible[:, None], self.opposed[:, None]
        return w * self.opposed_slopes() + o * self._visible_slopes()

    @property
    def _other_way(self) -> FacetPairs:
        """Sides exchanged, of first order."""
        flat = np.zeros_like(self.bent)
        return FacetPairs(self.master, self.facing, self.slave, self.corners, flat, flat,
                          (0, 0))  # fmt: skip

    # ---------------------------------------------------------------- integrals
    @property
    def _ways(self) -> int:
        """(a + b) d."""
        return (self.slave.shape[1] + self.master.shape[1]) * self.slave.shape[2]

    def _times(self, w: Array) -> tuple[Array, Array]:
        """Integrals times w (k,)."""
        if self.slave.shape[2] == 3:
            return self._in_space(plane_integrals, w)
        mass, cross = self._on_lines(self.slave, self.master)
        return _over(w, mass) * mass, _over(w, cross) * cross

    def _slopes_times(
        self, w: Array, slopes: Callable[[FacetPairs], Array]
    ) -> tuple[Array, Array]:
        """Derivatives of integrals times w (k,), of which `slopes` makes those."""
        if self.slave.shape[2] == 3:
            found = self._in_space(plane_slopes, w, self._ways)
        else:
            mass, cross = self._on_moved_lines()
            found = _over(w, mass) * mass, _over(w, cross) * cross
        fades = np.flatnonzero((w > 0) & (w < 1))
        if not len(fades):
            return found
        some = self.part(fades)
        by = slopes(some)[:, None, None]
        for out, part in zip(found, some._times(np.ones(len(fades))), strict=True):
            out[fades] += part[..., None] * by
        return found

    def _in_space(
        self, kernel: Callable[..., None], w: Array, *ways: int
    ) -> tuple[Array, Array]:
        """What a kernel finds, times w (k,)."""
        (k, a, _), b = self.slave.shape, self.master.shape[1]
        e, h = self.widths
        found = np.zeros((k, a, a + e, *ways)), np.zeros((k, a, b + h, *ways))
        numbers = np.stack([self.corners, self.facing, self.bent, self.opposite], axis=1)
        given = rules(second=e + h > 0)
        if (w == 1).all():
            kernel(self.slave, self.master, numbers, *given, *found)
            return found
        some = np.flatnonzero(w > 0)  # over outlines that cross themselves there is no integral
        parts = [part[some] for part in found]
        kernel(self.slave[some], self.master[some], numbers[some], *given, *parts)
        for out, part in zip(found, parts, strict=True):
            out[some] = part * _over(w[some], part)
        return found

    def _on_moved_lines(self) -> tuple[Array, Array]:
        """Derivatives of integrals over lines by all corners."""
        (k, a, d), b, ways = self.slave.shape, self.master.shape[1], self._ways
        mine, theirs = steps(self.slave, self.master)
        found = self._on_lines(mine.reshape(k, ways, a, d), theirs.reshape(k, ways, b, d))
        mass, cross = (np.moveaxis(part.imag, 1, -1) / STEP for part in found)
        return mass, cross

    def part(self, chosen: Index) -> FacetPairs:
        """Some of the pairs."""
        return FacetPairs(*(getattr(self, one.name)[chosen] for one in fields(self)[:-1]),
                          self.widths)  # fmt: skip

    def _on_lines(self, slave: Values, master: Values) -> tuple[Values, Values]:
        """`line_integrals`; of lines without a middle nothing at it."""
        e, h = self.widths
        mass, cross = line_integrals(slave, master, e > 0, h > 0)
        for found, bent in ((mass, self.bent), (cross, self.opposite)):
            found[bent == 0, ..., 2:] = 0.0
        return mass, cross
