"""A change of temperature as a load of a model, and what it is at the nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import number
from ...core.errors import InvalidInput
from ...core.words import helpful
from ..elements.elasticity import materials_by_region
from ..elements.rigid import Rigid
from ..meshes.mesh import unknown
from .timing import at_time, is_timed
from .values import component_at

if TYPE_CHECKING:
    from .body import Body
    from .model import Model

Array = NDArray[np.float64]


@helpful
@dataclass(frozen=True, eq=False)
class Temperature:
    """A change of temperature from the state without stress: a number or function of x (dim,).

    It acts on all bodies, on the named region, or on the nodes of a set or surface alone (on).
    What grows, and by how much, is the `expansion` of linear elastic materials.  Several add.
    mean: quad and hex cells of full integration take the mean of their nodes, as CalculiX and
    Abaqus do; a temperature that varies bends them less than it should.
    """

    value: float | Callable[..., float]
    region: str | None = None
    on: str | None = None
    mean: bool = False

    def __post_init__(self) -> None:
        if not callable(self.value):
            object.__setattr__(self, "value", number("temperature", self.value))
        if self.region is not None and self.on is not None:
            raise InvalidInput("temperature: expected region or on, got both")

    configuration = "reference"


def changes(bodies: Sequence[Body], loads: Sequence[Any]) -> list[Array | None]:
    """The change of temperature at the nodes, (n,), of every body; None where there is none.

    Other loads are passed over.  Raises InvalidInput for unknown regions and node sets.
    """
    out: list[Array | None] = [None] * len(bodies)
    for load in loads:
        if not isinstance(load, Temperature):
            continue
        met = False
        for k, body in enumerate(bodies):
            nodes = _nodes(bodies, k, load)
            if nodes is None or isinstance(body.material, Rigid):
                continue
            met = True
            before = out[k]
            added = np.zeros(len(body.mesh.points)) if before is None else before
            added[nodes] += component_at(load.value, body.mesh.points[nodes], "temperature")
            out[k] = added
        if not met:
            regions = {region for body in bodies for region in body.mesh.regions}
            raise InvalidInput(unknown("region", load.region, regions), ("region",),
                               "temperature")  # fmt: skip
    return out


def _nodes(bodies: Sequence[Body], k: int, load: Temperature) -> NDArray[np.int64] | None:
    """Nodes of body k that a temperature acts on; None without any."""
    from .supports import locate

    mesh = bodies[k].mesh
    if load.on is not None:
        owner, name = locate(bodies, load.on, sets=True)
        return mesh.surface_nodes(name) if owner == k else None
    if load.region is None:
        return np.arange(len(mesh.points))
    own = [cells.nodes.ravel() for cells in mesh.cells if cells.region == load.region]
    return np.unique(np.concatenate(own)) if own else None


def check_expansion(bodies: Sequence[Body]) -> None:
    """Raise InvalidInput where no material expands: a temperature would change nothing."""
    for body in bodies:
        if isinstance(body.material, Rigid):
            continue
        for law in materials_by_region(body.mesh, body.material).values():
            if np.any(getattr(law, "expansion", 0.0)):
                return
    raise InvalidInput(
        "temperature: no material has an expansion, expected LinearElastic(..., expansion=...) "
        "or OrthotropicElastic of one"
    )


def warming(model: Model, time: float | None = None) -> list[Array | None]:
    """The change of temperature at the nodes of every body, as stresses of a result see it.

    At the load factor of the model, or of a step in time at `time`.
    """
    factor, loads = model.load_factor, list(model.loads)
    if time is not None:
        timed = any(is_timed(part.value) for part in (*model.supports, *model.loads))
        factor = 1.0 if timed else time
        loads = [_at(load, time) for load in loads]
    found = changes(model.bodies, loads)
    return [None if each is None else factor * each for each in found]


def _at(load: Any, time: float) -> Any:
    if not isinstance(load, Temperature):
        return load
    return replace(load, value=at_time(load.value, time))
