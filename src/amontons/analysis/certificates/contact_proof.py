"""Multipliers of every contact, and the rounding-safe proof of what they say.

With tau, sigma, alpha > 0 and f of every contact, A = sym(D W), D_i = [[tau, 0], [f, sigma I]]
in rows N, T, and t B = sum t shape sigma / 2 (alpha dr_N^2 + |du_T|^2 / alpha), every load has
one solution at friction t shape where A - t B is positive definite (`contact_multipliers`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dsyrk

from ..multipliers.rounding import EPSILON, is_positive_definite, unit_scale
from .pencil import symmetrised

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ContactMultipliers:
    """At friction t shape every load has one solution, t = 0 without a proof.

    tau, sigma, alpha (k,), f (k, d - 1): the multipliers that prove it; 1 and 0 for contacts
    that can not react.  expected: t of them in floating point, before the proof.
    """

    t: float
    tau: Array
    sigma: Array
    alpha: Array
    f: Array
    expected: float = 0.0

    def unscaled(self, scale: Array) -> ContactMultipliers:
        """In units in which reactions are divided by scale (k d,), one number per contact."""
        return replace(self, alpha=self.alpha * scale[:: len(scale) // len(self.tau)] ** 2)


def holds(W: Array, shape: Array, t: float, by: ContactMultipliers) -> bool:
    """True when A - t B is positive definite, rounding included.

    W (k d, k d) and multipliers as given, all contacts reacting.
    """
    k = len(shape)
    d = len(W) // k
    if not (np.isfinite(t) and min(x.min() for x in (by.tau, by.sigma, by.alpha)) > 0):
        return False
    normal = d * np.arange(k)
    tangent = (normal[:, None] + np.arange(1, d)).ravel()
    D = np.empty(len(W))
    D[normal], D[tangent] = by.tau, by.sigma.repeat(d - 1)
    f = by.f.ravel()
    weight = (0.5 * t * shape * by.sigma / by.alpha).repeat(d - 1)
    at_normal = 0.5 * t * shape * by.sigma * by.alpha
    M = D[:, None] * W
    M[tangent] += f[:, None] * W[normal.repeat(d - 1)]
    rows = np.sqrt(weight)[:, None] * W[tangent]
    # M.T is M, and its lower half is all that counts from here on
    M = dsyrk(-1.0, rows.T, 1.0, symmetrised(M).T, lower=True, overwrite_c=True)
    M[normal, normal] -= at_normal
    scale = unit_scale(M)
    # sums of the rows of the terms' sizes, of which the rounding of an entry is a part
    ones, size = scale, np.abs(W)
    turned = D * ones
    turned[normal] += (np.abs(f) * ones[tangent]).reshape(k, -1).sum(axis=1)
    spread = size @ ones
    from_normal = np.abs(f) * spread[normal.repeat(d - 1)]
    spread = D * spread
    spread[tangent] += from_normal
    spread = (spread + size.T @ turned) / 2
    size = size[tangent]
    spread += size.T @ (weight * (size @ ones))
    spread[normal] += at_normal * ones[normal]
    rounding = (len(W) + 16) * EPSILON * float((spread * scale).max())
    M *= scale[:, None]
    M *= scale
    return is_positive_definite(M, rounding / len(W))
