"""The face of reactions: all that keep the motion of a solution.

Let (r0, u0) be a solution.  With the same u0 the law allows every contact

    open   r = 0,     slip   r = c r0 / r0_N, c >= 0,     stick   r in K, |r_T| <= mu r_N,

so r = F c with as many columns as free numbers, and the motion is the same exactly if H r =
H r0: from M dv = H dr and H^T dv = 0 follows dv^T M dv = dr^T H^T dv = 0, hence H dr = 0, also
where M is only semidefinite.  In the Delassus form W dr = 0 says the same.  So the reactions of
a motion are the convex set {c : A c = A c0, F c in the cones}, A = H F, of dimension k - rank A
where some c is strictly inside: statical indeterminacy of what the statuses leave.

Contacts that stick at the edge of the cone are moved inside by a linear program where the
balance allows it (cone inscribed by a polygon); those that stay there keep to the ray of r0, so
that the dimension is `at least` that.  The analytic centre of the set is where all is measured
from: the Newton steps of the barrier -log(mu^2 r_N^2 - |r_T|^2), -log r_N.  Its multipliers y
give s = A^T y with s.c = s.c0 on the whole set; where s is inside the dual cone no reaction is
larger than r_N <= s.c0 / (s_N - mu |s_T|).

S. Boyd, L. Vandenberghe, "Convex Optimization" (2004), sections 8.5.2 and 10.2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.linalg.lapack import dpstrf

from ...core.clock import Deadline
from ...linear.dense import dense
from ...linear.rank import Rank, matrix_rank
from ...problem.friction import Form, FrictionProblem
from ...problem.law.states import OPEN
from ...problem.solution import FrictionSolution

Array = NDArray[np.float64]
Places = NDArray[np.int64]
EDGE = 1e-5  # distance to the edge of the cone, of the largest r_N, that counts as none
NOTHING, STILL = 1e-9, 1e-13  # reactions, and velocities of what rests, that count as none
SURELY, DOUBT = 10.0, 1e3  # errors of the solution that count as none; times that, as moving
SHIFT = 1e-13  # of the diagonal of A H^-1 A^T: rows of A may depend on each other
SIDES = 8  # of the polygon in which contacts are moved off the edge
CENTRING = 60  # Newton steps
FARTHEST = 1e4  # c, in the largest reaction of the solution, beyond which there is no centre
CENTRED = 1e-6  # Newton decrement at the centre
FILL = 40.0  # operations of a factorisation per entry of the matrix and row, guessed


@dataclass(frozen=True, eq=False)
class Face:
    """r = (F c) unit + nothing at other contacts; c0 (k,) is the solution, A c = A c0.

    F (nc d, k); A (m, k) sparse or dense.  stick (s,), slip (l,): contacts; the columns of F
    are d per stick, then one per slip.  mu (s,) of the sticks.  unit: the largest r_N.
    edge: contacts held on the ray of r0, or whose status the solution's accuracy leaves open.
    """

    F: sparse.csr_array
    A: Any
    c0: Array
    stick: Places
    slip: Places
    mu: Array
    d: int
    unit: float
    edge: int = 0

    @property
    def unknowns(self) -> int:
        """k."""
        return len(self.c0)

    def reactions(self, c: Array) -> Array:
        """r (nc, d) in the unit of the problem."""
        return (self.F @ c).reshape(-1, self.d) * self.unit

    def parts(self, c: Array) -> tuple[Array, Array, Array]:
        """(r_N (s, b), r_T (s, d - 1, b) of sticks, r_N (l, b) of slips) of c (k, b)."""
        s = len(self.stick)
        own = c[: s * self.d].reshape(s, self.d, c.shape[1])
        return own[:, 0], own[:, 1:], c[s * self.d :]

    def slack(self, c: Array) -> Array:
        """Distances to the edges, (s + l,): mu r_N - |r_T| or r_N; negative outside."""
        normal, tangent, slip = self.parts(c[:, None])
        inside = self.mu * normal[:, 0] - np.linalg.norm(tangent[:, :, 0], axis=1)
        return np.concatenate([inside, slip[:, 0]])

    def rank(self, deadline: Deadline) -> Rank:
        """The rank of A."""
        return matrix_rank(sparse.csr_array(self.A), deadline)

    # ---------------------------------------------------------------- the barrier
    def gradient(self, c: Array) -> Array:
        """Of the barrier."""
        normal, tangent, slip = (part[..., 0] for part in self.parts(c[:, None]))
        square = self.mu**2 * normal**2 - (tangent**2).sum(axis=1)
        own = np.column_stack([-2 * self.mu**2 * normal, 2 * tangent]) / square[:, None]
        return np.concatenate([own.ravel(), -1 / slip])

    def inverse_hessian(self, c: Array) -> sparse.csr_array:
        """Of the barrier, block diagonal.

        -log of a product that is a square form q = x J x has the Hessian -2 J / q + 4 J x x J
        / q^2, whose inverse is x x - q J^-1 / 2.
        """
        normal, tangent, slip = (part[..., 0] for part in self.parts(c[:, None]))
        x = np.column_stack([normal, tangent])
        square = self.mu**2 * normal**2 - (tangent**2).sum(axis=1)
        blocks = x[:, :, None] * x[:, None, :]
        each = np.arange(self.d)
        J = np.ones((len(x), self.d))
        J[:, 0] = -1 / self.mu**2
        blocks[:, each, each] += 0.5 * square[:, None] * J
        s = len(self.stick)
        own = sparse.bsr_array((blocks, np.arange(s), np.arange(s + 1)),
                               shape=(s * self.d, s * self.d)) if s else None  # fmt: skip
        rest = sparse.diags_array(slip**2) if len(slip) else None
        parts = [part for part in (own, rest) if part is not None]
        return sparse.csr_array(sparse.block_diag(parts, format="csr"))

    def solver(self, inverse: sparse.csr_array, deadline: Deadline) -> Any:
        """y (m, b) of (A H^-1 A^T) y = x, for an H^-1 (k, k)."""
        K = self.A @ (inverse @ self.A.T)
        if isinstance(K, np.ndarray):
            deadline.pay(float(len(K)) ** 3)
            K = (K + K.T) / 2
            K[np.diag_indices(len(K))] *= 1 + SHIFT * len(K)
            try:
                factor = cho_factor(K, check_finite=False)
            except LinAlgError:
                return None
            return lambda x: cho_solve(factor, x, check_finite=False)
        from scipy.sparse.linalg import splu

        K = sparse.csc_array(K)
        diagonal = K.diagonal()
        size = np.where(diagonal > 0, diagonal, 1.0)
        root = np.sqrt(size)
        scale = sparse.diags_array(1 / root)
        K = sparse.csc_array(scale @ K @ scale + SHIFT * sparse.eye_array(len(root)))
        deadline.pay(FILL * K.nnz * np.sqrt(K.shape[0]))
        try:
            lu = splu(K, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                      options={"SymmetricMode": True})  # fmt: skip
        except RuntimeError:  # exactly singular
            return None
        return lambda x: (lu.solve((x.T / root).T).T / root).T

    def balanced(self, inverse: sparse.csr_array, solve: Any, g: Array) -> Array:
        """H^-1 (g - A^T y) with A of it zero, g (k, b); twice, for rounding."""
        p = inverse @ g
        for _ in range(2):
            p = p - inverse @ (self.A.T @ solve(self.A @ p))
        return p


def face_of(problem: FrictionProblem, solution: FrictionSolution, deadline: Deadline) -> Face:
    """The face of a solution; Coulomb's law.

    Contacts that carry nothing belong to it where they do not move apart, to the accuracy of
    the solution.  Raises InvalidInput where W does not fit into memory, TimeUp.
    """
    r, u = solution.r, solution.u
    unit = float(r[:, 0].max(initial=0.0)) or 1.0
    mu = problem.mu
    nothing = _speed(problem, solution)
    loaded = (r[:, 0] > NOTHING * unit) & (solution.status != OPEN)
    speed = np.linalg.norm(u[:, 1:], axis=1)
    closed = loaded | (u[:, 0] <= nothing)
    ray = closed & ((speed > nothing) | (mu == 0))
    doubtful = np.where(closed, (speed > nothing) & (speed <= DOUBT * nothing) & (mu > 0),
                        u[:, 0] <= DOUBT * nothing)  # fmt: skip
    whole = _face(problem, r, _rays(r, u, mu, loaded), unit, closed & ~ray, ray, deadline)
    if not (whole.slack(whole.c0) <= EDGE).any():
        return replace(whole, edge=int(doubtful.sum()))
    inner, known = _moved_inside(whole, deadline)
    slack = whole.slack(inner)
    moved, rays = whole.reactions(inner), _rays(whole.reactions(inner), u, mu, loaded)
    s = len(whole.stick)
    held, gone = np.zeros((2, len(r)), dtype=bool)
    held[whole.stick] = slack[:s] <= EDGE
    gone[whole.slip] = slack[s:] <= NOTHING
    gone |= held & (moved[:, 0] <= NOTHING * unit)
    stick = closed & ~ray & ~held
    found = _face(problem, moved, rays, unit, stick, (ray | held) & ~gone, deadline)
    doubtful |= held if known else held | gone  # nothing now may be something on the edge
    return replace(found, edge=int(doubtful.sum()))


def _speed(problem: FrictionProblem, solution: FrictionSolution) -> float:
    """The velocity that counts as none: what the solution may be off by."""
    return SURELY * max(solution.convergence.error, STILL) * size_of_motion(problem, solution)


def size_of_motion(problem: FrictionProblem, solution: FrictionSolution) -> float:
    """|u| of the free motion; what contact alone holds has none: of what its reactions move.

    A body at rest moves by rounding alone, of which its own |u| would say nothing.
    """
    if not problem.loose_modes.shape[1]:
        return float(np.linalg.norm(problem.free_velocity))
    rho = np.where(problem.rho > 0, problem.rho, np.inf)[:, None]
    moved = float(np.linalg.norm(solution.r / rho))
    return max(float(np.linalg.norm(solution.u)), moved)


def _rays(r: Array, u: Array, mu: Array, loaded: NDArray[np.bool_]) -> Array:
    """Reactions (nc, d) with r_N = 1 of what keeps its direction: along r, or against u_T."""
    out = np.ones_like(r)
    speed = np.linalg.norm(u[:, 1:], axis=1, keepdims=True)
    out[:, 1:] = -mu[:, None] * u[:, 1:] / np.where(speed > 0, speed, 1.0)
    along = loaded & (r[:, 0] > 0)
    out[along, 1:] = r[along, 1:] / r[along, :1]
    return out


def _face(
    problem: FrictionProblem, r: Array, along: Array, unit: float, stick: NDArray[np.bool_],
    ray: NDArray[np.bool_], deadline: Deadline,
) -> Face:  # fmt: skip
    """The face with these sticking contacts, and others along given reactions of r_N = 1."""
    nc, d = r.shape
    s, rays = np.flatnonzero(stick), np.flatnonzero(ray)
    rows = (d * np.concatenate([s, rays])[:, None] + np.arange(d)).ravel()
    k = len(s) * d
    columns = np.concatenate([np.arange(k), k + np.arange(len(rays)).repeat(d)])
    values = np.concatenate([np.ones(k), along[rays].ravel()])
    F = sparse.csr_array((values, (rows, columns)), shape=(nc * d, k + len(rays)))
    c0 = np.concatenate([r[s].ravel(), r[rays, 0]]) / unit
    return Face(F, _balance(problem, F, deadline), c0, s, rays, problem.mu[s], d, unit)


def _balance(problem: FrictionProblem, F: sparse.csr_array, deadline: Deadline) -> Any:
    """A, rows of unit length: H F, or a factor of W times F."""
    if problem.form is Form.GLOBAL:
        A: Any = sparse.csr_array(sparse.csr_array(problem.H) @ F)
        size = np.sqrt(np.asarray(A.multiply(A).sum(axis=1)).ravel())
        keep = np.flatnonzero(size > 0)
        return sparse.csr_array(sparse.diags_array(1 / size[keep]) @ A[keep])
    return problem.kept(rank_factor).T @ F if deadline.left > 0 else None


def rank_factor(problem: FrictionProblem) -> Array:
    """L (nc d, rank) with W = L L^T, by Cholesky with pivots, each row of W scaled to 1."""
    W = dense(problem.W, 3)
    n = len(W)
    size = np.sqrt(np.maximum(W.diagonal(), 0.0))
    one = np.where(size > 0, size, 1.0)
    full = 0.5 * (W + W.T) / one / one[:, None]
    factor, pivots, rank, _ = dpstrf(full, tol=n * np.finfo(float).eps, lower=1)
    L = np.zeros((n, rank))
    L[pivots - 1] = np.tril(factor)[:, :rank]
    return L * one[:, None]


def polygon(face: Face, sides: int, *, outside: bool) -> sparse.csr_array:
    """G, where G c <= 0 keeps sticks in a polygonal cone in K, or around it.

    In 2D both are K.
    """
    own = cone_rows(face.mu, face.d, sides, outside=outside)
    rest = sparse.csr_array((own.shape[0], face.unknowns - own.shape[1]))
    return sparse.csr_array(sparse.hstack([own, rest]))


def cone_rows(mu: Array, d: int, sides: int, *, outside: bool) -> sparse.csr_array:
    """G (s many, s d), where G r <= 0 keeps r (s, d) in polygonal cones in K, or around it."""
    s = len(mu)
    if d == 2:
        turns, shrink = np.array([[1.0], [-1.0]]), 1.0
    else:
        angle = 2 * np.pi * (np.arange(sides) + 0.5) / sides
        turns = np.column_stack([np.cos(angle), np.sin(angle)])
        shrink = 1.0 if outside else float(np.cos(np.pi / sides))
    many = len(turns)
    blocks = np.empty((s, many, d))
    blocks[:, :, 0] = -shrink * mu[:, None]
    blocks[:, :, 1:] = turns
    rows = np.arange(s * many).repeat(d)
    columns = (d * np.arange(s)[:, None, None] + np.arange(d)).repeat(many, axis=1).ravel()
    return sparse.csr_array((blocks.ravel(), (rows, columns)), shape=(s * many, s * d))


def _moved_inside(face: Face, deadline: Deadline) -> tuple[Array, bool]:
    """c of the face with as many contacts as possible off the edges; whether that is known."""
    from scipy.optimize import linprog

    k, s, rays = face.unknowns, len(face.stick), len(face.slip)
    G = polygon(face, SIDES, outside=False)
    normal, _, slip = face.parts(face.c0[:, None])
    most = 0.1 * float(np.concatenate([normal, slip]).mean()) if s + rays else 1.0
    many = G.shape[0] // s if s else 0
    apart = sparse.kron(sparse.eye_array(s), np.ones((many, 1)))
    beside = sparse.csr_array((-np.ones(rays), (np.arange(rays), np.arange(k - rays, k))),
                              shape=(rays, k))  # fmt: skip
    left = sparse.csr_array(sparse.block_diag([apart, sparse.eye_array(rays)]))
    left = sparse.hstack([sparse.vstack([G, beside]), left], format="csr")
    free = sparse.csr_array((face.A.shape[0], s + rays))
    equal = sparse.hstack([sparse.csr_array(face.A), free])
    deadline.pay(lp_work(left, equal))
    bounds = [(None, None)] * (k - rays) + [(0.0, None)] * rays + [(0.0, most)] * (s + rays)
    cost = np.concatenate([np.zeros(k), -np.ones(s + rays)])
    found = linprog(cost, left, np.zeros(left.shape[0]), equal.tocsr(), face.A @ face.c0,
                    bounds, method="highs-ipm")  # fmt: skip
    if found.x is None or found.status != 0:
        return face.c0, False
    return 0.5 * (face.c0 + found.x[:k]), True


def lp_work(left: Any, equal: Any) -> float:
    """Operations of a linear program by an interior point method, roughly."""
    rows, entries = left.shape[0] + equal.shape[0], left.nnz + equal.nnz
    return 16.0 * float(rows) * entries + 5e7


def centred(face: Face, deadline: Deadline) -> tuple[Array, Array | None, bool]:
    """(c near the analytic centre, s = A^T y there, False where the set seems unbounded)."""
    c, s, at_rest, balance = face.c0, None, False, face.A @ face.c0
    for _ in range(CENTRING):
        inverse = face.inverse_hessian(c)
        solve = face.solver(inverse, deadline)
        if solve is None:
            break
        g = face.gradient(c)
        y = solve(face.A @ (inverse @ g))
        step = -face.balanced(inverse, solve, g[:, None])[:, 0]
        decrement = float(-g @ step)
        step -= inverse @ (face.A.T @ solve(face.A @ c - balance))  # what rounding has lost
        s = -(face.A.T @ y)
        if decrement <= CENTRED:
            at_rest = True
            break
        reach = longest(face, c, step[:, None])[0]
        c = c + min(1.0 if decrement < 0.1 else 0.7 * reach, 1.0, 0.9 * reach) * step
        if not np.abs(c).max(initial=0.0) <= FARTHEST:  # no end that way
            break
    return c, s, at_rest


def longest(face: Face, c: Array, p: Array) -> Array:
    """How far c (k,) may go along p (k, b) within the cones, (b,); inf without an end."""
    normal, tangent, slip = face.parts(c[:, None])
    dn, dt, ds = face.parts(p)
    m2 = face.mu[:, None] ** 2
    a = m2 * dn**2 - (dt**2).sum(axis=1)
    b = m2 * normal * dn - (tangent * dt).sum(axis=1)
    q = m2 * normal**2 - (tangent**2).sum(axis=1)
    root = np.sqrt(np.maximum(b**2 - a * q, 0.0))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        # the smaller positive root of a t^2 + 2 b t + q, without cancellation
        first = np.where(b <= 0, q / (root - b), np.where(a < 0, (b + root) / -a, np.inf))
        ends = np.where((b**2 < a * q) | ~(first >= 0), np.inf, first)
        ahead = np.where(ds < 0, slip / -ds, np.inf)
    return np.minimum(ends.min(axis=0, initial=np.inf), ahead.min(axis=0, initial=np.inf))
