"""The linear problem with contact that large deformations are at one state.

Forces balance there and its contacts have the reactions, gaps and slips of that state, in the
frames of there; between bodies that deform frames and averages stay as they are there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...problem.friction import FrictionProblem
from .nonlinear_parts import NonlinearParts
from .obstacle_linearisation import turned_forces
from .tangent_structure import free_modes

Array = NDArray[np.float64]


def tangent_problem(
    parts: NonlinearParts, moved: Array, slopes: tuple[Array, Array],
    local: tuple[Array, Array, Array], sizes: tuple[float, float], name: str,
) -> FrictionProblem:  # fmt: skip
    """At displacements moved (nodes, d).

    slopes: f_int - f (dofs,) and its derivative in node blocks (m, d, d), which are changed;
    local: r, u (nc, d) and frames (nc, d, d); sizes: of forces and of u.
    """
    (needed, blocks), (r, u, axes), (load, length) = slopes, local, sizes
    v, meeting = moved.ravel()[parts.free], parts.meet(moved)
    if meeting.all_at_obstacles:
        blocks[parts.diagonal] -= turned_forces(axes, r, meeting.normal_slopes)
    H = sparse.csc_array(meeting.columns(axes).tocsr()[parts.free])
    M = parts.on_free(blocks)
    w = u - (H.T @ v).reshape(u.shape)
    return FrictionProblem.from_global(
        M, H, M @ v - needed[parts.free], w, parts.contact.law_at(meeting), load_scale=load,
        u_scale=length, name=name,
    )  # fmt: skip


def moved_on(
    tangent: FrictionProblem, parts: NonlinearParts, v: Array, u: Array,
    moved: Array, force: Array,
) -> FrictionProblem:  # fmt: skip
    """That of a state v under another load, for which supports move by `moved` (dofs,).

    u (nodes, d): displacements at v; force (dofs,): what comes to the free dofs by both.
    """
    meeting, w, contact = parts.meet(u), np.array(tangent.w), parts.contact
    motion = meeting.relative(moved.reshape(u.shape))
    w[:, 0] += (meeting.normals * motion).sum(axis=1)
    if (held := contact.heard & ~contact.free).any():
        w[:, 1:] += np.einsum("pkc,pc->pk", meeting.frames[:, 1:], motion * held)
    force, modes = force[parts.free], free_modes(parts, u)
    return replace(tangent, f=tangent.f + force, w=w, near_nullspace=modes, guess=v,
                   load_scale=max(tangent.load, float(np.linalg.norm(force))))  # fmt: skip
