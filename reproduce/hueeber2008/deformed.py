"""Deformed bodies coloured by von Mises stress, whole or cut open."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import amontons as am
from amontons.mechanics.elements import cell_stress, von_mises

from . import figures

# a hexahedron as six tetrahedra around the diagonal from corner 0 to corner 6
AROUND = ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1))
TETRAHEDRA = {
    "tet": np.array([[0, 1, 2, 3]]), "hex": np.array([[0, 6, *pair] for pair in AROUND]),
}  # fmt: skip
EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


def deformed(
    model: am.Model, solution: am.FrictionSolution, path: Path,
    view: tuple[float, float] = (22, -60), *, cut: bool = False,
) -> None:  # fmt: skip
    """Surfaces of the deformed bodies: figures 4.1, 5.1, 6.1, 6.6, 7.1.

    cut: only what lies behind the plane y = 0, with the section in that plane on it and once
    more beside it.
    """
    fields = model.recover(solution)
    faces: list[np.ndarray] = []
    values: list[float] = []
    sections = []
    for body, moved in zip(model.bodies, fields.displacement, strict=True):
        mesh, stress = body.mesh, _nodal_stress(body, moved)
        for facets in mesh.boundary:
            nodes = facets.nodes
            if cut:
                nodes = nodes[mesh.points[nodes][:, :, 1].mean(axis=1) > 0]
            faces += list((mesh.points + moved)[nodes])
            values += list(stress[nodes].mean(axis=1))
        if cut:
            sections.append(_section_of(mesh, moved, stress))
            faces += sections[-1][0]
            values += sections[-1][1]
    colours = plt.Normalize(0, np.quantile(values, 0.98))  # corners would take all colours
    figure = plt.figure(figsize=(13.5, 4.8) if cut else (7, 5.4))
    axes = figure.add_subplot(1, 2 if cut else 1, 1, projection="3d")
    _surfaces(axes, faces, colours(np.array(values)), view)
    frames = [axes]
    if cut:
        axes.set_zlabel("")  # where that of the section is
        figure.subplots_adjust(wspace=0.3)
        frames.append(figure.add_subplot(1, 2, 2))
        _draw_sections(frames[1], sections, colours)
    figure.colorbar(plt.cm.ScalarMappable(colours, "viridis"), ax=frames, shrink=0.7, pad=0.06,
                    extend="max", label="von Mises stress")  # fmt: skip
    figure.savefig(path, dpi=figures.DPI, bbox_inches="tight")
    plt.close(figure)


def _nodal_stress(body: am.Body, moved: np.ndarray) -> np.ndarray:
    """Von Mises stress at the nodes, (n,): means of the cells around."""
    (block,) = body.mesh.cells
    stress = von_mises(cell_stress(body.mesh, body.material, moved))
    total = np.zeros(len(body.mesh.points))
    np.add.at(total, block.nodes, stress[:, None])
    return total / np.bincount(block.nodes.ravel(), minlength=len(total))


def _section_of(mesh: am.Mesh, moved: np.ndarray, stress: np.ndarray) -> tuple[list, list]:
    """Polygons (k, 3) in which cells meet the plane y = 0, deformed, and their stress."""
    (block,) = mesh.cells
    cells = block.nodes[:, TETRAHEDRA[block.kind]].reshape(-1, 4)
    y = mesh.points[:, 1].copy()
    y[np.abs(y) < 1e-9] = 1e-9  # no node lies in the plane itself
    cells = cells[(y[cells] > 0).any(axis=1) & (y[cells] < 0).any(axis=1)]
    place = mesh.points + moved
    polygons, values = [], []
    for cell in cells:
        a, b = cell[EDGES].T
        crossed = y[a] * y[b] < 0
        a, b = a[crossed], b[crossed]
        t = y[a] / (y[a] - y[b])
        corners = place[a] + t[:, None] * (place[b] - place[a])
        middle = corners[:, [0, 2]] - corners[:, [0, 2]].mean(axis=0)
        polygons.append(corners[np.argsort(np.arctan2(middle[:, 1], middle[:, 0]))])
        values.append(float((stress[a] + t * (stress[b] - stress[a])).mean()))
    return polygons, values


def _surfaces(axes, faces: list, share: np.ndarray, view: tuple[float, float]) -> None:
    """Polygons (k, 3) in space."""
    axes.add_collection3d(
        Poly3DCollection(faces, facecolors=plt.cm.viridis(share), edgecolors="0.75",
                         linewidths=0.12)
    )  # fmt: skip
    every = np.concatenate(faces)
    low, high = every.min(axis=0), every.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]),
             xlabel="x", ylabel="y", zlabel="z")  # fmt: skip
    axes.set_box_aspect(high - low)
    for axis, span in zip((axes.xaxis, axes.yaxis, axes.zaxis), high - low, strict=True):
        axis.set_major_locator(plt.MaxNLocator(max(2, int(5 * span / (high - low).max()))))
    axes.view_init(*view)


def _draw_sections(axes, sections: list, colours) -> None:
    """Polygons of all bodies in the plane y = 0; of tubes one side."""
    for polygons, values in sections:
        flat = [p[:, [0, 2]] for p in polygons]
        middle = np.array([p[:, 0].mean() for p in flat])
        if np.abs(middle).min() > 0.1 * np.abs(middle).max():
            flat = [p for p, x in zip(flat, middle, strict=True) if x > 0]
            values = [v for v, x in zip(values, middle, strict=True) if x > 0]
        shown = plt.cm.viridis(colours(np.array(values)))
        axes.add_collection(
            matplotlib.collections.PolyCollection(
                flat, facecolors=shown, edgecolors=shown, linewidths=0.4
            )
        )
    axes.autoscale()
    axes.set(aspect="equal", xlabel="x", ylabel="z", title="section y = 0")
