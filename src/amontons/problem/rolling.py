"""The cone problem of contacts with moments: `RollingFriction` between u = W r + q and r.

Rows of a contact, in its frame, u_N >= 0 open, r_N >= 0 compression:

    3, in the plane    N, T, R            the moment about the normal of the plane
    5                  N, T1, T2, R1, R2  no resistance to spinning
    6                  N, T1, T2, S, R1, R2

Forces and moments have units of their own, so the error is told in lengths of each contact:
l^2 = tr W_uu / tr W_ww of its own block (for a ball of radius R on a floor some 2/3 R), moments
over l, angular velocities times l, coefficients over l.  It is |natural map / rho| / |q| of the
cone then, rho = 1 / |W_ii|_2, and does not depend on units.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from ..core.arrays import Matrix, finite, read_only, sparse_matrix
from ..core.errors import InvalidInput, shown
from .judge.measures import Measure, Weakest, ratio
from .law.rolling import ROWS, RollingFriction, all_missed, sizes_of, velocities_inplace
from .law.states import ContactStatus
from .protocol import Form, Problem, Start
from .settling import Accepted, Motion, Settled

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Blocks = tuple[NDArray[np.int32], NDArray[np.int32], Array]  # indptr, indices, (nb, 6, 6)
PLACES = {3: (0, 1, 4), 5: (0, 1, 2, 4, 5), 6: (0, 1, 2, 3, 4, 5)}  # of rows among six
MOMENTS = slice(3, 6)


class Regimes(NamedTuple):
    """What each contact does, (nc,): closed, and at which of its bounds it is then.

    A contact that is closed and at none sticks.
    """

    closed: Mask
    slips: Mask
    spins: Mask
    rolls: Mask


class RollingData(NamedTuple):
    """What kernels take: rows of 6x6 blocks in lengths of each contact."""

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    data: Array  # (nb, 6, 6)
    q: Array  # (nc, 6)
    coefficients: Array  # (nc, 3)
    rho: Array  # (nc,)
    diagonal: NDArray[np.int32]  # (nc,) place of W_ii, -1 where there is none


@dataclass(frozen=True, eq=False, repr=False)
class RollingProblem(Problem):
    """W (nc d, nc d), symmetric and positive semidefinite, q (nc, d), d = 3, 5 or 6, a law.

    The rows of a contact are those of the module.  Raises InvalidInput for what does not fit.
    """

    W: Matrix
    q: ArrayLike
    law: RollingFriction
    name: str = ""

    form: ClassVar[Form] = Form.DELASSUS  # type: ignore[misc]
    measure: ClassVar[Measure] = Measure.EXACT  # type: ignore[misc]
    has_v: ClassVar[bool] = False  # type: ignore[misc]
    unfit: ClassVar[str] = (
        "its contacts have moments (RollingFriction): Auto and RollingSweeps solve it"
    )
    no_path: ClassVar[str] = "contacts with moments have no continuation"

    def __post_init__(self) -> None:
        if not isinstance(self.law, RollingFriction):
            raise InvalidInput(f"expected RollingFriction(mu, ...), got {shown(self.law)}",
                               ("law",))  # fmt: skip
        q = read_only(finite("q", self.q, 2).copy())
        if q.shape[1] not in PLACES:
            raise InvalidInput(
                f"q: expected shape (nc, 3), (nc, 5) or (nc, 6), rows N, T, R in the plane, "
                f"N, T1, T2, R1, R2 or N, T1, T2, S, R1, R2 in space, got {q.shape}"
            )
        law = self.law
        if len(law) == 1 and len(q) > 1:
            law = law.at(np.zeros(len(q), dtype=np.int64))
        if len(law) != len(q):
            raise InvalidInput(f"law: expected {len(q)} contacts, got {len(law)}")
        if q.shape[1] != ROWS and law.torsion.any():
            raise InvalidInput(
                "torsion: expected 0 where contacts have no row of spin; six rows have one",
                ("law",),
            )
        W = sparse_matrix("W", self.W)
        if W.shape != (q.size, q.size):
            raise InvalidInput(f"W: expected shape {(q.size, q.size)}, got {W.shape}")
        far = abs(W - W.T).max() if W.nnz else 0.0
        if far > 0.0 and far > 1e-9 * abs(W).max():
            raise InvalidInput(f"W: expected a symmetric matrix, W - W^T has {far:.1e}")
        for key, value in (("q", q), ("law", law), ("W", W.tocsr())):
            object.__setattr__(self, key, value)

    @classmethod
    def _from_blocks(cls, blocks: Blocks, q: Array, law: RollingFriction) -> RollingProblem:
        """Of six rows, with W in rows of blocks that are known to be right, not copied."""
        indptr, indices, data = blocks
        W = sparse.bsr_array((data, indices, indptr), shape=(q.size, q.size)).tocsr()
        problem = object.__new__(cls)
        vars(problem).update(W=W, q=read_only(q), law=law, name="", _blocks=blocks)
        return problem

    def __repr__(self) -> str:
        return f"RollingProblem({len(self.law)} contacts of {self.rows} rows)"

    # ---------------------------------------------------------------- sizes
    @property
    def rows(self) -> int:
        """Of each contact."""
        return self.q.shape[1]  # type: ignore[union-attr]

    @property
    def dimension(self) -> int:  # type: ignore[override]
        """2 of three rows, else 3."""
        return 2 if self.rows == 3 else 3

    @property
    def unknowns(self) -> int:  # type: ignore[override]
        """Reactions, nc d."""
        return self.q.size  # type: ignore[union-attr]

    def start(self, given: Start | None = None) -> Motion:
        """(r, None): a checked copy of r (nc, d), or none."""
        if given is None:
            return np.zeros(self.q.shape), None  # type: ignore[union-attr]
        r = finite("r", given.r, 2)
        if r.shape != self.q.shape:  # type: ignore[union-attr]
            raise InvalidInput(f"expected r of shape {np.shape(self.q)}, got {r.shape}",
                               ("start",))  # fmt: skip
        return r.copy(), None

    # ---------------------------------------------------------------- kernels
    @cached_property
    def lengths(self) -> Array:
        """l (nc,): how far a moment is from its force; 1 where that is not known."""
        places = np.array(PLACES[self.rows])
        trace = self.W.diagonal().reshape(self.q.shape)  # type: ignore[union-attr]
        moved, turned = (
            trace[:, part].mean(axis=1) for part in (places < 3, places >= 3)
        )  # fmt: skip
        good = (moved > 0) & (turned > 0)
        return np.sqrt(np.where(good, moved, 1.0) / np.where(good, turned, 1.0))

    @cached_property
    def factors(self) -> Array:
        """(nc, 6): 1 of forces, l of moments; r over these, u times these are compared."""
        out = np.ones((len(self.lengths), ROWS))
        out[:, MOMENTS] = self.lengths[:, None]
        return out

    @cached_property
    def kernel_data(self) -> RollingData:
        """In lengths of each contact, rows that it has not being zero."""
        nc, places = len(self.lengths), np.array(PLACES[self.rows])
        indptr, indices, data = self._blocks
        row, factors = np.repeat(np.arange(nc), np.diff(indptr)), self.factors
        data = data * factors[row][:, :, None] * factors[indices][:, None, :]
        q = np.zeros((nc, ROWS))
        q[:, places] = np.asarray(self.q) * self.factors[:, places]
        diagonal = np.full(nc, -1, np.int32)
        own = row == indices
        diagonal[row[own]] = np.flatnonzero(own)
        rho = np.zeros(nc)
        largest = np.linalg.eigvalsh(data[own])[:, -1] if own.any() else np.zeros(0)
        rho[row[own]] = np.where(largest > 0, 1.0 / np.where(largest > 0, largest, 1.0), 0.0)
        coefficients = self.law.coefficients
        coefficients[:, 1:] /= self.lengths[:, None]
        return RollingData(indptr, indices, data, q, coefficients, rho, diagonal)

    @cached_property
    def _blocks(self) -> Blocks:
        """W in rows of 6x6 blocks, rows that it has not being zero."""
        nc, places = len(self.law), np.array(PLACES[self.rows])
        at = (ROWS * np.arange(nc)[:, None] + places).ravel()
        shape = ROWS * nc, len(at)
        E = sparse.coo_array((np.ones(len(at)), (at, np.arange(len(at)))), shape=shape)
        W = (E @ self.W @ E.T).tobsr((ROWS, ROWS))  # type: ignore[operator]
        W.sort_indices()
        indptr, indices = W.indptr.astype(np.int32), W.indices.astype(np.int32)
        return indptr, indices, np.ascontiguousarray(W.data)

    def six(self, r: Array) -> Array:
        """Reactions (nc, d) as kernels take them, (nc, 6)."""
        places = np.array(PLACES[self.rows])
        out = np.zeros((len(r), ROWS))
        out[:, places] = r / self.factors[:, places]
        return out

    def given_back(self, six: Array) -> Array:
        """Reactions (nc, d) of those of kernels."""
        places = np.array(PLACES[self.rows])
        return np.ascontiguousarray(six[:, places] * self.factors[:, places])

    @property
    def rho(self) -> Array:  # type: ignore[override]
        """1 / |W_ii|_2, (nc,), unit of r_N / u_N; 0 where a contact can not react."""
        return self.kernel_data.rho

    # ---------------------------------------------------------------- judging
    def _missed(self, r: Array) -> tuple[Array, Array, Array]:
        """(e, z, u) of reactions (nc, d), (nc, 6) in lengths of the contacts."""
        k, six = self.kernel_data, self.six(r)
        u = np.empty_like(k.q)
        velocities_inplace(k.indptr, k.indices, k.data, k.q, six, u)
        return *all_missed(six, u, k.coefficients, k.rho), u

    def error(self, r: Array, v: Array | None = None) -> float:
        """|natural map / rho| / |q|, see the module."""
        if not np.isfinite(r).all():
            return np.inf
        missed = float(np.linalg.norm(self._missed(r)[0]))
        return ratio(missed if np.isfinite(missed) else np.inf,
                     float(np.linalg.norm(self.kernel_data.q)))  # fmt: skip

    def motion(self, r: Array, v: Array | None = None) -> Motion:
        """(W r + q, None), (nc, d)."""
        return (self.W @ r.ravel()).reshape(r.shape) + self.q, None  # type: ignore[operator]

    def weakest(self, r: Array, v: Array | None = None) -> Weakest | None:
        """The contact that misses its law most, beside |q_i| and what all others push."""
        if not len(self.law):
            return None
        k = self.kernel_data
        missed = np.linalg.norm(self._missed(r)[0], axis=1)
        pushes, none = np.empty_like(k.q), np.zeros_like(k.q)
        size = np.abs(k.data), none, np.abs(self.six(r))
        velocities_inplace(k.indptr, k.indices, *size, pushes)
        scale = np.linalg.norm(k.q, axis=1) + np.linalg.norm(pushes, axis=1)
        share = np.where(missed > 0, missed / np.where(scale > 0, scale, 1.0), 0.0)
        share = np.where((missed > 0) & (scale <= 0), np.inf, share)
        worst = int(np.argmax(share))
        return Weakest(float(share[worst]), worst if share[worst] > 0 else None, 0.0)

    def regimes(self, r: Array) -> Regimes:
        """What contacts do at reactions r (nc, d): the piece of the cone that holds."""
        z, a = self._missed(r)[1], self.kernel_data.coefficients
        sizes = np.array([sizes_of(row) for row in z]).reshape(-1, 3)
        closed = (z[:, 0] + (a * sizes).sum(axis=1) > 0) & (r[:, 0] > 0)
        outside = closed[:, None] & (sizes > a * np.asarray(self.six(r))[:, :1])
        outside &= (a > 0) | (sizes > 0)
        return Regimes(closed, outside[:, 0], outside[:, 1], outside[:, 2])

    def accepted(
        self, r: Array, v: Array | None, error: float, tolerance: float
    ) -> Accepted:
        """The state with open contacts that carry nothing, and its statuses."""
        found = self.regimes(r)
        kept = np.where(found.closed[:, None], r, 0.0)
        if (kept != r).any():
            r, error = kept, self.error(kept)
            found = self.regimes(r)
        status = np.where(
            found.closed, np.where(found.slips, ContactStatus.SLIP, ContactStatus.STICK),
            ContactStatus.OPEN,
        ).astype(np.int8)  # fmt: skip
        weakest = self.weakest(r) if error <= tolerance else None
        told = Settled(r, status, found.slips, False)
        return Accepted(r, v, error, weakest, self.motion(r), told)


__all__ = ["Regimes", "RollingProblem"]
