"""A body: a mesh, what it is made of, and the space in which it moves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from ...core.errors import InvalidInput, shown
from ...core.words import helpful
from ..elements.elasticity import LinearElastic, materials_by_region
from ..elements.given import GivenMatrices
from ..elements.hyperelasticity import NAMES, Hyperelastic, is_hyperelastic
from ..elements.orthotropic import OrthotropicElastic
from ..elements.rigid import Rigid
from ..meshes.mesh import Mesh
from ..meshes.order import second_order

Material = LinearElastic | OrthotropicElastic | Hyperelastic


@helpful
@dataclass(frozen=True, eq=False)
class Body:
    """A mesh and its material, or one per region of it.

    LinearElastic, ElastoPlastic and OrthotropicElastic mean small strains, NeoHookean,
    CiarletGeymonat, MooneyRivlin, Ogden, SaintVenantKirchhoff and UserEnergy finite ones, of
    all bodies of the model.  Rigid, of the whole body: it moves without deforming, and its mesh
    only says where it is touched, held and loaded.

    order: 1 or 2, degree of the displacement.  With 2 the mesh becomes one of second order, see
    `second_order`: its points are then all nodes.
    axisymmetric: the mesh, in 2D with x >= 0, is one half of the section of a body of
    revolution, x the distance from the axis and y along it.  Nothing twists.  Forces are those
    of the whole body, as loads and in results; tractions and pressures are per area.  A rigid
    one moves along the axis alone, and follows a reference.
    corotational: LinearElastic or OrthotropicElastic in a frame that turns with the body, so
    that it may turn by any angle as a whole, at small strains; see `elements.corotational`.
    Contacts are found in the current state, as of finite strains.
    integration: of all cells, see `Cells`; by default what they say themselves, which is
    "auto" where nobody says: hybrid, without locking, from a poisson of 0.4 on, else full.
    """

    mesh: Mesh
    material: Material | Rigid | GivenMatrices | Mapping[str, Material]
    name: str = ""
    order: int = 1
    axisymmetric: bool = False
    integration: str | None = None
    corotational: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.mesh, Mesh):
            raise InvalidInput(f"mesh: expected a Mesh (see box, read_mesh), got {self.mesh!r}")
        if not isinstance(self.material, Material | Rigid | GivenMatrices | Mapping):
            raise InvalidInput(
                "material: expected LinearElastic, ElastoPlastic, OrthotropicElastic, "
                f"{NAMES}, or Rigid, or a dict region -> one of them, which is not Rigid, got "
                f"{self.material!r}"
            )
        if self.order not in (1, 2):
            raise InvalidInput(f"order: expected 1 or 2, got {self.order!r}")
        if self.order == 2:
            object.__setattr__(self, "mesh", second_order(self.mesh))
        object.__setattr__(self, "order", self.mesh.order)
        if self.integration is not None:
            cells = (replace(c, integration=self.integration) for c in self.mesh.cells)
            object.__setattr__(self, "mesh", replace(self.mesh, cells=tuple(cells)))
        if isinstance(self.material, GivenMatrices):
            self.material.check(self.mesh)
        laws = materials_by_region(self.mesh, self.material)
        self._turn(laws.values())
        self._check_frame(laws.values())
        if isinstance(self.material, Mapping):
            for region, law in laws.items():
                if not isinstance(law, Material):
                    raise InvalidInput(
                        f"material of region {region!r}: expected LinearElastic, "
                        f"ElastoPlastic, OrthotropicElastic, {NAMES}, got {law!r}"
                    )

    @classmethod
    def from_matrix(  # noqa: PLR0913  # what another program has of a body
        cls, mesh: Mesh, K: Any, *, load: Any = None, mass: Any = None, rows: Any = "nodes",
        held: bool = False, name: str = "",
    ) -> Body:  # fmt: skip
        """A body whose stiffness another program has assembled: any element, shell or tangent.

        mesh: its nodes, cells and surfaces; cells say which facets a surface has, and are not
        integrated but for tractions and body forces.  Surfaces in contact have the shape
        functions of the mesh.
        K, mass (dofs, dofs): sparse, dense or an operator of scipy (`LinearOperator`, whose
        entries are asked for), symmetric, force per length and mass; dynamics need the mass.
        load (dofs,): forces besides those of the model.  dofs = nodes * dim.
        rows: the order of their rows, "nodes" (x1 y1 z1 x2 …; scikit-fem's vector elements,
        dolfinx, CalculiX), "components" (x1 x2 …, y1 y2 …; NGSolve's VectorH1) or a table
        (nodes, dim) with the row of every component, such as scikit-fem's nodal_dofs.T.
        held: True where supports are in K already; a free K is checked to let go of rigid
        motions, which tells a wrong order of rows.

        Raises InvalidInput for other sizes, asymmetry, numbers that are not finite, and for a
        K that resists rigid motions without held.
        """
        return cls(mesh, GivenMatrices.of(mesh, K, load, mass, rows, held), name)

    @property
    def turns(self) -> bool:
        """True where it may turn by any angle: of finite strains, or corotational."""
        return self.corotational or is_hyperelastic(self.material)

    def _check_frame(self, laws: Iterable[object]) -> None:
        """Raise InvalidInput for a frame that turns of what has no linear stiffness."""
        if not isinstance(self.corotational, bool):
            raise InvalidInput(
                f"expected True or False, got {shown(self.corotational)}", ("corotational",)
            )
        for law in laws if self.corotational else ():
            if type(law) not in (LinearElastic, OrthotropicElastic) or self.axisymmetric:
                raise InvalidInput(
                    "expected LinearElastic or OrthotropicElastic, in the plane or in space: "
                    "others yield, turn by themselves, or have an axis; got "
                    f"{'an axisymmetric mesh' if self.axisymmetric else shown(law)}",
                    ("corotational",),
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
            if isinstance(law, Rigid):
                continue
            if not isinstance(law, LinearElastic | OrthotropicElastic) or law.plane == "stress":
                raise InvalidInput(
                    "axisymmetric: expected LinearElastic, OrthotropicElastic with an axis "
                    "around, or Rigid, without plane='stress', got "
                    f"{law!r}; large strains have no axisymmetric form"
                )
