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

from ...core.errors import InvalidInput
from ...core.faces import Told
from .sliding import SlidingState, factor

if TYPE_CHECKING:
    from .coalescence import Flutter

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
DENSE = 400  # unknowns up to which all modes are found at once
GROWING = 1e-7  # Re s, relative to |s|, above which a mode grows: rounding splits double ones
SAME = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class Modes(Told):
    """Modes by |s|: s (k,), complex, of a pair the one with Im s >= 0; shapes (n, k).

    shapes are those of the unknowns v, of length 1; state: what they are modes of.
    """

    s: Complex
    shapes: Complex
    state: SlidingState = field(repr=False)
    spread: Any = field(default=None, repr=False)  # unknowns to bodies, of a model

    @property
    def frequency(self) -> Array:
        """|Im s| / 2 pi, (k,), per unit of time."""
        return np.abs(self.s.imag) / (2 * np.pi)

    @property
    def damping(self) -> Array:
        """-Re s / |s|, (k,): negative for modes that grow."""
        size = np.abs(self.s)
        return -self.s.real / np.where(size > 0, size, 1.0)

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
        if self.spread is None:
            raise InvalidInput("modes: a discrete problem has no bodies; see shapes")
        return self.spread(self.shapes[:, k])

    def flutter(self, most: int = 5) -> tuple[Flutter, ...]:
        """Frictions at which two modes meet and begin to grow, ascending; see `coalescence`."""
        from .coalescence import flutter_points

        return flutter_points(self.state, len(self.s), most)

    @cached_property
    def divergence(self) -> Array:
        """Frictions > 0 at which the state loses its static stability, ascending, (k,)."""
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
    state: SlidingState, count: int = 10, near: float = 0.0, spread: Any = None
) -> Modes:
    """`count` modes nearest to a frequency, per unit of time; 0: the slowest."""
    if not count >= 1:
        raise InvalidInput(f"count: expected a number >= 1, got {count!r}")
    if not (np.isfinite(near) and near >= 0):
        raise InvalidInput(f"near: expected a frequency >= 0, got {near!r}")
    if state.K.shape[0] <= DENSE:
        s, shapes = _all(state)
    else:
        s, shapes = _some(state, count, near)
    keep = s.imag >= -SAME * np.maximum(np.abs(s), 1e-300)
    s, shapes = s[keep], shapes[:, keep]
    order = np.argsort(np.abs(s - 2j * np.pi * near), kind="stable")[:count]
    order = order[np.argsort(np.abs(s[order]), kind="stable")]
    s, shapes = s[order], shapes[:, order]
    return Modes(s, shapes / np.linalg.norm(shapes, axis=0), state, spread)


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
    if not C.any():
        values, shapes = linalg.eig(K, M)  # of -s^2
        finite = np.isfinite(values)
        root = 1j * np.sqrt(values[finite].astype(complex))
        root = np.where(np.abs(root.imag) <= 1e-14 * np.abs(root), root.real + 0j, root)
        both = np.concatenate([root, -root])
        return both, np.tile(V @ shapes[:, finite], (1, 2))
    n = len(K)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-K, -C]])
    B = linalg.block_diag(np.eye(n), M)
    values, shapes = linalg.eig(A, B)
    finite = np.isfinite(values)
    return values[finite], V @ shapes[:n, finite]


def _some(state: SlidingState, count: int, near: float) -> tuple[Complex, Complex]:
    from scipy.sparse.linalg import LinearOperator, eigs

    n, whole = state.K.shape[0], state.size
    K, M = state.stiffness(), state.wide(state.M)
    start = np.cos(np.arange(1.0, whole + 1.0))
    shift = 2j * np.pi * near
    wanted = min(2 * count + 4, n - 2)
    if state.C is None:
        sigma = float((-(shift**2)).real)
        solve = factor(sparse.csc_array(K - sigma * M) if sigma else K).solve
        inverse = LinearOperator((whole, whole), lambda x: solve(M @ x), dtype=float)  # type: ignore[call-arg]
        values, shapes = eigs(inverse, k=wanted, v0=solve(M @ start), tol=0)
        root = 1j * np.sqrt((sigma + 1 / values).astype(complex))
        both = np.concatenate([root, -root])
        return both, np.tile(shapes[:n], (1, 2))
    C = state.wide(state.C)
    Q = factor(sparse.csc_array(K + shift * C + shift**2 * M).astype(complex))

    def apply(x: Any) -> Any:
        a, b = x[:whole], x[whole:]
        first = Q.solve(-(M @ b + C @ a + shift * (M @ a)).astype(complex))
        return np.concatenate([first, a + shift * first])

    size = 2 * whole
    inverse = LinearOperator((size, size), apply, dtype=complex)  # type: ignore[call-arg]
    begin = apply(np.tile(start, 2).astype(complex))
    values, shapes = eigs(inverse, k=wanted, v0=begin, tol=0)
    return shift + 1 / values, shapes[:n]
