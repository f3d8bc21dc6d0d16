"""Hybrid cells: their change of volume is taken on the mean, so that they do not lock.

Near incompressibility the part U of the energy that depends on the change of volume alone is
large, and full integration asks each point of a cell to keep its volume.  Hybrid cells ask the
cell to: with J = det F at the points (1 + tr eps at small strains), v their volumes and phi_m,
m = 1 .. M, polynomials that are orthonormal over the cell (sum_q v phi_m phi_n = delta_mn),

    theta = sum_m phi_m sum_q v phi_m J,    energy = sum_q v [ (W - U)(F) + U(theta) ].

That is the pressure p, a polynomial of its own in every cell, eliminated from p (J - theta) +
U(theta); p = sum_m phi_m sum_q v phi_m U'(theta).  With b_m = sum_q v phi_m dJ the tangent gets

    sum_q v p d^2 J + sum_mn N_mn b_m b_n^T,    N_mn = sum_q v U''(theta) phi_m phi_n.       (1)

M = 1 (the mean) for cells of first order and simplices, dim + 1 (linear in x) for quad8, quad9,
hex20, hex27 and wedge15: [STP], [SB].  At small strains U = lame_lambda / 2 (tr eps)^2, N is
lame_lambda times the identity and the first term of (1) is zero.

[STP] J. C. Simo, R. L. Taylor, K. S. Pister, CMAME 51 (1985) 177-208.
[SB] T. Sussman, K.-J. Bathe, "A finite element formulation for nonlinear incompressible elastic
and inelastic analysis", Computers & Structures 26 (1987) 357-409.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..meshes.cells import CELLS
from ..meshes.check import around, determinant
from ..meshes.facets import Cells
from ..meshes.linear_cells import Rule
from ..meshes.mesh import Mesh

Array = NDArray[np.float64]
LINEAR_PRESSURE = ("quad8", "quad9", "hex20", "hex27", "wedge15")
NEARLY = 0.4  # poisson from which on full integration has at least twice their error
BENDING = ("quad", "hex")  # that may have incompatible modes
SIMPLEX = ("tri", "tet")  # of first order: their volume changes evenly anyhow


def element_formulation(mesh: Mesh, cells: Cells, law: object) -> str:
    """How cells of a law are integrated, see `Cells`.

    Cells that leave it open ("auto") are hybrid where the law is nearly incompressible, or
    yields, and so flows at constant volume; "quad" and "hex" of laws that do not yield then
    have incompatible modes, too, see `uniform`.
    """
    able = getattr(law, "volume", None) is not None and cells.kind not in SIMPLEX
    able = able and not is_thin(law, mesh)
    bends = cells.kind in BENDING and not mesh.axisymmetric
    bends = bends and not getattr(law, "keeps_volume", False)
    both = "hybrid-incompatible" if bends else "hybrid"
    if cells.integration == "hybrid":
        return "hybrid" if able else "full"
    if cells.integration == "hybrid-incompatible":
        return both if able else "full"
    if cells.integration != "auto":
        return cells.integration
    return both if able and _keeps_volume(law) else "full"


def is_hybrid(mesh: Mesh, cells: Cells, law: object) -> bool:
    """Whether cells have pressures of their own."""
    return element_formulation(mesh, cells, law).startswith("hybrid")


def _keeps_volume(law: Any) -> bool:
    return getattr(law, "keeps_volume", False) or getattr(law, "poisson", 0.0) >= NEARLY


def volume_modulus(law: Any) -> float:
    """U'' at rest of the volume term of hybrid cells, unit of stress."""
    return float(law.volume(np.ones(1))[2][0])


def is_thin(law: object, mesh: Mesh) -> bool:
    """True in plane stress, where the thickness gives way."""
    plane = getattr(law, "plane", "strain")
    return mesh.dim == 2 and not mesh.axisymmetric and plane == "stress"


def powers_of(kind: str, dim: int) -> int:
    """M, how many polynomials the change of volume has in a cell."""
    return 1 + dim if kind in LINEAR_PRESSURE else 1


def places_of(mesh: Mesh, cells: Cells, at: Array) -> Array:
    """Positions (k, p, dim) of reference points (p, dim) in cells."""
    return np.einsum("pa,kac->kpc", CELLS[cells.kind].shape(at), mesh.points[cells.nodes])


def volumes_of(mesh: Mesh, cells: Cells, rule: Rule) -> Array:
    """Volumes (k, q) of the points of integration of cells, around the axis where it is one."""
    cell, x = CELLS[cells.kind], mesh.points[cells.nodes]
    sizes = [w * determinant(cell.jacobians(x, at)) for at, w in zip(*rule, strict=True)]
    places = places_of(mesh, cells, rule[0])
    return np.stack(sizes, axis=1) * around(places, axisymmetric=mesh.axisymmetric)


def volume_modes(
    mesh: Mesh, cells: Cells, rule: Rule, at: Array | None = None
) -> tuple[Array, Array]:
    """phi (k, M, q) and volumes (k, q) at the points of integration of cells.

    at (p, dim): reference points at which phi (k, M, p) is taken instead.
    """
    volumes = volumes_of(mesh, cells, rule)
    where = rule[0] if at is None else at
    if powers_of(cells.kind, mesh.dim) == 1:
        total = volumes.sum(axis=1)[:, None, None]
        constant = np.empty((len(volumes), 1, len(where)))
        constant[:] = 1 / np.sqrt(total)
        return constant, volumes
    places = places_of(mesh, cells, rule[0])
    middle = places.mean(axis=1, keepdims=True)
    size = np.abs(places - middle).max(axis=(1, 2))[:, None, None]

    def powers(places: Array) -> Array:
        ones = np.ones((*places.shape[:2], 1))
        return np.concatenate([ones, (places - middle) / size], axis=2)

    upper = np.linalg.qr(powers(places) * np.sqrt(volumes)[:, :, None])[1]
    taken = powers(places if at is None else places_of(mesh, cells, at))
    basis = np.linalg.solve(np.swapaxes(upper, 1, 2), np.swapaxes(taken, 1, 2))
    return np.ascontiguousarray(basis, dtype=float), volumes


def averaged(modes: Array, volumes: Array, values: Array, at: Array | None = None) -> Array:
    """What polynomials keep of values (k, q) at the points of integration, (k, q).

    at (k, M, p): phi at other points, where the values (k, p) are wanted instead.
    """
    kept = np.einsum("kmq,kq->km", modes, volumes * values)
    return np.einsum("kmp,km->kp", modes if at is None else at, kept)


def curvature(modes: Array, volumes: Array, slopes: Array) -> Array:
    """N (k, M, M) of (1), for U''(theta) (k, q)."""
    return np.einsum("kmq,knq->kmn", modes * (volumes * slopes)[:, None], modes, optimize=True)
