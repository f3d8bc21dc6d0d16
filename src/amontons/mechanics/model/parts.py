"""What a model is made of: bodies, supports, loads, contacts.

Surfaces are named as in the mesh; "body.surface" where several bodies know the same name.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), eq. (20), (22).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import number
from ...core.errors import InvalidInput, shown
from ..contact import Nitsche, Obstacle
from ..elements.elasticity import LinearElastic, materials_by_region
from ..elements.hyperelasticity import CiarletGeymonat, NeoHookean
from ..elements.rigid import Rigid
from ..meshes.mesh import Mesh
from ..meshes.order import second_order
from .values import ScalarValue, VectorValue, check_scalar, check_vector

Array = NDArray[np.float64]
Material = LinearElastic | NeoHookean | CiarletGeymonat
METHODS = ("nodal", "mortar", "nitsche")  # "dual-mortar" is another name of the second
REFERENCE, CURRENT = CONFIGURATIONS = ("reference", "current")


@dataclass(frozen=True, eq=False)
class Body:
    """A mesh and its material: LinearElastic, NeoHookean or CiarletGeymonat, or one per region.

    The last two mean finite strains, of all bodies of the model.  Rigid, of the whole body: it
    moves without deforming, and its mesh only says where it is touched, held and loaded.

    order: 1 or 2, degree of the displacement.  With 2 the mesh becomes one of second order, see
    `second_order`: its points are then all nodes.
    """

    mesh: Mesh
    material: Material | Rigid | Mapping[str, Material]
    name: str = ""
    order: int = 1

    def __post_init__(self) -> None:
        if not isinstance(self.mesh, Mesh):
            raise InvalidInput(f"mesh: expected a Mesh (see box, read_mesh), got {self.mesh!r}")
        if not isinstance(self.material, Material | Rigid | Mapping):
            raise InvalidInput(
                "material: expected LinearElastic, NeoHookean, CiarletGeymonat or Rigid, or a "
                f"dict region -> one of the first three, got {self.material!r}"
            )
        if self.order not in (1, 2):
            raise InvalidInput(f"order: expected 1 or 2, got {self.order!r}")
        if self.order == 2:
            object.__setattr__(self, "mesh", second_order(self.mesh))
        object.__setattr__(self, "order", self.mesh.order)
        laws = materials_by_region(self.mesh, self.material)
        if isinstance(self.material, Mapping):
            for region, law in laws.items():
                if not isinstance(law, Material):
                    raise InvalidInput(
                        f"material of region {region!r}: expected LinearElastic, NeoHookean or "
                        f"CiarletGeymonat, got {law!r}"
                    )


@dataclass(frozen=True, eq=False)
class Fix:
    """Prescribed displacement of a surface, unit of length.

    value: one number or None (free) or function x -> number per component, or one function
    x -> components, x being the point (dim,) of a node; 0 holds all components.
    """

    on: str
    value: VectorValue

    def __post_init__(self) -> None:
        check_vector(self.value, f"fix on {self.on!r}", free=True)


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
            object.__setattr__(self, "value", number(f"pressure on {self.on!r}", self.value))


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


Load = Traction | Pressure | BodyForce


def check_configuration(value: object) -> None:
    """Raise InvalidInput unless it is "reference" or "current"."""
    if value not in CONFIGURATIONS:
        raise InvalidInput(
            f"configuration: expected one of {', '.join(CONFIGURATIONS)}, got {shown(value)}"
        )


@dataclass(frozen=True, eq=False)
class Contact:
    """Unilateral contact of a slave surface with an obstacle or a master, with friction.

    master: another surface, of any body; slave nodes without a facet of it in front of them are
    left out.
    method: "nodal", every slave node against the closest point of the other side, or "mortar",
    averages with dual basis functions, exact also for a uniform pressure between meshes that do
    not match, or "nitsche", the law at Gauss points with stresses in the place of reactions;
    `Nitsche(...)` sets its options.  By default "mortar" with a master and "nodal" with an
    obstacle; nodal contact between meshes that do not match is wrong by tens of percent.

    Either mu, the coefficient of Coulomb friction, or tresca, the largest shear traction (a
    stress): a number, one number per slave node, or a function of points (n, dim) -> (n,).
    The bound of a contact is a force, the area of the node times the value at the node; with
    mortar times the mean of the function with the dual function of the node, if that is > 0.
    where: a function of points (n, dim) -> (n,) bool that tells which slave nodes take part.
    configuration: where gap and normal are taken, "reference" or "current", where the nodes are
    now (nodal, obstacles only); by default "current" with hyperelastic laws.
    """

    slave: str
    obstacle: Obstacle | None = None
    mu: ScalarValue | None = None
    tresca: ScalarValue | None = None
    master: str | None = None
    method: str | Nitsche | None = None
    where: Callable[[Array], NDArray[np.bool_]] | None = None
    configuration: str | None = None

    def __post_init__(self) -> None:
        if self.configuration is not None:
            check_configuration(self.configuration)
        if (self.mu is None) == (self.tresca is None):
            raise InvalidInput(
                f"contact on {self.slave!r}: expected either mu or tresca (mu=0: no friction)"
            )
        if (self.obstacle is None) == (self.master is None):
            raise InvalidInput(
                f"contact on {self.slave!r}: expected either an obstacle or a master surface"
            )
        if not isinstance(self.method, Nitsche | str | None):
            raise InvalidInput(f"method: expected a text, got {shown(self.method)}")
        if self.method is None:
            object.__setattr__(self, "method", "nodal" if self.master is None else "mortar")
        check_scalar(getattr(self, self.friction), f"{self.friction} on {self.slave!r}")
        if self.method == "dual-mortar":
            object.__setattr__(self, "method", "mortar")
        if self.method == "nitsche":
            object.__setattr__(self, "method", Nitsche())
        if not isinstance(self.method, Nitsche) and self.method not in METHODS:
            raise InvalidInput(
                f"method: expected one of {', '.join(METHODS)}, got {self.method!r}"
            )
        if self.where is not None and not callable(self.where):
            raise InvalidInput(
                f"where: expected a function of points (n, dim) that returns (n,) of bool, got "
                f"{shown(self.where)}"
            )
        if self.master is None and (isinstance(self.obstacle, type) or not (
            hasattr(self.obstacle, "gap") and hasattr(self.obstacle, "normals")
        )):
            raise InvalidInput(
                f"obstacle: expected a Plane, Sphere or LevelSet, got {self.obstacle!r}"
            )

    @property
    def nitsche(self) -> Nitsche | None:
        """Options of Nitsche's method, None for the others."""
        return self.method if isinstance(self.method, Nitsche) else None

    @property
    def friction(self) -> str:
        """Name of the law: "mu" or "tresca"."""
        return "mu" if self.mu is not None else "tresca"
