"""The law of ties in `current`, rho (s + C lambda): neither do they part nor slip."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .current import ContactPoint

Array = NDArray[np.float64]


def gives(point: ContactPoint) -> Array:
    """C in global axes, (nc, d, d)."""
    (nc, d), give = point.n.shape, point.contact.law.give
    if give is None:
        return np.zeros((nc, d, d))
    across = np.eye(d) - point.n[:, :, None] * point.n[:, None, :]
    along = point.n[:, :, None] * point.n[:, None, :]
    return give[:, 0, None, None] * along + give[:, 1, None, None] * across


def tie_inplace(
    point: ContactPoint, by_force: Array, by_normal: Array, by_gap: Array, by_motion: Array
) -> None:
    """Put the partials of ties in their places."""
    tied, give, d = point.tied, point.contact.law.give, point.n.shape[1]
    rho, n, force = point.contact.rho[tied], point.n[tied], point.force[tied]
    by_force[tied] = rho[:, None, None] * gives(point)[tied]
    by_motion[tied] = rho[:, None, None] * np.eye(d)
    by_gap[tied] = by_normal[tied] = 0.0
    if give is None:
        return
    more = rho * (give[tied, 0] - give[tied, 1])
    turned = (n * force).sum(axis=1)[:, None, None] * np.eye(d)
    by_normal[tied] = more[:, None, None] * (turned + n[:, :, None] * force[:, None, :])
