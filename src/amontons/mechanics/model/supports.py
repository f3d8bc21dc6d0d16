"""What supports and loads give: prescribed displacements and nodal forces of all bodies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, within
from ..elements.elasticity import body_load
from ..elements.given import GivenMatrices
from ..elements.thermal import thermal_load
from ..meshes.mesh import Mesh, unknown
from ..meshes.surfaces import pressure_load, surface_load
from .parts import Body, BodyForce, Fix, Load, NodalForce, Pressure, Traction
from .temperature import Temperature, changes, check_expansion
from .timing import is_timed, lasting
from .values import component_at, vector_at

if TYPE_CHECKING:
    from .beside import Beside

Array = NDArray[np.float64]
Index = NDArray[np.int64]
ON_AXIS = 1e-12  # of the largest radius, up to which a node is on the axis
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
        cls, bodies: Sequence[Body], supports: Sequence[Fix], beside: Beside
    ) -> Prescribed:
        """Of all supports of a model, those of (x, t) at t = 0 unless they have a time."""
        values = with_held(prescribed_values(bodies, supports, beside), beside)
        if not any(is_timed(s.value) for s in supports):
            return cls(values, values.copy())  # functions of users are not called again
        same = tuple(replace(s, value=lasting(s.value)) for s in supports)
        return cls(values, with_held(prescribed_values(bodies, same, beside), beside))

    @property
    def is_fixed(self) -> NDArray[np.bool_]:
        """Dofs (dofs,) that supports prescribe."""
        return ~np.isnan(self.values)

    def by_body(self, offsets: Index, dim: int) -> tuple[list[NDArray[np.bool_]], list[Array]]:
        """Which components are prescribed, and lasting values: of every body (nodes, dim)."""
        held = self.is_fixed[: offsets[-1]].reshape(-1, dim)
        lasting = self.lasting[: offsets[-1]].reshape(-1, dim)
        return np.split(held, offsets[1:-1] // dim), np.split(lasting, offsets[1:-1] // dim)


def locate(bodies: Sequence[Body], on: str, *, sets: bool = False) -> tuple[int, str]:
    """(body, surface) of a name "surface" or "body.surface"; sets: also node sets."""
    named = [{*body.mesh.surfaces, *(body.mesh.node_sets if sets else ())} for body in bodies]
    found = [k for k, known in enumerate(named) if on in known]
    if len(found) == 1:
        return found[0], on
    if len(found) > 1:
        choices = ", ".join(f"{bodies[k].name}.{on}" for k in found)
        raise InvalidInput(f"surface {on!r}: several bodies have it, write one of {choices}")
    for k, body in enumerate(bodies):
        prefix = f"{body.name}."
        if on.startswith(prefix) and on[len(prefix) :] in named[k]:
            return k, on[len(prefix) :]
    names = [s for known in named for s in known]
    if len(bodies) > 1:
        names += [f"{bodies[k].name}.{s}" for k, known in enumerate(named) for s in known]
    raise InvalidInput(unknown("surface", on, dict.fromkeys(names)))


def with_held(values: Array, beside: Beside) -> Array:
    """Prescribed values (dofs,) with 0 for what is held without a support."""
    for entry in beside.entries.values():
        dofs = entry.dofs if entry.held else entry.dofs[:, list(entry.still)]
        values[dofs] = np.where(np.isnan(values[dofs]), 0.0, values[dofs])
    return values


def prescribed_values(
    bodies: Sequence[Body], supports: Sequence[Fix], beside: Beside
) -> Array:
    """Prescribed displacement of every dof, NaN where it is free, (dofs,).

    Nodes on the axis of an axisymmetric body stay on it.
    """
    values = np.full(beside.total, np.nan)
    for body, first in zip(bodies, beside.offsets[:-1], strict=False):
        values[first + 2 * on_axis(body.mesh)] = 0.0
    for at, support in enumerate(supports):
        dofs, points = _pointed(bodies, support.on, beside)
        what = f"fix on {support.on!r}"
        with within("supports", at, "value"):
            given = vector_at(support.value, points, what, free=True, size=dofs.shape[1])
            _check_agreement(values[dofs], given, points, what)
        values[dofs] = np.where(np.isnan(given), values[dofs], given)
    return values


def on_axis(mesh: Mesh) -> Index:
    """Nodes (k,) on the axis of an axisymmetric mesh; none of others."""
    if not mesh.axisymmetric:
        return np.zeros(0, dtype=np.int64)
    return np.flatnonzero(mesh.points[:, 0] <= ON_AXIS * mesh.points[:, 0].max())


def _pointed(bodies: Sequence[Body], on: str, beside: Beside) -> tuple[Index, Array]:
    """Dofs (k, components) and points (k, dim) under a name, of nodes or beside them."""
    entry = beside.named(on)
    if entry is not None:
        return entry.dofs, entry.points
    k, surface = locate(bodies, on, sets=True)
    mesh = bodies[k].mesh
    nodes = mesh.surface_nodes(surface)
    dofs = beside.offsets[k] + nodes[:, None] * mesh.dim + np.arange(mesh.dim)
    return dofs, mesh.points[nodes]


def _check_agreement(old: Array, new: Array, points: Array, what: str) -> None:
    """Two supports may meet at a node only if they say the same."""
    with np.errstate(invalid="ignore"):
        size = np.nanmax(np.abs(np.concatenate([old.ravel(), new.ravel(), [0.0]])))
        clash = np.argwhere(np.abs(old - new) > SAME * size)
    if len(clash):
        node, axis = clash[0]
        raise InvalidInput(
            f"{what}: component {axis} at {points[node]} is {new[node, axis]}, but "
            f"another support prescribes {old[node, axis]} there"
        )


def external_load(
    bodies: Sequence[Body], loads: Sequence[Load | None], beside: Beside, *, own: bool = True
) -> Array:
    """Nodal forces of loads on the undeformed bodies, (dofs,).

    None stands for a load of the model that is left out, so that others keep their address.
    own: with the loads that bodies of other programs bring.
    """
    out, offsets = np.zeros(beside.total), beside.offsets
    _add_temperature(out, bodies, loads, offsets)
    for k, body in enumerate(bodies):
        if own and isinstance(body.material, GivenMatrices):
            out[offsets[k] : offsets[k + 1]] += body.material.load
    for at, load in enumerate(loads):
        with within("loads", at):
            if isinstance(load, BodyForce):
                _add_body_force(out, bodies, load, offsets)
            elif isinstance(load, NodalForce):
                _add_nodal_force(out, bodies, load, beside)
            elif load is not None and not isinstance(load, Temperature):
                k, surface = locate(bodies, load.on)
                mesh = bodies[k].mesh
                part = (_pressed(mesh, surface, load) if isinstance(load, Pressure)
                        else _drawn(mesh, surface, load))  # fmt: skip
                out[offsets[k] : offsets[k + 1]] += part.ravel()
    return out


def _add_temperature(
    out: Array, bodies: Sequence[Body], loads: Sequence[Load | None], offsets: Index
) -> None:
    """Forces of all changes of temperature."""
    where = [at for at, load in enumerate(loads) if isinstance(load, Temperature)]
    if not where:
        return
    with within("loads", where[0]):
        check_expansion(bodies)
        for mean in {loads[at].mean for at in where}:
            kind = [loads[at] for at in where if loads[at].mean == mean]
            for k, change in enumerate(changes(bodies, kind)):
                if change is None:
                    continue
                if isinstance(bodies[k].material, GivenMatrices):
                    raise InvalidInput(
                        f"temperature: body {bodies[k].name!r} has a given K; give "
                        "the forces of its temperature as load of Body.from_matrix"
                    )
                part = thermal_load(bodies[k].mesh, bodies[k].material, change, mean=mean)
                out[offsets[k] : offsets[k + 1]] += part.ravel()


def _add_nodal_force(
    out: Array, bodies: Sequence[Body], load: NodalForce, beside: Beside
) -> None:
    dofs, points = _pointed(bodies, load.on, beside)
    with within("value"):
        what = f"nodal force on {load.on!r}"
        force = vector_at(load.value, points, what, size=dofs.shape[1])
    np.add.at(out, dofs, force)


def _drawn(mesh: Mesh, surface: str, load: Traction) -> Array:
    """Nodal forces (n, dim) of a traction."""
    facets, nodes = mesh.surface(surface), mesh.surface_nodes(surface)
    traction = np.zeros_like(mesh.points)
    with within("value"):
        what = f"traction on {load.on!r}"
        traction[nodes] = vector_at(load.value, mesh.points[nodes], what)
    return surface_load(mesh.points, facets, traction, axisymmetric=mesh.axisymmetric)


def _pressed(mesh: Mesh, surface: str, load: Pressure) -> Array:
    """Nodal forces (n, dim) of a pressure."""
    nodes, density = mesh.surface_nodes(surface), np.zeros(len(mesh.points))
    with within("value"):
        what = f"pressure on {load.on!r}"
        density[nodes] = component_at(load.value, mesh.points[nodes], what)
    return pressure_load(
        mesh.points, mesh.surface(surface), density, axisymmetric=mesh.axisymmetric
    )


def _add_body_force(
    out: Array, bodies: Sequence[Body], load: BodyForce, offsets: Index
) -> None:
    regions = {region for body in bodies for region in body.mesh.regions}
    if load.region is not None and load.region not in regions:
        text = unknown("region", load.region, regions)
        raise InvalidInput(text, ("region",), "body force")
    for k, body in enumerate(bodies):
        if load.region is None or load.region in body.mesh.regions:
            with within("value"):
                force = vector_at(load.value, body.mesh.points, "body force")
            part = body_load(body.mesh, force, load.region)
            out[offsets[k] : offsets[k + 1]] += part.ravel()
