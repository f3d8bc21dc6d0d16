"""Contacts with cones of equal kinds: families of one matrix inequality (`multipliers.lmi`).

A form V is asked to be negative on sums G x of generators, the columns of G: as a slack
-G^T V G - N, with N an unknown nonnegative sum of products that are >= 0 for all x allowed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..multipliers.lmi import Family, Slacks, restricted

Array = NDArray[np.float64]
DUAL = np.array(  # sum_i v_i DUAL_i is positive semidefinite for v_0 >= |(v_1, v_2)|
    [np.eye(2), [[1.0, 0.0], [0.0, -1.0]], [[0.0, 1.0], [1.0, 0.0]]]
)


@dataclass(frozen=True, eq=False)
class Form:
    """Generators G (sets, k, s) of one status, or (k, s) of one contact.

    pairs: x_i x_j >= 0 for these.  disc: |(x_1, x_2)| <= x_0, and x_3 >= 0 where there is one.
    """

    G: Array
    pairs: tuple[tuple[int, int], ...] = ()
    disc: bool = False

    @property
    def key(self) -> tuple:
        """Equal for forms that can be put together."""
        return self.G.shape[-1], self.pairs, self.disc

    @property
    def has_dual(self) -> bool:
        """True where x_3 times a vector v of the disc, its own dual, is among the products."""
        return self.disc and self.G.shape[-1] > 3

    @cached_property
    def products(self) -> Array:
        """N (n, s, s) of every further unknown >= 0; the last three of a dual disc are v."""
        s = self.G.shape[-1]
        pairs = [*self.pairs, *((i, 3) for i in range(3) if self.has_dual)]
        out = np.zeros((len(pairs), s, s))
        for N, (i, j) in zip(out, pairs, strict=True):
            N[i, j] = N[j, i] = 1.0
        cone = [np.diag([1.0, -1.0, -1.0, 0.0])[:s, :s]] if self.disc else []
        return np.array([*cone, *out]).reshape(-1, s, s)


@dataclass(frozen=True, eq=False)
class Group:
    """Contacts with cones of equal kinds, as families of the matrix inequality.

    family: slacks S = -G^T W G - N of the generators, for the proof.  turned: C^T S C with G C
    orthonormal, for the method, which would crawl from sharp cones otherwise; its extras times
    `factors` (contacts, extras) are those of `family`.  Without turning both are the same.
    """

    contacts: NDArray[np.int64]
    coordinates: tuple[int, ...]
    family: Family
    turned: Family
    factors: Array


def whole(parts: Sequence[Group], W: Sequence[Array], contacts: int, k: int) -> Array:
    """Multipliers (nc, k, k) with zeros for the variables that vanish."""
    out = np.zeros((contacts, k, k))
    for group, own in zip(parts, W, strict=True):
        own_rows = np.array(group.coordinates)
        out[np.ix_(group.contacts, own_rows, own_rows)] = own
    return out


def group_of(
    contacts: NDArray[np.int64], own: tuple[int, ...], forms: Sequence[Form],
    shape: tuple[int, int], *, turn: bool,
) -> Group:  # fmt: skip
    """Contacts of a problem (nc, d) with forms (sets, k, s) in coordinates `own` of z.

    Rows of the inequality are the 2 d of every contact, then one for an apex, coordinate 2 d.
    """
    nc, d = shape
    coordinates, sets = np.array(own), len(contacts)
    rows = np.where(coordinates < 2 * d, 2 * d * contacts[:, None] + coordinates, 2 * d * nc)
    m, extras = len(own) * (len(own) + 1) // 2, sum(len(form.products) for form in forms)
    factors, feasible, loose = np.ones((sets, extras)), np.ones(extras), np.ones(extras, bool)
    plain: list[Array] = []
    turned: list[Array] = []
    bounds: list[Array] = []
    number = m
    for form in forms:
        plain.append(restricted(form.G, extras))
        C = None
        if turn:
            Q, R = np.linalg.qr(form.G)
            C = np.linalg.inv(R)
            turned.append(restricted(Q, extras))
        for N in form.products:
            plain[-1][:, number] = -N
            if C is not None:
                T = np.swapaxes(C, 1, 2) @ N @ C
                factors[:, number - m] = 1 / np.linalg.norm(T, axis=(1, 2))
                turned[-1][:, number] = -T * factors[:, number - m, None, None]
            number += 1
        if form.has_dual:
            tied = slice(number - 3 - m, number - m)
            feasible[tied], loose[tied] = (1.0, 0.0, 0.0), False
            bounds.append(np.zeros((sets, m + extras, 2, 2)))
            bounds[-1][:, number - 3 : number] = DUAL
    for j in np.flatnonzero(loose):
        bounds.append(np.zeros((sets, m + extras, 1, 1)))
        bounds[-1][:, m + j] = 1.0
    first = Family(rows, _stacked([*plain, *bounds]), feasible)
    second = Family(rows, _stacked([*turned, *bounds]), feasible) if turn else first
    return Group(contacts, own, first, second, factors)


def _stacked(tensors: Sequence[Array]) -> tuple[Slacks, ...]:
    """Slacks (sets, m, s, s) of all sets, those of equal size s together."""
    out = []
    for s in sorted({tensor.shape[-1] for tensor in tensors}):
        same = [tensor for tensor in tensors if tensor.shape[-1] == s]
        owner = np.tile(np.arange(len(same[0])), len(same))
        out.append(Slacks(owner, np.concatenate(same)))
    return tuple(out)
