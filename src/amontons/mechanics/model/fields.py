"""Displacements and contact fields of a solved model, in words of mechanics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.locks import KeepsLocks
from ...problem.solution import FrictionSolution
from ..contact import forces
from ..meshes import Facets
from .assembly import Discretisation
from .faced import Faced
from .parts import Body
from .reactions import arms, support_forces
from .references import ReferenceFields, beside_wrench, reference_fields
from .supports import external_load
from .wrench import Wrench

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ContactFields(KeepsLocks):
    """What a solution of the discrete problem means on the model.

    displacement: (nodes, dim) per body, unit of length.  Per contact, in the order of the
    discrete problem: points (nc, d), frames (nc, d, d) with rows n, t1(, t2), weights (nc,)
    area, of now and of what faces the other side where contact is found there, else undeformed,
    gap (nc,) after deformation, pressure (nc,) >= 0 in compression, shear (nc, d-1)
    traction on the slave in the local frame, slip (nc, d-1) tangential displacement since the
    start, force (nc, d) on the slave in global axes.  resultant (d,): sum of the forces of
    obstacles on slaves, global axes.  body, node (nc,): where the contact sits; facets: per
    pair the body and the facets of its slave surface, for plots.  status (nc,): ContactStatus.
    What has slid: slid (nc, d-1), net, path (nc,), the length of the way, friction_work (nc,),
    energy that it took.  reaction: forces of supports at the nodes, (nodes, dim) per body;
    load: resultant of all loads.  references: of what is beside the nodes, None without.
    plastic: of bodies that yield, by number, the history (h,) of their points of integration.
    faced: what contacts face where they are found in the deformed state, else None.
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
    status: NDArray[np.int8]
    slid: Array
    path: Array
    friction_work: Array
    reaction: tuple[Array, ...]
    load: Wrench
    references: ReferenceFields | None = None
    plastic: Mapping[int, Array] | None = None
    faced: Faced | None = None

    @property
    def areas(self) -> Array:
        """Areas (nc,) that `force` acts on: weights, with parts that other slaves leave."""
        return self.weights if self.faced is None else self.weights * self.faced.passed


def recover_fields(
    model: Model, surfaces: tuple[tuple[int, str], ...], solution: FrictionSolution
) -> ContactFields:
    """Fields of a solution at the load factor; surfaces: (body, slave surface) per pair."""
    bodies, parts = model.bodies, model.discretisation
    sites = parts.sites
    if solution.r.shape != sites.points.shape:
        raise InvalidInput(
            f"solution: expected r of shape {sites.points.shape}, got {solution.r.shape}: "
            "it belongs to another model"
        )
    if solution.v is None:
        raise InvalidInput(
            "solution: holds no displacements; solve the global form, model.assemble()"
        )
    whole = parts.spread(solution.v, model.load_factor * parts.prescribed)
    load = model.load_factor * external_load(bodies, model.loads, parts.beside)
    displacement = by_body(bodies, parts, whole)
    held = support_forces(parts, parts.missing(whole, load, solution.r))
    force = forces([placed.rows for placed in parts.placed], solution.r)
    traction = solution.r / sites.weights[:, None]
    return ContactFields(
        displacement=displacement,
        points=sites.points, frames=sites.frames, weights=sites.weights,
        gap=solution.u[:, 0], pressure=traction[:, 0], shear=traction[:, 1:],
        slip=solution.u[:, 1:], force=force, resultant=force.sum(axis=0),
        body=sites.body, node=sites.node,
        facets=tuple((k, bodies[k].mesh.surface(name)) for k, name in surfaces),
        reaction=by_body(bodies, parts, held),
        load=load_wrench(model, displacement, load), status=solution.status,
        references=reference_fields(parts, whole, held, load),
        **at_once(solution),
    )  # fmt: skip


def at_once(solution: FrictionSolution) -> dict[str, Any]:
    """slid, path, friction_work of a static solution: one way from the undeformed state.

    Friction grows along it in proportion, so that half of its last value acts on the way.
    What the springs of contacts that give way take of the motion is no slip.
    """
    give, stays, r = solution.problem.law.give, solution.u[:, 1:], solution.r
    if give is not None:
        stays = stays + give[:, 1 : r.shape[1]] * r[:, 1:]
    slid = np.where(solution.sliding[:, None], stays, 0.0)
    work = -0.5 * (r[:, 1:] * stays).sum(axis=1)
    return {"slid": slid, "path": np.linalg.norm(slid, axis=1),
            "friction_work": np.maximum(work, 0.0)}  # fmt: skip


def load_wrench(model: Model, displacement: Sequence[Array], load: Array) -> Wrench:
    """The resultant of nodal loads (dofs,)."""
    at = arms(model, displacement)
    of_nodes = Wrench.of(at, load[: at.size].reshape(at.shape))
    return of_nodes + beside_wrench(model.beside, load)


def by_body(
    bodies: Sequence[Body], parts: Discretisation, whole: Array
) -> tuple[Array, ...]:
    """Values of all dofs (dofs,) body by body, (nodes, dim) each."""
    pairs = zip(parts.offsets[:-1], parts.offsets[1:], strict=True)
    return tuple(
        whole[a:b].reshape(body.mesh.points.shape)
        for body, (a, b) in zip(bodies, pairs, strict=True)
    )
