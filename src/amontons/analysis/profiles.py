"""Performance profiles: how often is a method within a factor of the best one.

[DM] E. D. Dolan, J. J. Moré, "Benchmarking optimization software with performance profiles",
Mathematical Programming 91 (2002).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.arrays import real
from ..core.errors import InvalidInput

Array = NDArray[np.float64]


def performance_profile(times: ArrayLike) -> tuple[Array, Array]:
    """Factors tau (k,), growing from 1, and shares rho (methods, k) solved within them.

    times (problems, methods) > 0; infinity or NaN is a failure.  rho[s, j] is the share of all
    problems that method s solves within tau[j] times the best time, [DM] eq. (2.1).  A problem
    that no method solves counts against all.

    >>> tau, rho = performance_profile([[1.0, 2.0], [3.0, 1.0]])
    >>> tau.tolist(), rho.tolist()
    ([1.0, 2.0, 3.0], [[0.5, 0.5, 1.0], [0.5, 1.0, 1.0]])
    """
    if any(value is None for value in np.ravel(np.asarray(times, dtype=object))):
        raise InvalidInput(
            "times: expected numbers, got None, as the record of a method that does not count "
            "its operations (`Convergence.flops`) has it; compare seconds, or leave it out"
        )
    table = real("times", times)
    if table.ndim != 2 or not table.size:
        raise InvalidInput(f"times: expected shape (problems, methods), got {table.shape}")
    if (table <= 0).any():
        raise InvalidInput(f"times: expected numbers > 0, got {np.nanmin(table)}")
    failed = ~np.isfinite(table)
    best = np.where(failed, np.inf, table).min(axis=1)
    with np.errstate(invalid="ignore"):
        ratio = np.where(failed, np.inf, table / best[:, None])
    tau = np.unique(np.append(ratio[np.isfinite(ratio)], 1.0))
    return tau, (ratio[:, :, None] <= tau).mean(axis=0)
