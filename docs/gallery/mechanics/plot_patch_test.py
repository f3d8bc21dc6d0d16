r"""
The patch test: nodes or averages
=================================

Two blocks whose meshes do not match are pressed together by a uniform pressure of 1. The exact answer is a uniform
pressure of 1 between them, and linear finite elements can represent it. Which method passes it on?

*Nodal* contact lets each slave node meet the closest point of the master, so the master gets :math:`\sum_p D_p N_a(y_p)` where
it should get :math:`\int N_a`. *Mortar* contact averages gap and force with dual functions, :math:`\int \psi_p \phi_q = 0` for
:math:`p \ne q`.
"""

# %%
import matplotlib.pyplot as plt

import amontons as am

figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
for method, style in (("nodal", "s--"), ("mortar", "o-")):
    low = am.Body(am.box((3, 1), cells=(7, 3)), am.LinearElastic(young=1000, poisson=0.3), name="low")
    high = am.Body(
        am.box((3, 1), cells=(11, 3), origin=(0, 1)), am.LinearElastic(young=1000, poisson=0.3), name="high"
    )
    model = am.Model(
        [low, high],
        supports=[am.Fix("low.bottom", (None, 0)), am.Fix("low.left", (0, None)), am.Fix("high.left", (0, None))],
        loads=[am.Pressure("high.top", 1.0)],
        contacts=[am.Contact("high.bottom", master="low.top", mu=0, method=method)],
    )
    solution = am.solve(model)
    axis.plot(solution.fields.points[:, 0], solution.fields.pressure, style, label=method)
    for warning in solution.warnings:
        print(f"{method}: {warning.name}")
axis.axhline(1, color="grey", lw=0.5)
axis.set(xlabel="x", ylabel="pressure", ylim=(0, 1.6))
axis.legend()

# %%
# Mortar contact passes to rounding, and is the default between bodies. Nodal contact is off by up to
# a tenth here, by more on other meshes; the result carries a warning that says so.
