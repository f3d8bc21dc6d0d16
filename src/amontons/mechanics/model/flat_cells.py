"""Doubts about finite strains: cells pressed flat without resistance, or partly inside out.

Energies that stay finite as a cell loses its thickness do not keep it from doing so: that of
Saint Venant-Kirchhoff under equal stretches of 1.5 in a plane is least where the body has no
thickness at all, and its force of compression falls from a stretch of 1 / sqrt 3 on.  U = bulk
/ 2 (J - 1)^2 does not keep the volume from vanishing, nor does anything keep linear elasticity.
Such a state has equilibrium, and means nothing.

A law resists where pressing a point on to PRESSED of what it is now, along its shortest stretch
or all around, takes a nominal stress above Young's modulus; it is asked where a point is
shorter than SHORT alone.

Points of integration may all be in front of a corner, or the middle of a side, that is turned
inside out: energies do not feel it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvertedCells
from ...core.warned import ResultWarning
from ..elements.cell_matrices import rule_of
from ..elements.elasticity import materials_by_region
from ..elements.energies import PointLaw
from ..elements.given import GivenMatrices
from ..elements.hybrid import is_thin
from ..elements.hyperelasticity import is_hyperelastic
from ..elements.plane_stress import with_thickness
from ..meshes.cells import CELLS
from ..meshes.facets import Cells
from ..meshes.mesh import Mesh
from .fields import ContactFields
from .worst_cells import cell_in_words, turned_corner

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
SHORT = 3**-0.5  # stretch at which Saint Venant-Kirchhoff bears its largest compression
PRESSED = 1e-4


def flat_cells(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """Bodies some of whose cells are flat, as nothing in their law resists that."""
    out = []
    for body, u in zip(model.bodies, fields.displacement, strict=True):
        if isinstance(body.material, GivenMatrices) or not np.isfinite(u).all():
            continue
        if told := flat_in_words(body.mesh, body.material, body.name, u):
            out.append(ResultWarning(
                "flat-cells",
                f"{told}; do not trust the state there: load it less, or take NeoHookean or "
                "CiarletGeymonat, whose energies grow without bound",
            ))  # fmt: skip
    return out


def turned_cells(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """Bodies of finite strains with a corner that is inside out though all points resist."""
    out = []
    for body, u in zip(model.bodies, fields.displacement, strict=True):
        if not (is_hyperelastic(body.material) and np.isfinite(u).all()):
            continue
        if corner := turned_corner(body.mesh, u):
            out.append(ResultWarning(
                "cells-inside-out",
                f"{corner} in body {body.name!r}, which no point of integration feels: "
                "stresses near it mean nothing; refine the mesh there, or load it less",
            ))  # fmt: skip
    return out


def flat_in_words(mesh: Mesh, material: Any, name: str, u: Array) -> str:
    """The flattest cell of a body at displacements u (n, dim), how many others are, or ""."""
    least, told, count, first = SHORT, "", 0, 0
    laws = materials_by_region(mesh, material)
    for cells in mesh.cells:
        law, x = laws[cells.region], mesh.points[cells.nodes]
        if _may_give_way(law):
            stretch, J = _given_way(mesh, cells, law, u)
            count += int(np.isfinite(stretch).sum())
            k = int(stretch.argmin())
            if stretch[k] < least:
                least = float(stretch[k])
                told = (f"{cell_in_words(first + k, x[k])} of body {name!r} is pressed to "
                        f"{least:.2g} of its thickness, det F = {J[k]:.2g}, which "
                        f"{getattr(law, 'name', type(law).__name__)} does not resist, as its "
                        "energy stays finite")  # fmt: skip
        first += len(x)
    return told + (f" ({count} cells alike)" if count > 1 else "")


def _may_give_way(law: Any) -> bool:
    """False where the energy has a logarithm of J (hyperelastic laws that are no PointLaw)."""
    return isinstance(law, PointLaw) or not is_hyperelastic(law)


def _given_way(mesh: Mesh, cells: Cells, law: Any, u: Array) -> tuple[Array, Array]:
    """Shortest stretch (k,) of cells, inf of those that resist or are not short, and det F."""
    moved, count = u[cells.nodes], len(cells.nodes)
    least, J = np.full((2, count), np.inf)
    C = np.empty((count, 3, 3))
    for at in rule_of(mesh, cells, finite=True)[0]:
        gradients = CELLS[cells.kind].gradients(mesh.points[cells.nodes], at)
        found = _stretched(law, mesh, np.einsum("kai,kaj->kij", moved, gradients))
        shorter = found[0] < least
        for known, new in zip((least, J, C), found, strict=True):
            known[shorter] = new[shorter]
    short = np.flatnonzero(least < SHORT)
    if isinstance(law, PointLaw) and len(short):
        short = short[~_resists(law, C[short])]
    out = np.full(count, np.inf)
    out[short] = least[short]
    return out, J


def _stretched(law: Any, mesh: Mesh, slopes: Array) -> tuple[Array, Array, Array]:
    """Shortest stretch (k,), or 1 where it is above SHORT, det F (k,) and C (k, 3, 3)."""
    k, dim, _ = slopes.shape
    F = np.tile(np.eye(3), (k, 1, 1))
    F[:, :dim, :dim] += slopes
    C, J = F.swapaxes(1, 2) @ F, np.linalg.det(F)
    if isinstance(law, PointLaw) and is_thin(law, mesh):
        C[:, 2, 2] = with_thickness(law, C)[0]
        J = J * np.sqrt(C[:, 2, 2])
    # l_1^2 >= det C / (tr C / 2)^2: most points need no principal stretches
    bound = SHORT * np.trace(C, axis1=1, axis2=2) / 2
    some = np.flatnonzero(~(bound < J))
    out = np.ones(k)
    squares = np.linalg.eigvalsh(C[some])[:, 0]
    out[some] = np.sqrt(np.maximum(squares, 0.0)) * np.where(J[some] > 0, 1.0, -1.0)
    return np.minimum(out, 1.0), J, C


def _resists(law: PointLaw, C: Array) -> Mask:
    """Whether points (k,) at C (k, 3, 3) resist being pressed on, one way and all around."""
    squares, axes = np.linalg.eigh(C)
    squares = np.maximum(squares, np.finfo(float).eps * squares[:, 2:])  # flat as they may be
    out = np.ones(len(C), dtype=bool)
    for ways in ([1], [1, 1, 1]):
        pressed = squares.copy()
        pressed[:, : len(ways)] *= PRESSED**2
        C = np.ascontiguousarray((axes * pressed[:, None]) @ axes.swapaxes(1, 2))
        try:
            S = law.whole(C, np.sqrt(pressed.prod(axis=1)))[1]
        except InvertedCells:  # no number there: nor can cells be
            continue
        along = np.einsum("kim,kij,kjm->km", axes, S, axes) * np.sqrt(pressed)
        out &= -along[:, : len(ways)].mean(axis=1) > law.young
    return out
