"""The compiled search over status patterns: which of them can hold a solution of a 2D problem.

Per contact four variables a, b >= 0 (r_N = a + b, r_T = mu (a - b)), u_N and u_T; all contacts
together obey 2 nc equations u = A x + c with x = (a, b).  A status fixes, frees or signs these
variables, so a pattern, also one in which some contacts are not decided yet, is a linear
feasibility problem whose bounds are all zero.  It is kept as a dictionary: basic variables in
terms of the others, which are at zero.  The search goes down from all contacts undecided, by
the dual simplex method from the dictionary of the parent, Bland's rule where it takes long.

A branch is cut only with a proof: the row that can not reach its bound gives multipliers y,
and sum y_k u_k - (A^T y) x = y c is checked against the bounds with A and c as given, and with
room for rounding.  What has no such proof is branched on; patterns that remain are leaves.
"""

from __future__ import annotations

import numpy as np

from ...core.compiled import njit
from ..statuses import ANY, CLOSED, FREE, FRICTIONLESS, MINUS, PLUS, STICK

UNBOUND, POSITIVE, NEGATIVE, FIXED = 0, 1, 2, 3  # bounds of a variable, closed
BOUNDS = np.array([  # a, b, u_N, u_T of a status
    [FIXED, FIXED, POSITIVE, UNBOUND],  # FREE
    [POSITIVE, FIXED, FIXED, NEGATIVE],  # PLUS
    [FIXED, POSITIVE, FIXED, POSITIVE],  # MINUS
    [POSITIVE, POSITIVE, FIXED, FIXED],  # STICK
    [POSITIVE, FIXED, POSITIVE, FIXED],  # LOAD: no contact, a and u_N = 1 - a
    [POSITIVE, FIXED, FIXED, UNBOUND],  # FRICTIONLESS
    [UNBOUND, UNBOUND, UNBOUND, UNBOUND],
    [POSITIVE, POSITIVE, FIXED, UNBOUND],  # CLOSED
    [POSITIVE, POSITIVE, POSITIVE, UNBOUND],  # ANY
], dtype=np.int8)  # fmt: skip
ZERO = 1e-10  # violation of a bound that counts as none, of variables of size 1
PIVOT = 1e-9  # smallest entry that is divided by
RENEWAL = 40  # pivots after which rounding is taken out of a dictionary
EPSILON = float(np.finfo(float).eps)
INFEASIBLE, FEASIBLE, UNDECIDED = 0, 1, 2


@njit(cache=True)
def _bounds(kind, low, high):
    """Range of a variable: what its bound and the a-priori box leave."""
    if kind == FIXED:
        return 0.0, 0.0
    if kind == POSITIVE:
        return max(low, 0.0), high
    if kind == NEGATIVE:
        return low, min(high, 0.0)
    return low, high


@njit(cache=True)
def _excluded(y, A, spread, c, states, low, high):
    """True when no (x, u) within the bounds has y u - (A^T y) x = y c, rounding included.

    spread (m,): of A x, by what A itself is off.
    """
    m = len(c)
    least = most = constant = size = more = 0.0
    for j in range(m):
        lam = total = 0.0
        for k in range(m):
            lam -= A[k, j] * y[k]
            total += abs(A[k, j] * y[k])
        for part in range(2):  # the column of x_j, then that of u_j
            weight = lam if part == 0 else y[j]
            v = 4 * (j // 2) + 2 * part + j % 2
            lo, hi = _bounds(BOUNDS[states[v // 4], v % 4], low[v], high[v])
            if lo > hi:
                return True
            least += weight * lo if weight > 0 else weight * hi
            most += weight * hi if weight > 0 else weight * lo
            size += (total if part == 0 else abs(weight)) * max(abs(lo), abs(hi))
        constant += y[j] * c[j]
        size += abs(y[j] * c[j])
        more += abs(y[j]) * spread[j]
    margin = 4 * EPSILON * (m + 4) * size + 2 * more
    return constant > most + margin or constant < least - margin


@njit(cache=True)
def _proved(y, A, c, states, low, high):
    """`_excluded` where A is exact."""
    return _excluded(y, A, np.zeros(len(c)), c, states, low, high)


@njit(cache=True)
def _row_multipliers(D, basic, nonbasic, i, m):
    """y of row i: the coefficients of u in x_basic - sum D x_nonbasic = constant."""
    y = np.zeros(m)
    v = basic[i]
    if v % 4 >= 2:
        y[2 * (v // 4) + v % 4 - 2] = 1.0
    for j in range(m):
        v = nonbasic[j]
        if v % 4 >= 2:
            y[2 * (v // 4) + v % 4 - 2] = -D[i, j]
    return y


@njit(cache=True)
def _pivot_inplace(D, basic, nonbasic, i, j):
    m = len(basic)
    p = 1.0 / D[i, j]
    for k in range(m + 1):
        D[i, k] *= -p
    D[i, j] = p
    for row in range(m):
        factor = D[row, j]
        if row != i and factor != 0.0:
            D[row, j] = 0.0
            for k in range(m + 1):
                D[row, k] += factor * D[i, k]
    basic[i], nonbasic[j] = nonbasic[j], basic[i]


@njit(cache=True)
def _violation(kind, value):
    """How far a value is outside its bound, with the sign of the change that it needs."""
    if kind == FIXED or (kind == POSITIVE and value < 0) or (kind == NEGATIVE and value > 0):
        return -value
    return 0.0


@njit(cache=True)
def _entering(D, nonbasic, states, i, up, least_index):
    """Column that can move basic variable i up (or down), -1 for none: largest, or first."""
    best, where = PIVOT, -1
    for j in range(len(nonbasic)):
        v = nonbasic[j]
        kind = BOUNDS[states[v // 4], v % 4]
        d = D[i, j] if up else -D[i, j]
        helps = (kind == POSITIVE and d > 0) or (kind == NEGATIVE and d < 0) or kind == UNBOUND
        if not helps or abs(d) <= PIVOT:
            continue
        if least_index:
            if where < 0 or v < nonbasic[where]:
                where = j
        elif abs(d) > best:
            best, where = abs(d), j
    return where


@njit(cache=True)
def _leaving(D, basic, states, least_index):
    """Row whose basic variable violates its bound, -1 for none: most, or first."""
    m = len(basic)
    worst, where = ZERO, -1
    for i in range(m):
        v = basic[i]
        violation = abs(_violation(BOUNDS[states[v // 4], v % 4], D[i, m]))
        if violation <= ZERO:
            continue
        if least_index:
            if where < 0 or v < basic[where]:
                where = i
        elif violation > worst:
            worst, where = violation, i
    return where


@njit(cache=True)
def _renew_inplace(D, basic, nonbasic, A, c):
    """Compute the dictionary again from A and c, which takes the rounding of its pivots out."""
    m = len(c)
    wanted = np.zeros(2 * m, dtype=np.bool_)
    for k in range(m):
        wanted[basic[k]] = True
    for k in range(m):
        D[k, m] = c[k]
        for j in range(m):
            D[k, j] = A[k, j]
        basic[k] = 4 * (k // 2) + 2 + k % 2
        nonbasic[k] = 4 * (k // 2) + k % 2
    for j in range(m):
        if not wanted[nonbasic[j]]:
            continue
        best, where = 0.0, -1
        for i in range(m):
            if not wanted[basic[i]] and abs(D[i, j]) > best:
                best, where = abs(D[i, j]), i
        if where >= 0:
            _pivot_inplace(D, basic, nonbasic, where, j)


@njit(cache=True)
def _feasible_inplace(  # noqa: PLR0913
    D, basic, nonbasic, states, A, spread, c, low, high, age, proof
):
    """Look for values within the bounds of these states: FEASIBLE, INFEASIBLE or UNDECIDED.

    age: pivots since the dictionary was computed anew; returned as the second value.  proof
    (m,): the multipliers where the answer is INFEASIBLE.
    """
    m = len(basic)
    fresh = False
    for iteration in range(60 * m):
        if age > RENEWAL:
            _renew_inplace(D, basic, nonbasic, A, c)
            age, fresh = 0, True
        careful = iteration > 6 * m
        i = _leaving(D, basic, states, careful)
        if i < 0:
            return FEASIBLE, age
        v = basic[i]
        up = _violation(BOUNDS[states[v // 4], v % 4], D[i, m]) > 0
        j = _entering(D, nonbasic, states, i, up, careful)
        if iteration % 4 == 0 or j < 0:
            y = _row_multipliers(D, basic, nonbasic, i, m)
            if _excluded(y, A, spread, c, states, low, high):
                for k in range(m):
                    proof[k] = y[k]
                return INFEASIBLE, age
        if j < 0 and fresh:
            return UNDECIDED, age
        if j < 0:
            age = RENEWAL + 1
            continue
        _pivot_inplace(D, basic, nonbasic, i, j)
        age += 1
        fresh = False
    return UNDECIDED, age


@njit(cache=True)
def _most_violated(D, basic, states):
    """Contact to decide next: where the law is violated most, else the first; -1 for none."""
    m, n = len(basic), len(states)
    x = np.zeros(4 * n)
    for i in range(m):
        x[basic[i]] = D[i, m]
    worst, where = -1.0, -1
    for p in range(n):
        if states[p] < CLOSED:
            continue
        a, b, un, ut = x[4 * p], x[4 * p + 1], x[4 * p + 2], x[4 * p + 3]
        slip = max(min(a, ut), min(b, -ut))
        size = max(slip, min(a + b, un)) if states[p] == ANY else slip
        if size > worst:
            worst, where = max(size, 0.0), p
    return where


@njit(cache=True)
def _child(state, number, reacts, frictional):
    """State of a child, -1 when there is none of that number."""
    if state == ANY:
        if number == 0:
            return FREE
        if number == 1 and reacts:
            return CLOSED if frictional else FRICTIONLESS
        return -1
    if state != CLOSED or number > 2:
        return -1
    return STICK if number == 0 else PLUS + number - 1


def start_inplace(D, basic, nonbasic, states, A, c, root):
    """The root: contacts as in `root`, for all or (nc,), u basic, the reactions at zero."""
    m = len(c)
    D[0, :, :m], D[0, :, m] = A, c
    reactions = np.array([4 * (k // 2) + k % 2 for k in range(m)], dtype=np.int64)
    basic[0], nonbasic[0] = reactions + 2, reactions
    states[0] = root


@njit(cache=True)
def _copy_inplace(D, basic, nonbasic, states, level):
    """The dictionary and pattern of a level also for the next one."""
    m = basic.shape[1]
    for i in range(m):
        basic[level + 1, i] = basic[level, i]
        nonbasic[level + 1, i] = nonbasic[level, i]
        for j in range(m + 1):
            D[level + 1, i, j] = D[level, i, j]
    for p in range(states.shape[1]):
        states[level + 1, p] = states[level, p]


@njit(cache=True)
def search_inplace(  # noqa: PLR0913
    A, spread, c, low, high, reacts, frictional, partner, D, basic, nonbasic, states, turn,
    level, leaves, cut, proofs,
):  # fmt: skip
    """Go on from `level` for at most len(leaves) nodes: (done?, level, nodes, leaves, cuts).

    D, basic, nonbasic, states: one dictionary and pattern per level; turn (levels, 3): contact
    that a level branches on, its next child, and the age of its dictionary.  partner (nc,): the
    contact that slips with another one, and else is free, or -1.  leaves (k, nc) takes
    complete patterns; cut (k, nc) and proofs (k, m) the excluded ones and multipliers.
    """
    nodes = found = cuts = 0
    while level >= 0:
        if nodes >= len(leaves):
            return False, level, nodes, found, cuts
        p = turn[level, 0]
        state = _child(states[level, p], turn[level, 1], reacts[p], frictional[p])
        if state < 0:
            level -= 1
            continue
        turn[level, 1] += 1
        _copy_inplace(D, basic, nonbasic, states, level)
        level += 1
        states[level, p] = state
        if partner[p] >= 0:
            states[level, partner[p]] = state if state == PLUS or state == MINUS else FREE
        nodes += 1
        answer, turn[level, 2] = _feasible_inplace(
            D[level], basic[level], nonbasic[level], states[level], A, spread, c, low,
            high, turn[level - 1, 2], proofs[cuts],
        )  # fmt: skip
        following = -1
        if answer == INFEASIBLE:
            cut[cuts] = states[level]
            cuts += 1
        else:
            following = _most_violated(D[level], basic[level], states[level])
            if following < 0:
                leaves[found] = states[level]
                found += 1
        if following < 0:
            level -= 1
        else:
            turn[level, 0], turn[level, 1] = following, 0
    return True, level, nodes, found, cuts
