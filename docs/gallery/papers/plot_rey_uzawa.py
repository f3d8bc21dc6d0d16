r"""
Rey 2026: Uzawa, and which solution it finds
============================================

On Hild's triangle with one contact at :math:`\mu = 3.5` there are three solutions. Uzawa's method,

.. math:: r_{k+1} = P_K (r_k - \rho\, {\hat u}_k),

goes to one of them, and which one depends on :math:`\rho` and on where it starts.
"""

# %%
# One contact: the start is a point in the plane of :math:`(r_N, r_T)`, so that a picture can show them all.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am
from amontons.mechanics.ready.hild import hild_triangle

problem = hild_triangle(1, mu=3.5).assemble().condensed()
found = am.all_solutions(problem)
print(found)
scale = max(np.abs(s.r).max() for s in found.solutions)

# %%
# The colour of a start is the solution at which it ends: blue free, green stick, orange slip, white none of them. Dots are the
# solutions, lines the cone.
sides = np.linspace(-1.5, 1.5, 21) * scale
figure, axes = plt.subplots(1, 3, figsize=(11, 3.8), sharey=True, layout="constrained")
for axis, rho in zip(axes, (0.1, 1.0, 3.0), strict=True):
    picture = np.zeros((21, 21))
    for i, t in enumerate(sides):
        for j, n in enumerate(sides):
            end = am.solve(problem, am.Uzawa(rho=rho), start=am.Iterate(np.array([[n, t]])),
                           max_iterations=300, check=False)
            if end.converged:
                apart = [np.abs(end.r - s.r).max() for s in found.solutions]
                picture[i, j] = 1 + "fs".find(found.solutions[int(np.argmin(apart))].pattern) % 3
    axis.pcolormesh(sides, sides, picture, cmap=plt.matplotlib.colors.ListedColormap(
        ["white", "lightskyblue", "lightgreen", "orange"]), vmin=-0.5, vmax=3.5)
    for s in found.solutions:
        axis.plot(*s.r[0], "ko")
    axis.plot([scale, 0, scale], [3.5 * scale, 0, -3.5 * scale], "k", lw=0.6)
    axis.set(title=f"rho = {rho}", xlabel="r_N at the start", ylim=(sides[0], sides[-1]))
axes[0].set(ylabel="r_T at the start")
