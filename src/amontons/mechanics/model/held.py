"""Contact nodes that supports hold: no contact force can act there, so none may be pushed in.

Where supports hold a slave node along the normal (and what it meets, too) there is no contact
in the discrete problem.  Whether the node stays outside is then a matter of the supports alone,
to be asked at every time and load factor at which they are applied.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, within
from ..contact import ContactRows, Obstacle
from .parts import Body, Contact, Fix
from .supports import locate

Array = NDArray[np.float64]
Index = NDArray[np.int64]
TOUCHING = 1e-12  # penetration of held nodes, relative to the mesh, that is none


@dataclass(frozen=True, eq=False)
class HeldNodes:
    """Slave nodes (k,) of a contact that can not move along its normal.

    dofs, points (k, d); gap (k,) in the reference configuration, at least 0 where an overlap
    there is no fault of the supports; normal (dofs, k): normals in the dofs of the model, of
    both sides; near: a length up to which penetration is rounding.
    """

    slave: str
    dofs: Index
    points: Array
    gap: Array
    normal: sparse.csc_array
    near: float
    obstacle: Obstacle | None

    @classmethod
    def of(
        cls, contact: Contact, rows: ContactRows, H: sparse.csc_array, first: int, size: float
    ) -> HeldNodes:
        """From rows with held normals and their H (dofs, k d); first dof of the slave body.

        size: largest distance of the slave's points from one another and from zero.
        """
        d = rows.points.shape[1]
        exact = contact.obstacle is not None or contact.method == "nodal"
        return cls(
            contact.slave, first + rows.nodes[:, None] * d + np.arange(d), rows.points,
            rows.gap if exact else np.maximum(rows.gap, 0.0), sparse.csc_array(H[:, ::d]),
            TOUCHING * size, None if contact.follows else contact.obstacle,
        )  # fmt: skip

    def left(self, prescribed: Array) -> Array:
        """Gaps (k,) under prescribed displacements (dofs,) that are zero on free dofs."""
        return self.gap + self.normal.T @ prescribed[: self.normal.shape[0]]

    def left_where_moved(self, prescribed: Array, is_fixed: NDArray[np.bool_]) -> Array:
        """The same at finite strains: at their new places, if all their components are held.

        Infinite between bodies: where both are held they may have slid off each other.
        """
        if self.obstacle is None:
            return np.full(self.gap.shape, np.inf)
        gap = self.left(prescribed)
        if not len(gap):
            return gap
        moved = self.obstacle.gap(self.points + prescribed[self.dofs])
        return np.where(is_fixed[self.dofs].all(axis=1), moved, gap)


def refuse_held(
    every: Sequence[HeldNodes | None], bodies: Sequence[Body], supports: Sequence[Fix],
    offsets: Index, prescribed: Array, *, between_bodies: bool,
) -> None:  # fmt: skip
    """Raise InvalidInput: supports fix the slaves of all contacts; of two bodies, or none."""
    for k, held in enumerate(every):
        with within("contacts", k):
            if held is not None:
                gap = held.left(prescribed)
                check_outside(held, gap, bodies, supports, offsets, "")
    text = "every slave node is fixed by a support, no contact is left"
    if between_bodies:
        text += "; make the master the slave, if that can move"
    raise InvalidInput(text, ("contacts",))


def check_outside(
    held: HeldNodes, gap: Array, bodies: Sequence[Body], supports: Sequence[Fix],
    offsets: Index, when: str,
) -> None:  # fmt: skip
    """Raise InvalidInput where supports alone push a node of gap (k,) into the other side.

    when: such as " at t = 0.5", for the message.
    """
    if not gap.size or gap.min() >= -held.near:
        return
    k = int(gap.argmin())
    names = _names(int(held.dofs[k, 0]), bodies, supports, offsets)
    raise InvalidInput(
        f"contact on {held.slave!r}:{when} supports hold the node at "
        f"{held.points[k].tolist()} ({names}) and push it {-gap[k]:.3g} into the other side, "
        "where no contact force can act; change the prescribed displacement or free the node"
    )


def _names(dof: int, bodies: Sequence[Body], supports: Sequence[Fix], offsets: Index) -> str:
    """The supports on whose surface a node lies, by its first dof."""
    body = int(np.searchsorted(offsets, dof, side="right")) - 1
    mesh = bodies[body].mesh
    node = (dof - int(offsets[body])) // mesh.dim
    found = []
    for support in supports:
        try:
            k, surface = locate(bodies, support.on, sets=True)
        except InvalidInput:  # beside the nodes
            continue
        if k == body and node in mesh.surface_nodes(surface):
            found.append(f"fix on {support.on!r}")
    return ", ".join(dict.fromkeys(found))
