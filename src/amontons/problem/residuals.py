"""What judges a state of a problem: the exact measure in the Delassus form, else residuals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..linear.blocks import kernel_rows
from .judge import measures as judge

if TYPE_CHECKING:
    from .equations import Equations

Array = NDArray[np.float64]


def exact(problem: Equations, r: Array) -> float:
    """The exact measure of the Delassus form, of reactions r (nc, d)."""
    rows = kernel_rows(r)
    if problem.q_norm == 0:
        return 0.0 if not rows.any() else np.inf
    return judge.natural_error(*problem.product_data, rows) / problem.q_norm


@np.errstate(over="ignore", invalid="ignore")
def residual(problem: Equations, r: Array, v: Array) -> float:
    """The largest of what balance, law and loose bodies miss, of r (nc, d) and v (n,)."""
    motion = kernel_rows(r), kernel_rows(problem.local_velocity(v))
    law = np.inf
    if all(np.isfinite(part).all() for part in motion):
        numbers = problem.law.kind, problem.law.parameters, problem.rho
        law = judge.error_of_motion(*numbers, *motion)
    error = max(problem.imbalance(r, v), judge.ratio(law, problem.scales[1]),
                unbalanced(problem, r))  # fmt: skip
    return float(error) if np.isfinite(error) else np.inf


def unbalanced(problem: Equations, r: Array) -> float:
    """Largest force that moves a loose body as a whole, relative to those on it.

    A loose body is one that contact alone holds; 0 where there is none, and in the Delassus
    form, which has none.
    """
    modes = problem.loose_modes
    if modes.shape[1]:
        modes = problem.matrices.balanced_modes
    if modes.shape[1] == 0:
        return 0.0
    assert problem.f is not None and problem.H is not None
    load = modes.T @ problem.f
    pushes = (problem.H.T @ modes).reshape(*r.shape, modes.shape[1]) * r[:, :, None]
    least = judge.FLOOR * judge.EPSILON * (np.abs(modes).T @ np.abs(problem.f))
    size = np.abs(load) + np.abs(pushes).sum(axis=(0, 1)) + least
    rest = np.abs(load + pushes.sum(axis=(0, 1)))
    return float(np.divide(rest, size, out=np.zeros_like(rest), where=size > 0).max())
