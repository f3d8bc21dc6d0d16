r"""
A block on a dome, friction that grows
======================================

An obstacle need not be a plane. Here it is a flat dome, given as a level set, :math:`\phi(x) = z + 0.2\,(x - 1/2)^2 + 0.2\,(y -
1/2)^2 < 0` inside, and the coefficient of friction grows along x from 0.2 to 0.5.

The gap of a point is :math:`\phi / |\nabla \phi|`, the normal :math:`\nabla \phi / |\nabla \phi|`.
"""

# %%
import amontons as am

dome = am.LevelSet(lambda p: p[:, 2] + 0.2 * ((p[:, 0] - 0.5) ** 2 + (p[:, 1] - 0.5) ** 2))
block = am.Body(
    am.box((1, 1, 0.5), cells=(12, 12, 6), kind="hex"), am.LinearElastic(young=500, poisson=0.3)
)
model = am.Model(
    [block],
    supports=[am.Fix("top", (0.002, None, -0.02)), am.Fix("front", (None, 0, None))],
    contacts=[am.Contact("bottom", dome, mu=lambda p: 0.2 + 0.3 * p[:, 0])],
    name="dome",
)
solution = am.solve(model)
print(solution)

# %%
# Contact is a disc around the summit. It is pressed alike on both sides, but sticks more towards the right, where
# friction is larger. The lines are contours of the pressure.
import matplotlib.pyplot as plt

fields = solution.fields
x, y, _ = fields.points.T
figure, axis = plt.subplots(figsize=(5.5, 4.5), layout="constrained")
axis.tricontour(x, y, fields.pressure, levels=8, cmap="viridis")
for status, colour in zip(am.ContactStatus, ("lightgrey", "orange", "seagreen"), strict=True):
    here = solution.solution.status == status
    axis.plot(x[here], y[here], "o", color=colour, label=status.name.lower())
axis.set(aspect="equal", xlabel="x", ylabel="y")
axis.legend(loc="upper left", bbox_to_anchor=(1, 1))
