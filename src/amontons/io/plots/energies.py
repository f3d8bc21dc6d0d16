"""Where the work of an evolution went: the energy balance, and the work of contact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...mechanics.steps import Energies
from .style import INK, UNKNOWN, Units, stamp, with_unit

Array = NDArray[np.float64]
ROUNDING = 1e-12  # work of contact that says nothing, relative to all that was put in


def energy_figure(
    times: Sequence[float], energies: Sequence[Energies], *, units: Units = UNKNOWN,
    note: str = "",
) -> Figure:  # fmt: skip
    """Where the work went: sums since the start (left), work of contact per step (right).

    One entry for each step; raises InvalidInput when there is none.  note: stamped on it, such
    as the step that did not converge.
    """
    if not len(times) or len(times) != len(energies):
        raise InvalidInput(
            f"energies: expected one for each of {len(times)} > 0 times, got {len(energies)}"
        )
    t = np.asarray(times, dtype=float)

    def total(name: str) -> Array:
        return np.cumsum([getattr(e, name) for e in energies])

    put_in = total("loads") + total("supports")
    stored = np.array([e.total for e in energies])
    stored += total("gain")[0] - stored[0]  # relative to the start
    dissipated = -total("contact")
    lost = total("damping") + total("numerical")
    figure = Figure(figsize=(10.8, 4.4), dpi=130, layout="constrained")
    left, right = figure.subplots(1, 2)
    # losses of the scheme last: those of quasi-static steps may be negative
    left.stackplot(t, stored, dissipated, lost, colors=("#56B4E9", "#E69F00", "#BBBBBB"),
                   labels=("stored (kinetic + elastic)", "dissipated by contact and friction",
                           "lost in time scheme and damping" if any(e.kinetic for e in energies)
                           else "missed by straight lines between steps"))  # fmt: skip
    left.plot(t, put_in, color=INK, linewidth=1.6, linestyle="--",
              label="work of loads and supports")  # fmt: skip
    left.set(xlabel=with_unit("time", units.time),
             ylabel=with_unit("energy, work", units.energy),
             title="Energy balance since the start",
             xlim=(min(t.min(), 0.0), t.max()))  # fmt: skip
    work = np.array([e.contact for e in energies])
    defect = np.abs([e.defect for e in energies])
    right.plot(t, np.maximum(-work, 0), color="#E69F00", label="dissipated by contact")
    gained = work > ROUNDING * max(np.abs(put_in).max(), np.abs(work).max())
    if gained.any():
        right.plot(t[gained], work[gained], "x", color="#D55E00", label="gained from contact")
    right.plot(t, defect, color=INK, linewidth=0.8, label="|defect of the balance|")
    largest = f"{work.max():.1e} {units.energy}".rstrip()
    told = f"Contact never creates energy: largest work {largest}"
    if gained.any():
        whole = f"{np.abs(put_in).max():.2g} {units.energy}".rstrip()
        told = f"Contact creates energy: at most {largest} in a step,\nof {whole} put in so far"
    shown = (work < 0).any() or (defect > 0).any()  # a log axis needs something to show
    right.set(xlabel=with_unit("time", units.time), yscale="log" if shown else "linear",
              ylabel=with_unit("work in a step", units.energy),
              title=told,
              xlim=left.get_xlim())  # fmt: skip
    for axes in (left, right):
        handles = axes.get_legend_handles_labels()
        axes.legend(*handles, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2,
                    frameon=False, fontsize=9)  # fmt: skip
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    stamp(figure, note)
    return figure
