"""Rigid bodies: a few unknowns each in the place of the displacements of their nodes.

The displacements of the nodes (dofs,) stay what contact, pictures and files are made of; they
are q = prescribed + S y, the unknowns y being those of the free nodes of deformable bodies and
the rigid motions of the others, a (dofs, 6) basis each with rotations scaled to the size of the
body, so that every unknown has the unit of a displacement.  Rotations are small, as everywhere.

What supports prescribe of a rigid body remains among its unknowns: a row of its own with a
value, which no contact force changes.  So a rigid body has 6 unknowns whatever holds it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput
from ..elements.rigid import Rigid
from .rigid import RANK, rigid_modes

if TYPE_CHECKING:
    from .parts import Body

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
RIGIDLY = 1e-9  # departure of prescribed values from a rigid motion, relative to the largest


@dataclass(frozen=True, eq=False)
class _Held:
    """One rigid body: its dofs (k,), modes (k, 6), driven (6,) and the inverse for these.

    at: its prescribed dofs, of the model; inverse (6, len(at)): their values to motions.
    """

    name: str
    dofs: Index
    modes: Array
    driven: Mask
    at: Index
    inverse: Array

    @classmethod
    def of(cls, body: Body, first: int, is_fixed: Mask) -> _Held:
        """The motions of a body whose dofs start at `first`, free ones before driven ones."""
        modes = rigid_modes(body.mesh.points)
        dofs = first + np.arange(len(modes))
        at = dofs[is_fixed[dofs]]
        rows = modes[at - first]
        _, s, vt = np.linalg.svd(np.linalg.qr(rows, mode="r"))
        rank = int((s > RANK * max(float(s.max(initial=0.0)), RANK)).sum())
        size = modes.shape[1]
        driven = np.arange(size) >= size - rank
        if 0 < rank < size:
            modes = modes @ np.vstack([vt[rank:], vt[:rank]]).T
            rows = modes[at - first]
        inverse = np.zeros((size, len(at)))
        inverse[driven] = np.linalg.pinv(rows[:, driven], rcond=RANK)
        return cls(body.name, dofs, modes, driven, at, inverse)

    def motion(self, values: Array) -> Array:
        """Unknowns (6,) that values (dofs,) on the prescribed dofs demand; InvalidInput."""
        given = values[self.at]
        found = self.inverse @ given
        missed = self.modes[self.at - self.dofs[0]] @ found - given
        if np.abs(missed).max(initial=0.0) > RIGIDLY * np.abs(given).max(initial=0.0):
            raise InvalidInput(
                f"body {self.name!r} is rigid, and what they prescribe on it is no small "
                "rigid motion", ("supports",),
            )  # fmt: skip
        return found

    def held_by(self, rest: Array) -> Array:
        """Forces (len(at),) of supports, the smallest that do what is missing, (k,), does."""
        return self.inverse.T @ (self.modes.T @ rest)


@dataclass(frozen=True, eq=False)
class RigidBodies:
    """The rigid bodies of a model beside the free dofs (k,) of the deformable ones.

    spread (dofs, n): S, without what is driven; driven (n,): unknowns that supports prescribe.
    """

    free: Index
    bodies: tuple[_Held, ...]
    spread: sparse.csc_array
    driven: Mask

    @classmethod
    def of(
        cls, bodies: Sequence[Body], offsets: Index, is_fixed: Mask
    ) -> RigidBodies | None:
        """None where all bodies deform."""
        held = tuple(
            _Held.of(body, int(first), is_fixed)
            for body, first in zip(bodies, offsets[:-1], strict=True)
            if isinstance(body.material, Rigid)
        )
        if not held:
            return None
        total = int(offsets[-1])
        moves = ~is_fixed
        for one in held:
            moves[one.dofs] = False
        free = np.flatnonzero(moves)
        blocks = [sparse.csc_array(sparse.csc_array(sparse.eye_array(total))[:, free])]
        for one in held:
            k, size = one.modes.shape
            rows, columns = np.repeat(one.dofs, size), np.tile(np.arange(size), k)
            acting = (one.modes * ~one.driven).ravel()
            block = sparse.coo_array((acting, (rows, columns)), shape=(total, size))
            blocks.append(sparse.csc_array(block))
        spread = sparse.csc_array(sparse.hstack(blocks, format="csc"))
        spread.eliminate_zeros()
        driven = np.concatenate([np.zeros(len(free), dtype=bool), *(h.driven for h in held)])
        return cls(free, held, spread, driven)

    @property
    def dofs(self) -> Index:
        """All dofs of rigid bodies."""
        return np.concatenate([body.dofs for body in self.bodies])

    def matrix(self, whole: sparse.csr_array) -> sparse.csc_array:
        """S^T A S for A (dofs, dofs), with the mean of its diagonal at what is driven."""
        inner = sparse.csc_array(self.spread.T @ whole @ self.spread)
        size = np.abs(inner.diagonal())
        mean = float(size[size > 0].mean()) if (size > 0).any() else 1.0
        return sparse.csc_array(inner + sparse.diags_array(np.where(self.driven, mean, 0.0)))

    def driven_values(self, prescribed: Array) -> Array:
        """Unknowns (n,) that values (dofs,) on prescribed dofs demand, zero elsewhere."""
        return np.concatenate(
            [np.zeros(len(self.free)), *(body.motion(prescribed) for body in self.bodies)]
        )

    def completed(self, prescribed: Array) -> Array:
        """Values (dofs,) on prescribed dofs, continued over the rigid bodies that they move."""
        out = prescribed.copy()
        for body in self.bodies:
            out[body.dofs] = body.modes @ body.motion(prescribed)
        return out

    def nearest(self, values: Array, prescribed: Array) -> Array:
        """Values (dofs,) with the nearest motions of the rigid bodies that fit `prescribed`."""
        out, known = values.copy(), self.completed(prescribed)
        for body in self.bodies:
            free = body.modes[:, ~body.driven]
            left = values[body.dofs] - known[body.dofs]
            out[body.dofs] = known[body.dofs] + free @ np.linalg.lstsq(free, left)[0]
        return out
