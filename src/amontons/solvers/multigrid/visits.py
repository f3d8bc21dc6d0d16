"""Visits of contacts at nodes of a mesh, each solved exactly given all else (`nodes`)."""

from __future__ import annotations

import numpy as np
from numba import uint64

from ...core.compiled import njit
from ...linear.block_products import product_of_blocks, product_of_blocks_back
from ...problem.law.law import BOUND, TRESCA
from ...problem.law.single import solve_contact
from ...problem.law.states import OPEN, SLIP, STICK

CLOSED = 3  # is added to the status of the tangential motion: a state is from 0 to 5


@njit(cache=True, error_model="numpy", nogil=True)
def sweep_contacts(begin, end, indptr, indices, data, node, H, inverse, compliance, w,
                   kind, parameters, f, x, r, u, state, backward):  # noqa: PLR0913 # fmt: skip
    """Solve the contacts of a chunk once in turn, see `ContactNodes.sweep`."""
    y, b = np.empty(3), np.empty(3)
    for step in range(end - begin):
        c = end - 1 - step if backward else begin + step
        p = node[c]
        first, last = uint64(indptr[c]), uint64(indptr[c + 1])
        if backward:
            s0, s1, s2 = product_of_blocks_back(data, indices, x, first, last)
        else:
            s0, s1, s2 = product_of_blocks(data, indices, x, first, last, last)
        g0, g1, g2 = f[p, 0] - s0, f[p, 1] - s1, f[p, 2] - s2
        for i in range(3):
            y[i] = x[p, i] + (
                inverse[c, i, 0] * g0 + inverse[c, i, 1] * g1 + inverse[c, i, 2] * g2
            )
        for i in range(3):
            b[i] = w[c, i] + H[c, 0, i] * y[0] + H[c, 1, i] * y[1] + H[c, 2, i] * y[2]
        r0, r1, r2, status = solve_contact(
            compliance[c], b[0], b[1], b[2], kind[c], parameters[c], r[c, 1], r[c, 2]
        )
        state[c] = _code(status, r1, r2, kind[c], parameters[c, BOUND])
        r[c, 0], r[c, 1], r[c, 2] = r0, r1, r2
        g0 = H[c, 0, 0] * r0 + H[c, 0, 1] * r1 + H[c, 0, 2] * r2
        g1 = H[c, 1, 0] * r0 + H[c, 1, 1] * r1 + H[c, 1, 2] * r2
        g2 = H[c, 2, 0] * r0 + H[c, 2, 1] * r1 + H[c, 2, 2] * r2
        for i in range(3):
            x[p, i] = y[i] + (
                inverse[c, i, 0] * g0 + inverse[c, i, 1] * g1 + inverse[c, i, 2] * g2
            )
            u[c, i] = b[i] + (
                compliance[c, i, 0] * r0 + compliance[c, i, 1] * r1 + compliance[c, i, 2] * r2
            )


@njit(cache=True, error_model="numpy")
def _code(status, r1, r2, kind, bound):
    """The state as one number."""
    if status != OPEN:
        return CLOSED + status
    if kind != TRESCA or bound == 0.0:
        return OPEN
    return SLIP if r1 * r1 + r2 * r2 >= 0.999999 * bound * bound else STICK
