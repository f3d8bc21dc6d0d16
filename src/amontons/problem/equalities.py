"""Equality constraints of a discrete problem, eliminated exactly.

In FCLib's letters (V. Acary et al., FCLib, RT-444, fclib.h), with p constraints and their
multipliers l:

    global   M v = H r + G l + f,    G^T v + b = 0,          u = H^T v + w
    local    u = W r + V l + q,      V^T r + R l + s = 0

Local form.  l = -R^+ (V^T r + s), so the contacts see

    W' = W - V R^+ V^T,   q' = q - V R^+ s.

R is symmetric and positive semidefinite, as G^T M^-1 G is; where constraints say the same twice
it is singular, and then neither V nor s may have a part there (both vanish in G of these).

Global form.  S^2 is the diagonal of M, Q an orthonormal basis of the range of S^-1 G,
P = I - S^-1 Q Q^T S, so that G^T P = 0 and v = P v + v0 with v0 from b.  Then

    M' = P^T M P + S Q Q^T S,   H' = P^T H,   f' = P^T (f - M v0) + S Q Q^T S v0,
    w' = w + H^T v0

have the same v, u and r: P^T times the first equation, and Q^T S v = Q^T S v0, which is
G^T v + b = 0.  M' has n rows as M, is definite where M is on what the constraints leave, and
the second term has the size of the diagonal of M whatever the units of G are.  Afterwards
G l = M v - H r - f; where rows of G depend on each other l is the smallest of many.

Parts of the constraints that share no unknown are dealt with alone, each dense.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.arrays import numbers, read_only, sparse_matrix
from ..core.errors import InvalidInput
from ..linear.dense import check_fits
from ..linear.rank import components
from .friction import FrictionProblem

Array = NDArray[np.float64]
Index = NDArray[np.int64]
DEPENDENT = 1e-10  # of rows of unit length: what is left of one that others say already
CONTRADICTED = 1e-8  # of the sizes of its terms: what may be left of such a row's equation
CANCELLED = 1e-13  # of the sizes of its terms: an entry that is rounding
ASYMMETRIC = 1e-9  # of its largest entry, of R


class Equalities(Protocol):
    """Constraints of a problem: bare, the problem without them; multipliers (p,) of a state."""

    bare: FrictionProblem

    @property
    def count(self) -> int:
        """The number p."""
        ...

    def eliminated(self) -> FrictionProblem:
        """The problem that holds them."""
        ...

    def multipliers(self, r: Array, v: Array | None) -> Array:
        """l (p,) of reactions (nc, d) and the motion (n,), None in the local form."""
        ...


# ------------------------------------------------------------------------ global form
class _Part(NamedTuple):
    """Constraints that share unknowns: rows (t,) of G, columns (k,), Q (t, rank), S (t,)."""

    rows: Index
    columns: Index
    basis: Array
    size: Array
    factors: Array  # Q^T S^-1 G D of these columns, D their lengths
    lengths: Array  # D, (k,)


@dataclass(frozen=True, eq=False)
class GlobalEqualities:
    """G (n, p) and b (p,) of G^T v + b = 0; see the module."""

    bare: FrictionProblem
    G: sparse.csc_array
    b: Array
    parts: tuple[_Part, ...]
    v0: Array

    @classmethod
    def of(cls, bare: FrictionProblem, G: Any, b: Any) -> GlobalEqualities:
        """Raises InvalidInput at ("G",) or ("b",) for what does not fit or contradicts."""
        G = sparse_matrix("G", G)
        n, p = G.shape
        if n != bare.unknowns:
            raise InvalidInput(f"expected {bare.unknowns} rows as M has, got {n}", ("G",))
        b = numbers("b", b, (p,))
        assert bare.M is not None
        size = _sizes(np.asarray(bare.M.diagonal(), dtype=float))
        parts = tuple(_part(G, rows, columns, size)
                      for rows, columns in components(sparse.csr_array(G)))  # fmt: skip
        v0 = np.zeros(n)
        for part in parts:
            right = -part.lengths * b[part.columns]
            y = np.linalg.lstsq(part.factors.T, right, rcond=DEPENDENT)[0]
            v0[part.rows] = part.basis @ y / part.size
        left = np.abs(G.T @ v0 + b)
        _check_agreement("b", left, abs(G).T @ np.abs(v0) + np.abs(b))
        return cls(bare, G, b, parts, read_only(v0))

    @property
    def count(self) -> int:
        """The number p of constraints."""
        return len(self.b)

    def eliminated(self) -> FrictionProblem:
        """The problem in the same v, r and u that holds them."""
        bare, v0 = self.bare, self.v0
        M, H, f, w = bare.M, bare.H, bare.f, bare.w
        assert M is not None and H is not None and f is not None and w is not None
        P, hold = self._projection()
        inner = _kept(P.T @ M @ P + hold, abs(P).T @ abs(M) @ abs(P) + abs(hold))
        push = _kept(P.T @ H, abs(P).T @ abs(H))
        if abs(M - M.T).nnz == 0:
            inner = 0.5 * (inner + inner.T)
        load = P.T @ (f - M @ v0) + hold @ v0
        return type(bare).from_global(
            sparse.csc_array(inner), sparse.csc_array(push), load,
            w + (H.T @ v0).reshape(w.shape), bare.mu, name=bare.name,
        )  # fmt: skip

    def _projection(self) -> tuple[sparse.csr_array, sparse.csr_array]:
        """(P, S Q Q^T S), (n, n) each."""
        n = self.G.shape[0]
        shares, holds = [], []
        for part in self.parts:
            full = part.basis @ part.basis.T
            share = full * part.size / part.size[:, None]
            shares.append(_placed(part.rows, share, n))
            holds.append(_placed(part.rows, full * part.size * part.size[:, None], n))
        P = sparse.eye_array(n, format="csr") - _summed(shares, n)
        return sparse.csr_array(P), _summed(holds, n)

    def multipliers(self, r: Array, v: Array | None) -> Array:
        """l (p,) with G l = M v - H r - f, as well as a state (r, v) balances."""
        bare = self.bare
        assert bare.M is not None and bare.H is not None and bare.f is not None
        rest = bare.M @ v - bare.H @ r.ravel() - bare.f
        l = np.zeros(self.count)
        for part in self.parts:
            y = part.basis.T @ (rest[part.rows] / part.size)
            found = np.linalg.lstsq(part.factors, y, rcond=DEPENDENT)[0]
            l[part.columns] = part.lengths * found
        return l


def _sizes(diagonal: Array) -> Array:
    """Square roots of the diagonal of M; of unknowns without one, the median of the others."""
    positive = diagonal > 0
    typical = float(np.median(diagonal[positive])) if positive.any() else 1.0
    return np.sqrt(np.where(positive, diagonal, typical))


def _part(G: sparse.csc_array, rows: Index, columns: Index, size: Array) -> _Part:
    """Orthonormal directions that these constraints hold."""
    from scipy.linalg import qr

    check_fits(8.0 * len(rows) ** 2, 4, f"G, which binds {len(rows)} unknowns together,")
    scaled = G[:, columns].tocsr()[rows].toarray() / size[rows, None]
    lengths = 1 / np.linalg.norm(scaled, axis=0)
    scaled *= lengths
    found: Any = qr(scaled, mode="economic", pivoting=True)
    pivots = np.abs(found[1].diagonal())
    basis = found[0][:, : int((pivots > DEPENDENT * pivots[0]).sum())]
    return _Part(rows, columns, basis, size[rows], basis.T @ scaled, lengths)


def _placed(rows: Index, block: Array, n: int) -> sparse.csr_array:
    """A matrix (n, n) with a dense block at these rows and columns."""
    i, j = np.repeat(rows, len(rows)), np.tile(rows, len(rows))
    return sparse.csr_array(sparse.coo_array((block.ravel(), (i, j)), shape=(n, n)))


def _summed(blocks: Sequence[sparse.csr_array], n: int) -> sparse.csr_array:
    out = sparse.csr_array((n, n))
    for block in blocks:
        out = out + block
    return sparse.csr_array(out)


# ------------------------------------------------------------------------- local form
@dataclass(frozen=True, eq=False)
class LocalEqualities:
    """V (nc d, p), R (p, p) and s (p,) of V^T r + R l + s = 0; see the module."""

    bare: FrictionProblem
    V: sparse.csc_array
    R: sparse.csc_array
    s: Array
    inverse: sparse.csr_array  # F (p, rank) with R^+ = F F^T

    @classmethod
    def of(cls, bare: FrictionProblem, V: Any, R: Any, s: Any) -> LocalEqualities:
        """Raises InvalidInput at ("V",), ("R",) or ("s",) for what does not fit."""
        V, R = sparse_matrix("V", V), sparse_matrix("R", R)
        p = R.shape[0]
        for name, matrix, shape in (("R", R, (p, p)), ("V", V, (bare.unknowns, p))):
            if matrix.shape != shape:
                raise InvalidInput(f"expected shape {shape}, got {matrix.shape}", (name,))
        s = numbers("s", s, (p,))
        far = float(abs(R - R.T).max()) if R.nnz else 0.0
        if far > ASYMMETRIC * abs(R).max():
            raise InvalidInput(
                f"expected a symmetric matrix, as G^T M^-1 G is; R - R^T has {far:.1e}", ("R",)
            )
        F, N = _square_root(R)
        held = np.abs(V @ N)
        _check_agreement("V", np.asarray(held.max(axis=0).toarray()).ravel(),
                         np.asarray((abs(V) @ abs(N)).max(axis=0).toarray()).ravel(),
                         _REACTIONS)  # fmt: skip
        _check_agreement("s", np.abs(N.T @ s), abs(N).T @ np.abs(s))
        return cls(bare, V, R, s, F)

    @property
    def count(self) -> int:
        """The number p of constraints."""
        return len(self.s)

    def eliminated(self) -> FrictionProblem:
        """The problem in the same r and u that holds them."""
        bare = self.bare
        W, q = bare.W, bare.q
        assert W is not None and q is not None
        through = sparse.csr_array(self.V @ self.inverse)
        give = through @ (self.inverse.T @ self.s)
        if not sparse.issparse(W):
            full = through.toarray()
            taken = full @ full.T
            inner: Any = W - taken
            inner[np.abs(inner) <= CANCELLED * (abs(W) + np.abs(taken))] = 0.0
        else:
            entries = float(np.square(np.diff(through.tocsc().indptr).astype(float)).sum())
            check_fits(12.0 * entries, 3, f"V R^-1 V^T of {len(q)} contacts")
            taken = sparse.csr_array(through @ through.T)
            inner = _kept(W - taken, abs(W) + abs(taken))
        return type(bare).from_delassus(
            inner, q - give.reshape(q.shape), bare.mu, name=bare.name
        )

    def multipliers(self, r: Array, v: Array | None) -> Array:
        """l (p,) of reactions (nc, d): -R^+ (V^T r + s)."""
        F = self.inverse
        return -(F @ (F.T @ (self.V.T @ r.ravel() + self.s)))


_REACTIONS = (
    "R is singular in a direction in which reactions act, so it is no G^T M^-1 G; "
    "expected V = H^T M^-1 G beside it, or the global form"
)


def _square_root(R: sparse.csc_array) -> tuple[sparse.csr_array, sparse.csc_array]:
    """(F, N) of R = R^T: F F^T = R^+, the columns of N span what R maps to nothing."""
    from scipy.sparse.csgraph import connected_components

    p = R.shape[0]
    label = connected_components(R, directed=False)[1] if p else np.zeros(0, int)
    order = np.argsort(label, kind="stable")
    roots, nothing = [], []
    for rows in np.split(order, np.flatnonzero(np.diff(label[order])) + 1):
        if not len(rows):
            continue
        check_fits(8.0 * len(rows) ** 2, 4, f"R, which couples {len(rows)} constraints,")
        block = R[:, rows].tocsr()[rows].toarray()
        size = _sizes(block.diagonal())
        values, modes = np.linalg.eigh(0.5 * (block + block.T) / np.outer(size, size))
        least = DEPENDENT * max(float(values[-1]), float(-values[0]))
        if values[0] < -least:
            raise InvalidInput(
                "expected a positive semidefinite matrix, as G^T M^-1 G is; constraint "
                f"{rows[int(np.abs(modes[:, 0]).argmax())]} and others have the eigenvalue "
                f"{values[0]:.3g} of the matrix with unit diagonal", ("R",),
            )  # fmt: skip
        modes, kept = modes / size[:, None], values > least
        roots.append((rows, modes[:, kept] / np.sqrt(values[kept])))
        nothing.append((rows, modes[:, ~kept]))
    return sparse.csr_array(_beside(roots, p)), sparse.csc_array(_beside(nothing, p))


def _beside(blocks: list[tuple[Index, Array]], rows: int) -> sparse.coo_array:
    """Dense blocks at rows of their own, one beside the other: (rows, sum of widths)."""
    values, i, j, first = [np.zeros(0)], [np.zeros(0, int)], [np.zeros(0, int)], 0
    for at, block in blocks:
        width = block.shape[1]
        values.append(block.ravel())
        i.append(np.repeat(at, width))
        j.append(np.tile(first + np.arange(width), len(at)))
        first += width
    place = (np.concatenate(i), np.concatenate(j))
    return sparse.coo_array((np.concatenate(values), place), shape=(rows, first))


# ------------------------------------------------------------------------- both forms
def _kept(matrix: Any, size: Any) -> sparse.csr_array:
    """Without entries that are rounding: what constraints hold does not move at all."""
    matrix, size = sparse.csr_array(matrix), sparse.csr_array(size)
    out = sparse.csr_array(matrix.multiply(abs(matrix) > CANCELLED * size))
    out.eliminate_zeros()
    return out


def _check_agreement(name: str, left: Array, size: Array, why: str = "") -> None:
    """Raise InvalidInput for what is left of equations that others say already."""
    bad = np.flatnonzero(left > CONTRADICTED * size)
    if bad.size:
        k = int(bad[(left / np.where(size > 0, size, 1.0))[bad].argmax()])
        raise InvalidInput(
            why or f"entry {k}: the constraints contradict each other there, what is left of "
            f"its equation is {left[k]:.3g}; expected constraints that can hold together",
            (name,),
        )  # fmt: skip
