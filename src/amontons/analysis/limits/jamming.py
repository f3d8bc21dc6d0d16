"""The smallest friction at which contacts can lock a state in without load.

A body that was pressed, or dragged, in between its contacts stays stressed after the load has
gone where reactions r != 0 inside of the friction cone K hold each other: with M x = H r,

    u_N = H_N^T x = 0 where a contact is closed,   u_N >= 0 and r = 0 where it is open,

u_T being where it has stuck ([J]; in the Delassus form u_N = W_N r).  The set of such r is a
cone for every pattern of open contacts, so that a bisection on mu and linear programs find the
smallest mu.  Both sides are proved:

- r itself, in K at `upper`, with the rest of u_N that rounding leaves;
- z = (x, y) with M^T x = H_N y, y_i <= 0 at open contacts, for which v = H^T x lies strictly
  inside of the dual cone, v_N > mu |v_T|, at every contact that may be closed: then 0 < v . r =
  y . u_N <= 0 is a contradiction, at every mu up to `lower`, the least v_N / |v_T|.

Discs are cut, not replaced by polygons: where v leaves the dual cone of the disc between the
directions so far, its direction is added, until one of both proofs is there.

[J] A. Klarbring, "Contact, friction, discrete mechanical structures and mathematical
programming", CISM 384 (1999); wedging: J. R. Barber, P. Hild, "On wedged configurations with
Coulomb friction", in Analysis and Simulation of Contact Problems (2006) 205-213.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import NEVER, Deadline, deadline_of, now
from ...core.errors import InvalidInput, SingularOperator, UnsupportedLaw
from ...core.faces import Told
from ...problem.friction import Form, FrictionProblem
from ...problem.law import Coulomb

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
LARGEST = 1e3  # friction above which no locked state is looked for
GAP = 1e-6  # distance of both bounds, relative, that is good enough
EPSILON = float(np.finfo(float).eps)
ROUNDS = 60  # of cuts at one friction
PATTERNS = 4_000  # linear programs of the search over open contacts
WORK = 30.0  # seconds of it by default
PROGRAM = (3e7, 3e3)  # operations of a program, and per row and column


@dataclass(frozen=True, eq=False, repr=False)
class Jamming(Told):
    """Bounds on the smallest friction that locks a state in without load.

    lower: below it none is, for the patterns that `every` tells; upper: at it r (nc, d) is one,
    infinite where none was found.  every: True where lower holds for every pattern of open
    contacts, False where it is that of all contacts closed.  shape (nc,): friction of the
    contacts over the bounds, which are those of the largest.  residual: |u_N| of r at closed
    contacts over its terms; closed (nc,): the pattern of r; v (nc, d): the proof of lower, with
    all contacts closed, margin: its distance from the border, relative.
    """

    lower: float
    upper: float
    every: bool
    r: Array | None
    closed: Mask | None
    residual: float
    v: Array | None
    margin: float
    shape: Array
    examined: int
    seconds: float
    reason: str

    @property
    def record(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "lower": self.lower, "upper": self.upper, "every_pattern": self.every,
            "residual": self.residual, "margin": self.margin, "examined": self.examined,
            "reason": self.reason, "seconds": self.seconds,
            "r": None if self.r is None else self.r.tolist(),
            "closed": None if self.closed is None else self.closed.tolist(),
            "v": None if self.v is None else self.v.tolist(),
        }  # fmt: skip

    def __str__(self) -> str:
        which = "whatever contacts open" if self.every else "with all contacts closed"
        above = "none was found" if self.r is None else f"from {self.upper:.7g} on one can be"
        return (
            f"no state is locked in below friction {self.lower:.7g} ({which}); {above}. "
            f"{self.reason}"
        )


def jamming_friction(
    problem: FrictionProblem, touching: Mask | None = None, *, time_limit: Any = None
) -> Jamming:
    """Bounds on the jamming friction of a problem, see the module.

    touching (nc,): contacts that can be closed without load, by default all.  The friction of
    the problem gives its shape over the contacts.  time_limit: seconds for the search over
    open contacts.  Raises UnsupportedLaw unless the law is Coulomb's.
    """
    if not isinstance(problem.law, Coulomb):
        raise UnsupportedLaw(f"jamming: expected Coulomb friction, got {problem.law.name}")
    began, deadline = now(), deadline_of(time_limit, WORK)
    largest = float(problem.mu.max(initial=0.0))
    shape = problem.mu / largest if largest > 0 else np.ones(problem.contacts)
    kept = np.ones(problem.contacts, dtype=bool) if touching is None else np.array(touching)
    if kept.shape != (problem.contacts,) or kept.dtype != bool:
        raise InvalidInput(f"touching: expected a mask of {problem.contacts} contacts")
    if not kept.any():
        return Jamming(np.inf, np.inf, True, None, None, 0.0, None, 0.0, shape, 0,
                       now() - began, "No contact touches without load.")  # fmt: skip
    search = _Search(problem, shape, kept, deadline)
    low, up, r, v, margin = search.bounds(kept, np.zeros_like(kept))
    closed, every, reason = kept, False, ""
    while True:
        start = min(up, LARGEST) * (1 - GAP)
        found, done = search.any_pattern(start, kept)
        if found is None:
            every = done
            break
        better = search.bounds(found[0], found[1])
        if not better[1] < up:
            break
        up, r, closed = better[1], better[2], found[0]
    lower = min(low, up)
    if every:
        lower = up * (1 - GAP) if np.isfinite(up) else LARGEST * (1 - GAP)
        reason = f"{search.examined} patterns of open contacts were excluded."
    elif up < low:
        lower, reason = 0.0, "Contacts that open jam earlier; the search did not end."
    else:
        reason = "Patterns with open contacts were not all looked at."
    rest = search.residual(r, closed) if r is not None else 0.0
    return Jamming(lower, up, every, r, None if r is None else closed, rest, v, margin, shape,
                   search.examined, now() - began, reason)  # fmt: skip


def _condenses(problem: FrictionProblem) -> bool:
    """Whether W is there, or cheap to form."""
    if problem.form is Form.DELASSUS:
        return True
    try:
        return problem.condensing_is_cheap and problem.condensed() is not None
    except SingularOperator:
        return False


class _Search:
    """The linear programs: z with v = V z, E z = 0, in scaled variables."""

    def __init__(
        self, problem: FrictionProblem, shape: Array, kept: Mask, deadline: Deadline = NEVER
    ) -> None:
        self.deadline = deadline
        self.nc, self.d = problem.contacts, problem.dimension
        self.shape, self.kept, self.examined = shape, kept, 0
        normal = np.arange(self.nc) * self.d
        if _condenses(problem):
            W: Any = problem.condensed().W
            root = np.repeat(np.sqrt(1 / np.where(problem.rho > 0, problem.rho, 1.0)), self.d)
            scale = sparse.diags_array(1 / root)
            W = scale @ sparse.csc_array(W) @ scale
            self.V, self.E = sparse.csr_array(sparse.csr_array(W)[normal].T), None
            self.root, self.first = root.reshape(-1, self.d), 0
        else:
            M, H = problem.assembled().M, sparse.csc_array(problem.H)
            n = M.shape[0]  # type: ignore[union-attr]
            size = float(np.abs(M.diagonal()).max()) or 1.0  # type: ignore[union-attr]
            none = sparse.csc_array((H.shape[1], self.nc))
            self.V = sparse.csr_array(sparse.hstack([H.T, none]))
            self.E = sparse.csr_array(sparse.hstack([M.T / size, -H[:, normal]]))
            self.root, self.first = np.ones((self.nc, self.d)), n

    def bounds(
        self, closed: Mask, apart: Mask
    ) -> tuple[float, float, Array | None, Array | None, float]:
        """(lower, upper, r, v, margin) with given closed contacts, others open or apart."""
        low, up, r, v, margin = 0.0, np.inf, None, None, 0.0
        trial = 1.0
        while not up - low <= GAP * low:
            proof = self.decide(trial, closed, ~closed & self.kept, apart)
            if isinstance(proof, tuple):
                if proof[0] > low:
                    low, v, margin = proof[0], proof[1], proof[2]
            elif proof is not None:
                own = self._friction(proof)
                if not own < up:
                    break
                up, r = own, proof
            else:  # neither proof within rounding: the border itself
                break
            trial = min(4 * max(low, trial), LARGEST) if up == np.inf else 0.5 * (low + up)
            if low >= LARGEST:
                break
        return low, up, r, v, margin

    def _friction(self, r: Array) -> float:
        """The least mu of the largest contact with r in the cone."""
        size = np.linalg.norm(r[:, 1:], axis=1)
        room = self.shape * r[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            own = np.where(size > 0, size / room, 0.0)
        return float(own.max(initial=0.0))

    def decide(
        self, mu: float, closed: Mask, open_: Mask, undecided: Mask
    ) -> Array | tuple[float, Array, float] | None:
        """r (nc, d) inside of the cone, or (friction, v, margin) that excludes it; or neither.

        Contacts that are closed or undecided may react; those open or undecided have u_N >= 0.
        """
        acting = np.flatnonzero(closed | undecided)
        cuts = [(int(i), s) for i in acting for s in self._directions()]
        for _ in range(ROUNDS):
            z, r, room = self._program(mu, cuts, open_ | undecided, acting)
            self.examined += 1
            if z is None:
                return None
            if room <= 1e-9:
                return r
            v = (self.V @ z).reshape(self.nc, self.d)
            size = np.linalg.norm(v[acting, 1:], axis=1)
            margin = v[acting, 0] - mu * self.shape[acting] * size
            blur = EPSILON * len(z) * (abs(self.V) @ np.abs(z)).reshape(v.shape)[acting].max()
            if margin.min() > blur:
                with np.errstate(divide="ignore"):
                    most = (v[acting, 0] - blur) / (self.shape[acting] * size)
                given = float(np.where(np.isnan(most), np.inf, most).min(initial=LARGEST))
                return given, v * self.root, float(margin.min() / np.abs(v).max())
            new = [(int(i), v[i, 1:] / s) for i, s, m in zip(acting, size, margin, strict=True)
                   if m <= blur and s > 0]  # fmt: skip
            if not new or self.d == 2:
                return None
            cuts += new
        return None

    def _directions(self) -> list[Array]:
        if self.d == 2:
            return [np.array([1.0]), np.array([-1.0])]
        turn = 2 * np.pi * np.arange(8) / 8
        return list(np.column_stack([np.cos(turn), np.sin(turn)]))

    def _program(
        self, mu: float, cuts: list[tuple[int, Array]], lifted: Mask, acting: Any
    ) -> tuple[Array | None, Array, float]:
        """(z, r, m): the largest m with v_N - mu s.v_T >= m at all cuts, |z| <= 1.

        lifted: contacts with y <= 0.  r: the multipliers of the cuts, whose motion has u_N = 0
        where m = 0.
        """
        from scipy.optimize import linprog

        p = self.V.shape[1]
        self.deadline.spend(PROGRAM[0] + PROGRAM[1] * float(len(cuts) * p))
        contact = np.array([i for i, _ in cuts])
        way = np.array([s for _, s in cuts])
        rows = [self.V[contact * self.d]]
        factor = mu * self.shape[contact]
        for k in range(self.d - 1):
            slope = sparse.diags_array(factor * way[:, k])
            rows.append(-(slope @ self.V[contact * self.d + 1 + k]))
        A = sparse.csr_array(sum(rows[1:], rows[0]))
        A = sparse.hstack([-A, np.ones((len(cuts), 1))], format="csr")
        bounds = np.tile([-1.0, 1.0], (p + 1, 1))
        y = self.first + np.arange(self.nc)
        bounds[y[lifted], 1] = 0.0
        bounds[y[~self.kept]] = 0.0
        bounds[p] = [0.0, np.inf]
        E = None
        if self.E is not None:
            E = sparse.hstack([self.E, np.zeros((self.E.shape[0], 1))], format="csr")
        c = np.zeros(p + 1)
        c[p] = -1.0
        found = linprog(c, A, np.zeros(len(cuts)), E,
                        None if E is None else np.zeros(E.shape[0]), bounds)  # fmt: skip
        if found.x is None or found.status not in (0, 4):
            return None, np.zeros((self.nc, self.d)), 0.0
        weight = np.maximum(-found.ineqlin.marginals, 0.0)
        r = np.zeros((self.nc, self.d))
        np.add.at(r[:, 0], contact, weight)
        np.add.at(r[:, 1:], contact, -(weight * factor)[:, None] * way)
        return found.x[:p], r / self.root, float(found.x[p])

    def any_pattern(self, mu: float, kept: Mask) -> tuple[tuple[Mask, Mask] | None, bool]:
        """((closed, undecided) of a pattern that may jam at mu, or None; has it ended?)."""
        none = np.zeros_like(kept)
        stack = [(none, none)]
        count = 0
        while stack:
            closed, open_ = stack.pop()
            count += 1
            if count > PATTERNS or self.deadline.passed:
                return None, False
            undecided = kept & ~closed & ~open_
            if not (closed | undecided).any():
                continue
            proof = self.decide(mu, closed, open_, undecided)
            if isinstance(proof, tuple):
                continue
            if not undecided.any():
                if proof is not None:
                    return (closed, none), False
                continue
            i = int(np.flatnonzero(undecided)[0])
            for choice in (open_, closed):
                more = choice.copy()
                more[i] = True
                stack.append((closed, more) if choice is open_ else (more, open_))
        return None, True

    def residual(self, r: Array, closed: Mask) -> float:
        """|u_N| of closed contacts over the terms that make it up, in scaled variables."""
        if self.E is not None:
            return 0.0  # of the equations that the program has met
        s = (r * self.root).ravel()
        u = (self.V.T @ s)[closed]
        terms = (abs(self.V).T @ np.abs(s))[closed]
        return float(np.abs(u).max(initial=0.0) / max(terms.max(initial=0.0), EPSILON**2))
