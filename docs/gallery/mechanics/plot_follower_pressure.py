r"""
A pressure that follows
=======================

A pressure stays normal to its surface, wherever that turns; a dead load keeps its direction. On a flap that bends far the
two differ.

.. math:: t = -p\, \det F\, F^{-T} n
"""

# %%
# A flap high over a floor, clamped at the left, pressed from above until its tip lies on the floor.
import matplotlib.pyplot as plt

import amontons as am

flap = am.Body(am.box((6, 0.3), cells=(48, 3), origin=(0, 3)), am.NeoHookean(young=200, poisson=0.3), order=2)
floor = am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.3)
loads = {"follows": am.Pressure("top", 0.3), "dead": am.Traction("top", (0, -0.3))}
figure, axis = plt.subplots(figsize=(7, 4.5), layout="constrained")
for (name, load), colour in zip(loads.items(), ("tab:blue", "tab:orange"), strict=True):
    model = am.Model([flap], supports=[am.Fix("left", (0, 0))], loads=[load], contacts=[floor])
    solution = am.solve(model)
    points = model.bodies[0].mesh.points + solution.fields.displacement[0]
    axis.plot(*points.T, ".", ms=2, color=colour, label=name)
    print(name, solution.solution.counts, "resultant", solution.fields.resultant.round(4))
axis.axhline(0, color="k")
axis.set(aspect="equal")
axis.legend()

# %%
# The pressure that follows also pushes the steep part of the flap back, towards the clamp: its tip ends farther to the
# left, by 5 % of the length.
