"""Bodies that yield: what plastic flow adds to the forces K u of linear elasticity.

    forces(u) = K u - f_p(u),    f_p = sum_q v B^T 2 shear eps_p,    tangent = K - K_p,

K being that of the cells as they are integrated, B u the components of the gradient at their
points of integration; eps_p and K_p by (2) of `plasticity`.  Points that have not flown and
cells without any cost nothing but the strain.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..meshes.facets import Cells
from ..meshes.mesh import Mesh
from .cell_matrices import AT_ONCE, components, gradient_rows, rule_of
from .elasticity import materials_by_region
from .nodal_stress import mean_of_centres
from .plasticity import NUMBERS, ElastoPlastic, packed, unpacked

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Flown:
    """The state of a body at displacements u, from a history at the beginning of the step.

    forces (n dim,): f_p; stiffness (n dim, n dim): K_p, None where nothing flows in the step;
    history (h,): at the end of it; stored: what is added to u K u / 2; lost: work of the flow.
    """

    forces: Array
    stiffness: sparse.csr_array | None
    history: Array
    stored: float
    lost: float


class YieldingBody:
    """The cells of a mesh that yield; their history is an array (h,) of 7 numbers a point."""

    def __init__(self, mesh: Mesh, material: Any) -> None:
        self.mesh = mesh
        laws: Mapping[str, Any] = materials_by_region(mesh, material)
        self._blocks = [
            (cells, law, rule_of(mesh, cells))
            for cells in mesh.cells
            if isinstance(law := laws[cells.region], ElastoPlastic)
        ]
        self.size = sum(
            len(cells.nodes) * len(rule[1]) * NUMBERS for cells, _, rule in self._blocks
        )
        self._trace = components(mesh.dim, axisymmetric=mesh.axisymmetric)

    def parts(self, history: Array) -> list[tuple[Cells, ElastoPlastic, Array]]:
        """Cells that yield, their law, and their history (k, q, 7)."""
        out, first = [], 0
        for cells, law, rule in self._blocks:
            shape = len(cells.nodes), len(rule[1]), NUMBERS
            last = first + int(np.prod(shape))
            out.append((cells, law, history[first:last].reshape(shape)))
            first = last
        return out

    def respond(self, u: Array, history: Array, *, tangent: bool = True) -> Flown:
        """What happens at displacements u (n dim,); tangent: with K_p."""
        forces, new, entries = np.zeros(u.size), [], []
        stored = lost = 0.0
        blocks = zip(self.parts(history), self._blocks, strict=True)
        for (cells, law, before), (_, _, rule) in blocks:
            for first in range(0, len(cells.nodes), AT_ONCE):
                some = slice(first, first + AT_ONCE)
                found = _Some(self.mesh, cells.kind, cells.nodes[some], self._trace)
                values = found.flow(u, law, rule, before[some], tangent=tangent)
                np.add.at(forces, found.dofs, found.forces)
                new.append(values.ravel())
                stored, lost = stored + found.stored, lost + found.lost
                if found.at.size:
                    entries.append((found.dofs[found.at], found.stiffness))
        whole = np.concatenate([np.zeros(0), *new])
        return Flown(forces, _matrix(entries, u.size), whole, stored, lost)


class _Some:
    """Cells of one kind and law: sums over their points of integration.

    dofs (k, a dim); forces (k, a dim); at (y,): cells that flow, stiffness (y, a dim, a dim).
    """

    def __init__(
        self, mesh: Mesh, kind: str, nodes: Index, pairs: list[tuple[int, int]]
    ) -> None:
        self._mesh, self._kind, self._nodes, self._pairs = mesh, kind, nodes, pairs
        self.dofs = (nodes[:, :, None] * mesh.dim + np.arange(mesh.dim)).reshape(len(nodes), -1)
        self.forces = np.zeros(self.dofs.shape)
        self.at = np.zeros(0, dtype=np.int64)
        self.stiffness = np.zeros((0, self.dofs.shape[1], self.dofs.shape[1]))
        self.stored = self.lost = 0.0

    def flow(
        self, u: Array, law: ElastoPlastic, rule: tuple, before: Array, *, tangent: bool
    ) -> Array:
        """The history (k, q, 7) after the step; fills the sums."""
        shear, (rows, columns) = law.shear, np.array(self._pairs).T
        moved, new = u[self.dofs], np.empty_like(before)
        points = []
        for q, (at, weight) in enumerate(zip(*rule, strict=True)):
            B, size = gradient_rows(self._mesh, self._kind, self._nodes, at)
            volume = weight * size
            gradient = np.zeros((len(moved), 3, 3))
            gradient[:, rows, columns] = np.einsum("ksa,ka->ks", B, moved)
            p, old = unpacked(before[:, q])
            found = law.flow((gradient + gradient.swapaxes(1, 2)) / 2, old, p)
            new[:, q] = packed(found.p, found.strain)
            held = 2 * shear * found.strain
            self.forces += np.einsum("ksa,ks,k->ka", B, held[:, rows, columns], volume)
            work = (held * (found.strain / 2 - gradient)).sum(axis=(1, 2))
            self.stored += float(volume @ work)
            self.lost += float(volume @ (found.q * (found.p - p)))
            points.append((B, volume, found))
        if tangent:
            self._add_stiffness(points)
        return new

    def _add_stiffness(self, points: list[tuple]) -> None:
        """K_p of the cells that flow, by (2) of `plasticity`."""
        flows = np.any([found.round > 0 for _, _, found in points], axis=0)
        self.at = np.flatnonzero(flows)
        rows, columns = np.array(self._pairs).T
        same, other = np.equal.outer(rows, rows), np.equal.outer(rows, columns)
        even = (same & np.equal.outer(columns, columns)) / 2
        even = even + (other & np.equal.outer(columns, rows)) / 2
        even -= np.outer(rows == columns, rows == columns) / 3
        n = self.dofs.shape[1]
        self.stiffness = np.zeros((len(self.at), n, n))
        for B, volume, found in points:
            own, size = B[self.at], volume[self.at]
            normal = found.normal[self.at][:, rows, columns]
            C = (size * found.round[self.at])[:, None, None] * even
            C += (size * found.along[self.at])[:, None, None] * (
                normal[:, :, None] * normal[:, None, :]
            )
            self.stiffness += np.swapaxes(own, 1, 2) @ (C @ own)


def _matrix(
    entries: list[tuple[Index, Array]], n: int
) -> sparse.csr_array | None:
    """The sum (n, n) of matrices (y, m, m) at dofs (y, m); None without any."""
    if not entries:
        return None
    rows, columns, values = [], [], []
    for dofs, K in entries:
        rows.append(np.broadcast_to(dofs[:, :, None], K.shape).ravel())
        columns.append(np.broadcast_to(dofs[:, None, :], K.shape).ravel())
        values.append((0.5 * (K + np.swapaxes(K, 1, 2))).ravel())
    at = np.concatenate(rows), np.concatenate(columns)
    return sparse.coo_array((np.concatenate(values), at), shape=(n, n)).tocsr()


def plastic_strain(mesh: Mesh, material: Any, history: Array) -> Array:
    """Equivalent plastic strain of the cells, (cells,): means over their points."""
    return _means(mesh, material, history)[0]


def relieved(
    mesh: Mesh, material: Any, elastic: tuple[Array, Array], history: Array
) -> tuple[Array, Array]:
    """Stress at centres and nodes, (k, 3, 3), of that without flow and a history (h,).

    Cells take off the mean of their points; nodes of cells that have flown have the mean of the
    cells around, which is nowhere far beyond the yield stress.
    """
    p, held = _means(mesh, material, history)
    centres, nodes = elastic[0] - held, np.array(elastic[1])
    flown, first = np.zeros(len(nodes), dtype=bool), 0
    for cells in mesh.cells:
        last = first + len(cells.nodes)
        flown[cells.nodes[p[first:last] > 0]] = True
        first = last
    nodes[flown] = mean_of_centres(mesh, centres)[flown]
    return centres, nodes


def _means(mesh: Mesh, material: Any, history: Array) -> tuple[Array, Array]:
    """p (cells,) and 2 shear eps_p (cells, 3, 3), means over the points of each cell."""
    laws = materials_by_region(mesh, material)
    parts = iter(YieldingBody(mesh, material).parts(history))
    strains, stresses = [], []
    for cells in mesh.cells:
        if not isinstance(laws[cells.region], ElastoPlastic):
            strains.append(np.zeros(len(cells.nodes)))
            stresses.append(np.zeros((len(cells.nodes), 3, 3)))
            continue
        _, law, own = next(parts)
        p, strain = unpacked(own.mean(axis=1))
        strains.append(p)
        stresses.append(2 * law.shear * strain)
    return np.concatenate(strains), np.concatenate(stresses)
