"""What ties degrees of freedom to one another: equations, couplings, pretension, turned axes.

Nodes are named as in supports, by a node set or surface, by their number in the mesh, or by
(body, number).  A `Reference` is a point beside the meshes with displacements and rotations:
supports, nodal forces and equations name it "R", and its rotations "R.rotation".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import finite, number
from ...core.errors import InvalidInput, shown
from ...core.words import helpful

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Where = str | int | tuple[str, int] | Index
Term = tuple[Where, int, float]
ROTATION = ".rotation"  # after the name of a reference
KINDS = KINEMATIC, DISTRIBUTING = ("kinematic", "distributing")


@helpful
@dataclass(frozen=True, eq=False)
class Reference:
    """A point that nodes may follow: displacement (dim,), and rotation (3,), in 2D (1,).

    Rotations are small, in radians.  Moments act on "R.rotation", forces on "R".
    """

    name: str
    point: Sequence[float]

    def __post_init__(self) -> None:
        _check_name("reference", self.name)
        where = f"point of reference {self.name!r}"
        object.__setattr__(self, "point", finite(where, self.point, 1))


@helpful
@dataclass(frozen=True, eq=False)
class Equation:
    """sum of coefficient * displacement = 0 over terms (nodes, component, coefficient).

    nodes: one, or as many in each term, which make so many equations, in the order of their
    numbers; one alone goes with each of several.  component: 0, 1, 2.  The first term is the
    dependent one: it is eliminated, so no support and no other equation may prescribe it.
    A right side that is not zero is the term of a reference whose displacement is prescribed.
    """

    terms: Sequence[Term]
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "terms", checked_terms("equation", self.terms))
        if not self.terms[0][2]:
            raise InvalidInput(
                "expected a coefficient that is not 0 for the first term, which is eliminated",
                ("terms", 0), "equation",
            )  # fmt: skip


@helpful
@dataclass(frozen=True, eq=False)
class Spring:
    """A linear spring: elongation e = sum of coefficient * displacement over its terms.

    Its energy is stiffness e^2 / 2; stiffness >= 0, force over length for coefficients without
    a unit.  terms: as in `Equation`; one term is a spring to the ground, and (a, c, -1),
    (b, c, 1) one between a and b.
    """

    terms: Sequence[Term]
    stiffness: float
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "terms", checked_terms("spring", self.terms))
        if number("stiffness", self.stiffness) < 0:
            raise InvalidInput(
                f"stiffness: expected a number >= 0, got {self.stiffness!r}", (), "spring"
            )


@helpful
@dataclass(frozen=True, eq=False)
class Coupling:
    """Nodes of a surface, node set or body that follow a reference.

    kind "kinematic": they move with it as a rigid body, in all components or in `components`
    (0, 1, 2) alone.  "distributing": the reference is the mean of their motion, so that they
    share its force and moment and deform freely; on a surface by areas, else evenly.
    """

    on: str
    reference: str
    kind: str = KINEMATIC
    components: Sequence[int] | None = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InvalidInput(
                f"kind: expected one of {', '.join(KINDS)}, got {shown(self.kind)}",
                (), f"coupling of {self.on!r}",
            )  # fmt: skip
        given = self.components
        if given is None:
            return
        if self.kind == DISTRIBUTING or not len(given) or not {*given} <= {0, 1, 2}:
            raise InvalidInput(
                "components: expected some of 0, 1, 2 of a kinematic coupling, got "
                f"{shown(given)}", (), f"coupling of {self.on!r}",
            )  # fmt: skip
        object.__setattr__(self, "components", tuple(sorted({*given})))


@helpful
@dataclass(frozen=True, eq=False)
class Pretension:
    """A bolt whose two halves are pulled together across a section: one unknown, `name`.

    sides: the surfaces of the halves at the section, which lie on one another with nodes at
    the same places (`opened` makes them).  Every node of the first is where its partner is,
    plus `name` times the normal: the length that is taken out of the bolt.  NodalForce(name,
    [F]) pulls it with a force F > 0 in tension, Fix(name, [s]) takes out a length s.
    normal: by default the mean outward normal of the first side.
    locked: from this time on the length stays as it is then, in quasi-static steps, of which
    one has to end at that time.  held: it stays 0.
    """

    name: str
    sides: tuple[str, str]
    normal: Sequence[float] | None = None
    locked: float | None = None
    held: bool = False

    def __post_init__(self) -> None:
        _check_name("pretension", self.name)
        what = f"pretension {self.name!r}"
        if isinstance(self.sides, str) or len(self.sides) != 2:
            raise InvalidInput(
                f"sides: expected two surfaces, got {shown(self.sides)}", (), what
            )
        object.__setattr__(self, "sides", tuple(self.sides))
        if self.normal is not None:
            way = finite("normal", self.normal, 1)
            if not way.any():
                raise InvalidInput("normal: expected a vector that is not zero", (), what)
            object.__setattr__(self, "normal", way / np.linalg.norm(way))
        if self.locked is not None:
            number("locked", self.locked)


@helpful
@dataclass(frozen=True, eq=False)
class Axes:
    """Nodes whose supports and forces are given along axes of their own, under `name`.

    axes: rows are the unit vectors of the new components, (dim, dim), or (nodes, dim, dim) in
    the order of the nodes.  Fix(name, ...) and NodalForce(name, ...) then mean these axes.
    """

    name: str
    on: Where
    axes: Any

    def __post_init__(self) -> None:
        _check_name("axes", self.name)
        axes = np.asarray(self.axes, dtype=float)
        square = axes.ndim in (2, 3) and axes.shape[-1] == axes.shape[-2]
        unit = square and np.allclose(axes @ np.swapaxes(axes, -1, -2), np.eye(axes.shape[-1]))
        if not unit:
            raise InvalidInput(
                "axes: expected orthogonal unit vectors as rows, (dim, dim) or (nodes, dim, "
                "dim)", (), f"axes {self.name!r}",
            )  # fmt: skip
        object.__setattr__(self, "axes", axes)


Constraint = Equation | Coupling | Pretension | Axes


def checked_terms(what: str, terms: object) -> tuple[Term, ...]:
    """Terms (nodes, component, coefficient); raises InvalidInput for anything else."""
    if not isinstance(terms, Sequence) or isinstance(terms, str) or not len(terms):
        raise InvalidInput(f"terms: expected a list, got {shown(terms)}", (), what)
    out = []
    for k, term in enumerate(terms):
        at = ("terms", k)
        if not isinstance(term, Sequence) or isinstance(term, str) or len(term) != 3:
            raise InvalidInput(
                f"expected (nodes, component, coefficient), got {shown(term)}", at, what
            )
        nodes, component, factor = term
        if isinstance(component, bool) or component not in (0, 1, 2):
            raise InvalidInput(f"component: expected 0, 1 or 2, got {shown(component)}",
                               at, what)  # fmt: skip
        out.append((nodes, int(component), number("coefficient", factor)))
    return tuple(out)


def _check_name(what: str, name: object) -> None:
    if not isinstance(name, str) or not name or not name.isprintable():
        raise InvalidInput(f"{what}: name: expected a text on one line, got {shown(name)}")
    if name.endswith(ROTATION):
        raise InvalidInput(f"{what}: name: expected one without {ROTATION!r}, got {name!r}")
