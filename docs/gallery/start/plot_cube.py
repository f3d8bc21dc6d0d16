r"""
A cube pressed and dragged
==========================

An elastic cube is pressed on a rigid plane, tilted a little, and dragged sideways. Which part of its bottom
sticks, which slides, and which has lifted off?

Coulomb's law holds at each node of the bottom: the shear :math:`|r_T|` is at most :math:`\mu r_N`, and where it is
less, the node does not slip.
"""

# %%
# The same model as ``amontons solve example:cube``, on a coarser mesh. The top is moved by 0.2 along y and pressed by
# 0.06 at one side, lifted by 0.09 at the other.
import amontons as am

cube = am.Body(am.box((1, 1, 1), cells=(8, 8, 8)), am.LinearElastic(young=200, poisson=0.3))
model = am.Model(
    [cube],
    supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
    contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    name="cube",
)
solution = am.solve(model)
print(solution)

# %%
# The bottom, seen from below. Contacts stick (green) where the cube is pressed most; a rim of slip lies between them
# and the side that has lifted off, where pressure and shear are zero. The arrows are the shear tractions on the cube.
import matplotlib.pyplot as plt
import numpy as np

fields = solution.fields
x, y, _ = fields.points.T
shear = np.einsum("ci,cij->cj", fields.shear, fields.frames[:, 1:])  # from the tangents to x, y, z
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained", sharey=True)
for status, colour in zip(am.ContactStatus, ("white", "orange", "seagreen"), strict=True):
    here = solution.solution.status == status
    left.scatter(x[here], y[here], c=colour, edgecolor="k", label=status.name.lower())
left.legend(loc="upper left")
left.set(title="status", xlabel="x", ylabel="y", aspect="equal")
points = right.scatter(x, y, c=fields.pressure, cmap="viridis")
right.quiver(x, y, shear[:, 0], shear[:, 1], scale=900, width=0.005)
right.set(title="pressure and shear", xlabel="x", aspect="equal")
figure.colorbar(points, ax=right, label="pressure")
