"""Contacts of a case file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from .obstacles import read_obstacle
from .tables import Table
from .values import configuration, steady

if TYPE_CHECKING:
    from ...mechanics.contact import Nitsche
    from ...mechanics.model import Body, Contact

LAWS = "a table, { coulomb = COEFFICIENT } or { tresca = STRESS }, or 'tied'"
NUMBERS = {"coulomb": "mu", "tresca": "tresca", "cap": "cap", "cohesion": "cohesion",
           "stiffness": "stiffness", "stick_stiffness": "stick_stiffness"}  # fmt: skip
POSITIVE = ("stiffness", "stick_stiffness")


def read_contact(table: Table, bodies: Sequence[Body]) -> Contact:
    """The contact of a table [[contact]]."""
    from ...mechanics.model import Contact
    from ...mechanics.model.supports import locate

    table.only("slave", "obstacle", "master", "friction", "method", "kinematics",
               "configuration", "name", "clearance", "follows")  # fmt: skip
    method = contact_method(table)
    if isinstance(table.data.get("slave"), list):
        raise table.error("slave", "expected one surface; write a table [[contact]] for each")
    slave = table.text("slave")
    masters = table.texts("master") if isinstance(table.data.get("master"), list) else ()
    for key in ("slave", *(() if masters else ("master",))):
        if key in table.data:
            with table.blamed(key):
                locate(bodies, table.text(key))
    for name in masters:
        with table.blamed("master"):
            locate(bodies, name)
    if ("obstacle" in table.data) == ("master" in table.data):
        raise table.error("", "expected either obstacle = { plane = { normal = [0, 1] } } or "
                          'master = "SURFACE"')  # fmt: skip
    numbers = friction(table)
    found = configuration(table)  # older words for kinematics
    if "kinematics" in table.data:
        found["kinematics"] = table.choice("kinematics", ("small", "finite"))
    if "clearance" in table.data:
        found["clearance"] = steady(table, "clearance")
    for key in ("name", "follows"):
        if key in table.data:
            found[key] = table.text(key)
    with table.blamed():
        if "master" in table.data:
            master, *more = masters or (table.text("master"),)
            found["more_masters"] = more
            return Contact(slave, master=master, **numbers, method=method, **found)
        words = "a table, such as { plane = { normal = [0, 1] } }"
        given = table.as_table("obstacle", table.data["obstacle"], words)
        obstacle = read_obstacle(given, bodies[0].mesh.dim)
        return Contact(slave, obstacle, **numbers, method=method, **found)


def friction(contact: Table) -> dict[str, Any]:
    """The numbers of a law by the names that `Contact` has for them."""
    given = contact.need("friction", LAWS)
    if given == "tied":
        return {"tied": True}
    if isinstance(given, int | float) and not isinstance(given, bool):
        hint = f"write {{ coulomb = {given} }}"
        raise contact.error("friction", f"expected {LAWS}, got {given}; {hint}")
    table = contact.as_table("friction", given, LAWS)
    table.only(*NUMBERS, "direction", "tied")
    if "tied" in table.data:
        return _tied(table)
    if ("coulomb" in table.data) == ("tresca" in table.data):
        raise table.error("", "expected either coulomb, a coefficient, or tresca, a stress")
    if "cap" in table.data and "tresca" in table.data:
        raise table.error("cap", "a largest shear stress goes with coulomb; tresca is one")
    numbers = _orthotropic(table)
    return numbers | _scalars(table, {"coulomb", "direction"} if numbers else set())


def _tied(table: Table) -> dict[str, Any]:
    """Bonds, maybe elastic ones: { tied = true, stiffness = … }."""
    table.only("tied", *POSITIVE)
    if table.data["tied"] is not True:
        raise table.error("tied", "expected true; without the key contact is unilateral")
    return {"tied": True} | _scalars(table, {"tied"})


def _scalars(table: Table, done: set[str]) -> dict[str, Any]:
    """The numbers that are a number or an expression, but for the keys that are done."""
    numbers: dict[str, Any] = {}
    for key in (key for key in table.data if key not in done):
        if key == "stiffness" and isinstance(table.data[key], dict):
            numbers[key] = _overclosure(table.table(key))
            continue
        value = numbers[NUMBERS[key]] = steady(table, key)
        if isinstance(value, float) and value < 0:
            raise table.error(key, f"expected a number >= 0, got {value}")
        if key in POSITIVE and value == 0:
            raise table.error(key, "expected a number > 0; without the key contact is rigid")
    return numbers


def _orthotropic(table: Table) -> dict[str, Any]:
    """The two coefficients and their direction, where coulomb is a list."""
    given = table.data.get("coulomb")
    if isinstance(given, dict) and "direction" not in table.data:
        return {"mu": _curve(table.table("coulomb"))}
    if isinstance(given, list) != ("direction" in table.data):
        raise table.error(
            "direction" if "direction" in table.data else "coulomb",
            "expected two coefficients with a direction, coulomb = [0.2, 0.4] and "
            "direction = [1, 0, 0]: along it and across",
        )
    if not isinstance(given, list):
        return {}
    along, across = (float(mu) for mu in table.numbers("coulomb", (2,)))
    if min(along, across) < 0:
        raise table.error("coulomb", f"expected numbers >= 0, got {min(along, across)}")
    return {"mu": along, "mu_across": across, "direction": table.numbers("direction", (3,))}


def _curve(table: Table) -> Any:
    """Coefficients over pressure or slip speed, { mu = [0.3, 0.1], speed = [0.0, 1.0] }."""
    from ...problem.law import FrictionCurve

    table.only("mu", "pressure", "speed")
    table.need("mu", "coefficients, one for each pressure or speed")
    with table.blamed():
        return FrictionCurve(**{key: table.data[key] for key in table.data})


def _overclosure(table: Table) -> Any:
    """Pressure over overclosure, a table of both or the exponential law of p0 and c0."""
    from ...problem.law import ExponentialOverclosure, OverclosureCurve

    exponential = "p0" in table.data or "c0" in table.data
    names = ("p0", "c0") if exponential else ("pressure", "overclosure")
    table.only(*names)
    for name in names:
        table.need(name, "the numbers of a curve of pressure over overclosure")
    with table.blamed():
        kind: Any = ExponentialOverclosure if exponential else OverclosureCurve
        return kind(**{key: table.data[key] for key in table.data})


def contact_method(table: Table) -> str | Nitsche | None:
    """A word, or a table { kind = "nitsche", kappa = …, theta = … } of options, or None."""
    from ...mechanics.contact import Nitsche

    if "method" not in table.data:
        return None
    if not isinstance(table.data.get("method"), dict):
        return table.choice("method", ("nodal", "mortar", "dual-mortar", "nitsche"))
    options = table.table("method")
    options.only("kind", "kappa", "scale", "theta", "points")
    options.need("kind", "'nitsche', the method that has options")
    options.choice("kind", ("nitsche",))
    values: dict[str, Any] = {
        key: options.number(key) for key in ("kappa", "scale", "theta") if key in options.data
    }
    if "points" in options.data:
        values["points"] = options.whole("points")
    with options.blamed():
        return Nitsche(**values)


def refuse_repeated(top: Table) -> None:
    """The same pair twice would share its load at random."""
    seen: list[dict[str, Any]] = []
    places: list[int] = []
    for k, table in enumerate(top.tables("contact")):
        pair = {key: table.data.get(key) for key in ("slave", "obstacle", "master")}
        if "pairs" in table.data:
            continue  # found, and only one asks for it
        if pair in seen:
            raise table.error(
                "", f"the same slave and partner as in contact[{places[seen.index(pair)]}]; "
                "expected every pair once"
            )  # fmt: skip
        seen.append(pair)
        places.append(k)
