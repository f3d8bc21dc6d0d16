"""Figures of one solution: the state of the contact surface, and how the solver got there.

Colours are those of Okabe and Ito, which colour-blind readers can tell apart.  Figures are made
without pyplot: no global state, no display needed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from ..solution import ContactStatus, Convergence, FrictionSolution

if TYPE_CHECKING:
    from ..model import ContactFields, Model

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
MAX_MAPS = 4  # pairs in 3D: each has a row of its own
MAX_NAMES = 6  # pairs in 2D: side by side under their names
ARROW_LENGTH = 2.2  # of the longest, in spacings of the arrows: neighbours stay apart


def status_figure(
    solution: FrictionSolution,
    fields: ContactFields | None = None,
    title: str = "",
    model: Model | None = None,
) -> Figure:
    """Status and pressure on the contact surface; without geometry, reactions in the cone."""
    pairs = [] if fields is None or model is None else _pairs(solution, fields, model)
    maps = solution.problem.dimension == 3 and 0 < len(pairs) <= MAX_MAPS
    rows = len(pairs) if maps else 1
    figure = Figure(figsize=(9.6, 0.4 + 4.2 * rows), dpi=150, layout="constrained")
    panels = figure.subplots(rows, 2, squeeze=False)
    if maps and model is not None:
        for (left, right), pair in zip(panels, pairs, strict=True):
            _surface_maps(figure, left, right, pair, model, named=rows > 1)
    elif pairs and solution.problem.dimension == 2:
        _profiles(*panels[0], pairs)
    else:
        _cone_plane(panels[0, 0], solution)
        _ranked_reactions(panels[0, 1], solution)
    figure.suptitle(title or solution.problem.name or "contact status", color=INK)
    _legend(figure, solution, markers=not maps)
    for axes in panels.flat:
        axes.spines[["top", "right"]].set_visible(False)
    return figure


@dataclass(frozen=True, eq=False)
class _Pair:
    """The contacts of one slave surface with one obstacle or master; rows as in the fields."""

    name: str
    body: int
    facets: tuple
    status: NDArray[np.int8]
    bound: Array  # of the shear traction
    points: Array
    frames: Array
    gap: Array
    slip: Array
    pressure: Array
    shear: Array
    node: NDArray[np.int64]


def _pairs(solution: FrictionSolution, fields: ContactFields, model: Model) -> list[_Pair]:
    """The pairs of a model that have contacts, in its order."""
    bound = solution.problem.law.bound(solution.r) / fields.weights
    ends = np.cumsum([len(placed.rows.nodes) for placed in model.discretisation.placed])
    found = []
    for contact, (body, facets), rows in zip(
        model.contacts, fields.facets, np.split(np.arange(len(bound)), ends[:-1]), strict=True
    ):
        if len(rows):
            pair = (
                _Pair(
                    contact.slave,
                    body,
                    facets,
                    solution.status[rows],
                    bound[rows],
                    fields.points[rows],
                    fields.frames[rows],
                    fields.gap[rows],
                    fields.slip[rows],
                    fields.pressure[rows],
                    fields.shear[rows],
                    fields.node[rows],
                )  # fmt: skip
            )
            by_node = contact.nitsche is not None and model.dimension == 3
            found.append(_at_nodes(pair, fields.weights[rows]) if by_node else pair)
    return found


def _at_nodes(pair: _Pair, weights: Array) -> _Pair:
    """Gauss points gathered at their nodes: means by area, and the highest status."""
    node, label = np.unique(pair.node, return_inverse=True)
    label = label.ravel()
    total = np.bincount(label, weights)

    def mean(values: Array) -> Array:
        out = np.zeros((len(node), *values.shape[1:]))
        np.add.at(out, label, (values.T * (weights / total[label])).T)
        return out

    status = np.zeros(len(node), dtype=pair.status.dtype)
    np.maximum.at(status, label, pair.status)
    names = ("bound", "points", "gap", "slip", "pressure", "shear")
    means = {name: mean(getattr(pair, name)) for name in names}
    first = np.unique(label, return_index=True)[1]
    return replace(pair, status=status, node=node, frames=pair.frames[first], **means)


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
def _profiles(left: Axes, right: Axes, pairs: list[_Pair]) -> None:
    """Gap and slip (left), pressure and shear with its bound (right) along the surfaces.

    Several pairs stand side by side, each with curves of its own.
    """
    start = 0.0
    size = _marker_size(sum(len(pair.gap) for pair in pairs))
    lengths = [float(np.ptp(_arc(pair.points))) for pair in pairs]
    space = 0.08 * max(lengths)
    for pair, length in zip(pairs, lengths, strict=True):
        _profile(left, right, pair, start, size)
        if start > 0:
            for axes in (left, right):
                axes.axvline(start - space / 2, color=INK, linewidth=0.6, alpha=0.4)
        if 1 < len(pairs) <= MAX_NAMES:
            for axes in (left, right):
                axes.text(start + length / 2, 0.99, pair.name, ha="center", va="top", color=INK,
                          transform=axes.get_xaxis_transform(), fontsize=9)  # fmt: skip
        start += length + space
    where = "position along the surface" if len(pairs) == 1 else "position along the surfaces"
    left.set(xlabel=where, ylabel="length", title="Gap (marks) and slip (dashed)")
    right.set(xlabel=where, ylabel="traction",
              title="Pressure, shear (dashed), its bound (grey)")  # fmt: skip
    if 1 < len(pairs) <= MAX_NAMES:  # room for the names
        for axes in (left, right):
            axes.margins(y=0.12)


def _profile(left: Axes, right: Axes, pair: _Pair, start: float, size: float) -> None:
    """The curves of one pair, its first contact at `start`."""
    s = _arc(pair.points)
    order = np.argsort(s, kind="stable")
    s = start + s[order]
    left.plot(s, pair.gap[order], color=INK, linewidth=1)
    left.plot(s, pair.slip[order, 0], color=INK, linewidth=1, linestyle="--")
    for status in ContactStatus:
        chosen = pair.status[order] == status
        left.scatter(s[chosen], pair.gap[order][chosen], s=size, zorder=3,
                     marker=MARKERS[status], color=COLOURS[status], edgecolors=INK,
                     linewidths=0.3)  # fmt: skip
    bound = pair.bound[order]
    right.plot(s, pair.pressure[order], color=INK, linewidth=1.2)
    right.fill_between(s, -bound, bound, color=INK, alpha=0.08, linewidth=0)
    right.plot(s, pair.shear[order, 0], color="#D55E00", linewidth=1.2, linestyle="--")


def _arc(points: Array) -> Array:
    """Coordinate along the main direction of points (n, 2); growing with x, else with y."""
    centred = points - points.mean(axis=0)
    axis = np.linalg.svd(centred, full_matrices=False)[2][0]
    lead = axis[np.argmax(np.abs(axis))]
    s = centred @ (axis if lead > 0 else -axis)
    return s - s.min(initial=0.0)


# ----------------------------------------------------------------------------------- 3D
def _surface_maps(
    figure: Figure, left: Axes, right: Axes, pair: _Pair, model: Model, *, named: bool
) -> None:
    """The surface seen along its mean normal: status left, pressure and shear arrows right."""
    origin, axes, names = _view(pair.points)
    patches, owner = _node_patches(model, pair, origin, axes)
    colours = np.array([COLOURS[status] for status in ContactStatus])[pair.status]
    known = owner >= 0
    face = np.where(known, colours[np.maximum(owner, 0)], "#FFFFFF")
    left.add_collection(
        PolyCollection(patches, facecolors=face, edgecolors=face, linewidths=0.2)
    )
    pressure = np.where(known, pair.pressure[np.maximum(owner, 0)], 0.0)
    shown = PolyCollection(patches, array=pressure, cmap="YlOrRd", edgecolors="face",
                           linewidths=0.2)  # fmt: skip
    right.add_collection(shown)
    figure.colorbar(shown, ax=right, label="pressure", shrink=0.85)
    tips = _shear_arrows(right, pair, origin, axes)
    place = f" on {pair.name}" if named else ""
    left.set_title(f"Contact status{place}")
    right.set_title("Pressure, and shear on the slave (arrows)")
    for panel in (left, right):
        panel.set(aspect="equal", xlabel=names[0], ylabel=names[1])
        panel.update_datalim(tips)  # no arrow leaves the frame; both panels show the same
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
    model: Model, pair: _Pair, origin: Array, axes: Array
) -> tuple[list[Array], NDArray[np.int64]]:
    """Facets cut into one patch per node, and the contact at that node or -1."""
    patches, owner = [], []
    points = (model.bodies[pair.body].mesh.points - origin) @ axes.T
    contact = np.full(len(points), -1)
    contact[pair.node] = np.arange(len(pair.node))
    for facets in pair.facets:
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


def _shear_arrows(axes: Axes, pair: _Pair, origin: Array, view: Array) -> Array:
    """Shear tractions in global axes, at most MAX_ARROWS of them; returns their tips (k, 2)."""
    shear = np.einsum("ik,ikc->ic", pair.shear, pair.frames[:, 1:]) @ view.T
    if not shear.any():
        return np.empty((0, 2))
    stride = -(-len(shear) // MAX_ARROWS)
    at, shear = ((pair.points - origin) @ view.T)[::stride], shear[::stride]
    spacing = np.sqrt(np.prod(np.maximum(np.ptp(at, axis=0), 1e-12)) / len(at))
    length = np.linalg.norm(shear, axis=1)
    shown = length > 1e-3 * length.max()
    at, shear = at[shown], shear[shown]
    scale = length.max() / (ARROW_LENGTH * spacing)
    arrows = axes.quiver(at[:, 0], at[:, 1], shear[:, 0], shear[:, 1], color=INK, angles="xy",
                         scale_units="xy", scale=scale, width=0.003, pivot="tail")  # fmt: skip
    value = _round_below(float(length.max()))
    axes.quiverkey(arrows, 0.86, -0.12, value, f"{value:g}", labelpos="S", color=INK,
                   labelsep=0.05, fontproperties={"size": 9})  # fmt: skip
    return at + shear / scale


def _round_below(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above a value > 0."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(max(k for k in (1, 2, 5) if k * power <= value * (1 + 1e-12))) * power


# -------------------------------------------------------------------------- convergence
def convergence_figure(record: Convergence, title: str = "") -> Figure:
    """Error against iterations and against time, with the tolerance.

    Time runs from the first iterate that was judged: what comes before is set-up.
    """
    figure = Figure(figsize=(10, 4), dpi=150, layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    error = np.array([step.error for step in record.history])
    positive = error[(error > 0) & np.isfinite(error)]
    floor = min(positive.min(initial=np.inf), record.tolerance) / 10
    ceiling = 3 * max(positive.max(initial=0.0), 10 * record.tolerance)
    error = np.where(np.isfinite(error), np.maximum(error, floor), np.nan)
    marker = "o" if len(error) <= 60 else ""
    seconds = np.array([step.seconds for step in record.history])
    setup = float(seconds.min(initial=np.inf)) if len(seconds) else 0.0
    iterations = np.array([step.iteration for step in record.history])
    time = f"seconds after the first iterate (set-up before: {setup:.2g} s)"
    for axes, x, label in ((left, iterations, "iterations"), (right, seconds - setup, time)):
        last = max(x.max(initial=0.0), 1e-9)
        axes.set(xlim=(-0.02 * last, 1.17 * last), ylim=(floor, ceiling), yscale="log")
        axes.plot(x, error, color=COLOURS[ContactStatus.STICK], marker=marker, markersize=4,
                      linewidth=1.2)  # fmt: skip
        axes.axhline(record.tolerance, color="#D55E00", linestyle="--", linewidth=1)
        axes.text(0.995, record.tolerance * 1.15, "tolerance", ha="right", va="bottom",
                  transform=axes.get_yaxis_transform(), color="#D55E00",
                  fontsize=9)  # fmt: skip
        axes.set_xlabel(label)
        axes.grid(which="major", alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    left.xaxis.set_major_locator(MaxNLocator(integer=True))
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
        last = 1.5 * max(float(tau[-1]), 1.1)
        for k, name in enumerate(names):
            axes.step(np.append(tau, last), np.append(rho[k], rho[k, -1]), where="post",
                      color=LINES[k % len(LINES)], linestyle=DASHES[k % len(DASHES)],
                      label=name, marker="o", markevery=[0], markersize=4,
                      clip_on=False)  # fmt: skip
        axes.set(xscale="log", xlim=(last**-0.04, last), ylim=(0, 1.03),
                 xlabel="time / best time", title=f"tolerance {tolerance:g}")  # fmt: skip
        _plain_ticks(axes, last)
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("share of problems solved")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center",
                  ncols=min(len(names), 4), frameon=False)  # fmt: skip
    return figure


def _plain_ticks(axes: Axes, last: float) -> None:
    """Ticks 1, 2, 5, 10, … on a logarithmic axis of ratios; only powers of ten when long."""
    steps = (1.0, 1.2, 1.5, 2.0) if last < 2.5 else (1.0, 2.0, 5.0) if last < 1e3 else (1.0,)
    axes.xaxis.set_major_locator(LogLocator(subs=steps, numticks=20))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
