"""Volumetric locking: how much too stiff elements of first order are near incompressibility.

Triangles, tetrahedra and cells with full integration (`elements.hybrid` has others) can not
keep their volume and follow a bending or bulging body at the same time.  The excess stiffness
was measured on a block of 2 x 1 (2 x 2 x 1) between a bonded and a rubbing
side, 2 to 32 cells high, poisson 0.3 to 0.4999, against second order on a fine mesh.  With

    x = (h / L)^2 lame_lambda / shear,    h the size of a cell, L = 2 volume / surface,

it is LINEAR x + ROOT sqrt(x), which gives the factor within 7 % at small strains.  Finite
strains of 10 % and 20 % have a larger root, with which it is within a third of the excess.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.warned import ResultWarning
from ..elements.elasticity import LinearElastic, materials_by_region
from ..elements.given import GivenMatrices
from ..elements.hybrid import element_formulation
from ..elements.orthotropic import OrthotropicElastic
from ..elements.rigid import Rigid
from ..meshes.cells import CELLS
from ..meshes.mesh import Mesh
from ..meshes.surfaces import facet_areas
from .fields import ContactFields

if TYPE_CHECKING:
    from .model import Model
    from .parts import Material

Array = NDArray[np.float64]
LINEAR = {"quad": 0.022, "tri": 0.044, "hex": 0.017, "tet": 0.021}
ROOT = {"quad": 0.033, "tri": 0.053, "hex": 0.015, "tet": 0.030}
LARGE_ROOT = 0.03  # is added to ROOT at finite strains
NEARLY = 0.45  # poisson below which first order is only as stiff as it is elsewhere
EXCESS = 0.1  # estimated excess from which on it is told


def volumetric_locking(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """A warning for each region that is much too stiff, with the estimated factor."""
    out = []
    for body in model.bodies:
        if body.mesh.order > 1 or isinstance(body.material, Rigid | GivenMatrices):
            continue
        for region, law in materials_by_region(body.mesh, body.material).items():  # type: ignore[arg-type]
            if not _nearly_incompressible(law, model.dimension):
                continue
            kinds = _locking_kinds(body.mesh, region, law)
            excess = _excess(body.mesh, region, law) if kinds else 0.0
            if excess >= EXCESS:
                where = f"region {region!r} of body {body.name!r}"
                out.append(_warning(where, law, excess, _remedy(model, kinds)))
    return out


def _locking_kinds(mesh: Mesh, region: str, law: Material) -> set[str]:
    """Kinds of cells of a region that lock: others keep their volume on the mean."""
    return {
        block.kind for block in mesh.cells
        if block.region == region
        and element_formulation(mesh, block, law) in ("full", "reduced")
    }  # fmt: skip


def _remedy(model: Model, kinds: set[str]) -> str:
    """What helps; between bodies nodal contact alone needs first order."""
    simplices = {"tri": "quadrilaterals", "tet": "hexahedra"}
    other = [simplices[kind] for kind in sorted(kinds) if kind in simplices]
    hybrid = " or ".join(other) or 'integration "hybrid" of the cells (elements CPE4H, C3D8H)'
    finer = "a finer mesh (half the cell size: a quarter of the excess)"
    pairs = [contact for contact in model.contacts if contact.master is not None]
    nodal = any(contact.method == "nodal" for contact in pairs)
    how = ', contact of method "mortar"' if nodal else ""
    second = f"second order (Body(..., order=2){how}, in case files order = 2 in [mesh])"
    return f"{second}, {hybrid}, or {finer}"


def _warning(where: str, law: Material, excess: float, remedy: str) -> ResultWarning:
    return ResultWarning(
        "volumetric-locking",
        f"{where} may be about {1 + excess:.2g} times too stiff: elements of first order lock "
        f"with poisson {law.poisson:g}; take {remedy}",
    )


def _nearly_incompressible(law: Material, dim: int) -> bool:
    """False in plane stress, where the thickness gives way, and of orthotropic laws."""
    if isinstance(law, OrthotropicElastic):
        return False
    thin = dim == 2 and law.plane == "stress"
    return law.poisson >= NEARLY and not thin


def _excess(mesh: Mesh, region: str, law: Material) -> float:
    """Estimated stiffness over the true one, minus 1; of isotropic laws."""
    assert not isinstance(law, OrthotropicElastic)
    volumes, squares, kinds = [], [], []
    for block in mesh.cells:
        cell = CELLS[block.kind]
        locks = element_formulation(mesh, block, law) in ("full", "reduced")
        slope = cell.jacobians(mesh.points[block.nodes], cell.centre)
        size = np.abs(np.linalg.det(slope))
        volumes.append(size * cell.gauss[1].sum())
        if block.region == region and locks:
            squares.append(size ** (2 / mesh.dim))
            kinds.append((block.kind, volumes[-1]))
    surface = sum(facet_areas(mesh.points, facets).sum() for facets in mesh.boundary)
    length = 2 * sum(part.sum() for part in volumes) / surface
    share = np.concatenate([part for _, part in kinds])
    mean = float(np.concatenate(squares) @ share / share.sum())  # of h^2, by volume
    ratio = mean / length**2 * 2 * law.poisson / (1 - 2 * law.poisson)
    kind = max(kinds, key=lambda pair: pair[1].sum())[0]
    like = kind if kind in LINEAR else "tet"  # wedges and pyramids were not measured
    root = ROOT[like] + (0.0 if isinstance(law, LinearElastic) else LARGE_ROOT)
    return LINEAR[like] * ratio + root * float(np.sqrt(ratio))
