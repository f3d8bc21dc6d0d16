"""Derivatives of the equations of large deformations with obstacles alone.

Contacts have no force on other nodes then, and all derivatives are by the place of their own.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...linear.condensed import Structure
from ..contact.current import ContactPoint
from .nodal_forces import NodalForces
from .nonlinear_parts import NonlinearParts
from .tangent_structure import structure_of

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Linearisation:
    """F and its derivatives at one state, with obstacles alone.

    u (nodes, d): displacements; rest (dofs,): f_int - f; blocks: its derivative; by_force,
    by_x, by_motion (nc, d, d): those of the contact law.
    """

    parts: NonlinearParts
    u: Array
    rest: Array
    blocks: Array
    point: ContactPoint
    by_force: Array
    by_x: Array
    by_motion: Array

    @property
    def residual(self) -> Array:
        """F, (n,)."""
        parts = self.parts
        out = self.rest.copy()
        out[parts.at] = self.point.residual()
        return out[parts.free]

    @cached_property
    def matrix(self) -> sparse.csc_array:
        """dF/dv, (n, n)."""
        parts = self.parts
        blocks = self.blocks.copy()
        rows = np.flatnonzero(parts.row_contact >= 0)
        blocks[rows] = self.by_force[parts.row_contact[rows]] @ blocks[rows]
        blocks[parts.diagonal] += self.by_x + self.by_motion
        return parts.on_free(blocks)

    def shifted(
        self, load: NodalForces | Array, prescribed: Array, drift: Array | None = None
    ) -> Array:
        """First-order change of F, (n,), with changes of load, prescribed (dofs,) and drift."""
        parts = self.parts
        change = parts.matrix(self.blocks) @ prescribed - NodalForces.of(load).at(self.u)
        moved = prescribed[parts.at] + (0.0 if drift is None else drift)
        slid = np.einsum("pij,pj->pi", self.by_motion, moved)
        return self.passed(change) + self.with_law(slid)

    @property
    def structure(self) -> Structure:
        """What the matrix consists of."""
        nothing = sparse.csr_array((len(self.parts.free), self.parts.at.size))
        return structure_of(self.parts, self.u, self.by_force, nothing)

    def with_law(self, change: Array) -> Array:
        """First-order change of F, (n,), with a change of the law at contacts, (nc, d)."""
        out = np.zeros(len(self.rest))
        out[self.parts.at] = change
        return out[self.parts.free]

    def passed(self, change: Array) -> Array:
        """First-order change of F, (n,), with a change of f_int - f, (dofs,)."""
        parts, out = self.parts, change.copy()
        out[parts.at] = np.einsum("pij,pj->pi", self.by_force, change[parts.at])
        return out[parts.free]


def turned_forces(axes: Array, r: Array, bend: Array) -> Array:
    """Derivative of the forces sum_k r_k axis_k by the position, (nc, d, d).

    dn = bend dx, and tangents are carried along: dt = -n (t . dn).
    """
    n, t = axes[:, 0], axes[:, 1:]
    along = np.einsum("pk,pkc,pcj->pj", r[:, 1:], t, bend)
    return r[:, 0, None, None] * bend - n[:, :, None] * along[:, None, :]
