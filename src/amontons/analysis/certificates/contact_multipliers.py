"""A friction below which every load has one solution, with multipliers of every contact.

Where the law of a contact is smooth, a change of its reaction and velocity obeys

    free   dr = 0        stick  du = 0
    slip   du_N = 0,  dr_T = -mu dr_N t - kappa P du_T,    t the direction of slip, |t| = 1,
                                                           P across it, kappa >= 0,

so dr_N du_N = 0, du_N dr_T = 0 and dr_T du_T <= mu |dr_N| |du_T|.  With tau, sigma, alpha > 0
and a vector f of every contact

    sum tau dr_N du_N + du_N f.dr_T + sigma dr_T.du_T
        <= sum mu sigma/2 (alpha dr_N^2 + |du_T|^2 / alpha).

With du = W dr the left side is dr A dr, A = sym(D W), D_i = [[tau, 0], [f, sigma I]] in rows
N, T, the right side t dr B dr with mu = t shape.  Where A - t B is positive definite no piece
of the law is singular, all have the orientation of those without friction.  Then the law and
balance, a Lipschitz map of x = r - u, have a determinant of at least some c > 0 almost
everywhere: such a map is open and discrete (Reshetnyak; in 2D it is piecewise linear), of
degree one as t is led to zero, and so every load has exactly one solution.

The multipliers are those of the largest t that a descent method finds: minimised is the
largest L of B v = L A v, smoothed over the largest few.  Many contacts begin with the
multipliers of every fourth (in 2D second) one alone, interpolated by how much W couples them,
with alpha times a factor that is tried.  All that is floating point; the proof at the end
covers rounding, for W as given.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from .contact_proof import ContactMultipliers, holds
from .energy_bound import energy_bound
from .pencil import DENSE, INDEFINITE, Pencil, symmetrised
from .thinning import COARSEST, couplings, spread_out

Array = NDArray[np.float64]
Places = NDArray[np.int64]
THINNED = {2: 2, 3: 4}  # contacts of which one begins
NEAREST, POWER = 4, 4  # contacts between which others are interpolated, power of couplings
SHIFTS = (-0.7, -0.35, 0.0, 0.2, 0.5, 0.7, 1.0)  # of log alpha, tried with all contacts
SHARES = (1.0, 0.6, 0.3, 0.0)  # of the variation of the others, until A is definite
SOFT = (40.0, 100.0)  # over how much of the largest L is smoothed, one search after the other
STEPS = 60  # of a search where contacts are few
MANY, FINE_STEPS = 1000, 20  # rows from which on, and steps where a coarser answer was at hand
ROOMS = (1e-4, 1e-3, 5e-3, 2e-2, 0.1)  # by which less is proved than was found
SURE = 2e-2  # the least where it is the last proof that there is time for
SINGLE = 0.25  # of the work of RATE: half the length, and products of matrices
PROOF = 1.0  # operations of a proof per cube of the rows
PROOFS = 2.0  # for which the search leaves time
COARSE = 0.5  # part of the time for a part of the contacts


def contact_multipliers(
    W: Array, shape: Array, deadline: Deadline = NEVER, *, wanted: float = np.inf
) -> ContactMultipliers:
    """Multipliers for W (k d, k d) and friction in the proportions shape (k,).

    wanted: a t that is enough.  Contacts with W_ii = 0 are left out.  Raises TimeUp where the
    deadline is nearer than two proofs and the energy bound of the first contacts, some 60;
    later it ends the search, in time for a proof.
    """
    k = len(shape)
    d = len(W) // max(k, 1)
    own = np.arange(k)
    able = np.linalg.norm(W.reshape(k, d, k, d)[own, :, own], axis=(1, 2)) > 0
    whole = ContactMultipliers(np.inf, np.ones(k), np.ones(k), np.ones(k), np.zeros((k, d - 1)))
    if not able.any():
        return whole
    rows = np.flatnonzero(np.repeat(able, d))
    form = _Form.of(W[np.ix_(rows, rows)], shape[able])
    found = _searched(form, deadline.before(PROOFS * form.proof), wanted)
    best = form.proved(found, deadline, wanted)
    for name in ("tau", "sigma", "alpha", "f"):
        getattr(whole, name)[able] = getattr(best, name)
    return replace(whole, t=best.t, expected=best.expected)


# ------------------------------------------------------------------------ searching
def _searched(form: _Form, deadline: Deadline, wanted: float) -> Array:
    """Multipliers x of the largest t found."""
    if form.contacts <= COARSEST:
        alpha = energy_bound(form.W, form.shape, deadline)[1]
        x = np.zeros(form.unknowns)
        x[2 * form.contacts : 3 * form.contacts] = np.log(alpha)
        steps = STEPS
    else:
        coarse, weight = form.thinned()
        x = form.interpolated(_searched(coarse, deadline.share(COARSE), np.inf), weight)
        steps = FINE_STEPS if len(form.W) > MANY else STEPS
        form = form.for_search()
        x = form.shifted(x, deadline)
    for soft in SOFT:
        x = form.improved(x, soft, steps, deadline, wanted * (1 + 10 * ROOMS[0]))
    return x


def _value(tried: tuple[float, Array]) -> float:
    return tried[0]


@dataclass(eq=False)
class _Form(Pencil):
    """A and B of contacts that all react, |W_ii| near 1, and what is asked about them.

    x: log tau, log sigma, log alpha (k,) each and f (k (d - 1),).
    """

    W: Array
    shape: Array
    root: Array  # (k d,) powers of two by which W as given was divided, twice
    normal: Places
    tangent: Places
    owner: Places  # (k (d - 1),) contact of a tangent

    @classmethod
    def of(cls, W: Array, shape: Array) -> _Form:
        """Of W as given."""
        k = len(shape)
        d = len(W) // k
        own = np.arange(k)
        size = np.linalg.norm(W.reshape(k, d, k, d)[own, :, own], 2, axis=(1, 2))
        root = np.exp2(np.round(np.log2(size) / 2)).repeat(d)
        normal = d * own
        tangent = (normal[:, None] + np.arange(1, d)).ravel()
        return cls(W / root / root[:, None], shape, root, normal, tangent, own.repeat(d - 1))

    def for_search(self) -> _Form:
        """The same in numbers of half the length where W is definite in them too.

        Half the work of large matrices; what is found is proved in numbers of full length.
        """
        if self.size <= DENSE:
            return self
        single = replace(self, W=self.W.astype(np.float32))
        return self if single.factor(np.zeros(self.unknowns)) is None else single

    @cached_property
    def sliding(self) -> Array:
        """Rows of W of the tangents, (k (d - 1), k d)."""
        return self.W[self.tangent]

    @property
    def contacts(self) -> int:
        """k."""
        return len(self.shape)

    @property
    def dimension(self) -> int:
        """d."""
        return len(self.W) // self.contacts

    @property
    def unknowns(self) -> int:
        """Length of x."""
        return self.contacts * (2 + self.dimension)

    @property
    def size(self) -> int:
        """Rows of W."""
        return len(self.W)

    @property
    def operations(self) -> float:
        """Of one evaluation; numbers of half the length go through four times as fast."""
        return super().operations * (SINGLE if self.W.dtype == np.float32 else 1.0)

    # ------------------------------------------------------------- coarser and finer
    def thinned(self) -> tuple[_Form, Array]:
        """(the form of a part of the contacts, weights (k, part) of theirs at all)."""
        near = couplings(self.W, self.contacts)
        chosen = spread_out(near, int(self.contacts / THINNED[self.dimension]))
        rows = (self.dimension * chosen[:, None] + np.arange(self.dimension)).ravel()
        coarse = _Form.of(self.W[np.ix_(rows, rows)], self.shape[chosen])
        weight = near[:, chosen] ** POWER
        weight[weight < np.sort(weight, axis=1)[:, -NEAREST, None]] = 0.0
        weight[chosen] = np.eye(len(chosen))
        weight[~weight.any(axis=1)] = 1.0  # coupled with none of the part
        return coarse, weight / weight.sum(axis=1, keepdims=True)

    def interpolated(self, x: Array, weight: Array) -> Array:
        """Multipliers of all from those of a part of the contacts."""
        n = weight.shape[1]
        values = x[: 3 * n].reshape(3, n) @ weight.T
        return np.concatenate([values.ravel(), (weight @ x[3 * n :].reshape(n, -1)).ravel()])

    def shifted(self, x: Array, deadline: Deadline) -> Array:
        """x with the shift of alpha that does best, tau, sigma and f less varied if need be.

        Without time the best that was tried, or without variation: A is W then.
        """
        tried: list[tuple[float, Array]] = []
        for share in SHARES:
            y, tried = self.varied(x, share), []
            for shift in SHIFTS:
                if not deadline.affords(self.operations):
                    return min(tried, key=_value)[1] if tried else self.varied(x, SHARES[-1])
                deadline.spend(self.operations)
                z = y.copy()
                z[2 * self.contacts : 3 * self.contacts] += shift
                tried.append((self.value(z, SOFT[-1], gradient=False)[0], z))
                if tried[-1][0] == INDEFINITE:
                    break
            else:
                return min(tried, key=_value)[1]
        return x

    def varied(self, x: Array, share: float) -> Array:
        """x with so much of the variation of tau, sigma and f."""
        k = self.contacts
        y, mean = x.copy(), x[:k].mean()
        y[: 2 * k] = mean + share * (x[: 2 * k] - mean)
        y[3 * k :] *= share
        return y

    # ------------------------------------------------------------- what is minimised
    def parts(self, x: Array) -> tuple[Array, Array, Array, Array]:
        """(tau, sigma, alpha, f)."""
        k = self.contacts
        tau, sigma, alpha = np.exp(x[: 3 * k]).reshape(3, k)
        return tau, sigma, alpha, x[3 * k :]

    def energy(self, x: Array) -> Array:
        """A (k d, k d)."""
        tau, sigma, _, f = (part.astype(self.W.dtype) for part in self.parts(x))
        W = self.W.reshape(self.contacts, self.dimension, -1)
        A = np.empty_like(W)
        np.multiply(W[:, 0], tau[:, None], out=A[:, 0])
        np.multiply(W[:, 1:], sigma[:, None, None], out=A[:, 1:])
        for j, own in enumerate(f.reshape(self.contacts, -1).T, 1):
            A[:, j] += own[:, None] * W[:, 0]
        return symmetrised(A.reshape(self.W.shape))

    def weights(self, x: Array) -> tuple[Array, Array]:
        """Of dr_N^2 (k,) and of the tangents of du (k (d - 1),) in B."""
        _, sigma, alpha, _ = self.parts(x)
        half = 0.5 * self.shape * sigma
        return half * alpha, (half / alpha)[self.owner]

    def times(self, x: Array, v: Array) -> Array:
        """B v for columns v."""
        at_normal, at_tangent = (part.astype(v.dtype) for part in self.weights(x))
        out = self.sliding.T @ (at_tangent[:, None] * (self.sliding @ v))
        out[self.normal] += at_normal[:, None] * v[self.normal]
        return out

    def slope(self, x: Array, w: Array, v: Array, p: Array) -> Array:
        """Gradient by eigenvectors v with v A v = 1, weighted by p (m,)."""
        _, sigma, alpha, f = self.parts(x)
        k, wp = self.contacts, w * p
        u = (self.W @ v).astype(float)
        v = v.astype(float)
        own = -(v * u) @ wp
        at_normal = 0.5 * self.shape * ((v[self.normal] ** 2) @ p) * sigma * alpha
        sliding = np.bincount(self.owner, (u[self.tangent] ** 2) @ p, k)
        sliding *= 0.5 * self.shape * sigma / alpha
        slope = np.empty_like(x)
        slope[:k] = own[self.normal] * np.exp(x[:k])
        slope[k : 2 * k] = np.bincount(self.owner, own[self.tangent], k) * sigma
        slope[k : 2 * k] += at_normal + sliding
        slope[2 * k : 3 * k] = at_normal - sliding
        slope[3 * k :] = -(v[self.tangent] * u[self.normal[self.owner]]) @ wp
        return slope

    # ---------------------------------------------------------------------- proving
    @property
    def proof(self) -> float:
        """Operations of a proof."""
        return PROOF * len(self.W) ** 3

    def multipliers(self, x: Array, t: float) -> ContactMultipliers:
        """In the units of W as given."""
        tau, sigma, alpha, f = self.parts(x)
        square = self.root[self.normal] ** 2
        # forces times root and velocities over it are the scaled ones: only alpha has units
        return ContactMultipliers(
            0.0, tau, sigma, alpha * square, f.reshape(self.contacts, -1), t
        )

    def proved(self, x: Array, deadline: Deadline, wanted: float) -> ContactMultipliers:
        """The multipliers with the largest t that could be proved."""
        t = self.sharpened(x)
        by = self.multipliers(x, t)
        given = self.W * self.root * self.root[:, None]
        for room in ROOMS if t > 0 else ():
            if not deadline.affords(self.proof):
                break
            deadline.spend(self.proof)
            if room > ROOMS[0] and not deadline.affords(self.proof):
                room = max(room, SURE)
            if holds(given, self.shape, t * (1 - room), by):
                return replace(by, t=t * (1 - room))
            if room == ROOMS[0]:
                t = min(t, self.sharpened(x))  # goes on where the first one ended
        return by


__all__ = ["ContactMultipliers", "contact_multipliers", "holds"]
