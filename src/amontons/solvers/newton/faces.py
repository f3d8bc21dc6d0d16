"""Faces that contacts share between two rigid bodies, as W tells them, for Newton matrices.

All contacts i of a face g feel one relative motion of six components, so that

    W_ij = L_i X_gh L_j^T,   L_i (3, 6),   i in g, j in h,

and a step (W + E) dr = f with E block diagonal and regular is [W], six unknowns for each face,

    (X + K) p = K h,   K_g = (sum_i L_i^T E_i^-1 L_i)^-1,   h_g = sum_i L_i^T E_i^-1 f_i,
    dr_i = E_i^-1 (f_i - L_i K_g (h_g - p_g)),

p_g = sum_i L_i^T dr_i; `face_steps` says how, without loss of digits.  Contacts that share none
keep their three unknowns: L = 1, K = E.  On a wall whose faces have nine contacts that is
a factor for a hundredth of the operations.
Nothing is known of bodies here but W.  Contacts with the same pattern in W are tried one after
another: a face takes them while the rank of its own part of W stays at six at most, told by
Cholesky's factor, whose rows are L; what it predicts is compared with all of W.

[W] M. A. Woodbury, "Inverting modified matrices", Princeton Statistical Research Group, memo 42
(1950).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ...problem.friction import FrictionProblem
from .block_lu import Symbolic, analyse_pattern, found

Array = NDArray[np.float64]
SIX = 6  # components of a relative motion
FEWEST = 3  # contacts of a face: two have six components as well
# Of a contact's block, from which a row of W counts as independent of others; error of what
# faces predict of W, of its largest entry, from which there are none.
INDEPENDENT, WRONG = 1e-9, 1e-8
# Work of a contact on a face and of a block of X, in products of blocks; what part of the work
# of a factor faces may leave.
SHARED, TURNED, WORTH = 80, 8, 0.5


class Faces(NamedTuple):
    """Faces as compiled functions read them; none where `first` has one entry.

    Unknowns p are blocks of three: one of a contact on its own, two of a face.
    """

    face: Any  # (nc,) number of the face of each contact, -1 of none
    levers: Any  # (nc, 3, 6) L
    first: Any  # (faces + 1,) where the contacts of each begin
    contacts: Any  # those of all faces, one behind the other
    rank: Any  # (faces,)
    place: Any  # (nc,) first block of p of the contact, or of its face
    indptr: Any  # of X, in blocks (., 3, 3)
    indices: Any
    data: Any


@njit(cache=True, error_model="numpy")
def _rows_inplace(indptr, indices, data, c, at, component, factor, count, rows):
    """rows (6, 3): what contact c adds to Cholesky's factor of count rows, and what is left."""
    for k in range(count):
        w = found(indptr, indices, at[k], c)
        for b in range(3):
            t = data[w, component[k], b] if w >= 0 else 0.0
            for m in range(k):
                t -= factor[k, m] * rows[m, b]
            rows[k, b] = t / factor[k, k]
    left = data[found(indptr, indices, c, c)].copy()
    for a in range(3):
        for b in range(3):
            for k in range(count):
                left[a, b] -= rows[k, a] * rows[k, b]
    return left


@njit(cache=True, error_model="numpy")
def _taken(indptr, indices, data, c, at, component, factor, count, rows):
    """Rows of the face with contact c in it, -1 where they were more than six."""
    left = _rows_inplace(indptr, indices, data, c, at, component, factor, count, rows)
    own = data[found(indptr, indices, c, c)]
    enough = INDEPENDENT * max(own[0, 0], own[1, 1], own[2, 2])
    while True:
        b = 0
        for a in range(1, 3):
            if left[a, a] > left[b, b]:
                b = a
        if not left[b, b] > enough:
            return count
        if count == SIX:
            return -1
        root = math.sqrt(left[b, b])
        at[count], component[count] = c, b
        factor[count, :count] = rows[:count, b]
        factor[count, count] = root
        for a in range(3):
            rows[count, a] = left[b, a] / root
        for a in range(3):
            for e in range(3):
                left[a, e] -= rows[count, a] * rows[count, e]
        count += 1


@njit(cache=True, error_model="numpy")
def _faces(indptr, indices, data, rho, order, starts):
    """(face, levers, first, contacts, rank, pivots) of sets of contacts, order[starts...]."""
    nc = len(indptr) - 1
    face, levers = np.full(nc, -1), np.zeros((nc, 3, SIX))
    first, contacts, rank = [0], np.empty(nc, np.int64), np.empty(nc, np.int64)
    factors, ats = np.empty((nc, SIX, SIX)), np.empty((nc, SIX, 2), np.int64)
    at, component = np.empty(SIX, np.int64), np.empty(SIX, np.int64)
    factor, rows, filled = np.zeros((SIX, SIX)), np.zeros((SIX, 3)), 0
    for s in range(len(starts) - 1):
        k = starts[s]
        while starts[s + 1] - k >= FEWEST:
            count, end = 0, k
            while end < starts[s + 1] and rho[order[end]] > 0.0:
                more = _taken(
                    indptr, indices, data, order[end], at, component, factor, count, rows
                )
                if more < 0:
                    break
                count, end = more, end + 1
            if end - k >= FEWEST:
                g = len(first) - 1
                for m in range(k, end):
                    c = order[m]
                    _rows_inplace(indptr, indices, data, c, at, component, factor, count, rows)
                    for b in range(3):
                        levers[c, b, :count] = rows[:count, b]
                    face[c], contacts[filled] = g, c
                    filled += 1
                first.append(filled)
                rank[g] = count
                factors[g] = factor
                ats[g, :, 0], ats[g, :, 1] = at, component
            k = max(end, k + 1)
    g = len(first) - 1
    return face, levers, np.array(first), contacts[:filled].copy(), rank[:g].copy(), (
        factors[:g].copy(), ats[:g].copy(),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _on_faces(indptr, indices, data, rho, order, starts):
    """How many contacts are in sets, order[starts...], whose first three share a face."""
    at, component = np.empty(SIX, np.int64), np.empty(SIX, np.int64)
    factor, rows, total = np.zeros((SIX, SIX)), np.zeros((SIX, 3)), 0
    for s in range(len(starts) - 1):
        begin, count, k = starts[s], 0, 0
        if starts[s + 1] - begin < FEWEST:
            continue
        while k < FEWEST and count >= 0 and rho[order[begin + k]] > 0.0:
            count = _taken(
                indptr, indices, data, order[begin + k], at, component, factor, count, rows
            )
            k += 1
        if k == FEWEST and count >= 0:
            total += starts[s + 1] - begin
    return total


@njit(cache=True, error_model="numpy")
def _pattern(indptr, indices, face, first, contacts):
    """(place, indptr, indices) of X in blocks of three, columns ascending."""
    nc = len(indptr) - 1
    place, n = np.full(nc, -1), 0
    of = np.empty(nc, np.int64)  # a contact of each block
    for i in range(nc):
        if face[i] < 0:
            place[i], of[n] = n, i
            n += 1
        elif place[i] < 0:
            of[n] = of[n + 1] = i
            for k in range(first[face[i]], first[face[i] + 1]):
                place[contacts[k]] = n
            n += 2
    starts, columns = np.zeros(n + 1, np.int32), np.empty(4 * len(indices) + n, np.int32)
    seen, filled = np.full(n, -1), 0
    for p in range(n):
        i, begin = of[p], filled
        seen[p], columns[filled] = p, p
        filled += 1
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            for half in range(2 if face[j] >= 0 else 1):
                q = place[j] + half
                if seen[q] != p:
                    seen[q] = p
                    columns[filled] = q
                    filled += 1
        columns[begin:filled] = np.sort(columns[begin:filled])
        starts[p + 1] = filled
    return place, starts, columns[:filled].copy()


@njit(cache=True, error_model="numpy")
def _lower_solved(factor, count, rows):
    """rows (6, m) becomes factor^-1 rows."""
    for k in range(count):
        for b in range(rows.shape[1]):
            t = rows[k, b]
            for m in range(k):
                t -= factor[k, m] * rows[m, b]
            rows[k, b] = t / factor[k, k]


@njit(cache=True, error_model="numpy")
def _fill(indptr, indices, data, face, rank, place, starts, columns, pivots, first, contacts):  # noqa: PLR0913
    """X in the pattern (starts, columns); rows of a face beyond its rank are empty."""
    factors, ats = pivots
    X = np.zeros((len(columns), 3, 3))
    nc = len(indptr) - 1
    row, column = np.empty((SIX, 2), np.int64), np.empty((SIX, 2), np.int64)
    for i in range(nc):
        g = face[i]
        if g >= 0 and contacts[first[g]] != i:
            continue
        height = 3 if g < 0 else rank[g]
        if g < 0:
            for a in range(3):
                row[a, 0], row[a, 1] = i, a
        else:
            row[:] = ats[g]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            h = face[j]
            if h >= 0 and contacts[first[h]] != j:
                continue
            width = 3 if h < 0 else rank[h]
            if h < 0:
                for a in range(3):
                    column[a, 0], column[a, 1] = j, a
            else:
                column[:] = ats[h]
            B = np.zeros((SIX, SIX))
            for a in range(height):
                for b in range(width):
                    w = found(indptr, indices, row[a, 0], column[b, 0])
                    if w >= 0:
                        B[a, b] = data[w, row[a, 1], column[b, 1]]
            if g >= 0:
                _lower_solved(factors[g], height, B)
            if h >= 0:
                C = B.T.copy()
                _lower_solved(factors[h], width, C)
                B = C.T.copy()
            for a in range(height):
                for b in range(width):
                    at = found(starts, columns, place[i] + a // 3, place[j] + b // 3)
                    X[at, a % 3, b % 3] = B[a, b]
    return X


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _misses(indptr, indices, data, faces):
    """Largest error of what X predicts of W, of the largest entry of W."""
    worst = size = 0.0
    eye, nc = np.eye(3, SIX), len(indptr) - 1
    heads = np.full(len(faces.rank), -1)  # contact with which L_i X_gh was made last
    rows, single = np.empty((len(heads), 3, SIX)), np.empty((3, SIX))
    for i in range(nc):
        g = faces.face[i]
        A = eye if g < 0 else faces.levers[i]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            h = faces.face[j]
            row = single if h < 0 else rows[h]
            if h < 0 or heads[h] != i:
                row[:] = 0.0
                for p in range(2 if g >= 0 else 1):
                    for q in range(2 if h >= 0 else 1):
                        X = faces.data[found(
                            faces.indptr, faces.indices, faces.place[i] + p, faces.place[j] + q
                        )]  # fmt: skip
                        for a in range(3):
                            for b in range(3):
                                for m in range(3):
                                    row[a, 3 * q + b] += A[a, 3 * p + m] * X[m, b]
                if h >= 0:
                    heads[h] = i
            B = eye if h < 0 else faces.levers[j]
            for a in range(3):
                for b in range(3):
                    t = data[k, a, b]
                    size = max(size, abs(t))
                    for m in range(SIX if h >= 0 else 3):
                        t -= row[a, m] * B[b, m]
                    worst = max(worst, abs(t))
    return worst / size if size > 0.0 else 0.0


NONE = Faces(
    np.empty(0, np.int64), np.empty((0, 3, SIX)), np.zeros(1, np.int64), np.empty(0, np.int64),
    np.empty(0, np.int64), np.empty(0, np.int64), np.zeros(1, np.int32), np.empty(0, np.int32),
    np.empty((0, 3, 3)),
)  # fmt: skip


@njit(cache=True, error_model="numpy")
def _sets(indptr, indices):
    """(order, starts): contacts of equal pattern one behind the other, in their own order.

    Equal are those whose columns, mixed by splitmix64, have the same sum.
    """
    nc = len(indptr) - 1
    sums = np.zeros(nc, np.uint64)
    for i in range(nc):
        for k in range(indptr[i], indptr[i + 1]):
            x = (np.uint64(indices[k]) + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
            x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            sums[i] += x ^ (x >> np.uint64(31))
    order, starts = np.argsort(sums, kind="mergesort"), [0]
    for k in range(1, nc):
        if sums[order[k]] != sums[order[k - 1]]:
            starts.append(k)
    starts.append(nc)
    return order, np.array(starts)


def are_shared(problem: FrictionProblem) -> bool:
    """True where most contacts share faces of rigid bodies, told once of a W by three each."""
    return problem.kept(_are_shared)


def _are_shared(problem: FrictionProblem) -> bool:
    b, rho = problem.blocks, problem.kernel_data[6]
    order, starts = _sets(b.indptr, b.indices)
    return 2 * _on_faces(b.indptr, b.indices, b.data, rho, order, starts) > problem.contacts


def _work(symbolic: Symbolic, contacts: int, blocks: int) -> int:
    """Of a step with so many contacts and blocks of X, in products of blocks."""
    return symbolic.products + SHARED * contacts + TURNED * blocks


@dataclass(frozen=True, eq=False)
class FaceMatrix:
    """Faces of a problem and the symbolic factor of X + K."""

    faces: Faces
    symbolic: Symbolic

    @property
    def arrays(self) -> tuple[Any, ...]:
        """What the compiled functions take."""
        return *self.symbolic.arrays, self.faces

    @property
    def products(self) -> int:
        """Products of 3x3 blocks that a step costs, or as many operations."""
        if not self.faces.rank.size:
            return self.symbolic.products
        return _work(self.symbolic, len(self.faces.face), len(self.faces.indices))

    @classmethod
    def of(cls, problem: FrictionProblem) -> FaceMatrix:
        """Of W, once for all variants with it; no faces where they leave half of the work."""
        return problem.kept(cls._kept)

    @classmethod
    def _kept(cls, problem: FrictionProblem) -> FaceMatrix:
        whole = Symbolic.of(problem)
        return cls._of(problem, whole.products) or cls(NONE, whole)

    @classmethod
    def _of(cls, problem: FrictionProblem, products: int) -> FaceMatrix | None:
        b, rho = problem.blocks, problem.kernel_data[6]
        if SHARED * problem.contacts > WORTH * products:
            return None
        order, starts = _sets(b.indptr, b.indices)
        if not (np.diff(starts) >= FEWEST).any():
            return None
        face, levers, first, contacts, rank, pivots = _faces(
            b.indptr, b.indices, b.data, rho, order, starts
        )
        if not rank.size:
            return None
        place, indptr, indices = _pattern(b.indptr, b.indices, face, first, contacts)
        symbolic = analyse_pattern(indptr, indices)
        if _work(symbolic, len(face), len(indices)) > WORTH * products:
            return None
        X = _fill(
            b.indptr, b.indices, b.data, face, rank, place, indptr, indices, pivots, first,
            contacts,
        )  # fmt: skip
        made = Faces(face, levers, first, contacts, rank, place, indptr, indices, X)
        if not _misses(b.indptr, b.indices, b.data, made) <= WRONG:
            return None
        return cls(made, symbolic)


__all__ = ["NONE", "SIX", "FaceMatrix", "Faces", "are_shared"]
