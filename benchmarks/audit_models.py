"""Models for audits: one of every kind, and decks in other units or sides exchanged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import amontons as am
from amontons.io.readers import read

STEEL = am.LinearElastic(1000.0, 0.3)
EXAMPLES = Path(am.__file__).parent / "examples_data"


# ------------------------------------------------------------------------------ our own
def pair(  # noqa: PLR0913  # what kinds of pairs differ by
    dim: int, low: int, high: int, kind: str | None = None, method: str | None = None,
    order: int = 1, mu: float = 0.3, *, tied: bool = False,
) -> am.Model:  # fmt: skip
    """A block pressed on a wider one and dragged; low, high: their cells per length."""
    along = (0,) * (dim - 2)
    below = am.box((2,) * (dim - 1) + (1,), (2 * low,) * (dim - 1) + (low,), kind)
    above = am.box((1,) * dim, high, kind, origin=(0.5,) * (dim - 1) + (1,))
    bodies = [am.Body(below, STEEL, "low", order=order),
              am.Body(above, STEEL, "high", order=order)]  # fmt: skip
    supports = [am.Fix("low.bottom", 0.0), am.Fix("high.top", (0.004, *along, -0.01))]
    law: dict[str, Any] = {"tied": True} if tied else {"mu": mu}
    contact = am.Contact("high.bottom", master="low.top", method=method, **law)
    return am.Model(bodies, supports, [contact])


def on_plane(dim: int, kind: str | None = None, order: int = 1, mu: float = 0.4) -> am.Model:
    """A block pressed on a plane and dragged, lifted at one end."""
    body = am.Body(am.box((2,) + (1,) * (dim - 1), 4, kind), STEEL, order=order)
    along = (0,) * (dim - 2)
    top = am.Fix("top", lambda x: (0.01, *along, -0.02 + 0.02 * x[0]))
    floor = am.Plane(normal=(*along, 0, 1))
    return am.Model([body], [top], [am.Contact("bottom", floor, mu=mu)])


def axisymmetric(order: int) -> am.Model:
    """A disc pressed on a wider one, both about the axis."""
    low = am.Body(am.box((2, 1), (8, 4)), STEEL, "low", order=order, axisymmetric=True)
    up = am.Body(am.box((1, 1), (5, 5), origin=(0, 1)), STEEL, "up", order=order,
                 axisymmetric=True)  # fmt: skip
    held = [am.Fix("low.bottom", 0.0), am.Fix("up.top", (0.0, -0.01))]
    return am.Model([low, up], held, [am.Contact("up.bottom", master="low.top", mu=0.2)])


def warmed() -> am.Model:
    """A block between two planes that grows."""
    warm = am.LinearElastic(1000.0, 0.3, expansion=1e-3)
    body = am.Body(am.box((2, 1), (8, 4)), warm)
    contacts = [am.Contact("bottom", am.Plane((0, 1)), mu=0.3),
                am.Contact("top", am.Plane((0, -1), (0, 1)), mu=0.3)]  # fmt: skip
    return am.Model([body], [am.Fix("left", (0, None))], contacts, [am.Temperature(10.0)])


def on_springs() -> am.Model:
    """A pressed block that springs hold along the plane."""
    mesh = am.box((2, 1), (8, 4))
    springs = [am.Spring([("left", 0, 1.0)], 50.0)]
    return am.Model(
        [am.Body(mesh, STEEL)], [], [am.Contact("bottom", am.Plane((0, 1)), mu=0.2)],
        [am.Pressure("top", 5.0), am.Traction("right", (0.6, 0.0))], springs=springs,
    )  # fmt: skip


def coupled() -> am.Model:
    """A block whose top a reference presses down and turns."""
    model = on_plane(2)
    moved = am.Reference("R", (2.0, 0.5))
    top = am.Fix("R", (0.01, -0.02))
    return replace(model, supports=[top, am.Fix("R.rotation", (0.002,))], references=[moved],
                   constraints=[am.Coupling("top", "R")])  # fmt: skip


def on_rigid() -> am.Model:
    """A block pressed on a rigid one."""
    low = am.Body(am.box((2, 1), (6, 3)), am.Rigid(), "low")
    high = am.Body(am.box((1, 1), (5, 5), origin=(0.5, 1)), STEEL, "high")
    held = [am.Fix("low.bottom", 0.0), am.Fix("high.top", (0.004, -0.01))]
    return am.Model([low, high], held, [am.Contact("high.bottom", master="low.top", mu=0.3)])


KINDS: dict[str, Callable[[], am.Model]] = {
    "3D, pair, meshes do not match": lambda: pair(3, 2, 3),
    "3D, pair, matching, nodal": lambda: pair(3, 2, 2, method="nodal"),
    "3D, pair, no friction": lambda: pair(3, 2, 3, mu=0.0),
    "3D, plane": lambda: on_plane(3),
    "3D, plane, tetrahedra of second order": lambda: on_plane(3, "tet", order=2),
    "3D, pair of second order": lambda: pair(3, 2, 3, order=2),
    "3D, tied": lambda: pair(3, 2, 3, tied=True),
    "2D, pair, meshes do not match": lambda: pair(2, 4, 7),
    "2D, pair, triangles of second order": lambda: pair(2, 4, 6, "tri", order=2),
    "2D, pair, matching, nodal": lambda: pair(2, 4, 4, method="nodal"),
    "2D, plane": lambda: on_plane(2),
    "2D, tied": lambda: pair(2, 4, 7, tied=True),
    "axisymmetric": lambda: axisymmetric(1),
    "axisymmetric of second order": lambda: axisymmetric(2),
    "temperature": warmed,
    "springs": on_springs,
    "coupling to a reference": coupled,
    "rigid body": on_rigid,
}
EXAMPLE_NAMES = ("brake", "cube", "dome", "hertz", "hild", "release", "slab", "tresca", "vee",
                 "wall")  # fmt: skip


def models() -> dict[str, am.Model]:
    """All kinds and examples, by name."""
    found = {name: make() for name, make in KINDS.items()}
    for name in EXAMPLE_NAMES:
        found[f"example:{name}"] = read(EXAMPLES / f"{name}.toml", ()).model
    return found


# ------------------------------------------------------------------------------ other units
@dataclass(frozen=True)
class Units:
    """length, force: of one mm and one N in these units."""

    name: str
    length: float
    force: float


SYSTEMS = (
    Units("m, N", 1e-3, 1.0), Units("mm, N, t", 1.0, 1.0),
    Units("inch, lbf", 1 / 25.4, 1 / 4.4482216152605), Units("mm, kN", 1.0, 1e-3),
    Units("µm, µN", 1e3, 1e6),
)  # fmt: skip


def deck_in(text: str, units: Units, *, exchanged: bool = False) -> str:
    """A deck of these anchors in other units; exchanged: slave and master."""
    stress = units.force / units.length**2
    factors = {  # keyword -> factor of each column, None for what has no unit
        "*NODE": (None, *[units.length] * 3), "*ELASTIC": (stress, None),
        "*SURFACE BEHAVIOR": (stress / units.length,),
        "*FRICTION": (None, stress / units.length),
        "*BOUNDARY": (None, None, None, units.length), "*CLOAD": (None, None, units.force),
        "*DLOAD": (None, None, stress),
    }  # fmt: skip
    out, columns, swap = [], (), False
    for line in text.splitlines():
        if line.startswith("*"):
            word = line.split(",")[0].strip().upper()
            columns, swap = factors.get(word, ()), exchanged and word == "*CONTACT PAIR"
            out.append(line)
            continue
        parts = line.split(",")
        if swap:
            parts = [part.strip() for part in reversed(parts)]
        for k, factor in enumerate(columns[: len(parts)]):
            if factor is not None:
                parts[k] = f"{float(parts[k]) * factor:.12g}"
        out.append(",".join(parts))
    return "\n".join(out) + "\n"


def frd_in(text: str, units: Units) -> str:
    """A .frd with nodes and displacements alone in other units, again with six digits."""
    out = []
    for line in text.splitlines():
        if line.startswith(" -1") and len(line) == 49:
            values = [float(line[k : k + 12]) * units.length for k in (13, 25, 37)]
            line = line[:13] + "".join(f"{value:12.5E}" for value in values)  # noqa: PLW2901
        out.append(line)
    return "\n".join(out) + "\n"
