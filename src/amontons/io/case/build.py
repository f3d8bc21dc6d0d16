"""From the tables of a case file to a model and solver settings."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Sequence
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.errors import FileFormatError, InvalidInput
from ...core.files import check_is_regular
from ...core.words import near_file, nearest
from ..readers import Case
from ..units import UNIT_NAMES, Units
from .bodies import read_bodies, read_material
from .contacts import read_contact, refuse_repeated
from .evolution import Evolution, read_evolution, read_wall
from .found import found_contacts
from .joints import TABLES, read_joints
from .keys import key_of
from .overrides import apply_overrides, check_depth
from .settings import GENERAL, LIMITS, Settings, make_solver, method_class
from .tables import Table
from .values import configuration, on_named, on_surface, pressure_on, temperature_of, vector

if TYPE_CHECKING:
    from ...mechanics.model import Model

EXAMPLE = "example:"  # before the name of a built-in case
DATA = files("amontons") / "examples_data"
SLIPS = {  # values that are no TOML, and what is meant
    r"[-+]?\d+,\d+": "numbers have a point, not a comma",
    r"[-+]?\.\d+": "numbers begin with a digit, 0.1 and not .1",
    r"(?!true$|false$|inf$|nan$)[A-Za-z][\w-]*": "words stand in quotes",
}
NO_CONTACT = "no [[contact]]: the bodies meet nothing, linear statics"
LARGEST_FILE = 2**24  # bytes of a case file; meshes stand in files of their own
TOP = ("title", "mesh", "wall", "material", "fix", "traction", "pressure", "body_force",
       "temperature", "contact", "solver", "continuation", "evolution", "units",
       *TABLES)  # fmt: skip


def read_case(
    path: str | os.PathLike[str], overrides: Sequence[str] = (), method: str | None = None
) -> Case:
    """The case in a TOML file; overrides such as "mesh.cells=32" replace single values.

    path: also "example:NAME", a case that comes with amontons.  method: solver in place of that
    of the case, before the overrides; options that the case has for another one go with it.
    Raises FileFormatError naming the file, the key, what was found and what was expected.
    """
    text = os.fspath(path)
    is_example = text.startswith(EXAMPLE)
    path = example_file(text.removeprefix(EXAMPLE)) if is_example else Path(path)
    data = _load(path)
    check_depth(data, str(path))
    if method is not None:
        data = with_method(data, method)
    top = Table(str(path), "", apply_overrides(data, overrides, str(path)))
    for key in top.data:
        if key not in TOP and key in GENERAL:
            raise top.error(key, f"unknown key; did you mean 'solver.{key}'?")
    top.only(*TOP)
    title = top.text("title", path.stem if path.stem != "case" else path.parent.name)
    model, notes = (
        (_wall_model(top, title), ()) if "wall" in top.data else _model(top, path, title)
    )
    settings = _settings(top)
    return Case(model, settings, title, path, _evolution(top, settings), top.data,
                key_of=partial(key_of, tables=top.data), notes=notes,
                units=_units(top))  # fmt: skip


def _units(top: Table) -> Units:
    """The names of the units in [units]: length, force, time."""
    if "units" not in top.data:
        return Units()
    table = top.table("units")
    table.only(*UNIT_NAMES)
    return Units(**{name: table.text(name) for name in table.data})


def example_file(name: str) -> Path:
    """The file of a built-in case; InvalidInput names the nearest where there is none."""
    path = Path(str(DATA / f"{name}.toml"))
    known = [file.name[:-5] for file in DATA.iterdir() if file.name.endswith(".toml")]
    if name not in known:
        raise InvalidInput(f"{EXAMPLE}{name}: no such example of a case{nearest(name, known)}")
    return path


def _load(path: Path) -> dict[str, Any]:
    check_is_regular(path)
    try:
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            if size > LARGEST_FILE:
                raise FileFormatError(
                    f"{path}: expected a case file of at most {LARGEST_FILE} bytes, got {size}"
                )
            return tomllib.loads(file.read().decode("utf-8-sig"))  # editors put a mark first
    except FileNotFoundError:
        raise FileFormatError(f"{path}: no such file{near_file(path)}") from None
    except IsADirectoryError:
        raise FileFormatError(f"{path}: expected a TOML case file, this is a folder") from None
    except OSError as reason:
        raise FileFormatError(f"{path}: can not be read: {reason.strerror}") from None
    except UnicodeDecodeError:
        raise FileFormatError(f"{path}: expected UTF-8 text") from None
    except FileFormatError:
        raise
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as reason:
        why = f"{reason}{_hint(path)}"
        raise FileFormatError(f"{path}: not valid TOML: {why}") from None


def _hint(path: Path) -> str:
    """What is often wrong in a file that is no TOML, in words, or ""."""
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        value = line.partition("#")[0].partition("=")[2].strip()
        for pattern, words in SLIPS.items():
            if re.fullmatch(pattern, value):
                return f"; {words}: {line.strip()}"
    return ""


# -------------------------------------------------------------------------------- model
def _model(top: Table, path: Path, title: str) -> tuple[Model, tuple[str, ...]]:
    """The model, and what is to be said of contacts that were found."""
    from ...mechanics.model import BodyForce, Fix, Model, Traction

    bodies = read_bodies(top, path)
    dim = bodies[0].mesh.dim
    for k, body in enumerate(bodies):
        if body.mesh.dim != dim:
            raise top.error(f"mesh[{k}]", f"expected a mesh in {dim}D as the first, got "
                            f"one in {body.mesh.dim}D")  # fmt: skip
    joints = read_joints(top, bodies)
    bodies = joints.bodies
    fixes = [on_surface(Fix, table, bodies, free=True) for table in top.tables("fix")]
    loads: list = [
        on_surface(Traction, table, bodies, "configuration") for table in top.tables("traction")
    ]
    loads += [pressure_on(table, bodies) for table in top.tables("pressure")]
    for table in top.tables("body_force"):
        table.only("value", "region", "configuration")
        region = table.text("region") if "region" in table.data else None
        value = vector(table, "value", dim)
        loads.append(BodyForce(value, region=region, **configuration(table)))
    loads += [temperature_of(table, bodies) for table in top.tables("temperature")]
    named = [table for table in top.tables("contact") if "pairs" not in table.data]
    contacts = [read_contact(table, bodies) for table in named]
    refuse_repeated(top)
    notes = () if contacts or "contact" in top.data else (NO_CONTACT,)
    if (found := found_contacts(top.tables("contact"), bodies, contacts)) is not None:
        bodies, notes = found.bodies, found.lines
        contacts += found.contacts
    with top.blamed("contact", partial(key_of, tables=top.data)):
        return Model(
            bodies, supports=[*fixes, *joints.supports], contacts=contacts,
            loads=[*loads, *joints.loads], name=title, references=joints.references,
            constraints=joints.constraints, springs=joints.springs,
        ), notes  # fmt: skip


def _wall_model(top: Table, title: str) -> Model:
    """The model of a case with [wall] in the place of [mesh] and [[contact]]."""
    from ...mechanics.model import BodyForce, Fix, Traction

    for key in ("mesh", "contact"):
        if key in top.data:
            raise top.error(key, "not with [wall], which makes its meshes and contacts")
    for key in ("temperature", *TABLES):
        if key in top.data:
            raise top.error(key, "not with [wall], which makes its meshes and contacts")
    if "pressure" in top.data:
        raise top.error("pressure", "not with [wall], whose surfaces are flat: give a traction")
    table = top.table("material")
    table.only("default", "plate")
    table.need("default", "a table")
    materials = {name: read_material(table.table(name)) for name in table.data}
    with top.table("wall").blamed():
        wall = read_wall(top.table("wall"), materials)
    dim = len(wall.size)
    fixes = [on_named(Fix, part, dim, free=True) for part in top.tables("fix")]
    loads: list = [on_named(Traction, part, dim) for part in top.tables("traction")]
    for part in top.tables("body_force"):
        part.only("value")
        loads.append(BodyForce(vector(part, "value", dim)))
    with top.blamed("wall", partial(key_of, tables=top.data)):
        return wall.model(fixes, loads, title)


def _evolution(top: Table, settings: Settings) -> Evolution | None:
    if "evolution" not in top.data:
        return None
    with top.table("evolution").blamed():
        return read_evolution(top.table("evolution"), settings.continuation())


# ------------------------------------------------------------------------------- solver
def with_method(data: dict[str, Any], method: str) -> dict[str, Any]:
    """The data of a case with another solver, without the options of the one it had."""
    table = data.get("solver", {})
    if not isinstance(table, dict):
        return data  # reading it will say so
    same = table.get("method", "auto") == method
    kept = {key: value for key, value in table.items() if same or key in GENERAL}
    return data | {"solver": kept | {"method": method}}


def _settings(top: Table) -> Settings:
    table = top.table("solver") if "solver" in top.data else Table(top.file, "solver", {})
    method = table.text("method", "auto")
    tolerance = table.number("tolerance", 1e-8)
    if not 0 < tolerance < 1:
        raise table.error("tolerance", f"expected a number between 0 and 1, got {tolerance}")
    single = table.number("contact_tolerance") if "contact_tolerance" in table.data else None
    if single is not None and not single > 0:
        raise table.error("contact_tolerance", f"expected a number > 0, got {single}")
    limits = [table.whole(key) for key in LIMITS]
    seconds = table.number("time_limit") if "time_limit" in table.data else None
    if seconds is not None and not seconds > 0:
        raise table.error("time_limit", f"expected seconds > 0, got {seconds}")
    options = {key: value for key, value in table.data.items() if key not in GENERAL}
    with table.blamed("method"):
        method_class(method)
    with top.blamed():  # its addresses begin with solver
        make_solver(method, options)
    limit = next((value for value in limits if value is not None), None)
    paths = dict(top.table("continuation").data) if "continuation" in top.data else {}
    settings = Settings(method, tolerance, limit, seconds, options, single, paths)
    with top.blamed():
        settings.continuation()
    return settings
