"""Which surface of a mesh has which name: its boundary from two sides, with numbers on it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

from ...mechanics.meshes import Facets, Mesh
from ...mechanics.meshes.facets import corner_facets
from ...mechanics.meshes.surfaces import facet_normals
from .raster import seen

Array = NDArray[np.float64]
VIEWS = ((25, -55), (-25, 125))  # elevation and azimuth, opposite to each other
LIGHT = 0.45  # how much darker a facet seen from the side is
LEGEND_ROWS = 30
PIXELS = 400  # of the view that tells which facets are hidden, each way
BOX = {"boxstyle": "round,pad=0.15", "fc": "white", "alpha": 0.8, "lw": 0}  # under a number


def draw_surface_names(mesh: Mesh) -> Figure:
    """The named surfaces with their numbers, in 3D from two opposite sides.

    Numbers count the surfaces in the order of the mesh, from 1; each stands on a facet that is
    seen, of those that lie outside.  Colours and numbers are explained beside the picture.
    """
    colours = _colours(len(mesh.surfaces))
    columns = -(-len(mesh.surfaces) // LEGEND_ROWS)
    figure = Figure(figsize=((11 if mesh.dim == 3 else 6) + 2 * columns, 5.5))
    if mesh.dim == 3:
        for k, (up, around) in enumerate(VIEWS):
            ax: Any = figure.add_axes((0.42 * k, 0.0, 0.42, 1.0), projection="3d")
            ax.view_init(up, around)
            _draw_solid(ax, mesh, colours, _towards(up, around))
    else:
        _draw_plane(figure.add_axes((0.08, 0.1, 0.6, 0.85)), mesh, colours)
    handles = [
        Line2D([], [], color=colour, linewidth=6, label=f"{k}  {name}")
        for k, (name, colour) in enumerate(zip(mesh.surfaces, colours, strict=True), 1)
    ]
    if handles:
        figure.legend(handles=handles, loc="center right", ncols=columns, frameon=False,
                      fontsize=8)  # fmt: skip
    return figure


def _colours(count: int) -> Array:
    """So many colours that neighbours in the list differ, (count, 3)."""
    hues = (np.arange(count) * 0.618034) % 1.0  # the golden ratio never comes back near
    return np.asarray(colormaps["hsv"](hues))[:, :3] * 0.75 + 0.25


def _towards(up: float, around: float) -> Array:
    """Unit vector from the body to who looks at it."""
    a, b = np.radians([up, around])
    return np.array([np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a)])


def _draw_solid(ax: Any, mesh: Mesh, colours: Array, eye: Array) -> None:
    shown, tints = [], []
    for facets, colour, number in _outer_facets(mesh, colours):
        flat = corner_facets(facets)
        normals = facet_normals(mesh.points, flat)
        cosine = normals @ eye / np.linalg.norm(normals, axis=1)
        facing = mesh.points[flat.nodes[cosine > 0]]
        if not len(facing):
            continue
        shown.append((number, facing))
        tints.append((1 - LIGHT * (1 - cosine[cosine > 0]))[:, None] * colour)
    for (number, facing), in_front in zip(shown, _in_front(shown, eye), strict=True):
        if number:
            middles = facing[in_front if in_front.any() else slice(None)].mean(axis=1)
            spot = middles[np.argmin(np.linalg.norm(middles - middles.mean(axis=0), axis=1))]
            ax.text(*spot, str(number), fontsize=9, ha="center", va="center", zorder=10,
                    bbox=BOX)  # fmt: skip
    corners = [facet for _, facing in shown for facet in facing]
    # one collection, so that what is nearer hides what is behind it
    ax.add_collection3d(Poly3DCollection(corners, facecolors=np.concatenate(tints),
                                         edgecolors=(0, 0, 0, 0.15), linewidths=0.2)
                        )  # fmt: skip
    low, high = mesh.bounding_box()
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]),
           xlabel="x", ylabel="y", zlabel="z")  # fmt: skip
    ax.locator_params(nbins=4)
    ax.set_box_aspect(np.maximum(high - low, 0.05 * (high - low).max()))


def _in_front(shown: list[tuple[int, Array]], eye: Array) -> Iterator[NDArray[np.bool_]]:
    """Of facets (k, corners, 3) which have a middle that nothing hides, for each surface."""
    across = np.cross((0.0, 0.0, 1.0), eye)
    axes = np.stack([across / np.linalg.norm(across), np.cross(eye, across), eye])
    axes[1] /= np.linalg.norm(axes[1])
    views = [facets @ axes.T for _, facets in shown]
    low = np.min([v.min(axis=(0, 1)) for v in views], axis=0)[:2]
    high = np.max([v.max(axis=(0, 1)) for v in views], axis=0)[:2]
    scale = (PIXELS - 1) / max((high - low).max(), 1e-300)
    fans, owners, count = [], [], 0
    for view in views:
        view[:, :, :2] = (view[:, :, :2] - low) * scale
        for k in range(1, view.shape[1] - 1):
            fans.append(view[:, [0, k, k + 1]])
            owners.append(count + np.arange(len(view)))
        count += len(view)
    front = seen(np.concatenate(fans), (PIXELS, PIXELS)).triangle
    owner = np.append(np.concatenate(owners), -1)[front]
    count = 0
    for view in views:
        column, row = np.rint(view.mean(axis=1)[:, :2]).astype(int).T
        yield owner[row, column] == count + np.arange(len(view))
        count += len(view)


def _outer_facets(mesh: Mesh, colours: Array) -> Iterator[tuple[Facets, Array, int]]:
    """Facets on the outside with colour and number: of each surface, then the nameless as 0."""
    for outside in mesh.boundary:
        label = {tuple(row): k for k, row in enumerate(np.sort(outside.nodes, axis=1).tolist())}
        named = np.zeros(len(outside.nodes), dtype=bool)
        for number, blocks in enumerate(mesh.surfaces.values(), 1):
            for facets in blocks:
                rows = (label.get(tuple(r)) for r in np.sort(facets.nodes, axis=1).tolist())
                found = [row for row in rows if row is not None and not named[row]]
                named[found] = True
                if found:
                    part = Facets(outside.kind, outside.nodes[found])
                    yield part, colours[number - 1], number
        if not named.all():
            yield Facets(outside.kind, outside.nodes[~named]), np.full(3, 0.85), 0


def _draw_plane(ax: Any, mesh: Mesh, colours: Array) -> None:
    for facets in mesh.boundary:
        for ends in mesh.points[facets.nodes[:, :2]]:
            ax.plot(*ends.T, color="0.85", linewidth=1)
    for k, (blocks, colour) in enumerate(zip(mesh.surfaces.values(), colours, strict=True), 1):
        for facets in blocks:
            for ends in mesh.points[facets.nodes[:, :2]]:
                ax.plot(*ends.T, color=colour, linewidth=3)
        middles = np.concatenate([mesh.points[f.nodes].mean(axis=1) for f in blocks])
        spot = middles[np.argmin(np.linalg.norm(middles - middles.mean(axis=0), axis=1))]
        ax.annotate(str(k), spot, ha="center", va="center", fontsize=9, bbox=BOX)
    ax.set(xlabel="x", ylabel="y", aspect="equal")
