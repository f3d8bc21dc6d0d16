"""Random problems for `abuse.py`, most of them made about a solution that is known.

r and u obey the law contact by contact, and q = u - W r: so a solver that finds nothing has
missed something.  Each family below gives one problem from a random generator.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from amontons.problem.friction import FrictionProblem
from amontons.problem.law import Coulomb, Law, Tresca

Array = NDArray[np.float64]
Random = np.random.Generator
STATES = ("open", "stick", "slip")
KINKS = ("graze", "edge")  # u_N = 0 without a force; on the cone without sliding


@dataclass(frozen=True, eq=False)
class Case:
    """A problem, reactions that solve it, (nc, d), if known, and whether there are any."""

    problem: FrictionProblem
    known: Array | None = None
    solvable: bool | None = None
    tolerance: float = 1e-8


def directions(random: Random, nc: int, d: int) -> Array:
    """Unit tangents, (nc, d - 1)."""
    e = random.standard_normal((nc, d - 1))
    return e / np.linalg.norm(e, axis=1, keepdims=True)


def obeying(
    random: Random, law: Law, d: int, states: tuple[str, ...] = STATES
) -> tuple[Array, Array]:
    """(r, u), (nc, d), that obey the law in states drawn at random."""
    nc = len(law.coefficient)
    state = random.choice(states, nc)
    e = directions(random, nc, d)
    r, u = np.zeros((nc, d)), np.zeros((nc, d))
    pushed = ~np.isin(state, ("open", "graze"))
    r[pushed, 0] = random.uniform(0.5, 2.0, pushed.sum())
    u[state == "open", 0] = random.uniform(0.1, 1.0, (state == "open").sum())
    speed = random.uniform(0.1, 1.0, nc)
    tresca = isinstance(law, Tresca)
    slides = np.isin(state, ("slip", "graze")) | ((state == "open") & (not tresca))
    slides |= tresca & (state == "open") & (random.random(nc) < 0.5)
    u[slides, 1:] = (speed[:, None] * e)[slides]
    bound = law.bound(r)
    share = np.where(state == "edge", 1.0, random.uniform(0.0, 0.9, nc))
    share[slides] = 1.0
    r[:, 1:] = -(share * bound)[:, None] * e
    return r, u


def delassus(
    random: Random, W: Array, law: Law, d: int, states: tuple[str, ...] = STATES
) -> Case:
    """The Delassus form about a known solution."""
    r, u = obeying(random, law, d, states)
    q = u - (W @ r.ravel()).reshape(r.shape)
    return Case(FrictionProblem.from_delassus(W, q, law), r, True)


def coulomb(random: Random, nc: int, low: float = 0.1, high: float = 0.8) -> Coulomb:
    """One coefficient for all contacts, or one for each."""
    each = random.uniform(low, high, nc)
    return Coulomb(each if random.random() < 0.5 else np.full(nc, each[0]))


def sizes(random: Random, most: int = 25) -> tuple[int, int]:
    """(nc, d): few contacts more often than many."""
    return int(np.ceil(most ** random.random())), int(random.integers(2, 4))


def full(random: Random, m: int) -> Array:
    """Symmetric positive definite, condition some tens."""
    A = random.standard_normal((m, m)) / np.sqrt(m)
    return A @ A.T + 0.1 * np.eye(m)


def deficient(random: Random, m: int) -> Array:
    """Symmetric, of a rank well below m."""
    rank = int(random.integers(max(1, m // 4), max(2, 3 * m // 4)))
    A = random.standard_normal((m, rank)) / np.sqrt(rank)
    return A @ A.T


def rigid_columns(random: Random, bodies: int, nc: int) -> Array:
    """H, (6 bodies, 3 nc), of contacts at random points between bodies or with the ground."""
    H = np.zeros((6 * bodies, 3 * nc))
    for i in range(nc):
        frame = np.linalg.qr(random.standard_normal((3, 3)))[0]
        body = random.choice(bodies, min(bodies, 2), replace=False)
        for k, sign in zip(body[: random.integers(1, 3)], (1.0, -1.0), strict=False):
            arm = random.uniform(-0.5, 0.5, 3)
            wrench = np.vstack([frame, np.cross(arm, frame.T).T])
            H[6 * k : 6 * k + 6, 3 * i : 3 * i + 3] = sign * wrench
    return H


# ------------------------------------------------------------------------------ families
def regular(random: Random) -> Case:
    """W positive definite."""
    nc, d = sizes(random)
    return delassus(random, full(random, nc * d), coulomb(random, nc), d)


def rank_deficient(random: Random) -> Case:
    """W of low rank, without structure."""
    nc, d = sizes(random)
    return delassus(random, deficient(random, nc * d), coulomb(random, nc), d)


def hyperstatic(random: Random) -> Case:
    """A few rigid bodies with many contacts."""
    bodies = int(random.integers(1, 5))
    nc = int(random.integers(3 * bodies, 12 * bodies))
    H = rigid_columns(random, bodies, nc)
    return delassus(random, H.T @ H, coulomb(random, nc), 3)


def frictionless(random: Random) -> Case:
    """Friction 0, also with W of low rank."""
    nc, d = sizes(random)
    W = random.choice([full, deficient])(random, nc * d)
    return delassus(random, W, Coulomb(np.zeros(nc)), d)


def friction_5(random: Random) -> Case:
    """Friction 5."""
    nc, d = sizes(random)
    return delassus(random, full(random, nc * d), Coulomb(np.full(nc, 5.0)), d)


def friction_mixed(random: Random) -> Case:
    """Friction 0, 0.3, 5 and 1000 side by side."""
    nc, d = sizes(random, 12)
    mu = random.choice([0.0, 0.3, 5.0, 1e3], nc)
    return delassus(random, full(random, nc * d), Coulomb(mu), d)


def friction_huge(random: Random) -> Case:
    """Friction 1000: contacts are glued while they push."""
    nc, d = sizes(random, 12)
    return delassus(random, full(random, nc * d), Coulomb(np.full(nc, 1e3)), d)


def uniform_state(random: Random) -> Case:
    """All open, all stuck or all slipping."""
    nc, d = sizes(random)
    W = random.choice([full, deficient])(random, nc * d)
    return delassus(random, W, coulomb(random, nc), d, (str(random.choice(STATES)),))


def kinks(random: Random) -> Case:
    """Contacts that graze, or stick on the edge of the cone, among others."""
    nc, d = sizes(random)
    W = random.choice([full, deficient])(random, nc * d)
    return delassus(random, W, coulomb(random, nc), d, STATES + KINKS)


def repeated(random: Random) -> Case:
    """One contact many times, with tangents of the same or of another frame each."""
    nc, d = int(random.integers(2, 40)), int(random.integers(2, 4))
    one = full(random, d)
    turns = [np.eye(d)] * nc
    if random.random() < 0.5:
        turns = [tangent_turn(random, d) for _ in range(nc)]
    W = np.block([[a @ one @ b.T for b in turns] for a in turns])
    law = Coulomb(np.full(nc, random.uniform(0.1, 0.8)))
    r, u = obeying(random, law, d)
    u = np.stack([turn @ u[0] for turn in turns])  # one body, seen in each frame
    alone = obeying_velocity(u, r, law)
    q = u - (W @ alone.ravel()).reshape(u.shape)
    return Case(FrictionProblem.from_delassus(W, q, law), alone, True)


def tangent_turn(random: Random, d: int) -> Array:
    """Another choice of tangents: a turn about the normal, in 2D perhaps a reflection."""
    turn = np.eye(d)
    c, s = directions(random, 1, 3)[0]
    turn[1:, 1:] = [[c, -s], [s, c]] if d == 3 else [[random.choice([-1.0, 1.0])]]
    return turn


def obeying_velocity(u: Array, r: Array, law: Law) -> Array:
    """Reactions that fit given velocities; where u = 0 those given, cut to the cone."""
    out = np.zeros_like(r)
    slip = np.linalg.norm(u[:, 1:], axis=1)
    closed = (u[:, 0] == 0) & (r[:, 0] > 0)
    out[closed, 0] = r[closed, 0]
    slides, sticks = closed & (slip > 0), closed & (slip == 0)
    e = u[:, 1:] / np.where(slip > 0, slip, 1)[:, None]
    out[slides, 1:] = -(law.bound(out)[:, None] * e)[slides]
    length = np.linalg.norm(r[:, 1:], axis=1)
    share = np.minimum(law.bound(out) / np.where(length > 0, length, 1), 1)
    out[sticks, 1:] = (share[:, None] * r[:, 1:])[sticks]
    return out


def in_other_units(case: Case, length: float, force: float) -> Case:
    """The same problem with u in units of 1 / length and r in units of 1 / force."""
    p = case.problem
    W = p.W * (length / force)
    law = Tresca(force * p.law.limit) if isinstance(p.law, Tresca) else p.law
    other = FrictionProblem.from_delassus(W, length * np.asarray(p.q), law)
    known = None if case.known is None else force * case.known
    return replace(case, problem=other, known=known)


def units(random: Random) -> Case:
    """Forces and lengths in units apart by up to 1e9 either way."""
    case = random.choice([regular, rank_deficient, hyperstatic, tresca])(random)
    length, force = 10.0 ** random.choice([-9, -5, 0, 5, 9], 2)
    return in_other_units(case, float(length), float(force))


def units_extreme(random: Random) -> Case:
    """Units apart by up to 1e80: squares must not overflow, products not vanish."""
    case = random.choice([regular, rank_deficient])(random)
    length, force = 10.0 ** random.choice([-40, -20, 0, 20, 40], 2)
    return in_other_units(case, float(length), float(force))


def mixed_bodies(random: Random) -> Case:
    """Rigid bodies with masses from a grain of sand to a lorry."""
    bodies = int(random.integers(2, 5))
    nc = int(random.integers(bodies, 6 * bodies))
    H = rigid_columns(random, bodies, nc)
    inverse = np.repeat(10.0 ** random.uniform(-4, 4, bodies), 6)
    return delassus(random, H.T @ (inverse[:, None] * H), coulomb(random, nc), 3)


def scaled_rows(random: Random) -> Case:
    """Contacts measured in different units: D W D with D from 1e-3 to 1e3."""
    nc, d = sizes(random, 12)
    D = np.repeat(10.0 ** random.uniform(-3, 3, nc), d)
    W = D[:, None] * full(random, nc * d) * D
    law = coulomb(random, nc)
    r, u = obeying(random, law, d)
    r, u = r / D.reshape(nc, d), u * D.reshape(nc, d)
    q = u - (W @ r.ravel()).reshape(nc, d)
    return Case(FrictionProblem.from_delassus(W, q, law), r, True)


def contacts_in_own_units(case: Case, random: Random) -> Case:
    """The same problem with every contact in units of its own, apart by up to 1e18.

    Where there is no solution, growing forces may yet come as close to one as both errors ask.
    """
    p = case.problem
    nc, d = p.contacts, p.dimension
    scale = 10.0 ** random.uniform(-9, 9, nc)
    S = np.repeat(scale, d)
    W = S[:, None] * p.W * S
    law = Tresca(p.law.limit / scale) if isinstance(p.law, Tresca) else p.law
    other = FrictionProblem.from_delassus(W, scale[:, None] * np.asarray(p.q), law)
    known = None if case.known is None else case.known / scale[:, None]
    return replace(case, problem=other, known=known, solvable=case.solvable or None)


def small_load(random: Random) -> Case:
    """q tiny or zero."""
    case = regular(random)
    size = float(random.choice([0.0, 1e-12, 1e-30, 1e-60, 1e-90]))
    if size == 0.0:
        p = case.problem
        zero = FrictionProblem.from_delassus(p.W, 0 * np.asarray(p.q), p.law)
        return Case(zero, np.zeros_like(case.known), True)
    return in_other_units(case, size, size)


def dead_contacts(random: Random) -> Case:
    """W_ii = 0 for some contacts, which stay open by themselves; tangents held in others."""
    nc, d = sizes(random)
    W = full(random, nc * d)
    dead = np.zeros((nc, d), bool)
    dead[random.random(nc) < 0.3] = True
    held = random.random(nc) < 0.3
    dead[held, 1] = True
    W[dead.ravel()] = 0
    W[:, dead.ravel()] = 0
    law = coulomb(random, nc)
    r, u = obeying(random, law, d)
    gone = dead.all(axis=1)
    r[gone] = 0
    u[gone, 0] = np.abs(u[gone, 0]) + 0.1
    held &= ~gone
    for i in np.flatnonzero(held):  # a held tangent neither moves nor pushes
        u[i, 1], r[i, 1] = 0, 0
        if d == 3 and u[i, 2] != 0 and r[i, 0] > 0:
            r[i, 2] = -law.coefficient[i] * r[i, 0] * np.sign(u[i, 2])
    q = u - (W @ r.ravel()).reshape(nc, d)
    return Case(FrictionProblem.from_delassus(W, q, law), r, True)


def driven_contacts(random: Random) -> Case:
    """Tangents that supports drive: W is zero there, and they slide at a given speed."""
    nc, d = sizes(random)
    W = full(random, nc * d)
    driven = random.random(nc) < 0.5
    rows = np.zeros((nc, d), bool)
    rows[driven, 1] = True
    W[rows.ravel()] = 0
    W[:, rows.ravel()] = 0
    law = coulomb(random, nc)
    r, u = obeying(random, law, d)
    for i in np.flatnonzero(driven):
        u[i, 1] = random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-6, 1)
        if d == 3 and r[i, 0] > 0:
            u[i, 2] = random.standard_normal()
        r[i, 1:] = -law.coefficient[i] * r[i, 0] * u[i, 1:] / norm_of(u[i, 1:])
    q = u - (W @ r.ravel()).reshape(nc, d)
    q[rows] = u[rows]
    return Case(FrictionProblem.from_delassus(W, q, law), r, True)


def norm_of(x: Array) -> float:
    """Euclidean length."""
    return float(np.linalg.norm(x))


def unsymmetric(random: Random) -> Case:
    """W with a skew part (follower loads, gyroscopic terms)."""
    nc, d = sizes(random)
    m = nc * d
    S = random.standard_normal((m, m)) / np.sqrt(m)
    W = full(random, m) + random.uniform(0.05, 0.5) * (S - S.T)
    return delassus(random, W, coulomb(random, nc), d)


def tresca(random: Random) -> Case:
    """Given friction bounds, some of them zero."""
    nc, d = sizes(random)
    W = random.choice([full, deficient])(random, nc * d)
    bound = random.uniform(0, 2, nc) * (random.random(nc) < 0.8)
    return delassus(random, W, Tresca(bound), d)


def one_contact(random: Random) -> Case:
    """A single contact, W_ii of rank 1 to 3."""
    d = int(random.integers(2, 4))
    A = random.standard_normal((d, int(random.integers(1, d + 1))))
    return delassus(random, A @ A.T, coulomb(random, 1, 0.0, 1.5), d, STATES + KINKS)


def many_contacts(random: Random) -> Case:
    """One to three hundred contacts, dense or a chain of neighbours."""
    nc = int(random.integers(100, 300))
    if random.random() < 0.5:
        return delassus(random, full(random, 3 * nc), coulomb(random, nc, 0.1, 0.5), 3)
    H = rigid_columns(random, nc // 2, nc)
    return delassus(random, H.T @ H, coulomb(random, nc, 0.1, 0.5), 3)


def single_precision(random: Random) -> Case:
    """W and q as float32; W is positive definite, so a solution exists."""
    nc, d = sizes(random)
    case = delassus(random, full(random, nc * d), coulomb(random, nc), d)
    p = case.problem
    W, q = np.float32(p.W), np.float32(p.q)
    return Case(FrictionProblem.from_delassus(W, q, p.law), None, True, 1e-6)


def global_form(random: Random) -> Case:
    """M v = H r + f with a coupled or block diagonal M."""
    nc, d = sizes(random, 12)
    n = nc * d + int(random.integers(0, 20))
    M = full(random, n) if random.random() < 0.5 else np.diag(random.uniform(0.1, 10, n))
    H = random.standard_normal((n, nc * d)) / np.sqrt(n)
    law = coulomb(random, nc)
    r, u = obeying(random, law, d)
    f = random.standard_normal(n)
    v = np.linalg.solve(M, H @ r.ravel() + f)
    w = u - (H.T @ v).reshape(nc, d)
    return Case(FrictionProblem.from_global(M, H, f, w, law), r, True)


def held_by_contact(random: Random) -> Case:
    """A chain of springs without a support: M has the null space of a rigid motion."""
    nc = int(random.integers(2, 8))
    n, d = 2 * nc, 2
    stiffness = np.zeros((n, n))
    for i in range(nc - 1):
        for k in range(d):
            a, b = d * i + k, d * (i + 1) + k
            stiffness[[a, b, a, b], [a, b, b, a]] += np.array([1, 1, -1, -1])
    law = coulomb(random, nc, 0.3, 0.8)
    r, u = obeying(random, law, d, ("stick",))
    v = random.standard_normal(n)
    f = stiffness @ v - r.ravel()
    w = u - v.reshape(nc, d)
    return Case(FrictionProblem.from_global(stiffness, np.eye(n), f, w, law), r, True)


def impossible(random: Random) -> Case:
    """No solution: a dead contact that penetrates, or a body between closing walls."""
    if random.random() < 0.5:
        case = regular(random)
        p = case.problem
        d = p.dimension
        W, q = np.array(p.W), np.array(p.q)
        W[:d], W[:, :d] = 0, 0
        q[0, 0] = -1.0
        return Case(FrictionProblem.from_delassus(W, q, p.law), None, False)
    d = int(random.integers(2, 4))
    H = np.hstack([np.eye(d), np.diag([-1.0] + [1.0] * (d - 1))])
    q = 0.1 * random.standard_normal((2, d))
    q[:, 0] = -random.uniform(0.5, 1, 2)
    return Case(FrictionProblem.from_delassus(H.T @ H, q, coulomb(random, 2)), None, False)


FAMILIES: dict[str, Callable[[Random], Case]] = {
    family.__name__.replace("_", " "): family
    for family in (
        regular, rank_deficient, hyperstatic, frictionless, friction_5, friction_mixed,
        friction_huge, uniform_state, kinks, repeated, units, units_extreme, mixed_bodies,
        scaled_rows, small_load, dead_contacts, driven_contacts, unsymmetric, tresca,
        one_contact, many_contacts, single_precision, global_form, held_by_contact, impossible,
    )
}  # fmt: skip


RESCALED = tuple(
    name for name in FAMILIES
    if name not in ("units extreme", "single precision", "global form", "held by contact")
)  # fmt: skip


def draw_rescaled(seed: int, number: int) -> tuple[str, Case]:
    """Problem `number` of a run of families in the Delassus form, contacts in own units."""
    name = RESCALED[number % len(RESCALED)]
    random = np.random.default_rng([seed, number, 2])
    return name, contacts_in_own_units(FAMILIES[name](random), random)


def draw(seed: int, number: int) -> tuple[str, Case]:
    """Problem `number` of a run: families take turns, and each draws from its own stream."""
    name = list(FAMILIES)[number % len(FAMILIES)]
    return name, FAMILIES[name](np.random.default_rng([seed, number]))
