"""The first-order system: all one-sided tangents of the solution curves through a point.

At a point where several pieces meet, H'((y, p); (y', p')) = 0 is itself piecewise linear: every
piece has its own kernel, and a direction of that kernel counts if it leads into the piece
([LR] eq. (P'), for contact (P'1)-(P'4') with the index sets (25); Theorem 3: if it leads there
strictly, exactly one solution curve leaves along it).

Orientation: along a curve without branch points sign(p') sign(det J_y) does not change.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), sections 2.1 and 3.1.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ...core.errors import NotConverged, SingularOperator
from ..tolerances import SINGULAR
from .cones import TangentCone, edges_and_lines, unit_rows
from .contact_rates import contact_rates
from .corrector import determinant_sign
from .friction_path import FrictionPath
from .path import PathProblem, corrected, name_of, weight_of
from .rate_claims import Claim
from .rest import REASON, rates_from_rest, resting
from .sparse_kernel import sparse_kernel
from .tangents import INWARD, FirstOrder, Tangent, merged, near_zero
from .tangents import inward as inside

Array = NDArray[np.float64]
Sets = list[tuple[tuple[str, ...], tuple[Array, ...]]]
BORDERS = 4  # near a point up to which all pieces are looked at one by one
SMALL = (1e-3, 1e-5, 1e-7)  # changes of the parameter that tell where a curve goes
NODES = 50_000  # patterns that such a search looks at
SEARCHED = 40  # contacts at a border up to which a tree search may come to an end
COMBINATIONS = 20_000  # pieces at a point up to which all are looked at


def first_order(
    problem: PathProblem, y: Array, p: float, *, tolerance: float = 1e-9,
    pieces: Sequence[Any] | None = None,
) -> FirstOrder:  # fmt: skip
    """All one-sided tangents at a solution (y, p).

    tolerance: distance to a border of a piece that counts as none.  pieces: those that meet
    there, for problems that do not tell; every problem needs `jacobian_of` and `margins`.
    """
    if isinstance(problem, FrictionPath) and pieces is None:
        return _friction(problem, y, p, tolerance)
    if pieces is None:
        if _many_meet(problem, y, p, tolerance):
            return _by_small_steps(problem, y, p, tolerance, "many pieces meet at this point")
        pieces = problem.pieces(y, p, tolerance)
    weight = weight_of(problem, len(y))
    found: list[Tangent] = []
    cones: list[TangentCone] = []
    for piece in pieces:
        lines = kernel(*problem.jacobian_of(piece, y, p), weight)
        if lines.shape[1] != 1:
            cone = _cone(problem, piece, y, p, lines, tolerance)
            cones += [cone] if cone is not None else []
            continue
        for sign in (1.0, -1.0):
            direction, rate = sign * lines[:-1, 0], sign * float(lines[-1, 0])
            inward = inside(problem, piece, y, p, direction, rate, tolerance)
            if inward is not None:
                found.append(Tangent(direction, rate, name_of(piece), inward))
    return _first_order(merged(problem, y, p, found, tolerance), cones)


def _first_order(tangents: tuple[Tangent, ...], cones: Sequence[TangentCone]) -> FirstOrder:
    sets = tuple(cone.piece for cone in cones)
    reason = "" if not sets else (
        "solutions near this point are not isolated: first-order systems have a set of them on "
        + ", ".join(map(str, sets))
    )  # fmt: skip
    return FirstOrder(tangents, sets, not sets, reason, tuple(cones))


def _cone(
    problem: Any, piece: Hashable, y: Array, p: float, lines: Array, tolerance: float
) -> TangentCone | None:
    """The tangents into a piece with several tangent lines (n + 1, k); None if less than two.

    Margins are taken as smooth.
    """
    near = near_zero(problem, piece, y, p, tolerance)
    step = 1e-6 * max(1.0, float(np.abs(y).max(initial=0)))
    there, behind = (
        np.array([problem.margins(piece, y + h * line[:-1], p + h * line[-1])[near]
                  for line in lines.T])
        for h in (step, -step)
    )  # fmt: skip
    conditions = ((there - behind) / (2 * step)).T
    edges, inside_all = edges_and_lines(conditions)
    if len(edges) + 2 * len(inside_all) < 2:
        return None
    weight = weight_of(problem, len(y))
    return TangentCone(name_of(piece), unit_rows(edges @ lines.T, weight),
                       unit_rows(inside_all @ lines.T, weight))  # fmt: skip


def _many_meet(problem: Any, y: Array, p: float, tolerance: float) -> bool:
    margins = problem.margins(problem.piece(y, p), y, p)
    return int((np.abs(margins) <= tolerance).sum()) > BORDERS


def _by_small_steps(
    problem: PathProblem, y: Array, p: float, tolerance: float, reason: str
) -> FirstOrder:
    """One tangent per sense of the parameter: that of the piece in which Newton steps end."""
    weight = weight_of(problem, len(y))
    found = []
    for sense in (1.0, -1.0):
        for step in SMALL:
            end = _solution_near(problem, y, p + sense * step)
            if end is None:
                continue
            piece: Any = problem.piece(end, p + sense * step)
            lines = kernel(*problem.jacobian_of(piece, y, p), weight)
            if lines.shape[1] != 1:
                continue
            line = lines[:, 0] * (sense if lines[-1, 0] > 0 else -sense)
            inward = inside(problem, piece, y, p, line[:-1], float(line[-1]), tolerance)
            if inward is not None:
                found.append(Tangent(line[:-1], float(line[-1]), name_of(piece), inward))
                break
    tangents = merged(problem, y, p, found, tolerance)
    return FirstOrder(tangents, (), False, f"{reason}: one way on per sense")


def _solution_near(problem: PathProblem, y: Array, p: float) -> Array | None:
    """A solution at p by Newton steps from y, else as the problem finds one."""
    end = corrected(problem, y, p)
    find = getattr(problem, "found_at", None)
    if end is not None or find is None:
        return end
    try:
        return np.array(find(p))
    except NotConverged:
        return None


def orientation(problem: PathProblem, y: Array, p: float, rate: float) -> int:
    """sign(p') sign(det J_y): the same all along a curve; 0 where it is not defined."""
    J, _ = problem.jacobian(y, p)
    return int(np.sign(rate)) * determinant_sign(J)


def kernel(J: Any, Jp: Array, weight: float, singular: float = SINGULAR) -> Array:
    """Orthonormal columns (n + 1, k), in the weighted norm, with J y' + Jp p' = 0."""
    if not isinstance(J, np.ndarray):
        return sparse_kernel(J, Jp, weight, singular)
    root = np.sqrt(weight)
    full = np.column_stack([J / root, Jp])
    size = np.linalg.norm(full, axis=1)
    floor = 1e-8 * max(1.0, float(size.max(initial=0.0)))  # a row of rounding stays small
    _, values, right = linalg.svd(full / np.maximum(size, floor)[:, None])
    lines = right[int((values > singular * max(1.0, float(values[0]))).sum()) :].T.copy()
    lines[:-1] /= root
    return lines


# ------------------------------------------------------------------ friction in 2D, reduced
def _friction(path: FrictionPath, y: Array, p: float, tolerance: float) -> FirstOrder:
    """Enumerates the statuses of the contacts at a border only, the others eliminated once."""
    choices = path.choices(y, p, tolerance)
    count = _combinations(choices)
    rest = resting(path, choices)
    if count > COMBINATIONS and path.start.dimension == 2 and not path.tresca:
        found = _by_search(path, y, p, tolerance)
        if found is not None:
            return found
    turning = path.start.dimension == 3 and not all(path.frictionless[rest])
    if rest and (count > COMBINATIONS or turning):
        count = _combinations([c for i, c in enumerate(choices) if i not in rest])
        if count <= COMBINATIONS:
            return _from_rest(path, y, p, tolerance, choices, rest)
    if count > COMBINATIONS:
        return _by_small_steps(path, y, p, tolerance, f"{count:.3g} pieces meet at this point")
    if path.start.dimension == 3 or path.tresca:
        return first_order(path, y, p, tolerance=tolerance, pieces=path.pieces(y, p, tolerance))
    at_border = [i for i, c in enumerate(choices) if len(c) > 1]
    basis = _others_eliminated(path, y, p, choices, at_border)
    local = _LocalPieces(path, y, p, basis, at_border, [choices[i] for i in at_border])
    found, sets = local.search()
    letters = [c[0] for c in choices]

    def name(word: Sequence[str]) -> str:
        for i, letter in zip(at_border, word, strict=True):
            letters[i] = letter
        return "".join(letters)

    weight = weight_of(path, len(y))
    tangents = []
    for word, c, strict in found:
        whole = basis @ c
        whole /= np.sqrt(weight * whole[:-1] @ whole[:-1] + whole[-1] ** 2)
        tangents.append(Tangent(whole[:-1], float(whole[-1]), name(word), strict))
    kept = merged(path, y, p, tangents, tolerance)
    cones = [
        TangentCone(name(word), *(unit_rows(rows @ basis.T, weight) for rows in parts))
        for word, parts in sets
    ]
    return _first_order(kept, cones)


def _by_search(path: FrictionPath, y: Array, p: float, tolerance: float) -> FirstOrder | None:
    """All tangents by the search of `contact_rates`; None where it comes to no end."""
    try:
        rates = contact_rates(path, y, p, tolerance=tolerance)
    except SingularOperator:
        return None
    if rates.pairs + len(rates.zi) > SEARCHED:
        return None
    weight, tangents, reasons = weight_of(path, len(y)), [], []
    for sense in (1.0, -1.0):
        found, search = rates.tangents(sense, path.deadline, nodes=NODES)
        if search.sets or not search.finished:
            return None
        reasons += [] if search.complete else [search.reason]
        for change, piece in found:
            size = float(np.sqrt(weight * change @ change + 1.0))
            strict = inside(path, piece, y, p, change / size, sense / size, tolerance)
            tangents.append(Tangent(change / size, sense / size, piece, bool(strict)))
    if rates.existence is not Claim.PROVED:
        reasons.append("tangents along which the parameter stands still were not looked for")
    kept = merged(path, y, p, tangents, tolerance)
    return FirstOrder(kept, (), not reasons, "; ".join(dict.fromkeys(reasons)))


def _combinations(choices: Sequence[str]) -> float:
    return math.prod(float(len(c)) for c in choices)  # inf beyond floats, without a warning


def _from_rest(
    path: FrictionPath, y: Array, p: float, tolerance: float, choices: list[str],
    rest: list[int],
) -> FirstOrder:  # fmt: skip
    """One tangent per sense of the parameter where contacts are at rest, see `rest`."""
    weight = weight_of(path, len(y))
    found = []
    for piece, rates, sense in rates_from_rest(path, y, p, choices, rest):
        size = float(np.sqrt(weight * rates @ rates + 1.0))
        direction, rate = rates / size, sense / size
        inward = inside(path, piece, y, p, direction, rate, tolerance)
        if inward is not None:
            found.append(Tangent(direction, rate, piece, inward))
    return FirstOrder(merged(path, y, p, found, tolerance), (), False, REASON)


def _others_eliminated(
    path: FrictionPath, y: Array, p: float, choices: list[str], at_border: list[int]
) -> Array:
    """Columns: all (y', p') that obey the conditions of contacts inside of their piece."""
    first = "".join(c[0] for c in choices)
    J, Jp = path.jacobian_of(first, y, p)
    m = len(y)
    mine = np.zeros(m, dtype=bool)
    for i in at_border:
        mine[2 * i : 2 * i + 2] = True
    rows, rest = np.flatnonzero(~mine), np.flatnonzero(mine)
    basis = np.zeros((m + 1, len(rest) + 1))
    basis[rest, np.arange(len(rest))] = 1
    basis[m, -1] = 1
    if not len(rows):
        return basis
    right = np.column_stack([J[np.ix_(rows, rest)], Jp[rows]])
    try:
        basis[rows] = -np.linalg.solve(J[np.ix_(rows, rows)], right)
        if np.isfinite(basis).all() and np.abs(basis).max() < 1 / SINGULAR**0.8:
            return basis
    except np.linalg.LinAlgError:
        pass
    return linalg.null_space(np.column_stack([J, Jp])[rows], rcond=SINGULAR)


class _LocalPieces:
    """The pieces at a point, in coordinates c of what the other contacts allow."""

    def __init__(
        self, path: FrictionPath, y: Array, p: float, basis: Array, contacts: list[int],
        choices: list[str],
    ) -> None:  # fmt: skip
        self.choices = choices
        self.count = basis.shape[1]
        W, mu = path.W, path.coefficient(p)
        self.equations: list[dict[str, Array]] = []
        self.conditions: list[dict[str, Array]] = []
        for i, letters in zip(contacts, choices, strict=True):
            N, T = 2 * i, 2 * i + 1
            u_N = W[N] @ basis[:-1] + path.q1[N] * basis[-1]
            u_T = W[T] @ basis[:-1] + path.q1[T] * basis[-1]
            r_N, r_T = basis[N], basis[T]
            bound = mu[i] * r_N + path.c1[i] * y[N] * basis[-1]
            sign = 1.0 if "+" in letters else -1.0
            both = "+" in letters and "-" in letters
            grazing = "f" in letters
            stick = [bound - sign * r_T] + ([bound + sign * r_T] if both else [])
            equations = {"f": [r_N, r_T], "s": [u_N, u_T]}
            conditions: dict[str, list[Array]] = {"f": [u_N], "s": stick}
            for letter, s in (("+", 1.0), ("-", -1.0)):
                equations[letter] = [u_N, r_T - s * bound]
                moving = "s" in letters
                conditions[letter] = [-s * u_T] * moving + [r_N] * grazing
            self.equations.append({k: _scaled(v) for k, v in equations.items()})
            self.conditions.append({k: _scaled(v) for k, v in conditions.items() if v})

    def search(self) -> tuple[list[tuple[tuple[str, ...], Array, bool]], Sets]:
        """(pattern, coordinates, strictly inside?) of all tangents; patterns with a set.

        Of a set, the edges and lines of its cone.
        """
        words = list(product(*self.choices))
        if not self.choices:
            found = [((), s * np.ones(1), True) for s in (1.0, -1.0)]
            if self.count == 1:
                return found, []
            return [], [((), edges_and_lines(np.zeros((0, self.count))))]
        stacks = np.array([
            np.vstack([rows[letter] for rows, letter in zip(self.equations, word, strict=True)])
            for word in words
        ])  # fmt: skip
        _, values, right = np.linalg.svd(stacks)
        rank = (values > SINGULAR * np.maximum(values[:, :1], 1e-300)).sum(axis=1)
        found, sets = [], []
        for k, word in enumerate(words):
            inside = [
                rows[letter]
                for rows, letter in zip(self.conditions, word, strict=True)
                if letter in rows
            ]
            conditions = np.vstack(inside) if inside else np.zeros((0, self.count))
            if rank[k] < self.count - 1:
                lines = right[k, rank[k] :]
                parts = tuple(rows @ lines for rows in edges_and_lines(conditions @ lines.T))
                if len(parts[0]) + 2 * len(parts[1]) > 1:
                    sets.append((word, parts))
                continue
            c = right[k, -1]
            rates = conditions @ c
            for s in (1.0, -1.0):
                if (s * rates >= -INWARD).all():
                    found.append((word, s * c, bool((s * rates > INWARD).all())))
        return found, sets


def _scaled(rows: list[Array]) -> Array:
    """Rows of length 1, where they are not zero."""
    stack = np.array(rows)
    size = np.linalg.norm(stack, axis=1)
    return stack / np.where(size > 1e-12, size, 1.0)[:, None]
