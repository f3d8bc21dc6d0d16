"""What partly decided statuses leave of a 2D Coulomb problem: cones and linear equations.

Variables of a contact are z = (r_N, r_T, u_N, u_T), u = W r + q, all scaled by powers of two so
that |W_ii| and |q| are near 1: the scaled problem is the given one without rounding.
Statuses and their cones C_s:

    free   r = 0, u_N >= 0              slip +  u_N = 0, r_T =  mu r_N, r_N >= 0, u_T <= 0
    stick  u = 0, |r_T| <= mu r_N       slip -  u_N = 0, r_T = -mu r_N, r_N >= 0, u_T >= 0

A contact without friction is free, or slips with u_T of any sign (listed as slip +).

`Branch` is a state of every contact: one status, or several that are not told apart.
`cones_about` gives cone(C_s - z) for a known solution z, `cones_with_apex` the cone over
C_s x {1}.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from ...problem import FrictionProblem
from ..multipliers.multiplier_lmi import Family, Slacks, restricted
from ..multipliers.scales import contact_sizes, load_size

Array = NDArray[np.float64]
States = NDArray[np.int8]
FREE, STICK, PLUS, MINUS = range(4)  # statuses, also the order of columns below
UNDECIDED, CLOSED, SLIPPING = 4, 5, 6  # further states of a contact in a branch
LETTERS = "fs+-.cx"
ALLOWED = np.zeros((7, 4), dtype=bool)  # statuses of a state
ALLOWED[:4] = np.eye(4, dtype=bool)
ALLOWED[UNDECIDED], ALLOWED[CLOSED, STICK:], ALLOWED[SLIPPING, PLUS:] = True, True, True
COORDINATES = {  # variables of a contact that do not vanish, or follow, by its state
    FREE: (2, 3), STICK: (0, 1), PLUS: (0, 3), MINUS: (0, 3),
    UNDECIDED: (0, 1, 2, 3), CLOSED: (0, 1, 3), SLIPPING: (0, 1, 3),
}  # fmt: skip
WITHOUT_FRICTION = (0, 2, 3)  # of a contact that is not decided
SNAP = 1e-9  # scaled distance from a border of the law that counts as none
NONE, PLANE, WEDGE, TRIPLE, LINE, SPACE = range(6)  # kinds of cones, see `Cones`
PAIRS = {NONE: (), PLANE: (), WEDGE: ((0, 1),), TRIPLE: ((0, 1), (0, 2), (1, 2)),
         LINE: ((1, 2),), SPACE: ()}  # fmt: skip
FLAT = 1e-4  # angle of the third generator with the plane of the others that is too small
SLIGHT = 1e-4  # friction below which a stick cone counts as the half plane r_N >= 0


@dataclass(frozen=True, eq=False)
class LoadProblem:
    """W (2 nc, 2 nc), q (2 nc,) and mu (nc,) in units that are powers of two."""

    problem: FrictionProblem
    W: Array
    q: Array
    mu: Array
    to_r: Array  # (2 nc,): reaction = to_r * scaled reaction
    to_u: Array
    reacts: NDArray[np.bool_]  # contacts with W_ii > 0

    @classmethod
    def of(cls, problem: FrictionProblem) -> LoadProblem:
        """The condensed problem, scaled."""
        local = problem.condensed()
        nc = local.contacts
        assert local.W is not None and local.q is not None
        W = local.W if isinstance(local.W, np.ndarray) else local.W.toarray()
        size, reacts = contact_sizes(W, nc)
        root = np.repeat(_power_of_two(np.sqrt(size)), 2)
        q = local.q.ravel() / root
        unit = _power_of_two(np.array(load_size(q.reshape(nc, 2), local.mu, reacts) or 1.0))
        W = W / root / root[:, None]
        return cls(local, W, q / unit, local.mu, unit / root, unit * root, reacts)

    @property
    def contacts(self) -> int:
        """nc."""
        return len(self.mu)

    @property
    def root_branch(self) -> States:
        """Nothing decided but what can not be otherwise."""
        return np.where(self.reacts, UNDECIDED, FREE).astype(np.int8)

    def allowed(self, branch: States) -> NDArray[np.bool_]:
        """(nc, 4): statuses of every contact."""
        out = ALLOWED[branch].copy()
        smooth = self.mu == 0
        out[smooth, PLUS] |= out[smooth, STICK] | out[smooth, MINUS]
        out[smooth, STICK] = out[smooth, MINUS] = False
        return out

    def children(self, branch: States, contact: int) -> tuple[States, ...]:
        """The branches into which one contact divides a branch, none when it is decided."""
        parts = {UNDECIDED: (FREE, CLOSED), CLOSED: (STICK, SLIPPING), SLIPPING: (PLUS, MINUS)}
        if self.mu[contact] == 0:
            parts = {UNDECIDED: (FREE, PLUS)}
        out = []
        for state in parts.get(int(branch[contact]), ()):
            child = branch.copy()
            child[contact] = state
            out.append(child)
        return tuple(out)

    def coordinates(self, branch: States) -> list[tuple[int, ...]]:
        """The variables of every contact that are not zero and do not follow from others."""
        return [
            WITHOUT_FRICTION if mu == 0 and state == UNDECIDED else COORDINATES[int(state)]
            for mu, state in zip(self.mu, branch, strict=True)
        ]

    def reactions(self, branch: States) -> sparse.csr_array:
        """R (2 nc, k): r = R y for all reactions of a branch."""
        normal = np.flatnonzero(branch != FREE)
        states = branch[normal]
        single = (states == PLUS) | (states == MINUS) | (self.mu[normal] == 0)
        first = np.concatenate([[0], np.cumsum(np.where(single, 1, 2))])
        column = first[:-1]
        slope = np.where(states == MINUS, -1.0, 1.0) * self.mu[normal]
        rows = [2 * normal, 2 * normal[single] + 1, 2 * normal[~single] + 1]
        columns = [column, column[single], column[~single] + 1]
        entries = [np.ones(len(normal)), slope[single], np.ones(int((~single).sum()))]
        return sparse.csr_array(
            (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))),
            shape=(2 * self.contacts, int(first[-1])),
        )

    def zero_velocities(self, branch: States) -> NDArray[np.int64]:
        """Components of u that vanish in all of a branch."""
        closed = np.flatnonzero((branch != FREE) & (branch != UNDECIDED))
        stick = np.flatnonzero(branch == STICK)
        return np.sort(np.concatenate([2 * closed, 2 * stick + 1]))


def word(branch: States) -> str:
    """A branch as text: f free, s stick, +, - slip, c closed, x slip, . anything."""
    return "".join(LETTERS[int(state)] for state in branch)


def _power_of_two(x: Array) -> Array:
    return np.exp2(np.round(np.log2(x)))


# ------------------------------------------------------------------ a known solution
@dataclass(frozen=True, eq=False)
class Known:
    """A solution: reactions r (2 nc,), the nearest z (nc, 4) that obeys the law, and how near.

    off (2 nc,): bound of |W r + q - u| with u from z, rounding included; r is that of z but for
    one rounding of a slipping r_T.  touches (nc, 4): statuses whose cone holds z.
    """

    r: Array
    z: Array
    off: Array
    touches: NDArray[np.bool_]

    @property
    def valid(self) -> bool:
        """True where every contact has a status."""
        return bool(self.touches.any(axis=1).all())


def known_solution(local: LoadProblem, r: Array) -> Known:
    """Scaled reactions (2 nc,) put on the law: what misses a border by SNAP lies on it."""
    mu = local.mu
    normal, tangent = r.reshape(-1, 2).T.copy()
    u = (local.W @ r + local.q).reshape(-1, 2)
    closed = (normal > SNAP) & local.reacts
    bound = mu * normal
    slip = closed & ((np.abs(u[:, 1]) > SNAP) | (mu == 0))
    border = closed & (np.abs(tangent) >= bound - SNAP)
    slope = np.where(slip, -np.sign(u[:, 1]), np.sign(tangent))
    tangent = np.where(slip | border, slope * bound, tangent)
    r = np.where(closed, np.stack([normal, tangent]), 0.0).T.ravel()
    u, rounding = _velocity(local, r)
    z = np.hstack([r.reshape(-1, 2), u.reshape(-1, 2)])
    z[:, 2] = np.where(closed | (z[:, 2] <= SNAP), 0.0, z[:, 2])
    z[closed & ~slip, 3] = 0.0
    off = np.abs(u - z[:, 2:].ravel()) + rounding
    return Known(r, z, off, _touches(local, z))


def _velocity(local: LoadProblem, r: Array) -> tuple[Array, Array]:
    """(W r + q, bound of its error): summed in extended precision where the machine has one."""
    if not r.any():
        return local.q.copy(), np.zeros(len(r))
    wide = np.longdouble
    u = np.asarray(local.W.astype(wide) @ r.astype(wide) + local.q, dtype=float)
    size = np.abs(local.W) @ np.abs(r) + np.abs(local.q)
    rounding = (len(r) + 4) * float(np.finfo(wide).eps) * size + np.finfo(float).eps * np.abs(u)
    return u, rounding


def _touches(local: LoadProblem, z: Array) -> NDArray[np.bool_]:
    """(nc, 4): statuses whose cone holds the rows of z, which obey the law exactly."""
    mu, none = local.mu, (z[:, :2] == 0).all(axis=1)
    still = (z[:, 2:] == 0).all(axis=1)
    out = np.zeros((len(z), 4), dtype=bool)
    out[:, FREE] = none
    out[:, STICK] = still & (mu > 0) & local.reacts
    contact = (z[:, 2] == 0) & local.reacts
    out[:, PLUS] = contact & (z[:, 1] == mu * z[:, 0]) & ((z[:, 3] <= 0) | (mu == 0))
    out[:, MINUS] = contact & (z[:, 1] == -mu * z[:, 0]) & (z[:, 3] >= 0) & (mu > 0)
    return out


def contains(local: LoadProblem, branch: States, known: Known) -> bool:
    """True when a branch has a known solution."""
    return bool((local.allowed(branch) & known.touches).any(axis=1).all())


# ------------------------------------------------------------------ cones
@dataclass(frozen=True, eq=False)
class Cones:
    """For every status and contact generators, the columns of G (4, nc, k, 3), and their kind.

    kind (nc, 4): NONE; PLANE and SPACE, the span of two or three columns; WEDGE and TRIPLE,
    nonnegative sums of two or three; LINE, any multiple of the first plus nonnegative ones of
    two others.
    """

    kind: NDArray[np.int8]
    G: Array


def cones_about(local: LoadProblem, branch: States, known: Known) -> Cones:
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
    kind[~local.allowed(branch)] = NONE
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


def cones_with_apex(local: LoadProblem, branch: States) -> Cones:
    """{(z, tau): tau >= 0, z in tau C_s} and limits, of all statuses of a branch; k = 5."""
    G = _pieces(local.mu, 5)
    G[:, :, 4, 2] = 1.0
    kind = np.full((local.contacts, 4), TRIPLE, dtype=np.int8)
    kind[:, FREE] = LINE
    kind[local.mu == 0, PLUS] = LINE
    kind[~local.allowed(branch)] = NONE
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


# ------------------------------------------------------------------ coordinates of a branch
def energy_basis(local: LoadProblem, branch: States, apex: bool) -> tuple[Array, Array]:
    """(Z (4 nc, N), T (k, N)): z = Z w, y = T w for w with the zero velocities of a branch.

    |w|^2 is the energy r W r, plus tau^2 where there is an apex, the last row of Z and T then.
    A semidefinite W gets a small part of |r|^2 more.
    """
    R = local.reactions(branch)
    WR = local.W @ R.toarray() if R.shape[1] else np.zeros((len(local.W), 0))
    rows = local.zero_velocities(branch)
    motion = np.column_stack([WR, local.q]) if apex else WR
    energy = R.T @ ((WR + (R.T @ local.W).T) / 2)
    energy += 1e-13 * len(energy) * sparse.csr_array(R.T @ R).toarray()
    if apex:
        energy = linalg.block_diag(energy, 1.0)
    T = linalg.null_space(motion[rows]) if len(rows) else np.eye(motion.shape[1])
    T = T @ _inverse_root(T.T @ energy @ T)
    shape = (local.contacts, 2, T.shape[1])  # no columns where nothing can move
    r = np.asarray(R @ T[: R.shape[1]]).reshape(shape)
    u = (motion @ T).reshape(shape)
    Z = np.concatenate([r, u], axis=1).reshape(4 * local.contacts, T.shape[1])
    return (np.vstack([Z, T[-1:]]) if apex else Z), T


def _inverse_root(energy: Array) -> Array:
    """B with B^T energy B = I; where energy is not definite a multiple of |y|^2 is added."""
    n = len(energy)
    energy = (energy + energy.T) / 2
    size = float(np.trace(energy)) / max(n, 1)
    for part in (0.0, 1e-10, 1e-7, 1e-4, 1e-2, 1.0):
        try:
            L = np.linalg.cholesky(energy + part * size * np.eye(n))
        except np.linalg.LinAlgError:
            continue
        return linalg.solve_triangular(L, np.eye(n), lower=True, trans="T")
    return np.eye(n)
