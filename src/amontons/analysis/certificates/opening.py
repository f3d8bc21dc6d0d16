"""Is there a solution, whatever the load?  A motion that opens all contacts at once.

Let u = H^T v + w be the local velocities of a motion v, normals positive where contacts open,
K = { r : |r_T| <= mu r_N } and K* = { u : u_N >= mu |u_T| }.  With M positive definite the
problem  M v = H r + f,  u + mu |u_T| e_N in K*, r in K, orthogonal, has a solution for every
load f if

    there is a v with H^T v + w inside K* at all contacts  [ACLM, KP].                    (1)

It always holds where the columns of H are independent.  By separation of the flat set of all
u from the open cone, (1) is wrong exactly if

    there is an r in K, not zero, with H r = 0 and w . r <= 0:                            (2)

reactions that hold each other, as of a wedge, while what is prescribed closes their contacts.
Then a solution may exist or not; that depends on the load.

Both come from one convex program (`opening_program`): among reactions of given size the ones
that are least felt, |H r|^2 + max(w . r, 0)^2.  If that is not zero its solution gives v, else
it is r.  What is returned was checked afterwards: v with the rounding of H^T v + w, so that (1)
is proved; r to RESIDUAL, so (2) holds to rounding.

The Delassus form has u = W x + q in the place of H^T v + w: W = H^T M^-1 H has the same range
as H^T, and q differs from w by a vector of it.  Of a W that is symmetric to SYMMETRIC the
symmetric part is meant.  Under Tresca's law mu = 0 is meant in both cones, as friction is
bounded.

[ACLM] V. Acary, F. Cadoux, C. Lemaréchal, J. Malick, "A formulation of the linear discrete
Coulomb friction problem via convex optimization", ZAMM 91 (2011); [KP] A. Klarbring, J.-S.
Pang, "Existence of solutions to discrete semicoercive frictional contact problems", SIAM J.
Optim. 8 (1998).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dpstrf
from scipy.sparse.linalg import lsmr

from ...core.clock import Deadline, TimeLimit, deadline_of, now
from ...core.errors import InvalidInput, SingularOperator, TimeUp
from ...core.faces import Told
from ...linear.dense import dense
from ...problem.friction import Form, FrictionProblem
from ...problem.indefinite import negative_direction
from ...problem.law import Coulomb, Tresca
from .opening_program import Cones, iterates

Array = NDArray[np.float64]
SECONDS = 20.0  # whose work a verdict without a time limit may take
RESIDUAL = 1e-7  # of H r and w . r relative to their terms, that counts as zero
SYMMETRIC = 1e-4  # asymmetry of M or W, relative, up to which the theorem is used
ROUNDING = 4 * np.finfo(float).eps  # per term of a sum
GROWTH = tuple(8.0**k for k in range(20))  # of a direction, until w does not matter
NEARLY = 1e-4  # residual from which reactions are polished
POLISHING = 300  # iterations of that


class Existence(Enum):
    """What is known; the value is the name in JSON files."""

    ASSURED = "assured"
    NOT_ASSURED = "not_assured"
    UNDECIDED = "undecided"

    @property
    def meaning(self) -> str:
        """One sentence for the user."""
        return _MEANING[self]


_MEANING = {
    Existence.ASSURED: "A solution exists, whatever the load.",
    Existence.NOT_ASSURED: "Whether a solution exists depends on the load.",
    Existence.UNDECIDED: "Nothing is known about the existence of solutions.",
}


@dataclass(frozen=True, eq=False, repr=False)
class Opening(Told):
    """The verdict with its certificate.

    v: a motion with which H^T v + w is inside K*, (n,), in the Delassus form x (nc d,) with W x
    + q there; margin: the least distance of a u_i from the border of K*, relative to |u_i|.
    r: reactions (nc, d), the largest of size 1, with (2); residual, work: |H r| and w . r
    relative to their terms.  None without.
    """

    verdict: Existence
    reason: str
    v: Array | None = None
    margin: float | None = None
    r: Array | None = None
    residual: float | None = None
    work: float | None = None
    seconds: float = 0.0

    def __str__(self) -> str:
        return f"{self.verdict.value.replace('_', ' ')}: {self.verdict.meaning} {self.reason}"


def opening(problem: FrictionProblem, *, time_limit: TimeLimit = None) -> Opening:
    """The verdict on a problem, by default after the work of at most some SECONDS.

    time_limit: seconds.
    """
    deadline, began = deadline_of(time_limit, SECONDS), now()
    try:
        found = _assess(problem, deadline)
    except TimeUp as error:
        found = _undecided(f"{str(error)[0].upper()}{str(error)[1:]}.")
    return replace(found, seconds=now() - began)


def _undecided(reason: str) -> Opening:
    return Opening(Existence.UNDECIDED, reason)


def _assess(problem: FrictionProblem, deadline: Deadline) -> Opening:
    if not problem.contacts:
        return Opening(Existence.ASSURED, "There is no contact.")
    if not isinstance(problem.law, Coulomb | Tresca):
        return _undecided(f"Nothing is proved here of {problem.law.name}.")
    doubt = _unfit(problem)
    system = _System.of(problem, deadline)
    if system is None:
        return _undecided("W is not positive semidefinite, and the theorem needs that.")
    found = _searched(system, deadline)
    if doubt and found.verdict is Existence.ASSURED:
        reason = f"{found.reason} But {doubt}."
        return replace(found, verdict=Existence.UNDECIDED, reason=reason)
    return found


def _unfit(problem: FrictionProblem) -> str:
    """Why the theorem says nothing of this M or W, "" if it does."""
    A = problem.M if problem.form is Form.GLOBAL else problem.W
    name = "M" if problem.form is Form.GLOBAL else "W"
    assert A is not None
    size = abs(A).max() if sparse.issparse(A) or isinstance(A, np.ndarray) else 0.0
    if size and abs(A - A.T).max() > SYMMETRIC * size:
        return f"{name} is not symmetric, and the theorem needs that"
    try:
        if negative_direction(problem) is not None:
            return f"{name} is indefinite, and the theorem needs a positive definite M"
        if problem.form is Form.GLOBAL:
            _check_definite(problem)
    except SingularOperator:
        return "contact alone holds a body, so M is not positive definite and the load counts"
    except InvalidInput as error:
        return str(error)
    return ""


def _check_definite(problem: FrictionProblem) -> None:
    """Raise SingularOperator where M, in which nothing negative was found, is singular."""
    if problem.small_blocks is not None:  # they have inverses
        return
    if problem.loose_modes.shape[1]:
        raise SingularOperator("loose")
    if not problem.is_mesh:  # nobody says which motions could be loose
        problem.factor()


@dataclass(frozen=True, eq=False)
class _System:
    """u = H^T v + w with the cones: H (n, nc d), w (nc, d), mu (nc,).

    inverse: of the Delassus form, the triangle U and the rows x of the pivots: H = U there.
    """

    H: sparse.csc_array
    w: Array
    mu: Array
    basis: tuple[Array, NDArray[np.int64]] | None = None
    W: Array | None = None

    @classmethod
    def of(cls, problem: FrictionProblem, deadline: Deadline) -> _System | None:
        """None where W is not positive semidefinite."""
        is_coulomb = isinstance(problem.law, Coulomb)
        mu = problem.law.mu if is_coulomb else np.zeros(problem.contacts)
        if problem.form is Form.GLOBAL:
            assert problem.H is not None and problem.w is not None
            return cls(sparse.csc_array(problem.H), problem.w, mu)
        assert problem.q is not None
        W = dense(problem.W, 3)
        m = len(W)
        deadline.pay(float(m) ** 3 / 3)
        W = 0.5 * (W + W.T)
        factor, pivots, rank, _ = dpstrf(W, tol=m * np.finfo(float).eps * np.abs(W).max())
        order = pivots.astype(np.int64) - 1
        U = np.triu(factor)[:rank]
        H = np.zeros((rank, m))
        H[:, order] = U
        if np.abs(H.T @ H - W).max() > 1e-6 * np.abs(W).max():
            return None
        return cls(sparse.csc_array(H), problem.q, mu, (U[:, :rank], order[:rank]), W)

    def motion(self, v: Array) -> Array:
        """v of the global form; in the Delassus form x with H^T v = W x."""
        if self.basis is None:
            return v
        U, pivots = self.basis
        x = np.zeros(self.H.shape[1])
        x[pivots] = solve_triangular(U, v)
        return x

    def margin(self, motion: Array) -> float:
        """Least distance of a u_i from the border of K*, relative to |u_i|; <= 0: no proof."""
        if self.W is None:
            u = self.H.T @ motion
            size = abs(self.H).T @ np.abs(motion)
            terms = np.diff(self.H.indptr).max(initial=0)
        else:
            u, size, terms = self.W @ motion, np.abs(self.W) @ np.abs(motion), len(motion)
        u = u.reshape(self.w.shape) + self.w
        blur = ROUNDING * (terms + 2) * (size.reshape(self.w.shape) + np.abs(self.w))
        t = np.linalg.norm(u[:, 1:], axis=1)
        doubt = blur[:, 0] + self.mu * np.linalg.norm(blur[:, 1:], axis=1)
        inside = u[:, 0] - self.mu * t - doubt
        length = np.sqrt(1 + self.mu**2) * np.linalg.norm(u, axis=1)
        return float((inside / np.where(length > 0, length, 1.0)).min())

    def felt(self, r: Array) -> tuple[float, float]:
        """|H r| and w . r of reactions (nc, d), relative to their terms."""
        flat = r.ravel()
        size = float((abs(self.H) @ np.abs(flat)).max(initial=0.0))
        residual = float(np.abs(self.H @ flat).max(initial=0.0))
        total = float(np.abs(self.w.ravel()) @ np.abs(flat))
        work = float(self.w.ravel() @ flat)
        return residual / size if size else 0.0, work / total if total else 0.0

    def holds(self, r: Array) -> bool:
        """Whether all reactions are in K, to rounding."""
        t = np.linalg.norm(r[:, 1:], axis=1)
        return bool((t <= self.mu * r[:, 0] + RESIDUAL * np.abs(r).max()).all())


def _searched(system: _System, deadline: Deadline) -> Opening:
    """The program, until one of both certificates holds."""
    program = _Program.of(system)
    for x, z, _ in iterates(program.A, program.cones, program.e, deadline):
        found = _open(system, program, z) or _stuck(system, program, x)
        if found is not None:
            return found
    return _undecided(
        "Neither a motion that opens all contacts nor reactions that hold each other were "
        "found to rounding."
    )


def _open(system: _System, program: _Program, z: Array) -> Opening | None:
    """(1) with the motion of the program, if that is proved."""
    v, pull = program.motion(z)
    for factor in GROWTH if pull <= 0 else (1 / pull,):
        motion = system.motion(factor * v)
        if not np.isfinite(motion).all():
            return None
        margin = system.margin(motion)
        if margin > 0:
            reason = f"A motion opens all contacts at once, with a margin of {margin:.2g}."
            return Opening(Existence.ASSURED, reason, v=motion, margin=margin)
    return None


def _stuck(system: _System, program: _Program, x: Array) -> Opening | None:
    """(2) with the reactions of the program, polished, if they hold to RESIDUAL."""
    for r in program.reactions(x, system):
        if not r.any() or not system.holds(r):
            continue
        residual, work = system.felt(r)
        if residual <= RESIDUAL and work <= RESIDUAL:
            reason = (
                "No motion opens all contacts at once: there are reactions that hold each "
                f"other, H r = 0 to {residual:.1g} and w . r = {work:.1g} of its terms."
            )
            return Opening(Existence.NOT_ASSURED, reason, r=r, residual=residual, work=work)
    return None


@dataclass(frozen=True, eq=False)
class _Program:
    """The program in its own units.

    A: the rows of H with entries, rows and contacts of unit size, and a row for w; rows (n,):
    scales of v, zero where H has none;
    stretch (m,): scales of x; places (m,): of x in r (flat); pull: scale of w, 0 without.
    """

    A: sparse.csr_array
    cones: Cones
    e: Array
    rows: Array
    stretch: Array
    places: NDArray[np.int64]
    pull: float

    @classmethod
    def of(cls, system: _System) -> _Program:
        H, w, mu = system.H, system.w, system.mu
        nc, d = w.shape
        rolls = mu > 0
        index = np.arange(nc * d).reshape(nc, d)
        places = np.sort(np.concatenate([index[rolls].ravel(), index[~rolls, 0]]))
        S = np.ones((nc, d))
        S[rolls, 0] = 1 / mu[rolls]
        H = sparse.csc_array(H @ sparse.diags_array(S.ravel()))[:, places]
        contact = places // d
        square = np.asarray(H.multiply(H).sum(axis=0)).ravel()
        size = np.sqrt(np.bincount(contact, square, minlength=nc))
        w = (S * w).ravel()[places]
        own = np.sqrt(np.bincount(contact, w * w, minlength=nc))
        size = np.where(size > 0, size, np.where(own > 0, own, 1.0))
        stretch = 1 / size[contact]
        H = sparse.csr_array(H @ sparse.diags_array(stretch))
        rows = np.sqrt(np.asarray(H.multiply(H).sum(axis=1)).ravel())
        live = np.flatnonzero(rows)
        rows = np.divide(1.0, rows, out=np.zeros_like(rows), where=rows > 0)
        H = sparse.csr_array(sparse.diags_array(rows[live]) @ H[live])
        w = w * stretch
        pull = 1 / np.abs(w).max() if w.any() else 0.0
        A = sparse.vstack([H, sparse.csr_array(pull * w[None])])
        last = np.zeros((len(live) + 1, 1))
        last[-1] = 1.0
        A = sparse.csr_array(sparse.hstack([A, sparse.csr_array(last)]))
        place = np.full(nc * d, -1)
        place[places] = np.arange(len(places))
        cones = Cones(place[index[rolls]], np.append(place[index[~rolls, 0]], len(places)))
        e = cones.identity(len(places) + 1)
        e[-1] = 0.0
        return cls(A, cones, e, rows, stretch * S.ravel()[places], places, pull)

    def motion(self, z: Array) -> tuple[Array, float]:
        """(v, factor on w) of z: H^T v + factor w opens what z opens."""
        v = np.zeros(len(self.rows))
        v[self.rows > 0] = self.rows[self.rows > 0] * z[:-1]
        return v, self.pull * max(float(z[-1]), 0.0)

    def reactions(self, x: Array, system: _System) -> list[Array]:
        """r (nc, d) of x, as it is and with what is felt of it taken away; largest 1."""
        out = [self._placed(x[:-1], system)]
        if RESIDUAL < system.felt(out[0])[0] <= NEARLY:
            H, lead = self.A[:-1, :-1], np.zeros(len(x) - 1)
            for cones in (self.cones.lorentz, self.cones.rays[:-1, None]):
                lead[cones] = x[cones[:, :1]]
            scaled = H @ sparse.diags_array(lead)
            change = lsmr(scaled, H @ x[:-1], atol=0, btol=0, conlim=0, maxiter=POLISHING)[0]
            out.append(self._placed(x[:-1] - lead * change, system))
        return out

    def _placed(self, x: Array, system: _System) -> Array:
        r = np.zeros(system.w.size)
        r[self.places] = self.stretch * x
        size = np.abs(r).max()
        return (r / size if size > 0 else r).reshape(system.w.shape)


__all__ = ["Existence", "Opening", "opening"]
