"""One solution for this load: multipliers of every contact about a known solution.

Of two solutions z0 = (r0, u0) and z of one load let d = z - z0, d_u = W d_r. Normals obey
d_rN d_uN <= 0. With its own r_N as given, Coulomb's law is monotone in the tangents: u0_T would
meet the reaction -mu r_N t, t = u0_T / |u0_T|, and where u0_T = 0 any in the disc |r_T| <= mu
r_N, so that with a unit vector t, or t = -r0_T / (mu r0_N) of a contact that sticks,

    (r_T + mu r_N t) . d_uT <= 0,    where  r_T + mu r_N t = d_rT + mu d_rN t.           (1)

No product of sizes is left. A contact that is open in z0, with the gap g = u0_N, has d_rN d_uN
= -g r_N besides, and for every w in the unit disc

    (r_T + mu r_N w) . d_uT <= mu r_N (|u0_T| - w . u0_T).                               (2)

With tau, sigma > 0 of every contact, and eta = sigma mu t, or for open contacts any

    |eta| <= sigma mu,    sigma mu |u0_T| - eta . u0_T <= tau g,                         (3)

the sum over the contacts of d_rN (tau d_uN + eta . d_uT) + sigma d_rT . d_uT, a quadratic form
of d_r with the matrix sym(E W), E_i = [[tau, eta], [0, sigma I]] in rows N, T, is not positive:
where the matrix is positive definite there is no other solution. It depends on tau, sigma and
eta alone, linearly. Where t varies smoothly over a surface mu does not matter at short
distances (W_NT is odd there), and so, other than for every load, the friction up to which this
holds hardly falls with the mesh.

z0 as computed obeys balance up to |e_u| <= off: with d_u = W d_r - e the smallest eigenvalue of
the matrix bounds d. (Derived here. Monotone where the bound is given: G. Duvaut, J.-L. Lions,
"Inequalities in Mechanics and Physics" (1976), III.5; in W, mu and r0 alone, checked by
`io.certificate_checker`.)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cholesky

from ...core.clock import NEVER, Deadline
from ..multipliers.rounding import EPSILON, gamma, is_positive_definite, unit_scale
from ..scaled import Scaled
from ..solutions.branch_proof import SHARE, smallest_eigenvalue
from ..solutions.discs.known import velocity_and_rounding
from ..tolerances import SLACK
from .pencil import Pencil

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
CONSTANTS = (1.0, 0.5, 1.5, 0.0, 2.0, -1.0)  # log tau that are tried with sigma = 1
# over how much of the largest L is smoothed, and the part of the friction where a search ends
SOFT = ((40.0, 1.05), (150.0, 1.001), (150.0, 2.0))
STEPS = 60
INSIDE = 1 - 1e-12  # of the disc that eta may have
NEAR = 8 * EPSILON  # relative: what rounding may do to a unit vector times a number
PROOF = 2.0  # operations of a proof per cube of the rows


@dataclass(frozen=True, eq=False)
class Reference:
    """A solution put on the law, in scaled variables.

    r, u (nc, d): next to numbers that obey the law exactly; off (nc, d): bound of W r + q - u
    with those; t (nc, d - 1): of the module docstring, zero where it is not determined.
    is_open, sticks (nc,): r = 0, u = 0 beside r_N > 0; rests (nc, d): reactions that are zero
    in every solution.
    """

    r: Array
    u: Array
    off: Array
    t: Array
    is_open: Mask
    sticks: Mask
    rests: Mask

    @classmethod
    def of(cls, scaled: Scaled, r: Array) -> Reference:
        """What misses a border of the law by SLACK lies on it; r (nc, d)."""
        nc, d = scaled.shape
        mu = scaled.mu
        u = scaled.velocity(r[None])[0]
        closed = (r[:, 0] > SLACK) & scaled.reacts
        speed = np.linalg.norm(u[:, 1:], axis=1)
        slip = closed & ((speed > SLACK) | (mu == 0))
        t = u[:, 1:] / np.where(speed > 0, speed, 1.0)[:, None]
        bound = mu * r[:, 0]
        size = np.linalg.norm(r[:, 1:], axis=1)
        inside = np.minimum(1.0, bound * (1 - NEAR) / np.where(size > 0, size, 1.0))
        tangent = np.where(slip[:, None], -bound[:, None] * t, r[:, 1:] * inside[:, None])
        r = np.where(closed[:, None], np.column_stack([r[:, 0], tangent]), 0.0)
        exact, rounding = velocity_and_rounding(scaled, r.ravel())
        given = exact.reshape(nc, d).copy()
        given[closed, 0] = 0.0
        given[~closed, 0] = np.maximum(given[~closed, 0], 0.0)
        stick = closed & ~slip
        given[stick, 1:] = 0.0
        # r_T = -mu r_N u_T / |u_T| of numbers, where that is only next to r_T as stored
        turned = np.abs(t - _directions(given[:, 1:])).max(axis=1, initial=0.0) + NEAR
        turned = np.where(slip, bound * turned, 0.0)
        turned = np.column_stack([np.zeros(nc), *[turned] * (d - 1)]).ravel()
        off = np.abs(exact - given.ravel()) + rounding
        off = (off + np.abs(scaled.W) @ turned * (1 + 1e-9)).reshape(nc, d)
        sticking = np.where(bound > 0, bound, 1.0)[:, None]
        direction = np.where(stick[:, None], -r[:, 1:] / sticking, _directions(given[:, 1:]))
        rests = np.zeros((nc, d), dtype=bool)
        rests[~scaled.reacts] = True
        rests[mu == 0, 1:] = True
        off[rests] = 0.0
        return cls(r, given, off, direction, ~closed, stick, rests)

    @property
    def statuses(self) -> str:
        """A letter of every contact."""
        letters = np.where(self.is_open, "f", np.where(self.sticks, "s", "l"))
        return "".join(letters.tolist())

    @property
    def gap(self) -> Array:
        """u_N of open contacts, 0 of others, (nc,)."""
        return np.where(self.is_open, self.u[:, 0], 0.0)

    @property
    def speed(self) -> Array:
        """|u_T| (nc,)."""
        return np.linalg.norm(self.u[:, 1:], axis=1)


@dataclass(frozen=True, eq=False)
class LoadMultipliers:
    """What proves that a solution is the only one of its load, within distance.

    r0 (nc, d): on the law next to the solution, unit of r; statuses: a letter of every contact
    there, f free, s stick, l slip.  tau, sigma (nc,), eta (nc, d - 1)
    for u in the units of the problem; of contacts in `pinned` (nc,) eta = sigma mu t follows.
    distance: bound of the difference of scaled reactions.  reached: part of the friction of
    the problem up to which the matrix stays definite, in floating point; at least 1 where
    there is a proof, and then as far as was looked.  proved: False for the best of a search
    that found no proof.
    """

    r0: Array
    statuses: str
    tau: Array
    sigma: Array
    eta: Array
    pinned: Mask
    distance: float
    reached: float
    proved: bool


def load_multipliers(
    scaled: Scaled, r: Array, deadline: Deadline = NEVER, *, near: float = np.inf
) -> LoadMultipliers:
    """Multipliers about a solution with reactions r (nc, d), scaled.

    near: distance that a proof may have.  Raises TimeUp where there is no time for one look.
    """
    reference = Reference.of(scaled, r)
    form = _Form(scaled, reference)
    deadline.pay(form.factorisation + PROOF * float(form.size) ** 3)
    known = reference.r * scaled.to_r, reference.statuses
    x, reached = form.constant(CONSTANTS[0]), 0.0
    for x, reached in form.candidates(deadline):
        if reached < 1:
            continue
        deadline.spend(PROOF * float(form.size) ** 3)
        by = form.multipliers(x)
        distance = proved_distance(scaled, reference, *by)
        if distance is not None and distance <= near:
            return LoadMultipliers(*known, *by, distance, reached, True)
    return LoadMultipliers(*known, *form.multipliers(x), np.inf, reached, False)


def proved_distance(
    scaled: Scaled, z0: Reference, tau: Array, sigma: Array, eta: Array, pinned: Mask, *,
    held: Array | None = None,
) -> float | None:  # fmt: skip
    """Bound of the difference of scaled reactions, rounding included; None without a proof.

    held (nc, d, d): what else is known to hold d_r with these multipliers, added to the matrix.
    """
    given = (tau, sigma, eta)
    if not all(np.isfinite(x).all() for x in given) or min(tau.min(), sigma.min()) <= 0:
        return None
    idle = ~scaled.reacts
    rows = idle.repeat(scaled.dimension)
    if scaled.W[rows].any() or scaled.W[:, rows].any() or not (z0.u[idle, 0] > 0).all():
        return None  # a contact may react and move nothing of its own
    form = _Form(scaled, z0)
    limit = sigma * form.mu
    eta = np.where(pinned[:, None], limit[:, None] * z0.t, eta) * (limit[:, None] > 0)
    if not _sides_hold(z0, limit, tau, eta, pinned):
        return None
    W, k, d = form.W, *scaled.shape
    M = form.applied(tau, sigma, eta, W)
    M = (M + M.T) / 2
    scale = unit_scale(M)
    size = np.abs(W)
    spread = form.applied(tau, sigma, np.abs(eta), (size @ scale)[:, None])[:, 0]
    turned = tau.repeat(d).reshape(k, d)
    turned[:, 1:] = sigma[:, None]
    turned *= scale.reshape(k, d)
    turned[:, 1:] += np.abs(eta) * scale.reshape(k, d)[:, :1]
    spread = (spread + size.T @ turned.ravel()) / 2
    if held is not None:
        here = np.arange(k * d).reshape(k, d)
        M[here[:, :, None], here[:, None, :]] += held
        spread += (np.abs(held) @ scale.reshape(k, d, 1)).ravel()
    M *= scale[:, None] * scale
    rounding = gamma(4 * d + 40) * float((spread * scale).max()) * (1 + 1e-9)
    exact = not z0.off.any()
    least = 0.0 if exact else SHARE * smallest_eigenvalue(M)
    M[np.diag_indices(len(M))] -= least
    if not is_positive_definite(M, rounding / len(M)):
        return None
    if exact or least <= 0:
        return 0.0 if exact else None
    push = form.applied(tau, sigma, np.abs(eta), z0.off.reshape(-1, 1))[:, 0]
    reach = float(np.linalg.norm(scale * push)) / least * (1 + 1e-9)
    return reach * float(scale.max()) * (1 + 1e-9)


def _sides_hold(z0: Reference, limit: Array, tau: Array, eta: Array, pinned: Mask) -> bool:
    """(3) for all open contacts that are not pinned, rounding included; others are pinned."""
    free = ~pinned
    if not z0.is_open[free].all():
        return False
    size, along = np.linalg.norm(eta, axis=1), (eta * z0.u[:, 1:]).sum(axis=1)
    needed = limit * z0.speed - along + 4 * NEAR * (limit + size) * z0.speed
    holds = (size <= limit * (1 - NEAR)) & (needed <= tau * z0.gap * (1 - NEAR))
    return bool((holds | (limit == 0))[free].all())


def _directions(v: Array) -> Array:
    """v / |v| of rows, zero where v is."""
    size = np.linalg.norm(v, axis=1)
    return v / np.where(size > 0, size, 1.0)[:, None]


class _Form(Pencil):
    """A = sym(diag(tau, sigma) W) and B = -sym(eta part): A - B is the matrix.

    x: log tau (k,), log sigma (k,), y (k, d - 1) flat: w = y / sqrt(1 + |y|^2) of open
    contacts, led towards t as far as (3) asks for it; W decoupled from reactions that rest.
    """

    def __init__(self, scaled: Scaled, z0: Reference) -> None:
        self.contacts, self.d = scaled.shape
        self.mu, self.z0 = np.where(scaled.reacts, scaled.mu, 0.0), z0
        rests = z0.rests.ravel()
        self.W = scaled.W
        if rests.any():
            self.W = np.where(rests[:, None] | rests, 0.0, scaled.W)
            self.W[rests, rests] = 1.0
        self.normal = self.d * np.arange(self.contacts)
        self.tangent = (self.normal[:, None] + np.arange(1, self.d)).ravel()
        pull = self.mu * z0.speed
        gap = np.where(z0.is_open, z0.gap, 0.0)
        self.room = np.divide(gap, pull, out=np.full(self.contacts, np.inf), where=pull > 0)
        self.room[~z0.is_open] = 0.0

    @property
    def size(self) -> int:
        """Rows of W."""
        return len(self.W)

    @property
    def factorisation(self) -> float:
        """Operations of one, with the matrix."""
        return float(self.size) ** 3 / 3 + 10.0 * float(self.size) ** 2

    def applied(self, tau: Array, sigma: Array, eta: Array, M: Array) -> Array:
        """E M."""
        out = np.empty_like(M)
        out[self.normal] = tau[:, None] * M[self.normal]
        for j in range(self.d - 1):
            out[self.normal] += eta[:, j, None] * M[self.normal + 1 + j]
        out[self.tangent] = sigma.repeat(self.d - 1)[:, None] * M[self.tangent]
        return out

    # ---------------------------------------------------------------- multipliers
    def parts(self, x: Array) -> tuple[Array, ...]:
        """(tau, sigma, w, inner, towards): w = t + towards (inner - t)."""
        k = self.contacts
        tau, sigma = np.exp(x[: 2 * k]).reshape(2, k)
        y = x[2 * k :].reshape(k, -1)
        inner = y / np.sqrt(1 + (y * y).sum(axis=1))[:, None]
        away = 1 - (inner * self.z0.t).sum(axis=1)
        room = np.minimum(self.room, 1e300) * tau / sigma
        towards = np.minimum(1.0, room / np.maximum(away, 1e-300))
        return tau, sigma, self.z0.t + towards[:, None] * (inner - self.z0.t), inner, towards

    def multipliers(self, x: Array) -> tuple[Array, Array, Array, Mask]:
        """(tau, sigma, eta, pinned), those that are not pinned a little inside of (3)."""
        tau, sigma, w, _, towards = self.parts(x)
        limit = sigma * self.mu
        back = INSIDE * np.where(towards < 1, 1 - 1e-9, 1.0)
        w = self.z0.t + back[:, None] * (w - self.z0.t)
        eta = INSIDE * limit[:, None] * w
        pinned = np.zeros(self.contacts, dtype=bool)
        for _ in range(2):  # what is not inside is on the border
            pinned = ~self.z0.is_open | pinned
            alone = self._holds(limit, tau, eta)
            pinned |= ~alone
        return tau, sigma, np.where(pinned[:, None], limit[:, None] * self.z0.t, eta), pinned

    def _holds(self, limit: Array, tau: Array, eta: Array) -> Mask:
        """Contacts at which (3) holds with room for rounding."""
        size, along = np.linalg.norm(eta, axis=1), (eta * self.z0.u[:, 1:]).sum(axis=1)
        needed = limit * self.z0.speed - along + 8 * NEAR * (limit + size) * self.z0.speed
        inside = (size <= limit * (1 - 2 * NEAR)) & (needed <= tau * self.z0.gap * (1 - NEAR))
        return inside | (limit == 0)

    # ---------------------------------------------------------------- what is minimised
    def energy(self, x: Array) -> Array:
        """A."""
        tau, sigma = np.exp(x[: 2 * self.contacts]).reshape(2, -1)
        A = self.applied(tau, sigma, np.zeros((self.contacts, self.d - 1)), self.W)
        return (A + A.T) / 2

    def times(self, x: Array, v: Array) -> Array:
        """B v."""
        _, sigma, w, _, _ = self.parts(x)
        eta = (sigma * self.mu)[:, None] * w
        out = np.zeros_like(v)
        spread = np.zeros_like(v)
        u = self.W @ v
        for j in range(self.d - 1):
            out[self.normal] -= eta[:, j, None] * u[self.normal + 1 + j]
            spread[self.normal + 1 + j] = eta[:, j, None] * v[self.normal]
        return (out - self.W.T @ spread) / 2

    def slope(self, x: Array, w: Array, v: Array, p: Array) -> Array:
        """Gradient of sum p v (B - w A) v."""
        k = self.contacts
        tau, sigma, at, inner, towards = self.parts(x)
        u = self.W @ v
        own = (-(v * u) @ (w * p)).reshape(k, self.d)
        g = np.empty_like(x)
        g[:k], g[k : 2 * k] = own[:, 0] * tau, own[:, 1:].sum(axis=1) * sigma
        vn, ut = v[self.normal], u.reshape(k, self.d, -1)[:, 1:]
        by_eta = -(vn[:, None] * ut) @ p
        limit = sigma * self.mu
        g[k : 2 * k] += limit * (by_eta * at).sum(axis=1)
        by_w = limit[:, None] * by_eta
        apart = inner - self.z0.t
        by_room = np.where(towards < 1, (by_w * apart).sum(axis=1) * towards, 0.0)
        g[:k] += by_room
        g[k : 2 * k] -= by_room
        away = np.maximum(1 - (inner * self.z0.t).sum(axis=1), 1e-300)
        by_inner = by_w * towards[:, None] + (by_room / away)[:, None] * self.z0.t
        y = x[2 * k :].reshape(k, -1)
        root = np.sqrt(1 + (y * y).sum(axis=1))[:, None]
        by_y = (by_inner - (by_inner * inner).sum(axis=1)[:, None] * inner) / root
        by_y[~self.z0.is_open] = 0.0
        g[2 * k :] = by_y.ravel()
        return g

    # ---------------------------------------------------------------- searching
    def constant(self, log_tau: float) -> Array:
        """x with sigma = 1 and w = 0 where it can be."""
        x = np.zeros(self.contacts * (self.d + 1))
        x[: self.contacts] = log_tau
        return x

    def candidates(self, deadline: Deadline) -> Iterator[tuple[Array, float]]:
        """(x, part of the friction that it reaches): constants, then better and better ones."""
        for c in CONSTANTS:
            if not deadline.affords(self.factorisation):
                return
            deadline.spend(self.factorisation)
            if self.is_definite(self.constant(c)):
                yield self.constant(c), 1.0
                break
        best, least = self.constant(CONSTANTS[0]), np.inf
        for c in CONSTANTS:
            if not deadline.affords(2 * self.operations):
                break
            deadline.spend(2 * self.operations)
            value = self.value(self.constant(c), SOFT[-1][0], gradient=False)[0]
            if value < least:
                best, least = self.constant(c), value
        for soft, enough in SOFT:
            best = self.improved(best, soft, STEPS, deadline, enough)
            if self.is_definite(best):
                yield best, 1.0
        yield best, min(self.sharpened(best), 1.0) if np.isfinite(least) else 0.0

    def is_definite(self, x: Array) -> bool:
        """True when the matrix is, in floating point."""
        tau, sigma, eta, _ = self.multipliers(x)
        M = self.applied(tau, sigma, eta, self.W)
        try:
            cholesky((M + M.T) / 2, lower=True, check_finite=False)
        except LinAlgError:
            return False
        return True
