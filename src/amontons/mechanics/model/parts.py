"""What a model is made of: bodies, supports, loads, contacts.

Surfaces are named as in the mesh; "body.surface" where several bodies know the same name.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), eq. (20), (22).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import InitVar, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import number, real
from ...core.errors import InvalidInput, shown
from ...core.words import helpful, nearest
from ...problem.law import (
    FrictionCurve,
    Law,
    Overclosure,
)
from ..contact import Nitsche, Obstacle
from .body import Body, Material
from .law_numbers import numbers_of
from .temperature import Temperature
from .values import ScalarValue, VectorValue, check_scalar, check_vector, pressure_of

__all__ = ["Body", "BodyForce", "Contact", "Fix", "Load", "Material", "NodalForce", "Pressure",
           "Temperature", "Traction"]  # fmt: skip
Array = NDArray[np.float64]
BONDS = ("stiffness", "stick_stiffness")  # numbers of a law that ties have too
METHODS = ("nodal", "mortar", "nitsche")  # "dual-mortar" is another name of the second
REFERENCE, CURRENT = CONFIGURATIONS = ("reference", "current")
SMALL, FINITE = KINEMATICS = ("small", "finite")


@helpful
@dataclass(frozen=True, eq=False)
class Fix:
    """Prescribed displacement of a surface or node set, unit of length.

    value: one number or None (free) or function x -> number per component, or one function
    x -> components, x being the point (dim,) of a node; 0 holds all components.
    """

    on: str
    value: VectorValue

    def __post_init__(self) -> None:
        check_vector(self.value, f"fix on {self.on!r}", free=True)


@helpful
@dataclass(frozen=True, eq=False)
class Traction:
    """Force per area on a surface (per length in 2D): components or functions of x (dim,).

    configuration: "reference", per area of the undeformed surface and at x there, or "current",
    per area of the deformed one and at x where its points are now: [LR] h^phi.
    """

    on: str
    value: VectorValue
    configuration: str = REFERENCE

    def __post_init__(self) -> None:
        check_vector(self.value, f"traction on {self.on!r}")
        check_configuration(self.configuration)


@helpful
@dataclass(frozen=True, eq=False)
class Pressure:
    """Force per area against the outward normal of a surface: a number or function of x (dim,).

    > 0 pushes into the body.  In large deformations it follows the body: per area, along the
    normal and at x of the deformed surface.  In small strains all three are undeformed.
    """

    on: str
    value: float | Callable[..., float]

    def __post_init__(self) -> None:
        if not callable(self.value):
            object.__setattr__(self, "value", pressure_of(self.value, self.on))


@helpful
@dataclass(frozen=True, eq=False)
class BodyForce:
    """Force per volume in all bodies, or in the named region: components or functions of x.

    configuration: "reference", per undeformed volume and at x there, or "current", per deformed
    volume and at x where its points are now: [LR] f^phi.
    """

    value: VectorValue
    region: str | None = None
    configuration: str = REFERENCE

    def __post_init__(self) -> None:
        check_vector(self.value, "body force")
        check_configuration(self.configuration)


@helpful
@dataclass(frozen=True, eq=False)
class NodalForce:
    """A force at every node of a node set or surface: components or functions of x (dim,).

    Its sum is the number of nodes times the value; a force that is spread over a surface is a
    Traction.  It keeps its direction and size when the body deforms.
    """

    on: str
    value: VectorValue

    def __post_init__(self) -> None:
        check_vector(self.value, f"nodal force on {self.on!r}")

    configuration = REFERENCE


Load = Traction | Pressure | BodyForce | NodalForce | Temperature


def check_configuration(value: object) -> None:
    """Raise InvalidInput unless it is "reference" or "current"."""
    if value not in CONFIGURATIONS:
        raise InvalidInput(
            f"configuration: expected one of {', '.join(CONFIGURATIONS)}, got {shown(value)}"
        )


@helpful
@dataclass(frozen=True, eq=False)
class Contact:
    """Unilateral contact of a slave surface with an obstacle or a master, with friction.

    master: another surface, of any body; slave nodes without a facet of it in front of them are
    left out.
    more_masters: other surfaces of the same side: a master made of several bodies.  With
    kinematics "finite", where several such contacts of one slave and law are one, too.
    method: "nodal", every slave node against the closest point of the other side, or "mortar",
    averages with dual basis functions, exact also for a uniform pressure between meshes that do
    not match, or "nitsche", the law at Gauss points with stresses in the place of reactions;
    `Nitsche(...)` sets its options.  By default "mortar" with a master and "nodal" with an
    obstacle; nodal contact between meshes that do not match is wrong by tens of percent.

    Either mu, the coefficient of Coulomb friction, or tresca, the largest shear traction (a
    stress): a number, one number per slave node, or a function of points (n, dim) -> (n,).
    mu may be a FrictionCurve, numbers over pressure or slip speed (`problem.law.varying`).
    With mu also cap, the largest shear traction whatever the pressure; with both cohesion, the
    largest tensile traction, which acts where the sides touch in the undeformed state and is
    not lost when they part (`problem.law.cohesive`).  Stresses become forces, the area of the
    node (of now where contacts are found there, see `contact.grown_areas`) times the value;
    with mortar times the mean of the function with the dual function of the node, if that is
    > 0.  law: the same numbers as a value, CappedCoulomb(mu,
    cap), Cohesive(Coulomb(mu), cohesion), …, each one number or one per slave node.
    stiffness, stick_stiffness: contact that gives way (`problem.law.compliant`), pressure over
    overclosure and shear traction over elastic slip, stress / length, > 0; by default rigid.
    stiffness may be an OverclosureCurve or ExponentialOverclosure (`problem.law.overclosure`).
    As a value Compliant(law, compliance, stick_compliance), which are their inverses.
    tied: the sides neither part nor slip (`problem.law.tied`), and keep the distance that they
    have in the undeformed state; with a stiffness an elastic bond.  As a value law=Tied().
    mu_across: orthotropic friction (`problem.law.orthotropic`), mu along `direction`, a vector
    in global axes seen in the tangent plane of each contact, mu_across across it; in 3D.
    where: a function of points (n, dim) -> (n,) bool that tells which slave nodes take part.
    clearance: the gap of the undeformed sides, < 0 where they overlap, in the place of the one
    that their meshes give: a number, or a function of points (n, dim) -> (n,).
    kinematics: "small", gap and normal are those of the undeformed bodies, or "finite", those
    where the nodes are now (nodal with obstacles, mortar with a master); by default "finite"
    with hyperelastic laws.
    configuration: the same in older words, "reference" or "current".
    follows: the name of a rigid body that the obstacle moves with, a tool: what supports and
    loads give to it, moves and presses the obstacle.  Small kinematics.
    name: of the pair in results and files; by default that of the slave, with a number where
    several contacts share it.
    """

    slave: str
    obstacle: Obstacle | None = None
    mu: ScalarValue | FrictionCurve | None = None
    tresca: ScalarValue | None = None
    master: str | None = None
    method: str | Nitsche | None = None
    where: Callable[[Array], NDArray[np.bool_]] | None = None
    configuration: InitVar[str | None] = None
    kinematics: str | None = None
    cap: ScalarValue | None = None
    cohesion: ScalarValue | None = None
    law: InitVar[Law | None] = None
    mu_across: ScalarValue | None = None
    direction: Sequence[float] | None = None
    tied: bool = False
    stiffness: ScalarValue | Overclosure | None = None
    stick_stiffness: ScalarValue | None = None
    angle: ScalarValue | None = None  # of the direction, from t1 to t2 of the contact frame
    name: str = ""
    clearance: float | Callable[[Array], Array] | None = None
    follows: str | None = None
    more_masters: Sequence[str] = ()

    def __post_init__(self, configuration: str | None, law: Law | None) -> None:
        if not isinstance(self.name, str) or not self.name.isprintable():
            raise InvalidInput(
                f"contact on {self.slave!r}: name: expected a text on one line, got "
                f"{shown(self.name)}"
            )
        self._check_kinematics(configuration)
        if law is not None:
            self._take(law)
        self._check_law()
        if (self.obstacle is None) == (self.master is None):
            raise InvalidInput(
                f"contact on {self.slave!r}: expected either an obstacle or a master surface"
            )
        if self.follows is not None:
            self._check_follows()
        self._check_masters()
        if not isinstance(self.method, Nitsche | str | None):
            raise InvalidInput(f"method: expected a text, got {shown(self.method)}")
        if self.method is None:
            object.__setattr__(self, "method", "nodal" if self.master is None else "mortar")
        self._check_directions()
        if self.clearance is not None and not callable(self.clearance):
            given = number(f"clearance on {self.slave!r}", self.clearance)
            object.__setattr__(self, "clearance", given)
        for name, value in self.numbers.items():
            if not (name == "stiffness" and isinstance(value, Overclosure)):
                check_scalar(value, f"{name} on {self.slave!r}")
        if self.method == "dual-mortar":
            object.__setattr__(self, "method", "mortar")
        if self.method == "nitsche":
            object.__setattr__(self, "method", Nitsche())
        if not isinstance(self.method, Nitsche) and self.method not in METHODS:
            raise InvalidInput(
                f"method: expected one of {', '.join(METHODS)}, got {self.method!r}"
                f"{nearest(self.method, METHODS)}"
            )
        if self.where is not None and not callable(self.where):
            raise InvalidInput(
                f"where: expected a function of points (n, dim) that returns (n,) of bool, got "
                f"{shown(self.where)}"
            )
        if self.master is None and (
            isinstance(self.obstacle, type)
            or not (hasattr(self.obstacle, "gap") and hasattr(self.obstacle, "normals"))
        ):
            raise InvalidInput(
                f"obstacle: expected one, such as Plane, Sphere or LevelSet, got "
                f"{self.obstacle!r}; "
                'another surface is master="NAME"'
            )

    def _check_masters(self) -> None:
        given = self.more_masters
        several = isinstance(given, list | tuple) and all(isinstance(n, str) for n in given)
        if not several or (given and self.master is None):
            raise InvalidInput(
                f"contact on {self.slave!r}: more_masters: expected a list of surfaces beside "
                f"master, got {shown(given)}"
            )
        object.__setattr__(self, "more_masters", tuple(given))
        if len(set(self.masters)) < len(self.masters):
            raise InvalidInput(
                f"contact on {self.slave!r}: more_masters: expected every master once, got "
                f"{', '.join(self.masters)}"
            )

    @property
    def masters(self) -> tuple[str, ...]:
        """All surfaces of the other side, none with an obstacle."""
        return () if self.master is None else (self.master, *self.more_masters)

    def _check_follows(self) -> None:
        where = f"contact on {self.slave!r}: follows"
        if not isinstance(self.follows, str):
            raise InvalidInput(f"{where}: expected a body's name, got {shown(self.follows)}")
        if self.obstacle is None:
            raise InvalidInput(f"{where}: goes with an obstacle; a master moves by itself")
        if self.nitsche is not None or self.method == "nitsche":
            raise InvalidInput(f"{where}: goes with method 'nodal' or 'mortar', not 'nitsche'")
        if self.kinematics == FINITE:
            raise InvalidInput(f"{where}: goes with kinematics='small'")

    def _check_law(self) -> None:
        where = f"contact on {self.slave!r}"
        if not isinstance(self.tied, bool):
            raise InvalidInput(f"{where}: tied: expected True or False, got {shown(self.tied)}")
        if self.tied:
            rubs = [name for name in self.numbers if name not in BONDS]
            if rubs:
                raise InvalidInput(
                    f"{where}: tied sides have no friction; expected no {rubs[0]}"
                )
        elif (self.mu is None) == (self.tresca is None):
            raise InvalidInput(f"{where}: expected either mu or tresca (mu=0: no friction)")
        if self.cap is not None and self.mu is None:
            raise InvalidInput(f"{where}: cap goes with mu, not with tresca")
        if isinstance(self.stiffness, Overclosure):
            if self.tied or self.cohesion is not None or isinstance(self.mu, FrictionCurve):
                raise InvalidInput(
                    f"{where}: a curve of pressure over overclosure goes with one coefficient "
                    "or stress of friction; expected no tie, cohesion or curve of mu"
                )

    def _check_directions(self) -> None:
        given = (self.direction is not None) + (self.angle is not None)
        if given != (self.mu_across is not None):
            raise InvalidInput(
                f"contact on {self.slave!r}: mu_across, the coefficient across a direction, "
                "and that direction go together"
            )
        if self.mu_across is None:
            return
        if self.mu is None or self.cap is not None or isinstance(self.mu, FrictionCurve):
            raise InvalidInput(
                f"contact on {self.slave!r}: mu_across goes with mu, and neither with tresca, "
                "nor with cap, nor with a curve"
            )
        if self.direction is not None:
            vector = real("direction", self.direction)
            if vector.shape != (3,) or not np.isfinite(vector).all() or not vector.any():
                raise InvalidInput(
                    "direction: expected three numbers in global axes, not all zero, got "
                    f"{shown(self.direction)}"
                )

    def _check_kinematics(self, configuration: str | None) -> None:
        if self.kinematics not in (None, *KINEMATICS):
            raise InvalidInput(
                f"kinematics: expected one of {', '.join(KINEMATICS)}, got "
                f"{shown(self.kinematics)}"
            )
        if configuration is None:
            return
        check_configuration(configuration)
        said = KINEMATICS[CONFIGURATIONS.index(configuration)]
        if self.kinematics not in (None, said):
            raise InvalidInput(
                f"contact on {self.slave!r}: kinematics {self.kinematics!r} and configuration "
                f"{configuration!r} contradict each other; expected kinematics alone"
            )
        object.__setattr__(self, "kinematics", said)

    @property
    def nitsche(self) -> Nitsche | None:
        """Options of Nitsche's method, None for the others."""
        return self.method if isinstance(self.method, Nitsche) else None

    @property
    def numbers(self) -> dict[str, Any]:
        """What the law is given by: mu or tresca, and what goes with it."""
        names = ("mu", "mu_across", "angle", "tresca", "cap", "cohesion", "stiffness",
                 "stick_stiffness")  # fmt: skip
        named = {name: getattr(self, name) for name in names}
        return {name: value for name, value in named.items() if value is not None}

    def _take(self, law: Law) -> None:
        """Set the numbers of a law; raises InvalidInput for one that has no such numbers."""
        if self.numbers or self.tied:
            raise InvalidInput(
                f"contact on {self.slave!r}: expected law or its numbers, got both"
            )
        numbers = numbers_of(law)
        object.__setattr__(self, "tied", bool(law.tied.all() and len(law)))
        for name, value in numbers.items():
            if isinstance(value, np.ndarray) and len(value) == 1:
                value = float(value[0])  # noqa: PLW2901
            object.__setattr__(self, name, value)
