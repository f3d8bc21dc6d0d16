"""Obstacles that move with a rigid body: the motion of their surface at contacts.

Small motions of a rigid body are affine in the place.  So the motion at the closest point of
the obstacle is a weighted sum of those of a few nodes of the body, wherever these are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput
from ..contact import ContactRows, Obstacle
from ..contact.mortar import coupled_columns
from ..elements.rigid import Rigid
from ..meshes.mesh import unknown
from .beside import Beside
from .constraints import KINEMATIC, Constraint, Coupling
from .parts import Body, Contact

Array = NDArray[np.float64]
FLAT = 1e-6  # of its size: nodes that span less do not tell a motion


def followed(bodies: Sequence[Body], contact: Contact) -> int:
    """The number of the body that an obstacle moves with; raises InvalidInput for none."""
    names = [body.name for body in bodies]
    if contact.follows not in names:
        raise InvalidInput(unknown("body", contact.follows, names), ("follows",))
    return names.index(contact.follows)


def check_follows(
    contact: Contact, beside: Beside, constraints: Sequence[Constraint], finite: bool
) -> None:
    """Raise InvalidInput for an obstacle that follows what is not rigid, or can not follow."""
    if contact.follows is None:
        return
    k = followed(beside.bodies, contact)
    body = beside.bodies[k]
    if finite:
        raise InvalidInput(
            "obstacles that follow a body need small kinematics and small strains", ("follows",)
        )
    led = (
        part for part in constraints
        if isinstance(part, Coupling) and part.kind == KINEMATIC and part.components is None
    )
    own = set(range(int(beside.offsets[k]), int(beside.offsets[k + 1])))
    if not isinstance(body.material, Rigid) and not any(
        own <= {*beside.nodes(part.on)[0].ravel().tolist()} for part in led
    ):
        raise InvalidInput(
            f"expected a body that does not deform, {contact.follows!r} does: give it the "
            "material Rigid(), or couple all of its nodes to a reference", ("follows",),
        )  # fmt: skip


def following_columns(
    body: Body, obstacle: Obstacle, rows: ContactRows
) -> sparse.csc_array:
    """Minus the motion of the obstacle under each contact, (dofs of the body, nc d)."""
    d = body.mesh.dim
    feet = np.stack([rows.mean(_Foot(obstacle, c)) for c in range(d)], axis=1)
    nodes, weights = _affine(body.mesh.points, feet)
    nc = len(feet)
    table = sparse.coo_array(
        (weights.ravel(), (np.repeat(np.arange(nc), len(nodes)), np.tile(nodes, nc))),
        shape=(nc, len(body.mesh.points)),
    )
    none = np.zeros((nc, d), dtype=bool)
    return -coupled_columns(sparse.csr_array(table.tocsr()), rows.frames, none)


class _Foot:
    """A coordinate of the closest point of an obstacle, as a function of points."""

    def __init__(self, obstacle: Obstacle, axis: int) -> None:
        self.obstacle, self.axis = obstacle, axis

    def __call__(self, x: Array) -> Array:
        """The coordinate of places on the obstacle, (n,)."""
        return x[:, self.axis] - self.obstacle.gap(x) * self.obstacle.normals(x)[:, self.axis]


def _affine(points: Array, feet: Array) -> tuple[NDArray[np.int64], Array]:
    """Nodes (k,) and weights (nc, k) that give every affine field at feet (nc, dim)."""
    axes = range(points.shape[1])
    ends = [[int(points[:, c].argmin()), int(points[:, c].argmax())] for c in axes]
    for nodes in (np.unique(ends), np.arange(len(points))):
        x = points[nodes] - points[nodes].mean(axis=0)
        size = float(np.abs(x).max(initial=0.0)) or 1.0
        matrix = np.concatenate([np.ones((1, len(nodes))), x.T / size])
        if np.linalg.svd(matrix, compute_uv=False)[-1] > FLAT:
            break
    right = np.concatenate(
        [np.ones((1, len(feet))), (feet - points[nodes].mean(axis=0)).T / size]
    )
    return nodes, (np.linalg.pinv(matrix) @ right).T
