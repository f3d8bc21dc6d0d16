"""Small motions about a state that slides: M v'' + C v' + K v = F(mu) r,  B v + D r = 0.

Statuses are kept: open contacts have r = 0, sticking ones move with their support, sliding ones
keep u_N = 0 and a friction force that follows the pressure against the slip t = u_T / |u_T|,

    columns of F:   H_N - mu H_T t  (sliding),   H_N, H_T  (sticking)
    rows of B:      H_N^T                        H_N^T, H_T^T

D holds the compliance of contacts that give way, else 0.  That F and B^T differ makes the modes
of an undamped body complex: flutter ([HFAG]).  Under a given bound (Tresca's law, a cap) the
force does not follow and F has H_N alone.  In 3D slip may turn: with the speed V of the sliding
that takes (mu r_N / V) (1 - t t^T) of damping, which C gets where V is told.

[HFAG] N. Hoffmann, M. Fischer, R. Allgaier, L. Gaul, "A minimal model for studying properties
of the mode-coupling type instability in friction induced oscillations", Mech. Res. Commun. 29
(2002) 197-205.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, SingularOperator
from ...linear import Direct
from ...problem.law.law import MU
from ...problem.law.states import ContactStatus
from ..gradients.linearised import Linearised

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SlidingState:
    """M, C, K (n, n); F_0 + p F_1 (n, k), B (k, n), D (k, k): p = 1 is the friction given.

    mu: the largest coefficient of contacts that slide, so that p mu is that over all p.
    """

    M: sparse.csc_array
    C: sparse.csc_array | None
    K: sparse.csc_array
    F_0: sparse.csc_array
    F_1: sparse.csc_array
    B: sparse.csr_array
    D: sparse.csc_array
    mu: float
    sliding: int

    @classmethod
    def of(
        cls, at: Linearised, M: Any, C: Any = None, *, toward: Array | None = None,
        speed: float | None = None,
    ) -> SlidingState:  # fmt: skip
        """About a solution in global form; M (n, n), C (n, n) or None.

        toward (nc, d - 1): t of the contacts that slide, by default that of the solution;
        speed: V, of a length per time.
        """
        p, solution = at.problem.assembled(), at.solution
        d, law, H = p.dimension, p.law, sparse.csc_array(p.H)
        closed = (solution.status != ContactStatus.OPEN) | law.tied
        slides = closed & solution.sliding & ~law.tied
        t = at.slope if toward is None else np.where(slides[:, None], toward, 0.0)
        s = law.pressed(solution.r)
        mu = np.where(slides & ~law.plain.given(s), law.plain.parameters[:, MU], 0.0)
        kept = np.tile((closed & ~slides)[:, None], (1, d))
        kept[:, 0] = closed
        columns = np.flatnonzero(kept.ravel())
        place = {int(c): k for k, c in enumerate(columns)}
        rows: list[int] = []
        entries: list[float] = []
        where: list[int] = []
        for i in np.flatnonzero(mu > 0):
            for k in range(d - 1):
                rows.append(int(i) * d + 1 + k)
                where.append(place[int(i) * d])
                entries.append(-float(mu[i] * t[i, k]))
        turn = sparse.coo_array((entries, (rows, where)), shape=(H.shape[1], len(columns)))
        give = np.zeros(p.contacts * d) if law.give is None else law.give[:, :d].ravel()
        F_0 = sparse.csc_array(H[:, columns])
        if speed is not None and d == 3:
            C = _with_turning(C, H, at.problem.law.bound(solution.r), t, slides, speed)
        return cls(
            sparse.csc_array(M), None if C is None else sparse.csc_array(C),
            sparse.csc_array(p.M), F_0, sparse.csc_array(H @ turn.tocsc()),
            sparse.csr_array(F_0.T), sparse.csc_array(sparse.diags_array(give[columns])),
            float(mu.max(initial=0.0)), int(slides.sum()),
        )  # fmt: skip

    @property
    def size(self) -> int:
        """n + k."""
        return self.K.shape[0] + self.B.shape[0]

    @cached_property
    def scale(self) -> float:
        """A typical entry of K: r and the rows of B are scaled by it, or B v would be noise."""
        return float(np.abs(self.K.diagonal()).mean()) or 1.0

    def stiffness(self, p: float = 1.0) -> sparse.csc_array:
        """[[K, -F_0 - p F_1], [B, D]], the rows of B and r scaled."""
        a = self.scale
        F = -a * (self.F_0 + p * self.F_1)
        return sparse.csc_array(
            sparse.block_array([[self.K, F], [a * self.B, a * a * self.D]])
        )

    @property
    def by_friction(self) -> sparse.csc_array:
        """The derivative of `stiffness` by p."""
        k = self.B.shape[0]
        zero, low = sparse.csc_array(self.K.shape), sparse.csc_array((k, self.K.shape[0]))
        none = sparse.csc_array((k, k))
        slope = -self.scale * self.F_1
        return sparse.csc_array(sparse.block_array([[zero, slope], [low, none]]))

    def wide(self, matrix: Any) -> sparse.csc_array:
        """A matrix (n, n) with rows and columns of zeros for r."""
        k = self.B.shape[0]
        return sparse.csc_array(sparse.block_diag([matrix, sparse.csc_array((k, k))]))


def _with_turning(
    C: Any, H: sparse.csc_array, bound: Array, t: Array, slides: Any, speed: float
) -> Any:
    """C with the damping of slip that turns."""
    if not speed > 0:
        raise InvalidInput(f"speed: expected a speed > 0, got {speed!r}")
    d = 3
    blocks = np.zeros((len(t), d, d))
    across = np.eye(2) - t[:, :, None] * t[:, None, :]
    blocks[:, 1:, 1:] = (np.where(slides, bound, 0.0) / speed)[:, None, None] * across
    index = np.arange(len(t) + 1)
    middle = sparse.bsr_array((blocks, index[:-1], index), shape=(len(t) * d,) * 2)
    more = H @ middle @ H.T
    return more if C is None else C + more


def factor(matrix: sparse.csc_array) -> Any:
    """An LU of a real or complex matrix; raises SingularOperator where it has none."""
    if not np.iscomplexobj(matrix.data):
        return Direct().factor(matrix)
    from scipy.sparse.linalg import splu

    try:
        return splu(matrix)
    except RuntimeError as reason:
        raise SingularOperator(f"modes: {reason}") from reason
