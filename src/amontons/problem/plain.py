"""The problem of a plain law, of which others are changes of variables (`law.changed`)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.arrays import Matrix, locked, read_only
from ..core.errors import InvalidInput
from .law import Law

if TYPE_CHECKING:
    from .friction import FrictionProblem

Array = NDArray[np.float64]


def check_dimension(law: Law, dimension: int) -> None:
    """Raise InvalidInput for two coefficients of friction in 2D."""
    if law.stretch is not None and dimension == 2:
        raise InvalidInput(
            "law: expected one coefficient, in 2D there is one direction to slide along; "
            f"{law.name} needs contacts in 3D"
        )


def plain_of(problem: FrictionProblem) -> FrictionProblem:
    """The problem in s and u' of the plain law.

    Errors of r are those of s there: cohesion counts as load.
    """
    law = problem.law
    if law.give is not None:
        problem = _with_give(problem, law.give)
    if law.cohesion.any():
        problem = _without_tension(problem)
    if law.stretch is not None:
        problem = _without_stretch(problem, law.stretch)
    return replace(problem, law=law.plain)


def _with_give(problem: FrictionProblem, give: Array) -> FrictionProblem:
    """The problem of u + C r, in the Delassus form; raises SingularOperator as condensing."""
    problem = problem.condensed()
    assert problem.W is not None
    W = problem._shared.once(_softer, (problem.W, give), problem.W, give, problem.dimension)
    return replace(problem, W=W)


def _softer(W: Matrix, give: Array, d: int) -> Any:
    """W + C."""
    C = give[:, :d].ravel()
    if sparse.issparse(W):
        return locked(sparse.csr_array(W + sparse.diags_array(C)))
    return read_only(W + np.diag(C))


def _without_tension(problem: FrictionProblem) -> FrictionProblem:
    """The problem in r + c n, under another load."""
    tension = np.zeros((problem.contacts, problem.dimension))
    tension[:, 0] = problem.law.cohesion
    if problem.q is not None:
        q = read_only(problem.q - (problem.W @ tension.ravel()).reshape(tension.shape))
        return replace(problem, q=q)
    assert problem.f is not None and problem.H is not None
    push = problem.H @ tension.ravel()
    size = problem.load_scale
    size = None if size is None else float(np.hypot(size, np.linalg.norm(push)))
    return replace(problem, f=read_only(problem.f - push), load_scale=size)


def _without_stretch(problem: FrictionProblem, stretch: Array) -> FrictionProblem:
    """The problem in T^-1 r and T u: H T and T w, or T W T and T q."""
    law, sources = problem.law, (problem.H, problem.W, stretch)
    H, W = problem._shared.once(_stretched, sources, *sources)
    rows = (problem.w, problem.q)
    w, q = (None if x is None else read_only(law.stretched(x)) for x in rows)
    blur = problem.blur
    if blur is not None:
        blur = blur * np.maximum(np.linalg.eigvalsh(stretch)[:, 1], 1.0)
    return replace(problem, H=H, W=W, w=w, q=q, blur=blur)


def _stretched(H: Matrix | None, W: Matrix | None, stretch: Array) -> tuple[Any, Any]:
    """(H T, T W T), those that there are, of tangents stretched by (nc, 2, 2)."""
    nc = len(stretch)
    blocks = np.zeros((nc, 3, 3))
    blocks[:, 0, 0], blocks[:, 1:, 1:] = 1.0, stretch
    T = sparse.bsr_array((blocks, np.arange(nc), np.arange(nc + 1))).tocsr()
    T.eliminate_zeros()
    if H is None and not sparse.issparse(W):
        return None, read_only(np.ascontiguousarray((T @ (T @ W).T).T))
    out = sparse.csc_array(H @ T) if H is not None else sparse.csr_array(T @ W @ T)
    out.sort_indices()
    return (locked(out), None) if H is not None else (None, locked(out))
