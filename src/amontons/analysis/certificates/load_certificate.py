"""Is a solution of a 2D Coulomb problem the only one for its load?  A certificate, or another.

Another solution z differs from the found one z0 by d with d_u = W d_r.  In status s contact p
has d_p in the cone K_ps = cone(C_s - z0_p).  Symmetric matrices W_p with d_p^T W_p d_p <= 0 on
all K_ps and sum_p d_p^T W_p d_p > 0 for all d with d_u = W d_r leave d = 0 only.  They solve a
linear matrix inequality (`multiplier_lmi`): -G^T W_p G = positive semidefinite + nonnegative,
G the generators of K_ps, which in up to four dimensions is all that copositivity asks for.

Where none exist, contacts are divided: free or closed, stick or slip, slip + or -.  Branches
with z0 are treated alike, without the velocities and reactions that vanish there; branches
without z0 must be shown to hold no solution, by multipliers of (z, 1).  Other solutions are
looked for with Newton's method, from many starts and from where an inequality fails.

What CERTIFIED means, in floating point with all rounding accounted for (`load_proof`): every
solution of the problem, with W, q and mu as given, is within `distance` of the one found; where
no contact of it is nearer than that to another status, it is the only one.

P. Parrilo, "Structured semidefinite programs and semialgebraic geometry methods in robustness
and optimization", thesis, Caltech (2000), chapter 5 (copositive matrices).
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ...errors import InvalidInput
from ...problem import FrictionProblem
from ...solution import FrictionSolution
from ..multipliers.multiplier_lmi import (
    SMALLEST,
    LmiOutcome,
    find_multipliers,
    slacks_are_positive,
)
from ..solutions.enumerate import PieceSolution
from ..solutions.multistart import Finder, certain_error, described
from ..solutions.newton_batch import Stack
from . import load_pieces as pieces
from .load_pieces import Known, LoadProblem, States
from .load_proof import BranchProof, prove
from .load_reduction import shared_multipliers

Array = NDArray[np.float64]
NEAR = 1e-6  # of the size of reactions: a larger `distance` proves nothing of use
HOPELESS = 1e-6  # eigenvalue of M, of mean 1, below which a branch is divided instead
LARGEST = 600  # contacts up to which each can have a multiplier of its own: memory
LARGE = 150  # contacts from which few different multipliers are tried first
STARTS = 60  # of Newton's method once the first inequality has no multipliers
STEP_WORK, RATE = 30.0, 1e10  # operations of a start per (2 nc)^3, and per second
TOLERANCE = 1e-8  # error by the judge of another solution
EXACT = 1e-12  # error of solutions that fill a segment
GOOD = 1e-12  # by which a solution in scaled variables may miss the law
SAME_SOLUTION = 1e-4  # scaled distance that refining a solution may move it
DISTINCT = 1e-6  # scaled distance of two solutions that count as different


class LoadOutcome(Enum):
    """What is known about other solutions for the same load."""

    CERTIFIED = "certified"  # there is no other
    REFUTED = "refuted"  # here is another
    UNDECIDED = "undecided"


@dataclass(frozen=True, eq=False)
class LoadBranch:
    """One part of a certificate: no other solution has statuses of this pattern.

    pattern: per contact f free, s stick, + or - slip, x slip, c closed, . anything.
    multipliers: (nc, 4, 4) for z - z0, or (nc, 5, 5) for (z, 1), z = (r_N, r_T, u_N, u_T), in
    the units of the problem.
    """

    pattern: str
    multipliers: Array


@dataclass(frozen=True, eq=False)
class LoadCertificate:
    """The answer of `certify_load`.

    other: a second solution where REFUTED.  branches: what proves CERTIFIED; together they have
    all patterns.  distance: bound of the difference of reactions to r0 (nc, 2), relative to
    the largest reaction or, if that is larger, to what the load can make.  examined:
    inequalities that were solved.
    """

    outcome: LoadOutcome
    other: PieceSolution | None
    branches: tuple[LoadBranch, ...]
    r0: Array
    distance: float
    examined: int
    reason: str
    seconds: float

    def __str__(self) -> str:
        return f"{self.outcome.value}: {self.reason}"


def certify_load(
    problem: FrictionProblem, solution: FrictionSolution | PieceSolution, *,
    time_limit: float = 60.0,
) -> LoadCertificate:  # fmt: skip
    """Certificate that a Coulomb problem has no solution but the given one, or another one.

    time_limit: seconds, after which the answer is undecided.  The global form is condensed.
    In 3D see `load_certificate_discs`.  Raises UnsupportedForm under Tresca's law, InvalidInput
    where `solution` does not solve the problem.
    """
    if problem.dimension == 3:
        from .load_certificate_discs import certify_load_discs

        return certify_load_discs(problem, solution, time_limit=time_limit)
    r = reactions_of(problem, solution, time_limit)
    return _Search(LoadProblem.of(problem), r, time_limit).run()


def reactions_of(
    problem: FrictionProblem, solution: FrictionSolution | PieceSolution, time_limit: float
) -> Array:
    """Reactions (nc, d) of a solution under Coulomb's law; raises for what can not be meant."""
    if not time_limit > 0:
        raise InvalidInput(f"time_limit: expected seconds > 0, got {time_limit!r}")
    _ = problem.mu
    r, shape = np.asarray(solution.r), (problem.contacts, problem.dimension)
    if r.shape != shape:
        raise InvalidInput(f"solution: expected reactions {shape}, got {r.shape}")
    return r


class _Search:
    """Branches that are not proved yet, and what was found on the way."""

    def __init__(self, local: LoadProblem, r: Array, time_limit: float) -> None:
        self.local, self.began, self.limit = local, time.perf_counter(), time_limit
        self.known = refined(local, r.ravel() / local.to_r)
        self.size = max(1.0, float(np.abs(self.known.r).max(initial=0.0)))
        self.proofs: list[BranchProof] = []
        self.examined = 0

    @property
    def left(self) -> float:
        """Seconds until the time limit, at least a little."""
        return max(self.limit - (time.perf_counter() - self.began), 1e-3)

    def run(self) -> LoadCertificate:
        """Root, other solutions, branches."""
        root = self.local.root_branch
        if not len(root):
            return self._answer(LoadOutcome.CERTIFIED, "there is no contact")
        if self.local.problem.q_norm == 0:
            return self._answer(LoadOutcome.UNDECIDED, "q is zero: nothing sets a scale")
        failure = self._prove(root)
        if failure is None:
            return self._certified()
        self.other = OtherSolutions(self.local, self.known)
        found = self.other.near(failure, self.left) or self.other.far(0.2 * self.left)
        if found:
            return self._refuted(found)
        if self.local.contacts > LARGEST:
            reason = f"no shared multipliers, and more than {LARGEST} contacts for own ones"
            return self._answer(LoadOutcome.UNDECIDED, reason)
        return self._divide(failure)

    def _divide(self, failure: Failure) -> LoadCertificate:
        """Branch until all is proved, another solution is found, or the time is over."""
        stack, undecided = [failure], 0
        while stack:
            failure = stack.pop()
            contact = failure.contact(self.local)
            if contact < 0:
                undecided += 1
                continue
            for child in self.local.children(failure.branch, contact):
                if time.perf_counter() - self.began > self.limit:
                    reason = (
                        f"stopped after {self.limit:g} s with {len(stack) + 1} branches left"
                    )
                    return self._answer(LoadOutcome.UNDECIDED, reason)
                following = self._prove(child)
                if following is None:
                    continue
                found = self.other.near(following, self.left)
                if found:
                    return self._refuted(found)
                stack.append(following)
        if undecided:
            reason = f"{undecided} patterns could neither be excluded nor solved"
            return self._answer(LoadOutcome.UNDECIDED, reason)
        return self._certified()

    def _prove(self, branch: States) -> Failure | None:
        """None where a branch is proved, which is kept."""
        self.examined += 1
        known = self.known if pieces.contains(self.local, branch, self.known) else None
        inequality = Inequality(self.local, branch, known)
        proof = inequality.solve(NEAR * self.size, self.left)
        if isinstance(proof, Failure):
            return proof
        self.proofs.append(proof)
        return None

    # ------------------------------------------------------------------ answers
    def _certified(self) -> LoadCertificate:
        count = len(self.proofs)
        parts = f" on {count} parts" if count > 1 else ""
        return self._answer(LoadOutcome.CERTIFIED, f"multipliers exclude all others{parts}")

    def _refuted(self, other: PieceSolution) -> LoadCertificate:
        return self._answer(LoadOutcome.REFUTED, f"another solution is {other.pattern}", other)

    def _answer(
        self, outcome: LoadOutcome, reason: str, other: PieceSolution | None = None
    ) -> LoadCertificate:
        certified = outcome is LoadOutcome.CERTIFIED
        branches = tuple(self._branch(proof) for proof in self.proofs) if certified else ()
        distance = max((proof.distance for proof in self.proofs), default=0.0) / self.size
        r0 = (self.known.r * self.local.to_r).reshape(-1, 2)
        return LoadCertificate(
            outcome, other, branches, r0, distance if certified else np.inf, self.examined,
            reason, time.perf_counter() - self.began,
        )  # fmt: skip

    def _branch(self, proof: BranchProof) -> LoadBranch:
        """The multipliers in the units of the problem: exact, units are powers of two."""
        unit = np.ones((self.local.contacts, proof.multipliers.shape[1]))
        unit[:, :2] = 1 / self.local.to_r.reshape(-1, 2)
        unit[:, 2:4] = 1 / self.local.to_u.reshape(-1, 2)
        W = proof.multipliers * unit[:, :, None] * unit[:, None, :]
        return LoadBranch(pieces.word(proof.branch), W)


@dataclass(frozen=True, eq=False)
class Failure:
    """A branch without multipliers, and the z (nc, k) in which the inequality fails most."""

    branch: States
    direction: Array
    score: Array  # (nc,): z^T W z of the best multipliers

    def contact(self, local: LoadProblem) -> int:
        """The contact to be divided: undecided, and with the largest score; -1 for none."""
        for p in np.argsort(-self.score):
            if local.children(self.branch, int(p)):
                return int(p)
        return -1


class Inequality:
    """The matrix inequality of a branch, about a known solution in it or without one."""

    def __init__(self, local: LoadProblem, branch: States, known: Known | None) -> None:
        self.local, self.branch, self.known = local, branch, known
        apex = known is None
        if known is None:
            self.cones = pieces.cones_with_apex(local, branch)
        else:
            self.cones = pieces.cones_about(local, branch, known)
        self.groups = pieces.groups(self.cones, local.coordinates(branch))
        self.Z, _ = pieces.energy_basis(local, branch, apex)

    @property
    def divisible(self) -> bool:
        """True where some contact is not decided yet."""
        return bool((self.branch >= pieces.UNDECIDED).any())

    @property
    def large(self) -> bool:
        """Where few different multipliers are worth a try first."""
        return (
            self.local.contacts >= LARGE
            and self.known is not None
            and bool((self.branch == pieces.UNDECIDED).all())
        )

    def solve(self, near: float, time_limit: float) -> BranchProof | Failure:
        """Its proof with a distance <= near, or where it fails."""
        if not self.Z.shape[1]:  # nothing moves: any multipliers will do
            W = self._whole_identity()
            proof = prove(self.local, self.branch, W, self.known)
            able = proof is not None and proof.distance <= near
            return proof if able and proof else self._failure(np.zeros(0), W)
        proofs: list[BranchProof] = []

        def accept(W: tuple[Array, ...], extras: tuple[Array, ...]) -> bool:
            own = tuple(e * g.factors for e, g in zip(extras, self.groups, strict=True))
            if not slacks_are_positive([g.family for g in self.groups], W, own):
                return False
            proof = prove(self.local, self.branch, self._whole(W), self.known)
            if proof is None or proof.distance > near:
                return False
            proofs.append(proof)
            return True

        share = 1.0 if self.local.contacts > LARGEST else 0.5
        if self.large and shared_multipliers(
            self.local, self.branch, self.groups, accept, time_limit=share * time_limit
        ):
            return proofs[-1]
        if self.local.contacts > LARGEST:
            return self._failure(np.zeros(self.Z.shape[1]), self._whole_identity())
        answer = find_multipliers(
            self.Z, [g.turned for g in self.groups], accept=accept, time_limit=time_limit,
            smallest=HOPELESS if self.divisible else SMALLEST,
        )  # fmt: skip
        if answer.outcome is LmiOutcome.FOUND:
            return proofs[-1]
        return self._failure(answer.lowest, self._whole(answer.W))

    def _whole(self, parts: tuple[Array, ...]) -> Array:
        return pieces.whole(self.groups, parts, self.local.contacts, self.cones.G.shape[2])

    def _whole_identity(self) -> Array:
        """W = -I, which is never positive on the cones."""
        return -np.tile(np.eye(self.cones.G.shape[2]), (self.local.contacts, 1, 1))

    def _failure(self, lowest: Array, W: Array) -> Failure:
        nc = self.local.contacts
        z = (self.Z[: 4 * nc] @ lowest).reshape(nc, 4)
        if self.known is None:
            z = np.column_stack([z, np.full(nc, self.Z[-1] @ lowest)])
        return Failure(self.branch, z, np.einsum("pa,pab,pb->p", z, W, z))


# ------------------------------------------------------------------ solutions
def refined(local: LoadProblem, r: Array) -> Known:
    """The solution next to scaled reactions (2 nc,), on its piece or by Newton's method.

    Raises InvalidInput where there is none.
    """
    best = pieces.known_solution(local, r)
    for improve in (_on_piece, _by_newton):
        if best.valid and best.off.max(initial=0.0) <= GOOD:
            return best
        for other in improve(local, best.r if best.valid else r):
            known = pieces.known_solution(local, other)
            near = np.abs(known.r - r).max() <= SAME_SOLUTION * (1 + np.abs(r).max())
            better = not best.valid or known.off.max() < best.off.max()
            if near and known.valid and better:
                best = known
    if not best.valid or best.off.max(initial=0.0) > NEAR:
        error = local.problem.error((r * local.to_r).reshape(-1, 2))
        raise InvalidInput(
            f"solution: expected a solution of the problem, got one with error {error:.1e}; "
            "solve again with a smaller tolerance"
        )
    return best


def _on_piece(local: LoadProblem, r: Array) -> list[Array]:
    """The reactions that the statuses of a solution determine."""
    known = pieces.known_solution(local, r)
    branch = np.argmax(known.touches, axis=1).astype(np.int8)
    R, rows = local.reactions(branch), local.zero_velocities(branch)
    if not known.valid or not len(rows):
        return []
    try:
        y = np.linalg.solve((R.T @ local.W[rows].T).T, -local.q[rows])
    except np.linalg.LinAlgError:
        return []
    return [np.asarray(R @ y)]


def _by_newton(local: LoadProblem, r: Array) -> list[Array]:
    """Where semismooth Newton steps lead."""
    stack = Stack.of(local.problem)
    reached = stack.newton(r.reshape(1, -1, 2), np.random.default_rng(0))
    return [found.ravel() for found in reached]


class OtherSolutions:
    """Looks for solutions different from a known one."""

    def __init__(self, local: LoadProblem, known: Known) -> None:
        self.problem, self.known = local.problem, known.r.reshape(-1, 2)
        self.stack = Stack.of(local.problem)
        self.random = np.random.default_rng(0)
        self.size = DISTINCT * (1 + np.abs(self.known).max(initial=0.0))

    @property
    def seconds(self) -> float:
        """Of Newton's method from one start, at most and roughly."""
        return STEP_WORK * self.stack.W.shape[0] ** 3 / RATE

    def near(self, failure: Failure, seconds: float) -> PieceSolution | None:
        """From where an inequality fails: along d, or at z / tau."""
        z = failure.direction
        if 4 * self.seconds > seconds or not z.any():
            return None
        if z.shape[1] == 5:
            tau = z[0, 4]
            starts = z[None, :, :2] / (tau if tau else 1.0)
        else:
            length = np.abs(z[:, :2]).max(initial=0.0)
            steps = np.array([-3.0, -0.3, 0.3, 3.0])[:, None, None]
            starts = self.known + steps * z[:, :2] / (length or 1.0)
        return self._first(self.stack.newton(starts, self.random))

    def far(self, seconds: float) -> PieceSolution | None:
        """From many starts."""
        began, finder = time.perf_counter(), Finder(self.stack, self.random, TOLERANCE)
        finder.add(self.known)
        if 2 * self.seconds > seconds:
            return None
        each = int(np.clip(0.2 / self.seconds, 2, STARTS))
        for _ in range(0, STARTS, each):
            finder.search(each)
            found = self._first(np.array(finder.found).reshape(-1, *self.known.shape))
            if found or time.perf_counter() - began > seconds:
                return found
        return None

    def _first(self, reached: Array) -> PieceSolution | None:
        for r in reached:
            if np.abs(r - self.known).max() > self.size and self._solves(r):
                return described(self.stack, r)
        return None

    def _solves(self, r: Array) -> bool:
        """True where r is a solution, and not only because all between the two nearly are."""
        error = self._error(r)
        between = self._error((r + self.known) / 2)
        return error <= TOLERANCE and (between > 100 * error or between <= EXACT)

    def _error(self, r: Array) -> float:
        return certain_error(self.problem, r * self.stack.to_r)
