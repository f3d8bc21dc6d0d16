"""Complex modes v e^(s t) of small motions about a sliding state, and what they say.

    (s^2 M + s C + K) v = F r,    B v + D r = 0                       (see `sliding`)

Small problems: all modes of the pencil projected onto the motions that B allows, tested with
those on which F does no work.  Others: the modes nearest to a frequency by ARPACK with the
inverse of the shifted matrix ("shift-invert") of the whole, sparse system; constraints have
infinite s, which the inverse maps to zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from ...core.arrays import number, whole
from ...core.errors import InvalidInput
from ...core.faces import Shown
from ...mechanics.model.fields import by_body
from .sliding import SlidingState, factor

if TYPE_CHECKING:
    from ...mechanics.model import Model
    from .coalescence import FlutterPoints

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
DENSE = 400  # unknowns up to which all modes are found at once
GROWING = 1e-7  # Re s, relative to |s|, above which a mode grows: rounding splits double ones
SAME = 1e-6
HELD = 1e-6  # part of B v, relative, that rounding may leave


@dataclass(frozen=True, eq=False, repr=False)
class Modes(Shown):
    """Modes by |s|: s (k,), complex, of a pair the one with Im s >= 0; shapes (n, k).

    shapes are those of the unknowns v, of length 1; state: what they are modes of.
    """

    s: Complex
    shapes: Complex
    state: SlidingState = field(repr=False)
    model: Model | None = field(default=None, repr=False)

    @property
    def frequency(self) -> Array:
        """|Im s| / 2 pi, (k,), per unit of time."""
        return np.abs(self.s.imag) / (2 * np.pi)

    @property
    def damping(self) -> Array:
        """-Re s / |s|, (k,): negative for modes that grow."""
        size = np.abs(self.s)
        return 0.0 - self.s.real / np.where(size > 0, size, 1.0)

    @property
    def growing(self) -> NDArray[np.int64]:
        """Modes that grow: flutter where they swing, divergence where they do not."""
        size = np.maximum(np.abs(self.s), SAME * np.abs(self.s).max(initial=0.0))
        return np.flatnonzero(self.s.real > GROWING * size)

    @property
    def stable(self) -> bool:
        """Whether none of the modes found grows."""
        return not len(self.growing)

    def displacement(self, k: int) -> tuple[Complex, ...]:
        """Shape of mode k on the bodies of a model, (nodes, dim) each, complex."""
        if self.model is None:
            raise InvalidInput("modes: a discrete problem has no bodies; see shapes")
        parts = self.model.discretisation
        parts_of = [
            by_body(self.model.bodies, parts, parts.spread(x, np.zeros(parts.dofs)))
            for x in (self.shapes[:, k].real, self.shapes[:, k].imag)
        ]
        return tuple(a + 1j * b for a, b in zip(*parts_of, strict=True))

    def flutter(self, most: int = 3) -> FlutterPoints:
        """Frictions at which two modes meet and begin to grow, ascending; see `coalescence`.

        Statuses are those of this state, whatever the friction; where contacts would open or
        stick before, ask again at that friction.  Damping is left out.  `warnings` of the
        tuple name points that seem to be there and were not found.
        """
        from .coalescence import flutter_points

        return flutter_points(self.state, len(self.s), most)

    @cached_property
    def divergence(self) -> Array:
        """Frictions > 0 at which the state loses static stability, ascending, (k,)."""
        from .coalescence import divergence_points

        return divergence_points(self.state)

    @property
    def record(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "stable": self.stable, "friction": self.state.mu, "sliding": self.state.sliding,
            "modes": [
                {"real": float(s.real), "imaginary": float(s.imag), "frequency": float(f),
                 "damping": float(c)}
                for s, f, c in zip(self.s, self.frequency, self.damping, strict=True)
            ],
        }  # fmt: skip

    def __str__(self) -> str:
        lines = [
            f"{len(self.s)} modes about a state of {self.state.sliding} sliding contacts: "
            + ("none grows" if self.stable else f"{len(self.growing)} grow")
        ]
        for k, s in enumerate(self.s):
            word = "" if k not in self.growing else (
                "  grows: flutter" if s.imag > SAME * abs(s) else "  grows: divergence"
            )  # fmt: skip
            lines.append(f"{k}: frequency {self.frequency[k]:.8g}, damping "
                         f"{self.damping[k]:+.3e}{word}")  # fmt: skip
        return "\n".join(lines)


def modes_of(
    state: SlidingState, count: int = 10, near: float = 0.0, model: Model | None = None
) -> Modes:
    """`count` modes nearest to a frequency, per unit of time; 0: the slowest."""
    count, near = whole("count", count, least=1), number("near", near, least=0.0)
    if state.K.shape[0] <= DENSE:
        s, shapes = _all(state)
    else:
        s, shapes = _some(state, count, near)
    keep = s.imag >= -SAME * np.maximum(np.abs(s), 1e-300)
    s, shapes = s[keep], shapes[:, keep]
    order = np.argsort(np.abs(s - 2j * np.pi * near), kind="stable")[:count]
    size = np.abs(s[order])
    order = order[np.lexsort((s[order].real, np.round(size / size.max(initial=1e-300), 9)))]
    s, shapes = s[order], shapes[:, order]
    return Modes(s, shapes / np.linalg.norm(shapes, axis=0), state, model)


def projected(state: SlidingState, p: float = 1.0) -> tuple[Array, Array, Array, Array]:
    """(K, C, M, V) dense: tested with W, F^T W = 0, on the motions V, B V = 0; D as springs."""
    F, B, D = (state.F_0 + p * state.F_1).toarray(), state.B.toarray(), state.D.diagonal()
    K, M = state.K.toarray(), state.M.toarray()
    C = np.zeros_like(K) if state.C is None else state.C.toarray()
    soft = D > 0
    if soft.any():  # r = -B v / D
        K = K + (F[:, soft] / D[soft]) @ B[soft]
    F, B = F[:, ~soft], B[~soft]
    if not B.shape[0]:
        eye = np.eye(len(K))
        return K, C, M, eye
    V, W = linalg.null_space(B), linalg.null_space(F.T)
    return W.T @ K @ V, W.T @ C @ V, W.T @ M @ V, V


def _all(state: SlidingState) -> tuple[Complex, Complex]:
    K, C, M, V = projected(state)
    unit = _unit(state)
    C, M = unit * C, unit**2 * M
    if not C.any():
        pairs: Any = linalg.eig(K, M)  # of -s^2
        values, shapes = pairs
        finite = np.isfinite(values)
        root = 1j * np.sqrt(values[finite].astype(complex))
        root = np.where(np.abs(root.imag) <= 1e-14 * np.abs(root), root.real + 0j, root)
        both: Any = unit * np.concatenate([root, -root])
        return both, np.tile(V @ shapes[:, finite], (1, 2))
    K, M = K / state.scale, M / state.scale
    C = C / state.scale
    n = len(K)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-K, -C]])
    B = linalg.block_diag(np.eye(n), M)
    pairs = linalg.eig(A, B)
    values, shapes = pairs
    finite = np.isfinite(values)
    return unit * values[finite], V @ shapes[:n, finite]


def _some(state: SlidingState, count: int, near: float) -> tuple[Complex, Complex]:
    from scipy.sparse.linalg import LinearOperator, eigs

    n, whole = state.K.shape[0], state.size
    K, M = state.stiffness(), state.wide(state.M)
    unit = _unit(state)
    M = unit**2 * M
    start = np.cos(np.arange(1.0, whole + 1.0))
    shift = 2j * np.pi * near / unit
    wanted = min(2 * count + 4, n - 2)
    if state.C is None:
        sigma = float((-(shift**2)).real)
        solve = factor(sparse.csc_array(K - sigma * M) if sigma else K).solve
        inverse = LinearOperator((whole, whole), lambda x: solve(M @ x), dtype=float)  # type: ignore[call-arg]
        found: Any = eigs(inverse, k=wanted, v0=solve(M @ start), tol=0)
        values, x = found
        root = 1j * np.sqrt((sigma + 1 / values).astype(complex))
        held = _held(state, K, x)
        both: Any = unit * np.concatenate([root, -root])
        return both[np.tile(held, 2)], np.tile(x[:n, held], 2).astype(complex)
    C = unit * state.wide(state.C)
    shifted: Any = sparse.csc_array(K + shift * C + shift**2 * M).astype(complex)
    Q = factor(shifted)

    def apply(y: Any) -> Any:
        a, b = y[:whole], y[whole:]
        first = Q.solve(-(M @ b + C @ a + shift * (M @ a)).astype(complex))
        return np.concatenate([first, a + shift * first])

    size = 2 * whole
    inverse = LinearOperator((size, size), apply, dtype=complex)  # type: ignore[call-arg]
    begin = apply(apply(np.tile(start, 2).astype(complex)))
    found = eigs(inverse, k=wanted, v0=begin, tol=0)
    values, y = found
    held = _held(state, K, y[:whole])
    return unit * (shift + 1 / values[held]), y[:n, held]


def _unit(state: SlidingState) -> float:
    """A typical |s|, by which all are divided."""
    return float(np.sqrt(state.scale / np.abs(state.M.diagonal()).mean()))


def _held(state: SlidingState, K: sparse.csc_array, x: Complex) -> NDArray[np.bool_]:
    """Which vectors (n + k, m) obey B v + D r = 0: those of infinite s do not."""
    n = state.K.shape[0]
    rest = np.linalg.norm(K[n:] @ x, axis=0)
    return np.asarray(rest <= HELD * state.scale * np.linalg.norm(x[:n], axis=0))
