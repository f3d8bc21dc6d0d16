"""The problem of a plain law, of which others are changes of variables (`law.changed`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.arrays import Matrix, locked, read_only
from ..core.errors import InvalidInput
from .law import Law
from .protocol import Form

if TYPE_CHECKING:
    from .equations import Equations
    from .friction import FrictionProblem
    from .structure import Structure

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
    problem = _offset(problem)
    if law.give is not None:
        problem = _with_give(problem, law.give)
    if law.cohesion.any():
        problem = _without_tension(problem)
    if law.stretch is not None:
        problem = _without_stretch(problem, law.stretch)
    return replace(problem, law=law.plain)


def of_plain(judged: Callable[..., Any]) -> Callable[..., Any]:
    """A judgement of r, and maybe v, that is made of s in `FrictionProblem.plain`."""

    @wraps(judged)
    def asked(self: Equations, r: Array, v: Array | None = None, **named: Any) -> Any:
        law, given = self.law, () if v is None else (v,)
        if law.varies:
            return asked(frozen(self, r, v), r, v, **named)
        if law.plain is law:
            return judged(self, r, *given, **named)
        plain = self.plain
        if v is not None:
            wider = plain_motion(self, r, v)  # type: ignore[arg-type]
            given = () if wider is None else (wider,)
        return judged(plain, self.law.pressed(r), *given, **named)

    return asked


def frozen(problem: Any, r: Array, v: Array | None) -> FrictionProblem:
    """The problem with the coefficients of friction that belong to a state, see `varying`."""
    u = problem.motion(r, v)[0]
    return replace(problem, law=problem.law.frozen(r, u))


# ---------------------------------------------------------------- compliance
def plain_motion(problem: FrictionProblem, r: Array, v: Array | None) -> Array | None:
    """The v of `problem.plain` at a state (r, v); None where that has none."""
    plain = problem.plain
    if v is None or not plain.has_v:
        return None
    if plain.unknowns == problem.unknowns:
        return v
    assert problem.law.give is not None and plain.M is not None
    size = plain.M.diagonal()[-1]
    return np.concatenate([v, (np.sqrt(_flat(problem, problem.law.give) / size)) * r.ravel()])


def _flat(problem: FrictionProblem, give: Array) -> Array:
    """Diagonal of C, (nc d,)."""
    return give[:, : problem.dimension].ravel()


def _with_give(problem: FrictionProblem, give: Array) -> FrictionProblem:
    """The problem of u + C r: with W + C, or with springs in its global form."""
    if problem.form is Form.GLOBAL:
        return _with_springs(problem, give)
    assert problem.W is not None
    W = problem._shared.once(_softer, (problem.W, give), problem.W, give, problem.dimension)
    return replace(problem, W=W)


def _offset(problem: FrictionProblem) -> FrictionProblem:
    """The problem of u + o n."""
    if not np.any(problem.law.offset):
        return problem
    name = "w" if problem.q is None else "q"
    rows = np.array(getattr(problem, name))
    rows[:, 0] += problem.law.offset
    return replace(problem, **{name: read_only(rows)})


def _with_springs(problem: FrictionProblem, give: Array) -> FrictionProblem:
    """Every contact in series with springs y: u + C r = H^T v + (m C)^½ y + w, m y = (m C)^½ r.

    m, a typical entry of M, is the same for all: equal bodies share what is made of them.
    """
    problem = problem.assembled()
    sources = (problem.M, problem.H, give)
    M, H = problem._shared.once(_sprung, sources, *sources, problem.dimension)
    more = np.zeros(H.shape[0] - problem.unknowns)
    assert problem.f is not None
    modes, guess = problem.near_nullspace, problem.guess
    if modes is not None:
        modes = read_only(np.vstack([modes, np.zeros((len(more), modes.shape[1]))]))
    return replace(
        problem, M=M, H=H, f=read_only(np.concatenate([problem.f, more])), levels=(),
        near_nullspace=modes, structure=_with_spring_nodes(problem.structure, len(give)),
        guess=None if guess is None else read_only(np.concatenate([guess, more])),
    )  # fmt: skip


def _sprung(M: Any, H: Any, give: Array, d: int) -> tuple[Any, Any]:
    """(M, H) with a spring at every contact."""
    C = give[:, :d].ravel()
    size = float(np.abs(M.diagonal()).mean()) or 1 / float(C[C > 0].mean())
    wider = sparse.block_diag([M, size * sparse.eye_array(len(C))], format="csc")
    taller = sparse.vstack([H, sparse.diags_array(np.sqrt(size * C))], format="csc")
    taller.eliminate_zeros()
    out = sparse.csc_array(wider), sparse.csc_array(taller)
    for matrix in out:
        matrix.sort_indices()
    return locked(out[0]), locked(out[1])


def _with_spring_nodes(known: Structure | None, contacts: int) -> Structure | None:
    """A node, and a body, for the spring of every contact."""
    if known is None:
        return None
    nodes, d, number = len(known.piece), known.dimension, np.arange(contacts)
    more = known.piece.max(initial=-1) + 1 + number.astype(np.int32)
    place = np.concatenate([known.place, d * nodes + np.arange(d * contacts)])
    return replace(known, place=place, piece=np.concatenate([known.piece, more]))


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
