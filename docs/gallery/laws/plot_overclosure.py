r"""
Pressure over overclosure: hard, linear, exponential, measured
==============================================================

Measured surfaces give way by a curve, not a line, and decks of other programs bring such curves: a table, or the
exponential law that is felt across a gap :math:`c_0`.

.. math:: 0 \le u_N + D(p) \perp p \ge 0, \qquad p = p_0 \exp\left(\ln(100)\, d / c_0\right)
"""

# %%
# A column of height 1 and modulus 100 is lowered onto a plane, so a share of the way goes into the surface: with the
# top lowered by w, :math:`w = p / E + D(p)`, which is the line below each row of points.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am

E = 100.0
table = am.OverclosureCurve(pressure=[0, 0.1, 0.5, 2.0], overclosure=[0, 0.01, 0.02, 0.03])
laws = {
    "hard": None,
    "linear, 50": 50.0,
    "table": table,
    "exponential": am.ExponentialOverclosure(p0=0.2, c0=0.01),
}
column = am.Body(am.box((1, 1), cells=4), am.LinearElastic(young=E, poisson=0.0))


def pressure(law, way):
    """On the foot of the column, its top lowered by `way`."""
    numbers = {} if law is None else {"stiffness": law}
    contact = am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.3, **numbers)
    model = am.Model([column], supports=[am.Fix("top", (0, -way))], contacts=[contact])
    return am.solve(model).pairs["bottom"].largest_pressure


figure, axis = plt.subplots(figsize=(7, 4.2), layout="constrained")
ways = np.linspace(-0.008, 0.03, 14)
p = np.linspace(1e-4, 2.0, 400)
for (name, law), colour in zip(laws.items(), ("k", "tab:blue", "tab:orange", "tab:green"), strict=True):
    axis.plot(ways, [pressure(law, w) for w in ways], "o", ms=4, color=colour, label=name)
    curved = isinstance(law, am.OverclosureCurve | am.ExponentialOverclosure)
    give = law.needed(p)[0] if curved else p / law if law else 0 * p
    axis.plot(p / E + give, p, lw=0.8, color=colour)
axis.set(xlabel="way of the top", ylabel="pressure", xlim=(-0.01, 0.031), ylim=(-0.05, 2))
axis.legend()

# %%
# Hard contact has the slope of the column alone. The exponential law presses already before the sides meet, at ways
# below 0. In decks the keyword is ``SURFACE BEHAVIOR``, in case files ``stiffness`` under ``friction``.
