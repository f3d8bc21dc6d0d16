"""What supports and loads give: prescribed displacements and nodal forces of all bodies."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ..elements.elasticity import body_load
from ..elements.moved_loads import pressure_forces
from ..meshes.mesh import Mesh, unknown
from ..meshes.surfaces import surface_load
from .parts import Body, BodyForce, Fix, Load, Pressure, Traction
from .timing import lasting
from .values import component_at, vector_at

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SAME = 1e-12  # prescribed values that differ by less, relative to the largest, agree


@dataclass(frozen=True, eq=False)
class Prescribed:
    """What supports say: values (dofs,), NaN where free, as they are now.

    lasting (dofs,): the values that do not depend on time, NaN elsewhere.
    """

    values: Array
    lasting: Array

    @classmethod
    def of(
        cls, bodies: tuple[Body, ...], supports: tuple[Fix, ...], offsets: Index
    ) -> Prescribed:
        """Of all supports of a model, those of (x, t) at t = 0 unless they have a time."""
        values = prescribed_values(bodies, supports, offsets)
        same = tuple(replace(s, value=lasting(s.value)) for s in supports)
        return cls(values, prescribed_values(bodies, same, offsets))

    @property
    def is_fixed(self) -> NDArray[np.bool_]:
        """Dofs (dofs,) that supports prescribe."""
        return ~np.isnan(self.values)

    def by_body(self, offsets: Index, dim: int) -> tuple[list[NDArray[np.bool_]], list[Array]]:
        """Which components are prescribed, and lasting values: of every body (nodes, dim)."""
        split = [np.split(a, offsets[1:-1]) for a in (self.is_fixed, self.lasting)]
        held, values = ([a.reshape(-1, dim) for a in parts] for parts in split)
        return held, values


def locate(bodies: tuple[Body, ...], on: str) -> tuple[int, str]:
    """(body, surface) of a name "surface" or "body.surface"."""
    found = [k for k, body in enumerate(bodies) if on in body.mesh.surfaces]
    if len(found) == 1:
        return found[0], on
    if len(found) > 1:
        choices = ", ".join(f"{bodies[k].name}.{on}" for k in found)
        raise InvalidInput(f"surface {on!r}: several bodies have it, write one of {choices}")
    for k, body in enumerate(bodies):
        prefix = f"{body.name}."
        if on.startswith(prefix) and on[len(prefix) :] in body.mesh.surfaces:
            return k, on[len(prefix) :]
    names = [s for body in bodies for s in body.mesh.surfaces]
    if len(bodies) > 1:
        names += [f"{body.name}.{s}" for body in bodies for s in body.mesh.surfaces]
    raise InvalidInput(unknown("surface", on, dict.fromkeys(names)))


def prescribed_values(
    bodies: tuple[Body, ...], supports: tuple[Fix, ...], offsets: Index
) -> Array:
    """Prescribed displacement of every dof, NaN where it is free, (dofs,)."""
    values = np.full(int(offsets[-1]), np.nan)
    for support in supports:
        k, surface = locate(bodies, support.on)
        mesh = bodies[k].mesh
        nodes = mesh.surface(surface) and mesh.surface_nodes(surface)
        given = vector_at(
            support.value, mesh.points[nodes], f"fix on {support.on!r}", free=True
        )
        dofs = offsets[k] + nodes[:, None] * mesh.dim + np.arange(mesh.dim)
        _check_agreement(values[dofs], given, mesh.points[nodes], support.on)
        values[dofs] = np.where(np.isnan(given), values[dofs], given)
    return values


def _check_agreement(old: Array, new: Array, points: Array, on: str) -> None:
    """Two supports may meet at a node only if they say the same."""
    with np.errstate(invalid="ignore"):
        size = np.nanmax(np.abs(np.concatenate([old.ravel(), new.ravel(), [0.0]])))
        clash = np.argwhere(np.abs(old - new) > SAME * size)
    if len(clash):
        node, axis = clash[0]
        raise InvalidInput(
            f"fix on {on!r}: component {axis} at {points[node]} is {new[node, axis]}, but "
            f"another support prescribes {old[node, axis]} there"
        )


def external_load(
    bodies: tuple[Body, ...], loads: tuple[Load, ...], offsets: Index
) -> Array:
    """Nodal forces of loads on the undeformed bodies, (dofs,)."""
    out = np.zeros(int(offsets[-1]))
    for load in loads:
        if isinstance(load, BodyForce):
            _add_body_force(out, bodies, load, offsets)
            continue
        k, surface = locate(bodies, load.on)
        forces = _pressed if isinstance(load, Pressure) else _drawn
        out[offsets[k] : offsets[k + 1]] += forces(bodies[k].mesh, surface, load).ravel()
    return out


def _drawn(mesh: Mesh, surface: str, load: Traction) -> Array:
    """Nodal forces (n, dim) of a traction."""
    facets, nodes = mesh.surface(surface), mesh.surface_nodes(surface)
    traction = np.zeros_like(mesh.points)
    traction[nodes] = vector_at(load.value, mesh.points[nodes], f"traction on {load.on!r}")
    return surface_load(mesh.points, facets, traction)


def _pressed(mesh: Mesh, surface: str, load: Pressure) -> Array:
    """Nodal forces (n, dim) of a pressure."""
    out, nodes = np.zeros_like(mesh.points), mesh.surface_nodes(surface)
    density = np.zeros(len(out))
    density[nodes] = component_at(
        load.value, mesh.points[nodes], f"pressure on {load.on!r}"
    )  # fmt: skip
    for facets in mesh.surface(surface):
        x = mesh.points[facets.nodes]
        forces, _ = pressure_forces(facets.kind, x, density[facets.nodes], np.zeros_like(x))
        np.add.at(out, facets.nodes, forces)
    return out


def _add_body_force(
    out: Array, bodies: tuple[Body, ...], load: BodyForce, offsets: Index
) -> None:
    regions = {region for body in bodies for region in body.mesh.regions}
    if load.region is not None and load.region not in regions:
        raise InvalidInput("body force: " + unknown("region", load.region, regions))
    for k, body in enumerate(bodies):
        if load.region is None or load.region in body.mesh.regions:
            force = vector_at(load.value, body.mesh.points, "body force")
            part = body_load(body.mesh, force, load.region)
            out[offsets[k] : offsets[k + 1]] += part.ravel()
