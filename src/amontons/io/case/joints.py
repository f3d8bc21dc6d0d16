"""References, couplings, equations, springs and bolts of a case file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from ...core.errors import InvalidInput
from .tables import Table
from .values import scalar, vector

if TYPE_CHECKING:
    from ...mechanics.model import Body

TABLES = ("reference", "coupling", "equation", "spring", "pretension")


@dataclass
class Joints:
    """What the tables give to a model."""

    bodies: list[Body]
    references: list[Any] = field(default_factory=list)
    constraints: list[Any] = field(default_factory=list)
    springs: list[Any] = field(default_factory=list)
    supports: list[Any] = field(default_factory=list)
    loads: list[Any] = field(default_factory=list)


def read_joints(top: Table, bodies: Sequence[Body]) -> Joints:
    """All of a file; meshes are opened where a bolt names a plane."""
    made = Joints(list(bodies))
    readers = {"reference": _reference, "coupling": _coupling, "equation": _equation,
               "spring": _spring, "pretension": _pretension}  # fmt: skip
    for name, read in readers.items():
        for table in top.tables(name):
            with table.blamed():
                read(table, made)
    return made


def _reference(table: Table, made: Joints) -> None:
    """name, point; displacement, rotation: prescribed; force, moment: given."""
    from ...mechanics.model import Fix, NodalForce, Reference
    from ...mechanics.model.constraints import ROTATION

    table.only("name", "point", "displacement", "rotation", "force", "moment")
    dim = made.bodies[0].mesh.dim
    name, turns = table.text("name"), 1 if dim == 2 else 3
    made.references.append(Reference(name, table.numbers("point", (dim,))))
    for key, on, size in (("displacement", name, dim), ("rotation", name + ROTATION, turns)):
        if key in table.data:
            made.supports.append(Fix(on, vector(table, key, size, free=True)))
    for key, on, size in (("force", name, dim), ("moment", name + ROTATION, turns)):
        if key in table.data:
            made.loads.append(NodalForce(on, vector(table, key, size)))


def _coupling(table: Table, made: Joints) -> None:
    from ...mechanics.model import Coupling
    from ...mechanics.model.constraints import KINDS

    table.only("on", "reference", "kind", "components")
    kind = table.choice("kind", KINDS, KINDS[0])
    made.constraints.append(
        Coupling(table.text("on"), table.text("reference"), kind, table.data.get("components"))
    )


def _terms(table: Table) -> list[tuple[Any, int, float]]:
    """[nodes, component, coefficient] of each term."""
    given = table.need("terms", "a list of [nodes, component, coefficient]")
    if not isinstance(given, list) or not all(
        isinstance(term, list) and len(term) == 3 for term in given
    ):
        raise table.error("terms", "expected a list of [nodes, component, coefficient]")
    return [tuple(term) for term in given]


def _equation(table: Table, made: Joints) -> None:
    from ...mechanics.model import Equation

    table.only("terms", "name")
    made.constraints.append(Equation(_terms(table), table.text("name", "")))


def _spring(table: Table, made: Joints) -> None:
    from ...mechanics.model import Spring

    table.only("terms", "stiffness", "name")
    spring = Spring(_terms(table), table.number("stiffness"), table.text("name", ""))
    made.springs.append(spring)


def _pretension(table: Table, made: Joints) -> None:
    """name; sides, or a plane by point and normal (mesh, region); force or length; locked."""
    from ...mechanics.model import Fix, NodalForce, Pretension

    table.only("name", "sides", "point", "normal", "mesh", "region", "force", "length",
               "locked")  # fmt: skip
    name = table.text("name")
    if ("sides" in table.data) == ("point" in table.data):
        raise table.error("", "expected either sides, two surfaces, or point and normal")
    sides = _opened(table, made, name) if "point" in table.data else table.data["sides"]
    locked = table.number("locked") if "locked" in table.data else None
    made.constraints.append(Pretension(name, sides, locked=locked))
    if ("force" in table.data) == ("length" in table.data):
        raise table.error("", "expected either force, > 0 in tension, or length")
    if "force" in table.data:
        force: Any = [scalar(table, "force")]
        made.loads.append(NodalForce(name, force))
    else:
        length: Any = [scalar(table, "length")]
        made.supports.append(Fix(name, length))


def _opened(table: Table, made: Joints, name: str) -> tuple[str, str]:
    """Open the mesh of one body along the plane; the two surfaces."""
    from ...mechanics.meshes import opened

    dim = made.bodies[0].mesh.dim
    names = [body.name for body in made.bodies]
    k = 0
    if len(names) > 1:
        which = table.choice("mesh", names)
        k = names.index(which)
    point, normal = (table.numbers(key, (dim,)) for key in ("point", "normal"))
    region = table.text("region") if "region" in table.data else None
    try:
        mesh = opened(made.bodies[k].mesh, name, point, normal, region)
    except InvalidInput as reason:
        raise table.error("point", reason.text) from None
    made.bodies[k] = replace(made.bodies[k], mesh=mesh)
    return f"{name}-below", f"{name}-above"
