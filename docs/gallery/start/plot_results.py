r"""
What a result shows by itself
=============================

Statuses, pressures and shear, who is pressed where, and how the solve went: a result has pictures of its own, in a
notebook it is a small table, and with pandas a large one. Nothing has to be drawn by hand.
"""

# %%
# A block on a plate, meshes that do not match. In a notebook the last line of a cell is shown as here.
import amontons as am

plate = am.Body(am.box((3, 1), cells=(12, 4)), am.LinearElastic(young=1e4, poisson=0.3), name="plate")
block = am.Body(
    am.box((1, 1), cells=(9, 9), origin=(1, 1)), am.LinearElastic(young=1e3, poisson=0.3), name="block"
)
model = am.Model(
    [plate, block],
    supports=[am.Fix("plate.bottom", (0, 0)), am.Fix("block.top", (0.01, -0.02))],
    contacts=[am.Contact("block.bottom", master="plate.top", mu=0.3)],
    name="block on a plate",
)
solution = am.solve(model)
solution

# %%
# In 2D the surface of contact as curves: gap, slip and status on the left, pressure and shear within its bound on the
# right. In 3D the bodies are drawn as well.
solution.plot()

# %%
# How the error fell, stage by stage. The dashed line is the tolerance.
solution.convergence.plot()
