"""How the cells of a model are integrated, where that is not left to the eye."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..elements.elasticity import materials_by_region
from ..elements.given import GivenMatrices
from ..elements.hybrid import element_formulation, powers_of
from ..elements.rigid import Rigid

if TYPE_CHECKING:
    from .model import Model


def formulations(model: Model) -> list[tuple[str, str, str, str]]:
    """(body, region, kind of cells, formulation) of all cells that deform by a law.

    The formulation is "full", "reduced", "incompatible", "hybrid" or
    "hybrid-incompatible", see `Cells`.
    """
    out = []
    for body in model.bodies:
        if isinstance(body.material, Rigid | GivenMatrices):
            continue
        laws = materials_by_region(body.mesh, body.material)
        for cells in body.mesh.cells:
            taken = element_formulation(body.mesh, cells, laws[cells.region])
            out.append((body.name, cells.region, cells.kind, taken))
    return list(dict.fromkeys(out))


def in_words(model: Model) -> list[str]:
    """A line about the cells that are not integrated in full; none where all are."""
    dim, parts = model.dimension, []
    several = len(model.bodies) > 1
    for body, region, kind, taken in formulations(model):
        if taken == "full":
            continue
        where = f" of region {region!r}" if region != "default" else ""
        where += f" of {body!r}" if several and body else ""
        mean = "linear in the cell" if powers_of(kind, dim) > 1 else "constant in the cell"
        pressure = f" (pressure {mean}: no locking)" if taken.startswith("hybrid") else ""
        parts.append(f"{kind}{where} {taken}{pressure}")
    return [f"elements: {'; '.join(parts)}"] if parts else []
