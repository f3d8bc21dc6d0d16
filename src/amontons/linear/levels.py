"""Prolongations between nested levels: checks, and from nodal values to free unknowns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.arrays import compressed, locked
from ..core.errors import InvalidInput, shown

Levels = tuple[sparse.csr_array, ...]
Mask = NDArray[np.bool_]
ONE = 1e-12  # distance from 1 of the entry of a fine node that is a coarse node


def checked_levels(levels: Sequence[sparse.csr_array], size: int) -> Levels:
    """Read-only CSR matrices that fit together, the first with `size` rows."""
    if not isinstance(levels, Sequence) or isinstance(levels, str):
        raise InvalidInput(f"levels: expected sparse matrices, got {shown(levels)}")
    out = []
    for k, level in enumerate(levels):
        if not sparse.issparse(level) or level.ndim != 2 or level.shape[0] != size:
            found = getattr(level, "shape", type(level).__name__)
            raise InvalidInput(
                f"levels[{k}]: expected a sparse matrix with {size} rows, got {found}"
            )
        level = compressed(f"levels[{k}]", level)
        if not _is_locked(level):
            level = locked(sparse.csr_array(level, dtype=float, copy=True))
        if level.shape[1] > size or not np.isfinite(level.data).all():
            raise InvalidInput(
                f"levels[{k}]: expected finite entries and at most {size} columns, got shape "
                f"{level.shape}"
            )
        out.append(level)
        size = level.shape[1]
    return tuple(out)


def _is_locked(level: sparse.csr_array) -> bool:
    """True for what nobody can change, so that it may be shared."""
    if not isinstance(level, sparse.csr_array) or level.dtype != float:
        return False
    arrays = (level.data, level.indices, level.indptr)
    return not any(array.flags.writeable for array in arrays)


def free_levels(
    bodies: Sequence[Levels], nodes: Sequence[int], dim: int, fixed: Mask
) -> Levels:
    """Prolongations of the free unknowns of several bodies, finest first.

    bodies: nodal levels of every body, () for a body without; nodes: its numbers of nodes.
    fixed, (dofs,), body by body and node by node: unknowns that supports prescribe; coarse ones
    that sit on them are left out too.  A body that has run out of levels keeps its unknowns
    while others coarsen.
    """
    out: list[sparse.csr_array] = []
    sizes = list(nodes)
    for depth in range(max((len(levels) for levels in bodies), default=0)):
        nodal = _nodal(bodies, sizes, depth)
        coarse_fixed = fixed.reshape(-1, dim)[fine_unknown(nodal)].ravel()
        if coarse_fixed.all():
            break
        level = sparse.kron(nodal, sparse.eye_array(dim), format="csr")
        out.append(sparse.csr_array(level[~fixed][:, ~coarse_fixed]))
        fixed = coarse_fixed
    return tuple(out)


def _nodal(bodies: Sequence[Levels], sizes: list[int], depth: int) -> sparse.csr_array:
    """Level `depth` of all bodies; sizes: their numbers of nodes there, then on the next."""
    parts: list[sparse.csr_array] = [
        levels[depth] if depth < len(levels) else sparse.csr_array(sparse.eye_array(size))
        for levels, size in zip(bodies, sizes, strict=True)
    ]
    sizes[:] = [part.shape[1] for part in parts]
    if len(parts) == 1:
        return parts[0]
    return sparse.csr_array(sparse.block_diag(parts, format="csr"))


def continued(
    bodies: Sequence[Levels], nodes: Sequence[int], values: NDArray[np.float64], fixed: Mask
) -> NDArray[np.float64]:
    """Prescribed values (dofs,) continued smoothly to the other dofs, through all levels.

    On the coarsest level they are zero elsewhere; every finer level interpolates and puts in
    what is prescribed there.  bodies, nodes and fixed as in `free_levels`.
    """
    sizes = list(nodes)
    dim = len(values) // max(sum(sizes), 1)
    shown = [(np.where(fixed, values, 0.0).reshape(-1, dim), fixed.reshape(-1, dim))]
    steps = []
    for depth in range(max((len(levels) for levels in bodies), default=0)):
        steps.append(_nodal(bodies, sizes, depth))
        given, held = shown[-1]
        own = fine_unknown(steps[-1])
        shown.append((given[own], held[own]))
    out = shown[-1][0]
    for step, (given, held) in zip(reversed(steps), reversed(shown[:-1]), strict=True):
        out = np.where(held, given, step @ out)
    return out.ravel()


def fine_unknown(level: sparse.csr_array) -> NDArray[np.int64]:
    """The fine node, or unknown, that every coarse one sits on, (coarse ones,)."""
    start = level.indptr[:-1][np.diff(level.indptr) == 1]
    rows = np.flatnonzero(np.diff(level.indptr) == 1)
    own = np.abs(level.data[start] - 1) < ONE
    node = np.full(level.shape[1], -1)
    node[level.indices[start[own]]] = rows[own]
    if (node < 0).any():
        raise InvalidInput(
            f"levels: coarse node {int(np.flatnonzero(node < 0)[0])} is no node of the finer "
            "mesh"
        )
    return node
