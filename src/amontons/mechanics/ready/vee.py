"""The V-shaped body: a load that grows steadily, and contact that jumps.

Two legs of width 0.3, one upright and one at 45 degrees, clamped at their ends; the bottom,
from (0, 0) to (0.15 + 0.3 / sqrt 2, 0), can touch the plane y = 0.  Lamé constants 100 and 82
GN/m^2, plane strain, body force (-5, 1 - 9 t) GN/m^3.  From a friction of about 1.5 on the
solution curve over t turns back twice: three solutions between the folds.

[LR] T. Ligurský, Y. Renard, "A continuation problem for computing solutions of discretised
evolution problems with application to plane quasi-static contact problems with friction",
Comput. Methods Appl. Mech. Engrg. 280 (2014), section 3.2.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import as_file, files

import numpy as np
from numpy.typing import NDArray

from ..contact import Plane
from ..elements import LinearElastic
from ..meshes import Mesh, read_mesh, refined
from ..model import Body, BodyForce, Contact, Fix, Model

LAME_LAMBDA, SHEAR = 100.0, 82.0  # GN/m^2
FRICTION = 1.8


def vee(mesh: int | Mesh = 1, *, mu: float = FRICTION, name: str = "vee") -> Model:
    """The V-shaped body; its loads depend on the time t.

    mesh: how often the built-in mesh of some 560 triangles is refined, or a mesh with surfaces
    "clamped" and "contact".
    """
    if not isinstance(mesh, Mesh):
        mesh = refined(vee_mesh(), mesh)
    young = SHEAR * (3 * LAME_LAMBDA + 2 * SHEAR) / (LAME_LAMBDA + SHEAR)
    poisson = LAME_LAMBDA / (2 * (LAME_LAMBDA + SHEAR))
    return Model(
        [Body(mesh, LinearElastic(young=young, poisson=poisson))],
        supports=[Fix("clamped", (0.0, 0.0))],
        loads=[BodyForce(body_force)],  # type: ignore[arg-type]
        contacts=[Contact("contact", Plane(normal=(0, 1)), mu=mu)],
        name=name,
    )


def vee_mesh() -> Mesh:
    """The built-in mesh, with surfaces "clamped" and "contact"."""
    with as_file(files("amontons") / "examples_data" / "vee.msh") as path:
        return read_mesh(path)


def body_force(x: Sequence[float] | NDArray[np.float64], t: float) -> tuple[float, float]:
    """Force per volume at time t, GN/m^3."""
    return (-5.0, 1.0 - 9.0 * t)
