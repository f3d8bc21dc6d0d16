"""Displacements and contact fields of a solved model, in words of mechanics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...problem.solution import FrictionSolution
from ..contact import forces
from ..meshes import Facets
from .assembly import Discretisation
from .parts import Body

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ContactFields:
    """What a solution of the discrete problem means on the model.

    displacement: (nodes, dim) per body, unit of length.  Per contact, in the order of the
    discrete problem: points (nc, d), frames (nc, d, d) with rows n, t1(, t2), weights (nc,)
    area, gap (nc,) after deformation, pressure (nc,) >= 0 in compression, shear (nc, d-1)
    traction on the slave in the local frame, slip (nc, d-1) tangential displacement, force
    (nc, d) on the slave in global axes.  resultant (d,): sum of the forces of obstacles on
    slaves, global axes.  body, node (nc,): where the contact sits; facets: per pair the body
    and the facets of its slave surface, for plots.
    """

    displacement: tuple[Array, ...]
    points: Array
    frames: Array
    weights: Array
    gap: Array
    pressure: Array
    shear: Array
    slip: Array
    force: Array
    resultant: Array
    body: Index
    node: Index
    facets: tuple[tuple[int, tuple[Facets, ...]], ...]


def recover_fields(
    bodies: Sequence[Body],
    surfaces: tuple[tuple[int, str], ...],
    parts: Discretisation,
    solution: FrictionSolution,
    factor: float,
) -> ContactFields:
    """Fields of a solution at a load factor; surfaces: (body, slave surface) per pair."""
    rows = [placed.rows for placed in parts.placed]
    frames = np.concatenate([r.frames for r in rows])
    if solution.r.shape != frames.shape[:2]:
        raise InvalidInput(
            f"solution: expected r of shape {frames.shape[:2]}, got {solution.r.shape}: "
            "it belongs to another model"
        )
    if solution.v is None:
        raise InvalidInput(
            "solution: holds no displacements; solve the global form, model.assemble()"
        )
    v = solution.v
    weights = np.concatenate([r.weights for r in rows])
    force = forces(rows, solution.r)
    traction = solution.r / weights[:, None]
    return ContactFields(
        displacement=_by_body(bodies, parts, v, factor),
        points=np.concatenate([r.points for r in rows]),
        frames=frames, weights=weights, gap=solution.u[:, 0], pressure=traction[:, 0],
        shear=traction[:, 1:], slip=solution.u[:, 1:], force=force, resultant=force.sum(axis=0),
        body=np.concatenate([np.full(len(p.rows.nodes), p.body) for p in parts.placed]),
        node=np.concatenate([r.nodes for r in rows]),
        facets=tuple((k, bodies[k].mesh.surface(name)) for k, name in surfaces),
    )  # fmt: skip


def _by_body(
    bodies: Sequence[Body], parts: Discretisation, v: Array, factor: float
) -> tuple[Array, ...]:
    whole = parts.spread(v, factor * parts.prescribed)
    pairs = zip(parts.offsets[:-1], parts.offsets[1:], strict=True)
    return tuple(
        whole[a:b].reshape(body.mesh.points.shape)
        for body, (a, b) in zip(bodies, pairs, strict=True)
    )
