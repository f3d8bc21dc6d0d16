"""The cones of statuses: about a known solution z, cone(C_s - z), or over C_s x {1}."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scaled import Scaled
from ...solutions.groups import Form, Group, group_of
from ...statuses import ANY, CLOSED, FREE, MINUS, PLUS, SLIP, STICK, States
from .known import Known

Array = NDArray[np.float64]
NONE, PLANE, WEDGE, TRIPLE, LINE, SPACE = range(6)  # kinds of cones, see `Cones`
PAIRS = ((), (), ((0, 1),), ((0, 1), (0, 2), (1, 2)), ((1, 2),), ())  # by kind, see `Form`
FLAT = 1e-4  # angle of the third generator with the plane of the others that is too small
ALLOWED = np.zeros((9, 4), dtype=bool)  # statuses of a state
ALLOWED[:4] = np.eye(4, dtype=bool)
ALLOWED[ANY], ALLOWED[CLOSED, PLUS:], ALLOWED[SLIP, [PLUS, MINUS]] = True, True, True
SLIGHT = 1e-4  # friction below which a stick cone counts as the half plane r_N >= 0


@dataclass(frozen=True, eq=False)
class Cones:
    """For every status and contact generators, the columns of G (4, nc, k, 3), and their kind.

    kind (nc, 4): NONE; PLANE and SPACE, the span of two or three columns; WEDGE and TRIPLE,
    nonnegative sums of two or three; LINE, any multiple of the first plus nonnegative ones of
    two others.
    """

    kind: NDArray[np.int8]
    G: Array


def allowed(mu: Array, branch: States) -> NDArray[np.bool_]:
    """(nc, 4): statuses of every contact."""
    out = ALLOWED[branch].copy()
    smooth = mu == 0
    out[smooth, PLUS] |= out[smooth, STICK] | out[smooth, MINUS]
    out[smooth, STICK] = out[smooth, MINUS] = False
    return out


def cones_about(local: Scaled, branch: States, known: Known) -> Cones:
    """cone(C_s - z) of all statuses of a branch that holds the known solution; k = 4."""
    G, z = _pieces(local.mu, 4), known.z
    length = np.linalg.norm(z, axis=1)
    G[:, :, :, 2] = -z / np.where(length > 0, length, 1.0)[:, None]
    mu, smooth = local.mu, local.mu == 0
    kind = np.full((local.contacts, 4), TRIPLE, dtype=np.int8)
    none, still = (z[:, :2] == 0).all(axis=1), (z[:, 2:] == 0).all(axis=1)
    kind[:, FREE] = np.where(none, PLANE, LINE)
    kind[still, STICK] = np.where(length > 0, PLANE, WEDGE)[still]
    for status, sign in ((PLUS, 1.0), (MINUS, -1.0)):
        inside = (z[:, 2] == 0) & (z[:, 1] == sign * mu * z[:, 0])
        ahead = (z[:, 0] > 0) | (sign * z[:, 3] < 0)
        kind[inside, status] = np.where(ahead, PLANE, WEDGE)[inside]
    kind[smooth, PLUS] = np.where(z[:, 2] == 0, PLANE, LINE)[smooth]
    kind[~allowed(local.mu, branch)] = NONE
    _widen_inplace(kind, G)
    _half_planes_inplace(kind, mu)
    return Cones(kind, G)


def _widen_inplace(kind: NDArray[np.int8], G: Array) -> None:
    """Cones whose third generator is almost in the plane of the others: a wider one instead.

    With -z = -a g_1 - b g_2 - p, p across, it lies in the sum of all multiples of those g with
    a positive factor, nonnegative ones of the others, and those of -p.  Of a line always.
    """
    for status, contact in np.argwhere(np.isin(kind.T, (TRIPLE, LINE))):
        columns = G[status, contact]
        factors = np.linalg.lstsq(columns[:, :2], columns[:, 2])[0]
        across = columns[:, 2] - columns[:, :2] @ factors
        size = np.linalg.norm(across)
        line = kind[contact, status] == LINE
        if size > FLAT and not line:
            continue
        columns[:, 2] = across / size
        both = np.array([line or factors[0] < 0, factors[1] < 0 and size <= FLAT])
        if both[1] and not both[0]:
            columns[:, :2] = columns[:, 1::-1]
        kind[contact, status] = (TRIPLE, LINE, SPACE)[int(both.sum())]


def cones_with_apex(local: Scaled, branch: States) -> Cones:
    """{(z, tau): tau >= 0, z in tau C_s} and limits, of all statuses of a branch; k = 5."""
    G = _pieces(local.mu, 5)
    G[:, :, 4, 2] = 1.0
    kind = np.full((local.contacts, 4), TRIPLE, dtype=np.int8)
    kind[:, FREE] = LINE
    kind[local.mu == 0, PLUS] = LINE
    kind[~allowed(local.mu, branch)] = NONE
    _half_planes_inplace(kind, local.mu)
    return Cones(kind, G)


def _half_planes_inplace(kind: NDArray[np.int8], mu: Array) -> None:
    """Kinds of stick cones whose first generator is a line, see `_pieces`."""
    slight = (mu > 0) & (mu < SLIGHT)
    stick = kind[:, STICK]
    wide = np.where(stick == WEDGE, PLANE, np.where(stick == TRIPLE, LINE, stick))
    kind[slight, STICK] = wide[slight]


def _pieces(mu: Array, k: int) -> Array:
    """G (4, nc, k, 3) with the two generators of C_s in the first two columns."""
    G = np.zeros((4, len(mu), k, 3))
    length = np.sqrt(1 + mu**2)
    G[FREE, :, 3, 0] = G[FREE, :, 2, 1] = 1.0
    for status, column, sign in ((STICK, 0, 1), (STICK, 1, -1), (PLUS, 0, 1), (MINUS, 0, -1)):
        G[status, :, 0, column] = 1 / length
        G[status, :, 1, column] = sign * mu / length
    G[PLUS, :, 3, 1], G[MINUS, :, 3, 1] = -1.0, 1.0
    slight, smooth = mu < SLIGHT, mu == 0
    G[STICK, slight] = 0.0
    G[STICK, slight, 1, 0] = G[STICK, slight, 0, 1] = 1.0
    G[PLUS, smooth] = 0.0
    G[PLUS, smooth, 3, 0] = G[PLUS, smooth, 0, 1] = 1.0
    return G


def groups(cones: Cones, coordinates: list[tuple[int, ...]]) -> list[Group]:
    """Contacts with cones of equal kinds and coordinates together."""
    nc, apex = len(cones.kind), cones.G.shape[2] == 5
    code = np.array([sum(1 << c for c in own) for own in coordinates])
    _, group = np.unique(np.column_stack([code, cones.kind]), axis=0, return_inverse=True)
    group, out = np.ravel(group), []
    for g in range(group.max() + 1):
        index = np.flatnonzero(group == g)
        own = (*coordinates[index[0]], 4) if apex else coordinates[index[0]]
        G = cones.G[:, index][:, :, list(own)]
        forms = [Form(G[status][:, :, :2] if kind in (PLANE, WEDGE) else G[status], PAIRS[kind])
                 for status, kind in enumerate(cones.kind[index[0]].tolist())
                 if kind != NONE]  # fmt: skip
        out.append(group_of(index, own, forms, (nc, 2), turn=True))
    return out
