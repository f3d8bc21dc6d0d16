"""The augmentation parameter rho of projection functions, from the blocks W_ii of the operator.

rho has the unit of r / u.  At a solution any rho > 0 tells the same; on the way there it
decides which piece of the law a contact is thought to be on, and so the path of Newton's
method.  With s_max >= s_min the singular values (for a symmetric W the eigenvalues) of W_ii or
of its tangential part W_TT:

    constant         1, in the units of the problem
    global           1 / max_i s_max(W_ii), one for all contacts
    per-contact      1 / s_max(W_ii)
    split            rho_N = 1 / W_NN, rho_T = 1 / s_max(W_TT)
    split-condition  rho_N = 1 / W_NN, rho_T = s_min(W_TT) / s_max(W_TT)^2
    spectral         1 / sqrt(s_min(W_ii) s_max(W_ii)), [GTSJ]

times a factor.  Siconos (fc3d_AlartCurnier_functions.c) calls four of them CONSTANT,
SPECTRAL_NORM (per contact), SPLIT_SPECTRAL_NORM and SPLIT_SPECTRAL_NORM_COND; in the last two
it has another expression in the place of the determinant of W_TT.

[GTSJ] E. Ghadimi, A. Teixeira, I. Shames, M. Johansson, "Optimal parameter selection for the
alternating direction method of multipliers (ADMM): quadratic problems", IEEE Trans. Automat.
Control 60 (2015), whose optimal step for a quadratic problem this is.
"""

from __future__ import annotations

from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..problem.friction import Form, FrictionProblem

Array = NDArray[np.float64]
LARGEST_CONDITION = 1e4  # of W_ii or W_TT: a singular block must not give rho = 0 or infinity


class RhoStrategy(Enum):
    """Where rho comes from; see the module."""

    CONSTANT = "constant"
    GLOBAL = "global"
    PER_CONTACT = "per-contact"
    SPLIT = "split"
    SPLIT_CONDITION = "split-condition"
    SPECTRAL = "spectral"

    @property
    def splits(self) -> bool:
        """True when normal and tangential directions get different values."""
        return self in (RhoStrategy.SPLIT, RhoStrategy.SPLIT_CONDITION)


def own_blocks(problem: FrictionProblem) -> Array:
    """W_ii, (nc, d, d); in the global form the cheap stand-in of `problem.local_stiffness`."""
    if problem.form is Form.DELASSUS:
        d = problem.dimension
        return problem.blocks.diagonal_blocks[:, :d, :d]
    return problem.local_stiffness


def augmentation(problem: FrictionProblem, strategy: RhoStrategy, factor: float) -> Array:
    """rho > 0, (nc,), or (nc, 2) with columns rho_N and rho_T; unit of r / u.

    Contacts that can not react get `factor`: nothing is ever multiplied by it.
    """
    able = problem.rho > 0
    if strategy is RhoStrategy.CONSTANT:
        return np.full(problem.contacts, factor)
    if strategy is RhoStrategy.PER_CONTACT:
        return factor * np.where(able, problem.rho, 1.0)
    if strategy is RhoStrategy.GLOBAL:
        smallest = problem.rho[able].min() if able.any() else 1.0
        return np.full(problem.contacts, factor * smallest)
    blocks = own_blocks(problem)
    able = np.any(blocks, axis=(1, 2), keepdims=True)
    blocks = np.where(able, blocks, np.eye(problem.dimension))
    if strategy is RhoStrategy.SPECTRAL:
        largest, smallest = _singular_values(blocks)
        return factor / np.sqrt(smallest * largest)
    return factor * _split(blocks, strategy is RhoStrategy.SPLIT_CONDITION)


def _split(blocks: Array, condition: bool) -> Array:
    """(nc, 2) with columns rho_N, rho_T; a direction without compliance takes the other's."""
    largest, smallest = _singular_values(blocks[:, 1:, 1:])
    tangential = smallest / np.where(largest > 0, largest, 1) ** 2 if condition else None
    if tangential is None:
        tangential = 1 / np.where(largest > 0, largest, 1)
    normal = np.maximum(blocks[:, 0, 0], 0)
    whole = 1 / np.linalg.norm(blocks, 2, axis=(1, 2))
    return np.column_stack([
        np.where(normal > 0, 1 / np.where(normal > 0, normal, 1), whole),
        np.where(largest > 0, tangential, whole),
    ])  # fmt: skip


def _singular_values(blocks: Array) -> tuple[Array, Array]:
    """Largest and smallest singular value, (nc,) each, no further apart than a condition."""
    values: Any = np.linalg.svd(blocks, compute_uv=False)
    return values[:, 0], np.maximum(values[:, -1], values[:, 0] / LARGEST_CONDITION)
