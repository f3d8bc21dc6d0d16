"""A body: a mesh, what it is made of, and the space in which it moves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ...core.errors import InvalidInput, shown
from ...core.words import helpful
from ..elements.elasticity import LinearElastic, materials_by_region
from ..elements.hyperelasticity import CiarletGeymonat, NeoHookean
from ..elements.orthotropic import OrthotropicElastic
from ..elements.rigid import Rigid
from ..meshes.mesh import Mesh
from ..meshes.order import second_order

Material = LinearElastic | OrthotropicElastic | NeoHookean | CiarletGeymonat


@helpful
@dataclass(frozen=True, eq=False)
class Body:
    """A mesh and its material, or one per region of it.

    LinearElastic and OrthotropicElastic mean small strains, NeoHookean and CiarletGeymonat
    finite ones, of all bodies of the model.  Rigid, of the whole body: it moves without
    deforming, and its mesh only says where it is touched, held and loaded.

    order: 1 or 2, degree of the displacement.  With 2 the mesh becomes one of second order, see
    `second_order`: its points are then all nodes.
    axisymmetric: the mesh, in 2D with x >= 0, is one half of the section of a body of
    revolution, x the distance from the axis and y along it.  Nothing twists.  Forces are those
    of the whole body, as loads and in results; tractions and pressures are per area.
    """

    mesh: Mesh
    material: Material | Rigid | Mapping[str, Material]
    name: str = ""
    order: int = 1
    axisymmetric: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.mesh, Mesh):
            raise InvalidInput(f"mesh: expected a Mesh (see box, read_mesh), got {self.mesh!r}")
        if not isinstance(self.material, Material | Rigid | Mapping):
            raise InvalidInput(
                "material: expected LinearElastic, OrthotropicElastic, NeoHookean, "
                "CiarletGeymonat or Rigid, or a dict region -> one of the first four, got "
                f"{self.material!r}"
            )
        if self.order not in (1, 2):
            raise InvalidInput(f"order: expected 1 or 2, got {self.order!r}")
        if self.order == 2:
            object.__setattr__(self, "mesh", second_order(self.mesh))
        object.__setattr__(self, "order", self.mesh.order)
        laws = materials_by_region(self.mesh, self.material)
        self._turn(laws.values())
        if isinstance(self.material, Mapping):
            for region, law in laws.items():
                if not isinstance(law, Material):
                    raise InvalidInput(
                        f"material of region {region!r}: expected LinearElastic, "
                        f"OrthotropicElastic, NeoHookean or CiarletGeymonat, got {law!r}"
                    )


    def _turn(self, laws: Iterable[object]) -> None:
        """Make the mesh axisymmetric where that is asked for; laws: its materials."""
        if not isinstance(self.axisymmetric, bool):
            raise InvalidInput(
                f"axisymmetric: expected True or False, got {shown(self.axisymmetric)}"
            )
        if self.axisymmetric:
            object.__setattr__(self, "mesh", self.mesh.turned())
        object.__setattr__(self, "axisymmetric", self.mesh.axisymmetric)
        for law in laws if self.axisymmetric else ():
            if not isinstance(law, LinearElastic | OrthotropicElastic) or law.plane == "stress":
                raise InvalidInput(
                    "axisymmetric: expected LinearElastic, or OrthotropicElastic with an axis "
                    "around, without plane='stress', got "
                    f"{law!r}; large strains and rigid bodies have no axisymmetric form"
                )
