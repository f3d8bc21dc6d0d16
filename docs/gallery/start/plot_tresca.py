r"""
Tresca: a bound that does not ask for pressure
==============================================

Where the bound of friction is *given*, as for a lubricated or yielding layer, contact is a convex problem: the
displacements minimise an energy and are the only ones. Here the bound is :math:`\tau(x, y) = 80\, x y (1 - x)(1 - y)`,
largest in the middle of the bottom and zero on its rim.

.. math:: |r_T| \le \tau, \qquad u_T \ne 0 \Rightarrow r_T = -\tau\, u_T / |u_T|
"""

# %%
import amontons as am

cube = am.Body(am.box((1, 1, 1), cells=8), am.LinearElastic(young=200, poisson=0.3))
model = am.Model(
    [cube],
    supports=[am.Fix("top", (0, 0.012, -0.03))],
    contacts=[
        am.Contact(
            "bottom",
            am.Plane(normal=(0, 0, 1)),
            tresca=lambda p: 80 * p[:, 0] * p[:, 1] * (1 - p[:, 0]) * (1 - p[:, 1]),
        )
    ],
    name="cube with given friction",
)
solution = am.solve(model)
print(solution)
print(am.uniqueness(model, solution).verdict)

# %%
# ``amontons solve example:tresca`` moves the top farther, and then all of the bottom slides. Here the middle still
# sticks, although it is not pressed more than the rest; the rim slides, at its corners without any shear.
import matplotlib.pyplot as plt
import numpy as np

fields = solution.fields
x, y, _ = fields.points.T
shear = np.linalg.norm(fields.shear, axis=1)
figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
bound = 80 * x * y * (1 - x) * (1 - y)
for axis, values, title in zip(axes, (shear, np.maximum(bound - shear, 0)), ("shear", "bound less shear"), strict=True):
    filled = axis.tricontourf(x, y, values, levels=12)
    axis.set(title=title, aspect="equal", xlabel="x", ylabel="y")
    figure.colorbar(filled, ax=axis)
stick = solution.solution.status == am.ContactStatus.STICK
axes[1].plot(x[stick], y[stick], "r.")
axes[1].set(title="bound less shear; dots stick")
