"""Figures of one solution: the state of the contact surface, and how the solver got there.

Colours are those of Okabe and Ito, which colour-blind readers can tell apart.  Figures are made
without pyplot: no global state, no display needed.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from .solution import ContactStatus, Convergence, FrictionSolution

if TYPE_CHECKING:
    from .model import ContactFields, Model

Array = NDArray[np.float64]
Patches = Iterator[tuple[Array, NDArray[np.int64]]]  # polygons (k, corners, 2) and their nodes
COLOURS = {
    ContactStatus.OPEN: "#C9D1D9",
    ContactStatus.SLIP: "#E69F00",
    ContactStatus.STICK: "#0072B2",
}
MARKERS = {ContactStatus.OPEN: "o", ContactStatus.SLIP: "^", ContactStatus.STICK: "s"}
INK = "#333333"
WIDE = 1e2  # ratio of largest to smallest reaction above which axes are logarithmic
QUARTERS = {"quad9": ((0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3))}
MAX_ARROWS = 400
ARROW_LENGTH = 2.2  # of the longest, in spacings of the arrows: neighbours stay apart


def status_figure(
    solution: FrictionSolution,
    fields: ContactFields | None = None,
    title: str = "",
    model: Model | None = None,
) -> Figure:
    """Status and pressure on the contact surface; without geometry, reactions in the cone."""
    figure = Figure(figsize=(9.6, 4.6), dpi=150, layout="constrained")
    left, right = figure.subplots(1, 2)
    if fields is None or model is None:
        _cone_plane(left, solution)
        _ranked_reactions(right, solution)
        markers = True
    elif solution.problem.dimension == 2:
        _profile(left, right, solution, fields)
        markers = True
    else:
        _surface_maps(figure, left, right, solution, fields, model)
        markers = False
    figure.suptitle(title or solution.problem.name or "contact status", color=INK)
    _legend(figure, solution, markers)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def _legend(figure: Figure, solution: FrictionSolution, markers: bool) -> None:
    """One legend below both panels, with the number of contacts in every state."""
    handles = []
    for status in ContactStatus:
        label = f"{status.name.lower()}: {solution.counts[status.name.lower()]}"
        if markers:
            handles.append(Line2D([], [], linestyle="", marker=MARKERS[status], label=label,
                                  color=COLOURS[status], markeredgecolor=INK))  # fmt: skip
        else:
            handles.append(Patch(facecolor=COLOURS[status], edgecolor=INK, label=label))
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)


# ---------------------------------------------------------------------- without geometry
def _cone_plane(axes: Axes, solution: FrictionSolution) -> None:
    """|r_T| against its bound: slipping contacts on the diagonal, sticking ones below."""
    bound = solution.problem.law.bound(solution.r)
    shear = np.linalg.norm(solution.r[:, 1:], axis=1)
    closed = (solution.status != ContactStatus.OPEN) & (bound > 0)
    axes.set(xlabel="friction bound  $\\mu r_N$", ylabel="tangential reaction  $|r_T|$",
             title="Reactions and the friction cone")  # fmt: skip
    if not closed.any():
        axes.text(0.5, 0.5, "no contact transmits friction", ha="center", va="center",
                  transform=axes.transAxes, color=INK)  # fmt: skip
        return
    low, high = bound[closed].min(), bound[closed].max()
    logarithmic = high > WIDE * low
    if logarithmic:
        axes.set_xscale("log")
        axes.set_yscale("log")
        low = max(low, 1e-6 * high)  # what lies lower is rounding
        axes.set_xlim(low / 2, 2 * high)
        axes.set_ylim(low / 20, 2 * high)
        line = np.geomspace(low / 2, 2 * high, 50)
    else:
        axes.set_xlim(0, 1.1 * high)
        axes.set_ylim(0, 1.1 * high)
        line = np.linspace(0, 1.1 * high, 2)
    axes.plot(line, line, color=INK, linewidth=1)
    axes.fill_between(line, line, color=INK, alpha=0.05, linewidth=0)
    size = _marker_size(int(closed.sum()))
    # slipping contacts, few and at the edge of the cone, are drawn larger and last
    for status, factor in ((ContactStatus.STICK, 1), (ContactStatus.SLIP, 2)):
        chosen = closed & (solution.status == status)
        axes.scatter(bound[chosen], shear[chosen], s=factor * size,
                     marker=MARKERS[status], color=COLOURS[status], alpha=0.8,
                     edgecolors="white", linewidths=0.3)  # fmt: skip


def _ranked_reactions(axes: Axes, solution: FrictionSolution) -> None:
    """Normal reactions, largest first: how evenly the contacts carry the load."""
    normal = solution.r[:, 0]
    order = np.argsort(-normal, kind="stable")
    rank = np.arange(1, len(order) + 1)
    positive = normal[(normal > 0) & (solution.status != ContactStatus.OPEN)]
    axes.set(xlabel="contacts, largest reaction first", ylabel="normal reaction  $r_N$",
             title="How the contacts share the load")  # fmt: skip
    if positive.size and positive.max() > WIDE * positive.min():
        axes.set_yscale("log")
        axes.set_ylim(max(positive.min(), 1e-9 * positive.max()) / 2, 2 * positive.max())
    elif positive.size:
        axes.set_ylim(0, 1.1 * positive.max())
    for status in ContactStatus:
        chosen = solution.status[order] == status
        axes.scatter(rank[chosen], normal[order][chosen], s=_marker_size(len(order)),
                     marker=MARKERS[status], color=COLOURS[status], edgecolors=INK,
                     linewidths=0.3)  # fmt: skip
    axes.set_xlim(0, len(order) + 1)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def _marker_size(count: int) -> float:
    return float(np.clip(4000 / max(count, 1), 8, 60))


# ----------------------------------------------------------------------------------- 2D
def _profile(
    left: Axes, right: Axes, solution: FrictionSolution, fields: ContactFields
) -> None:
    """Gap and slip (left), pressure and shear with its bound (right) along the surface."""
    s = _arc(fields.points)
    order = np.argsort(s, kind="stable")
    s = s[order]
    left.plot(s, fields.gap[order], color=INK, linewidth=1)
    left.plot(s, fields.slip[order, 0], color=INK, linewidth=1, linestyle="--")
    for status in ContactStatus:
        chosen = solution.status[order] == status
        left.scatter(s[chosen], fields.gap[order][chosen], s=_marker_size(len(s)), zorder=3,
                     marker=MARKERS[status], color=COLOURS[status], edgecolors=INK,
                     linewidths=0.3)  # fmt: skip
    left.set(xlabel="position along the surface", ylabel="length",
             title="Gap (marks) and slip (dashed)")  # fmt: skip
    bound = solution.problem.law.bound(solution.r)[order] / fields.weights[order]
    right.plot(s, fields.pressure[order], color=INK, linewidth=1.2)
    right.fill_between(s, -bound, bound, color=INK, alpha=0.08, linewidth=0)
    right.plot(s, fields.shear[order, 0], color="#D55E00", linewidth=1.2, linestyle="--")
    right.set(xlabel="position along the surface", ylabel="traction",
              title="Pressure, shear (dashed), its bound (grey)")  # fmt: skip


def _arc(points: Array) -> Array:
    """Coordinate along the main direction of points (n, 2); growing with x, else with y."""
    centred = points - points.mean(axis=0)
    axis = np.linalg.svd(centred, full_matrices=False)[2][0]
    lead = axis[np.argmax(np.abs(axis))]
    s = centred @ (axis if lead > 0 else -axis)
    return s - s.min(initial=0.0)


# ----------------------------------------------------------------------------------- 3D
def _surface_maps(
    figure: Figure, left: Axes, right: Axes, solution: FrictionSolution,
    fields: ContactFields, model: Model,
) -> None:  # fmt: skip
    """The surface seen along its mean normal: status left, pressure and shear arrows right."""
    origin, axes, names = _view(fields.points)
    patches, owner = _node_patches(model, fields, origin, axes)
    colours = np.array([COLOURS[status] for status in ContactStatus])[solution.status]
    known = owner >= 0
    face = np.where(known, colours[np.maximum(owner, 0)], "#FFFFFF")
    left.add_collection(
        PolyCollection(patches, facecolors=face, edgecolors=face, linewidths=0.2)
    )
    pressure = np.where(known, fields.pressure[np.maximum(owner, 0)], 0.0)
    shown = PolyCollection(patches, array=pressure, cmap="YlOrRd", edgecolors="face",
                           linewidths=0.2)  # fmt: skip
    right.add_collection(shown)
    figure.colorbar(shown, ax=right, label="pressure", shrink=0.85)
    _shear_arrows(right, fields, origin, axes)
    left.set_title("Contact status")
    right.set_title("Pressure, and shear on the slave (arrows)")
    for panel in (left, right):
        panel.set(aspect="equal", xlabel=names[0], ylabel=names[1])
        panel.autoscale_view()


def _view(points: Array) -> tuple[Array, Array, tuple[str, str]]:
    """Origin and two axes (2, 3) to draw on: global ones if the surface is flat along them."""
    spread = np.ptp(points, axis=0)
    flat = int(np.argmin(spread))
    if spread[flat] <= 0.5 * np.sort(spread)[1]:
        kept = [k for k in range(3) if k != flat]
        return np.zeros(3), np.eye(3)[kept], ("xyz"[kept[0]], "xyz"[kept[1]])
    origin = points.mean(axis=0)
    axes = np.linalg.svd(points - origin, full_matrices=False)[2][:2]
    return origin, axes, ("first principal direction", "second principal direction")


def _node_patches(
    model: Model, fields: ContactFields, origin: Array, axes: Array
) -> tuple[list[Array], NDArray[np.int64]]:
    """Facets cut into one patch per node, and the contact at that node or -1."""
    patches, owner = [], []
    for body, blocks in fields.facets:
        points = (model.bodies[body].mesh.points - origin) @ axes.T
        contact = np.full(len(points), -1)
        here = np.flatnonzero(fields.body == body)
        contact[fields.node[here]] = here
        for facets in blocks:
            cut = _thirds if facets.kind == "tri6" else _quarters
            for table in QUARTERS.get(facets.kind, [slice(None)]):
                for patch, nodes in cut(points, facets.nodes[:, table]):
                    patches.extend(patch)
                    owner.append(contact[nodes])
    return patches, np.concatenate(owner)


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
        yield np.stack([corners[:, k], corners[:, k - 2], centre], axis=1), nodes[:, 3 + k]


def _shear_arrows(axes: Axes, fields: ContactFields, origin: Array, view: Array) -> None:
    """Shear tractions in global axes, at most MAX_ARROWS of them."""
    shear = np.einsum("ik,ikc->ic", fields.shear, fields.frames[:, 1:]) @ view.T
    if not shear.any():
        return
    stride = -(-len(shear) // MAX_ARROWS)
    at, shear = ((fields.points - origin) @ view.T)[::stride], shear[::stride]
    spacing = np.sqrt(np.prod(np.maximum(np.ptp(at, axis=0), 1e-12)) / len(at))
    length = np.linalg.norm(shear, axis=1)
    shown = length > 1e-3 * length.max()
    at, shear = at[shown], shear[shown]
    arrows = axes.quiver(at[:, 0], at[:, 1], shear[:, 0], shear[:, 1], color=INK, angles="xy",
                         scale_units="xy", scale=length.max() / (ARROW_LENGTH * spacing),
                         width=0.003, pivot="tail", clip_on=False)  # fmt: skip
    arrows.set_in_layout(False)  # long arrows at the rim must not squeeze the map


# -------------------------------------------------------------------------- convergence
def convergence_figure(record: Convergence, title: str = "") -> Figure:
    """Error against iterations and against time, with the tolerance."""
    figure = Figure(figsize=(10, 4), dpi=150, layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    error = np.array([step.error for step in record.history])
    positive = error[(error > 0) & np.isfinite(error)]
    floor = min(positive.min(initial=np.inf), record.tolerance) / 10
    ceiling = 3 * max(positive.max(initial=0.0), 10 * record.tolerance)
    error = np.where(np.isfinite(error), np.maximum(error, floor), np.nan)
    marker = "o" if len(error) <= 60 else ""
    for axes, name, label in ((left, "iteration", "iterations"), (right, "seconds", "seconds")):
        x = np.array([getattr(step, name) for step in record.history])
        axes.set(xlim=(0, max(x.max(initial=0.0), 1e-9) * 1.03), ylim=(floor, ceiling),
                 yscale="log")  # fmt: skip
        axes.plot(x, error, color=COLOURS[ContactStatus.STICK], marker=marker, markersize=4,
                      linewidth=1.2)  # fmt: skip
        axes.axhline(record.tolerance, color="#D55E00", linestyle="--", linewidth=1)
        axes.set_xlabel(label)
        axes.grid(which="major", alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    left.annotate("tolerance", (0.99, record.tolerance), xycoords=("axes fraction", "data"),
                  ha="right", va="bottom", color="#D55E00", fontsize=9)  # fmt: skip
    left.set_ylabel(f"error ({record.measure.value} measure)")
    outcome = f"{record.outcome.name.lower().replace('_', ' ')} with {record.solver}"
    figure.suptitle(f"{title}: {outcome}" if title else outcome, color=INK)
    return figure


# ----------------------------------------------------------------------------- profiles
LINES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
DASHES = ("-", "--", "-.", ":")


def profile_figure(profiles: dict[float, tuple[Array, Array]], names: list[str]) -> Figure:
    """Performance profiles, one panel per tolerance: (tau, rho) by tolerance."""
    count = len(profiles)
    figure = Figure(figsize=(4.6 * count + 0.4, 3.8), dpi=150, layout="constrained")
    panels = figure.subplots(1, count, sharey=True, squeeze=False)[0]
    for axes, (tolerance, (tau, rho)) in zip(panels, profiles.items(), strict=True):
        last = max(float(tau[-1]), 1.1)
        for k, name in enumerate(names):
            axes.step(np.append(tau, 1.5 * last), np.append(rho[k], rho[k, -1]), where="post",
                      color=LINES[k % len(LINES)], linestyle=DASHES[k % len(DASHES)],
                      label=name)  # fmt: skip
        axes.set(xscale="log", xlim=(1, 1.5 * last), ylim=(0, 1.03),
                 xlabel="time / best time", title=f"tolerance {tolerance:g}")  # fmt: skip
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("share of problems solved")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center",
                  ncols=min(len(names), 4), frameon=False)  # fmt: skip
    return figure
