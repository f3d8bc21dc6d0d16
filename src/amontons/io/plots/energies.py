"""Where the work of an evolution went: the energy balance, and the work of contact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...mechanics.steps import Energies
from ...mechanics.steps.energy import TOLERATED
from .layout import SMALL, Sheet
from .style import INK, UNKNOWN, Units, with_unit

Array = NDArray[np.float64]


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
    sheet = Sheet(10.8, 4.5, note=note)
    left, right = (sheet.panel(x, 1.2, 4.4, 2.85) for x in (0.9, 6.2))
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
    most = max(np.abs(put_in).max(), max(e.turnover for e in energies))
    gained = work > TOLERATED * most  # below it is what the solve leaves
    if gained.any():
        right.plot(t[gained], work[gained], "x", color="#D55E00", label="gained from contact")
    right.plot(t, defect, color=INK, linewidth=0.8, label="|defect of the balance|")
    largest = f"{work.max():.1e} {units.energy}".rstrip()
    beyond = " beyond the solve's error" if work.max() > 0 else ""
    told = f"Contact creates no energy{beyond}: largest work {largest}"
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
        axes.legend(*handles, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2,
                    frameon=False, fontsize=SMALL)  # fmt: skip
        axes.grid(alpha=0.25)
    if shown:
        right.yaxis.set_minor_locator(NullLocator())
    return sheet.done()
