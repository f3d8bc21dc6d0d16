"""Contact of a 3D model: maps of status and pressure on a surface, arrows of shear."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from numpy.typing import NDArray

from ...mechanics.meshes.cells import CELLS
from ...mechanics.meshes.facets import Facets, corner_facets
from ...problem.solution import ContactStatus
from .contact_pairs import ContactPair
from .style import COLOURS, INK, round_below
from .surface_views import Projection, Unrolled, view_of

if TYPE_CHECKING:
    from ...mechanics.model import Model

Array = NDArray[np.float64]
Patches = Iterator[tuple[Array, NDArray[np.int64]]]  # polygons (k, 4, 3) and their nodes
QUARTERS = {"quad9": ((0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3)),
            "quad8": ((0, 4, 1, 5, 2, 6, 3, 7),)}  # fmt: skip
HEAT = "YlOrRd"
TINY = 1e-300  # instead of a largest pressure of 0
KEY = 0.36  # inches of the key of the arrows below its panel
MAX_ARROWS = 400
ARROW_LENGTH = 2.2  # of the longest, in spacings of the arrows: neighbours stay apart
LONGEST = 0.25  # of the surface, where contacts are few


def draw_maps(
    left: Axes, right: Axes, pair: ContactPair, model: Model, *, named: bool
) -> None:
    """The surface laid flat (`surface_views`): status left, pressure and shear arrows right."""
    view = view_of(pair.points, pair.frames[:, 0])
    patches: Any
    patches, owner = _node_patches(model, pair, view)
    colours = np.array([COLOURS[status] for status in ContactStatus])[pair.status]
    known = owner >= 0
    face = np.where(known, colours[np.maximum(owner, 0)], "#FFFFFF")
    left.add_collection(
        PolyCollection(patches, facecolors=face, edgecolors=face, linewidths=0.2)
    )
    pressure = np.where(known, pair.pressure[np.maximum(owner, 0)], 0.0)
    largest = max(float(pressure.max(initial=0.0)), TINY)
    right.add_collection(
        PolyCollection(patches, array=pressure, cmap=HEAT, clim=(0.0, largest),
                       edgecolors="face", linewidths=0.2)
    )  # fmt: skip
    _draw_scale(right, largest)
    tips = _shear_arrows(right, pair, view)
    place = f" on {pair.name}" if named else ""
    left.set_title(f"Contact status{place}")
    right.set_title("Pressure, shear on the slave (arrows)")
    for panel in (left, right):
        panel.set(aspect="equal", xlabel=view.names[0], ylabel=view.names[1])
        panel.update_datalim(tips)  # no arrow leaves the frame; both panels show the same
        panel.autoscale_view()


def _draw_scale(axes: Axes, largest: float) -> None:
    """Colours of the pressures from 0 on, to the right of a panel whatever its shape."""
    scale = axes.inset_axes((1.04, 0.08, 0.05, 0.84))
    scale.imshow(np.linspace(0, 1, 128)[:, None], cmap=HEAT, origin="lower", aspect="auto",
                 extent=(0.0, 1.0, 0.0, largest))  # fmt: skip
    scale.set(xticks=[], ylabel="pressure")
    scale.yaxis.set(ticks_position="right", label_position="right")
    scale.tick_params(labelsize=8)
    scale.yaxis.label.set_fontsize(9)


def _node_patches(
    model: Model, pair: ContactPair, view: Projection | Unrolled
) -> tuple[Array, NDArray[np.int64]]:
    """Facets with contacts cut into a patch for each node, and the contact there or -1.

    Facets without any are left out: the far side of a body would hide the contacts.
    """
    patches, owner = [], []
    points = model.bodies[pair.body].mesh.points
    contact = np.full(len(points), -1)
    contact[pair.node] = np.arange(len(pair.node))
    for facets in pair.facets:
        middles = facets.nodes[:, CELLS[facets.kind].corner_count :]
        if (contact[middles] < 0).all():  # averages sit at corners
            facets = corner_facets(facets)  # noqa: PLW2901
        facets = Facets(facets.kind, facets.nodes[(contact[facets.nodes] >= 0).any(axis=1)])
        cut = _thirds if facets.kind == "tri6" else _quarters
        tables = QUARTERS.get(facets.kind, [slice(None)])
        if facets.kind == "quad8" and (contact[facets.nodes[:, 4:]] < 0).all():
            tables = [slice(4)]  # nodal contact has none at the middles of sides
        for table in tables:
            for patch, nodes in cut(points, facets.nodes[:, table]):
                patches.append(patch)
                owner.append(contact[nodes])
    return view.laid(np.concatenate(patches)), np.concatenate(owner)


def _quarters(points: Array, nodes: NDArray[np.int64]) -> Patches:
    """A quadrilateral per corner: to the middles of the sides and the centre."""
    corners = points[nodes]
    centre = corners.mean(axis=1)
    after = 0.5 * (corners + np.roll(corners, -1, axis=1))
    for k in range(corners.shape[1]):
        patch = np.stack([corners[:, k], after[:, k], centre, after[:, k - 1]], axis=1)
        yield patch, nodes[:, k]


def _thirds(points: Array, nodes: NDArray[np.int64]) -> Patches:
    """A triangle per side for the node in its middle: the corners have no contact."""
    corners = points[nodes[:, :3]]
    centre = corners.mean(axis=1)
    for k in range(3):
        patch = [corners[:, k], corners[:, k - 2], centre, centre]  # four corners, as the rest
        yield np.stack(patch, axis=1), nodes[:, 3 + k]


def _shear_arrows(axes: Axes, pair: ContactPair, view: Projection | Unrolled) -> Array:
    """Shear tractions in global axes, at most MAX_ARROWS of them; returns their tips (k, 2)."""
    shear = np.einsum("ik,ikc->ic", pair.shear, pair.frames[:, 1:])
    shear = view.turned(pair.points, shear)
    if not shear.any():
        return np.empty((0, 2))
    stride = -(-len(shear) // MAX_ARROWS)
    at, shear = view.laid(pair.points[::stride, None])[:, 0], shear[::stride]
    size = np.maximum(np.ptp(at, axis=0), 1e-12)
    longest = min(ARROW_LENGTH * np.sqrt(np.prod(size) / len(at)), LONGEST * size.max())
    length = np.linalg.norm(shear, axis=1)
    shown = length > 1e-3 * length.max()
    at, shear = at[shown], shear[shown]
    scale = length.max() / longest
    arrows = axes.quiver(at[:, 0], at[:, 1], shear[:, 0], shear[:, 1], color=INK, angles="xy",
                         scale_units="xy", scale=scale, width=0.003, pivot="tail")  # fmt: skip
    value = round_below(float(length.max()))
    place = axes.get_position(original=True)  # whatever shape the panel takes inside of it
    inch = 1.0 / axes.get_figure(root=True).get_size_inches()[1]  # type: ignore[union-attr]
    axes.quiverkey(arrows, place.x0 + 0.9 * place.width, place.y0 - KEY * inch, value,
                   f"{value:g}", labelpos="S", color=INK, labelsep=0.05, coordinates="figure",
                   fontproperties={"size": 8})  # fmt: skip
    return at + shear / scale
