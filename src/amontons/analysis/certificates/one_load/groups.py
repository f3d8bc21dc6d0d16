"""Contacts with cones of equal kinds: families of one matrix inequality (`multipliers.lmi`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...multipliers.lmi import Family, Slacks, restricted
from .cones import LINE, NONE, PLANE, SPACE, TRIPLE, WEDGE, Cones

Array = NDArray[np.float64]
PAIRS = {NONE: (), PLANE: (), WEDGE: ((0, 1),), TRIPLE: ((0, 1), (0, 2), (1, 2)),
         LINE: ((1, 2),), SPACE: ()}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Group:
    """Contacts with cones of equal kinds, as families of the matrix inequality.

    family: slacks S = -G^T W G - N of the generators, for the proof.  turned: C^T S C with G C
    orthonormal, for the method, which would crawl from sharp cones otherwise; its extras times
    `factors` (contacts, extras) are those of `family`.
    """

    contacts: NDArray[np.int64]
    coordinates: tuple[int, ...]
    family: Family
    turned: Family
    factors: Array


def groups(cones: Cones, coordinates: list[tuple[int, ...]]) -> list[Group]:
    """Rows of Z are 4 contact + coordinate, then one for tau where there is an apex."""
    nc, apex = len(cones.kind), cones.G.shape[2] == 5
    code = np.array([sum(1 << c for c in own) for own in coordinates])
    _, group = np.unique(np.column_stack([code, cones.kind]), axis=0, return_inverse=True)
    group, out = np.ravel(group), []
    for g in range(group.max() + 1):
        index = np.flatnonzero(group == g)
        own = coordinates[index[0]]
        rows = 4 * index[:, None] + np.array(own)
        if apex:
            rows = np.column_stack([rows, np.full(len(index), 4 * nc)])
            own = (*own, 4)
        G = cones.G[:, index][:, :, list(own)]
        out.append(_group(index, own, rows, cones.kind[index[0]], G))
    return out


def whole(parts: list[Group], W: tuple[Array, ...], contacts: int, k: int = 4) -> Array:
    """Multipliers (nc, k, k) with zeros for the variables that vanish."""
    out = np.zeros((contacts, k, k))
    for group, own in zip(parts, W, strict=True):
        out[np.ix_(group.contacts, group.coordinates, group.coordinates)] = own
    return out


def _group(
    contacts: NDArray[np.int64], own: tuple[int, ...], rows: NDArray[np.int64],
    kind: NDArray[np.int8], G: Array,
) -> Group:  # fmt: skip
    sets, k = rows.shape
    m, extras = k * (k + 1) // 2, sum(len(PAIRS[int(one)]) for one in kind)
    factors, number = np.ones((sets, extras)), 0
    plain, turned = [], []
    for status in np.flatnonzero(kind != NONE):
        columns = G[status, :, :, : 2 if kind[status] in (PLANE, WEDGE) else 3]
        Q, R = np.linalg.qr(columns)
        C = np.linalg.inv(R)
        own_tensor, other = restricted(columns, extras), restricted(Q, extras)
        for i, j in PAIRS[int(kind[status])]:
            own_tensor[:, m + number, i, j] = own_tensor[:, m + number, j, i] = -1.0
            N = C[:, i, :, None] * C[:, j, None, :]
            N = N + np.swapaxes(N, 1, 2)
            factors[:, number] = 1 / np.linalg.norm(N, axis=(1, 2))
            other[:, m + number] = -N * factors[:, number, None, None]
            number += 1
        plain.append(Slacks(np.arange(sets), own_tensor))
        turned.append(Slacks(np.arange(sets), other))
    numbers = _positive_extras(sets, m, extras)
    first, second = (Family(rows, (*s, *numbers), np.ones(extras)) for s in (plain, turned))
    return Group(contacts, own, first, second, factors)


def _positive_extras(sets: int, m: int, extras: int) -> list[Slacks]:
    """Each extra unknown as a slack of its own."""
    if not extras:
        return []
    tensor = np.zeros((sets, extras, m + extras, 1, 1))
    tensor[:, np.arange(extras), m + np.arange(extras)] = 1.0
    owner = np.repeat(np.arange(sets), extras)
    return [Slacks(owner, tensor.reshape(-1, m + extras, 1, 1))]
