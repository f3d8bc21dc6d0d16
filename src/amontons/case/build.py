"""From the tables of a case file to a model and solver settings."""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import AmontonsError, FileFormatError, InvalidInput, MissingDependency
from ..expressions import Expression
from .evolution import Evolution, read_evolution, read_wall
from .overrides import apply_overrides
from .settings import LIMITS, Settings, make_solver, method_class
from .tables import LARGEST, Table

if TYPE_CHECKING:
    from ..contact import Nitsche, Obstacle
    from ..fem import Mesh
    from ..model import Contact, Model
    from ..model.parts import Material

TOP = ("title", "mesh", "wall", "material", "fix", "traction", "body_force", "contact",
       "solver", "evolution")  # fmt: skip
LAWS = {  # of materials, with their own keys
    "linear-elastic": ("plane", "density"), "neo-hookean": (), "ciarlet-geymonat": ("a",),
}  # fmt: skip
MAX_NODES = 5_000_000  # of a box: a typing error must not fill the memory


@dataclass(frozen=True, eq=False)
class Case:
    """A model, the settings of the [solver] table, a title, and how it goes on in time."""

    model: Model
    settings: Settings
    title: str
    path: Path
    evolution: Evolution | None = None


def read_case(path: str | os.PathLike[str], overrides: Sequence[str] = ()) -> Case:
    """The case in a TOML file; overrides such as "mesh.cells=32" replace single values.

    Raises FileFormatError naming the file, the key, what was found and what was expected.
    """
    path = Path(path)
    top = Table(str(path), "", apply_overrides(_load(path), overrides, str(path)))
    top.only(*TOP)
    title = top.text("title", path.stem if path.stem != "case" else path.parent.name)
    model = _wall_model(top, title) if "wall" in top.data else _model(top, path, title)
    return Case(model, _settings(top), title, path, _evolution(top))


def _load(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as file:
            return tomllib.load(file)
    except FileNotFoundError:
        raise FileFormatError(f"{path}: no such file") from None
    except IsADirectoryError:
        raise FileFormatError(f"{path}: expected a TOML case file, this is a folder") from None
    except OSError as reason:
        raise FileFormatError(f"{path}: can not be read: {reason.strerror}") from None
    except UnicodeDecodeError:
        raise FileFormatError(f"{path}: expected UTF-8 text") from None
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as reason:
        raise FileFormatError(f"{path}: not valid TOML: {reason}") from None


# -------------------------------------------------------------------------------- model
def _model(top: Table, path: Path, title: str) -> Model:
    from ..model import Body, BodyForce, Fix, Model, Traction

    mesh = _mesh(top.table("mesh"), path)
    order = top.table("mesh").whole("order", 1)
    if order not in (1, 2):
        raise top.error("mesh.order", f"expected 1 or 2, got {order}")
    material = _materials(top.table("material"), mesh)
    fixes = [_on_surface(Fix, table, mesh, free=True) for table in top.tables("fix")]
    loads: list = [_on_surface(Traction, table, mesh) for table in top.tables("traction")]
    for table in top.tables("body_force"):
        table.only("value", "region")
        region = table.text("region") if "region" in table.data else None
        loads.append(BodyForce(_vector(table, "value", mesh.dim), region=region))
    if "contact" not in top.data:
        raise top.error("contact", "missing, expected at least one table [[contact]]")
    contacts = [_contact(table, mesh) for table in top.tables("contact")]
    _refuse_repeated(top)
    with _Blame(top, "material"):
        body = Body(mesh, material, order=order)
    with _Blame(top, "contact"):
        return Model([body], supports=fixes, contacts=contacts, loads=loads, name=title)


def _wall_model(top: Table, title: str) -> Model:
    """The model of a case with [wall] in the place of [mesh] and [[contact]]."""
    from ..model import BodyForce, Fix, Traction

    for key in ("mesh", "contact"):
        if key in top.data:
            raise top.error(key, "not with [wall], which makes its meshes and contacts")
    table = top.table("material")
    table.only("default", "plate")
    table.need("default", "a table")
    materials = {name: _material(table.table(name)) for name in table.data}
    with _Blame(top.table("wall"), ""):
        wall = read_wall(top.table("wall"), materials)
    dim = len(wall.size)
    fixes = [_on_named(Fix, part, dim, free=True) for part in top.tables("fix")]
    loads: list = [_on_named(Traction, part, dim) for part in top.tables("traction")]
    for part in top.tables("body_force"):
        part.only("value")
        loads.append(BodyForce(_vector(part, "value", dim)))
    with _Blame(top, "wall"):
        return wall.model(fixes, loads, title)


def _evolution(top: Table) -> Evolution | None:
    if "evolution" not in top.data:
        return None
    with _Blame(top.table("evolution"), ""):
        return read_evolution(top.table("evolution"))


@dataclass(frozen=True)
class _Blame:
    """Turns what the layers below reject into a complaint about a key of the file."""

    table: Table
    key: str

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: type | None, error: BaseException | None, trace: object) -> None:
        if isinstance(error, FileFormatError | MissingDependency):
            return
        if isinstance(error, InvalidInput):
            raise self.table.error(self.key, str(error)) from error


def _mesh(table: Table, path: Path) -> Mesh:
    from ..fem import box

    if ("box" in table.data) == ("file" in table.data):
        raise table.error("", "expected either box, the sizes of a box, or file")
    if "file" in table.data:
        return _mesh_file(table, path)
    table.only("box", "cells", "kind", "order")
    size = table.numbers("box", (2, 3))
    if any(0 < abs(length) < 1 / LARGEST for length in size):
        raise table.error("box", f"expected lengths above {1 / LARGEST:g}, got {size}")
    cells = table.need("cells", "a whole number or one per direction")
    counts = cells if isinstance(cells, list) else [cells] * len(size)
    if len(counts) != len(size) or not all(type(c) is int and c >= 1 for c in counts):
        raise table.error("cells", f"expected a whole number >= 1, or {len(size)} of them, "
                          f"got {cells!r}")  # fmt: skip
    if math.prod(c + 1 for c in counts) > MAX_NODES:
        raise table.error("cells", f"expected at most {MAX_NODES} nodes, got {cells!r}; "
                          "build larger models in Python")  # fmt: skip
    with _Blame(table, ""):
        return box(size, counts, table.text("kind") if "kind" in table.data else None)


def _mesh_file(table: Table, path: Path) -> Mesh:
    """The mesh of a mesh file or CAD file, refined if asked for."""
    from ..fem import refined

    table.only("file", "size", "order", "refine")
    times = table.whole("refine", 0, minimum=0)
    mesh = _read_file(table, path)
    if mesh.cell_count * 2 ** (mesh.dim * times) > MAX_NODES:
        raise table.error("refine", f"expected at most {MAX_NODES} cells, got {times}; "
                          "build larger models in Python")  # fmt: skip
    return refined(mesh, times)


def _read_file(table: Table, path: Path) -> Mesh:
    """The mesh of a mesh file, or of a CAD file, which needs a size of cells."""
    from ..fem import is_cad, read_cad, read_mesh

    name = path.parent / table.text("file")
    if not name.is_file():
        raise table.error("file", f"no such file: {name}")
    if not is_cad(name):
        if "size" in table.data:
            raise table.error("size", "only for CAD files, a mesh file has its cells")
        with _Blame(table, "file"):
            return read_mesh(name)
    table.need("size", "the size of cells in mm, as a CAD file has no mesh")
    size = table.number("size")
    if size <= 0:
        raise table.error("size", f"expected a length > 0, got {size}")
    with _Blame(table, "file"):
        return read_cad(name, size)


def _materials(table: Table, mesh: Mesh) -> Material | dict[str, Material]:
    """One material for all, [material.default], and one per region named otherwise."""
    found = {region: _material(table.table(region)) for region in table.data}
    if not found:
        raise table.error("", "expected a table [material.default]")
    if set(found) == {"default"}:
        return found["default"]
    if "default" in found and "default" not in mesh.regions:
        found = {region: found.get(region, found["default"]) for region in mesh.regions} | {
            region: law for region, law in found.items() if region != "default"
        }
    return found


def _material(table: Table) -> Material:
    from ..model import CiarletGeymonat, LinearElastic, NeoHookean

    law = table.choice("law", tuple(LAWS), "linear-elastic")
    table.only("law", "young", "poisson", *LAWS[law])
    density = table.number("density") if "density" in table.data else None
    young, poisson = table.number("young"), table.number("poisson")
    with _Blame(table, ""):
        if law == "neo-hookean":
            return NeoHookean(young, poisson)
        if law == "ciarlet-geymonat":
            return CiarletGeymonat(
                young, poisson, table.number("a") if "a" in table.data else None
            )
        return LinearElastic(
            young, poisson, table.choice("plane", ("strain", "stress"), "strain"), density
        )


def _contact(table: Table, mesh: Mesh) -> Contact:
    from ..model import Contact

    table.only("slave", "obstacle", "master", "friction", "method")
    method = _contact_method(table)
    slave = table.text("slave")
    for key in ("slave", "master"):
        if key in table.data:
            with _Blame(table, key):
                mesh.surface(table.text(key))
    if ("obstacle" in table.data) == ("master" in table.data):
        raise table.error("", "expected either obstacle or master")
    friction = table.table("friction")
    friction.only("coulomb", "tresca")
    if len(friction.data) != 1:
        raise friction.error("", "expected either coulomb, a coefficient, or tresca, a stress")
    key = next(iter(friction.data))
    value = _scalar(friction, key)
    if isinstance(value, float) and value < 0:
        raise friction.error(key, f"expected a number >= 0, got {value}")
    mu, tresca = (value, None) if key == "coulomb" else (None, value)
    with _Blame(table, ""):
        if "master" in table.data:
            master = table.text("master")
            return Contact(slave, master=master, mu=mu, tresca=tresca, method=method)
        obstacle = _obstacle(table.table("obstacle"), mesh.dim)
        return Contact(slave, obstacle, mu=mu, tresca=tresca, method=method)


def _contact_method(table: Table) -> str | Nitsche:
    """A word, or a table { kind = "nitsche", kappa = …, theta = … } of options."""
    from ..contact import Nitsche

    if not isinstance(table.data.get("method"), dict):
        return table.choice("method", ("nodal", "mortar", "dual-mortar", "nitsche"), "nodal")
    options = table.table("method")
    options.only("kind", "kappa", "scale", "theta", "points")
    options.need("kind", "'nitsche', the method that has options")
    options.choice("kind", ("nitsche",))
    values: dict[str, Any] = {
        key: options.number(key) for key in ("kappa", "scale", "theta") if key in options.data
    }
    if "points" in options.data:
        values["points"] = options.whole("points")
    with _Blame(options, ""):
        return Nitsche(**values)


def _refuse_repeated(top: Table) -> None:
    """The same pair twice would share its load at random; two laws do not fit one problem."""
    seen: list[dict[str, Any]] = []
    tables = top.tables("contact")
    for table in tables:
        law, first = (set(part.data["friction"]) for part in (table, tables[0]))
        if law != first:
            raise table.error(
                "friction", f"expected {first.pop()} as in contact[0], one law for all, "
                f"got {law.pop()}"
            )  # fmt: skip
        pair = {key: table.data.get(key) for key in ("slave", "obstacle", "master")}
        if pair in seen:
            raise table.error(
                "", f"the same slave and partner as in contact[{seen.index(pair)}]; "
                "expected every pair once"
            )  # fmt: skip
        seen.append(pair)


def _obstacle(table: Table, dim: int) -> Obstacle:
    from ..contact import LevelSet, Plane, Sphere

    table.only("plane", "sphere", "level_set")
    if len(table.data) != 1:
        raise table.error("", "expected one of plane, sphere, level_set")
    kind = next(iter(table.data))
    if kind == "level_set":
        function = _scalar(table, "level_set")
        if not isinstance(function, Expression):
            raise table.error(kind, f"expected an expression in x, y, z, got {function}")
        return LevelSet(function)
    inner = table.table(kind)
    with _Blame(inner, ""):
        if kind == "plane":
            inner.only("point", "normal")
            point = inner.numbers("point", (dim,)) if "point" in inner.data else None
            return Plane(normal=inner.numbers("normal", (dim,)), point=point)
        inner.only("center", "radius")
        return Sphere(center=inner.numbers("center", (dim,)), radius=inner.number("radius"))


# ------------------------------------------------------------------------------- values
def _on_surface(kind: type, table: Table, mesh: Mesh, *, free: bool = False) -> Any:
    part = _on_named(kind, table, mesh.dim, free=free)
    with _Blame(table, "on"):
        mesh.surface(part.on)
    return part


def _on_named(kind: type, table: Table, dim: int, *, free: bool = False) -> Any:
    table.only("on", "value")
    return kind(table.text("on"), _vector(table, "value", dim, free=free))


def _vector(table: Table, key: str, dim: int, *, free: bool = False) -> list:
    """One number, expression or, for supports, "free" (None) per component."""
    words = "numbers or expressions" + (' or "free"' if free else "")
    values = table.need(key, f"a list of {dim} {words}")
    if not isinstance(values, list) or len(values) != dim:
        raise table.error(key, f"expected a list of {dim} {words}, got {values!r}")
    return [
        None if free and value == "free" else _entry(table, f"{key}[{k}]", value, dim)
        for k, value in enumerate(values)
    ]


def _scalar(table: Table, key: str) -> float | Expression:
    return _entry(table, key, table.need(key, "a number or an expression"), 3)


def _entry(table: Table, key: str, value: Any, dim: int) -> float | Expression:
    """A finite number, or an expression; one without variables is a number at once."""
    if not isinstance(value, str):
        return table.as_number(key, value)
    try:
        expression = Expression(value)
        if dim == 2 and "z" in expression.names:
            raise InvalidInput(f"expression {value!r}: 'z' does not exist in 2D")
        return expression if expression.names else float(expression(np.zeros(3)))
    except AmontonsError as reason:
        raise table.error(key, str(reason)) from None


# ------------------------------------------------------------------------------- solver
def _settings(top: Table) -> Settings:
    table = top.table("solver") if "solver" in top.data else Table(top.file, "solver", {})
    method = table.text("method", "auto")
    tolerance = table.number("tolerance", 1e-8)
    if not 0 < tolerance < 1:
        raise table.error("tolerance", f"expected a number between 0 and 1, got {tolerance}")
    limits = [table.whole(key) for key in LIMITS]
    seconds = table.number("time_limit") if "time_limit" in table.data else None
    if seconds is not None and not seconds > 0:
        raise table.error("time_limit", f"expected seconds > 0, got {seconds}")
    used = ("method", "tolerance", "time_limit", *LIMITS)
    options = {key: value for key, value in table.data.items() if key not in used}
    with _Blame(table, "method"):
        method_class(method)
    with _Blame(top, ""):  # its messages begin with solver.FIELD
        make_solver(method, options)
    limit = next((value for value in limits if value is not None), None)
    return Settings(method, tolerance, limit, seconds, options)
