"""The tangent problem of large deformations at a state: a `FrictionProblem`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...problem.friction import FrictionProblem
from .obstacle_linearisation import turned_forces
from .tangent_structure import free_modes

if TYPE_CHECKING:
    from .large_deformation import LargeDeformation

Array = NDArray[np.float64]


def linearised(problem: LargeDeformation, v: Array, held: Array | None) -> FrictionProblem:
    """At v: same reactions, gaps and slips there, frames of there; held: of `residual`."""
    parts, moved = problem.parts, problem.displacement(v)
    needed, blocks = problem._needed_slopes(moved)
    r, u, axes, rest = problem._local(v, held)
    meeting = parts.meet(moved)
    if meeting.all_at_obstacles:
        blocks[parts.diagonal] -= turned_forces(axes, r, meeting.normal_slopes)
    H = sparse.csc_array(meeting.columns(axes).tocsr()[parts.free])
    M = parts.on_free(blocks)
    load, length = problem._sizes(v, r, u, rest)
    w = u - (H.T @ v).reshape(u.shape)
    return FrictionProblem.from_global(
        M, H, M @ v - needed[parts.free], w, parts.contact.law_at(meeting), load_scale=load,
        u_scale=length, name=problem.name,
    )  # fmt: skip


def towards(now: LargeDeformation, then: LargeDeformation, v: Array) -> FrictionProblem:
    """At a state v of a load, under another load."""
    tangent, u = now.linearised(v), now.displacement(v)
    moved = then.prescribed - now.prescribed
    force = (then.load - now.load).at(u)
    force -= now.parts.matrix(now._needed_slopes(u)[1]) @ moved
    meeting, w = now.parts.meet(u), np.array(tangent.w)
    motion, contact = meeting.relative(moved.reshape(u.shape)), now.parts.contact
    w[:, 0] += (meeting.normals * motion).sum(axis=1)
    if (held := contact.heard & ~contact.free).any():
        w[:, 1:] += np.einsum("pkc,pc->pk", meeting.frames[:, 1:], motion * held)
    force, modes = force[now.parts.free], free_modes(now.parts, u)
    return replace(tangent, f=tangent.f + force, w=w, near_nullspace=modes, guess=v,
                   load_scale=max(tangent.load, float(np.linalg.norm(force))))  # fmt: skip
