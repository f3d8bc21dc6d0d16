r"""
Hild's triangle: three solutions in closed form
===============================================

A triangle hangs on one side, is pulled along another and can touch a floor with the third. For friction above 3 there
is a solution that is free of the floor, one that sticks to all of it, and one between them.

P. Hild (2005) has the first two for every mesh, as both are linear in x and y. With the bottom at y = 0,

.. math:: v_{free} = (7 x + y - 7,\; 1 - x - 7 y / 4), \qquad v_{stick} = (-6 y,\; -3 y / 4) .
"""

# %%
import amontons as am

model = am.read_case("example:hild").model
found = am.all_solutions(model)
print(found)

# %%
# The triangle is *pulled* to the left, and held on the right. When it sticks, friction :math:`r_T = 3 r_N` carries the
# pull; when it is free, the held side does. In the third solution the corner
# at the left sticks and all other nodes slip.
import matplotlib.pyplot as plt
import numpy as np
from amontons.mechanics.ready.hild import free_displacement, stick_displacement

mesh = model.bodies[0].mesh
figure, axes = plt.subplots(1, 3, figsize=(11, 3.2), layout="constrained")
for axis, solution in zip(axes, found.solutions, strict=True):
    motion = am.solve(model, start=am.Iterate(solution.r)).fields.displacement[0]
    axis.triplot(*mesh.points.T, mesh.cells[0].nodes, color="lightgrey", lw=0.5)
    axis.triplot(*(mesh.points + 0.1 * motion).T, mesh.cells[0].nodes, lw=0.8)
    axis.axhline(0, color="k")
    axis.set(title=solution.pattern, aspect="equal")
    for name, exact in (("free", free_displacement), ("stick", stick_displacement)):
        if np.allclose(motion, exact(mesh.points)):
            axis.set(xlabel=f"Hild's solution '{name}', to {np.abs(motion - exact(mesh.points)).max():.0e}")
