r"""
Rey 2026: methods, parameters, solutions
========================================

The tables of the paper ask which solution a method finds: Uzawa, Alart and Curnier's augmented Lagrangian with Newton's method,
Nitsche's method, active sets. ``am.basins`` makes such tables.
"""

# %%
# Hild's triangle with three contacts at :math:`\mu = 3.5`, from zero and from random reactions in the cone.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am
from amontons.mechanics.ready.hild import hild_triangle

model = hild_triangle(3, mu=3.5)
found = am.basins(
    model,
    ["uzawa", "semismooth-newton", "nitsche", "gauss-seidel"],
    {"uzawa.rho": [0.1, 1.0, 10.0], "nitsche.kappa": [1.0, 10.0, 100.0]},
    {"zero": 1, "cone": 15},
    seed=1,
)
print(found)

# %%
# Shares of the runs that end at each solution. No method finds the unstable one from random starts, and what the others
# find depends on a parameter that has no meaning in mechanics. So ask for all solutions where it matters.
counts = found.counts
names = sorted({name for row in counts.values() for name in row})
figure, axis = plt.subplots(figsize=(8.5, 3.8), layout="constrained")
bottom = np.zeros(len(counts))
for name in names:
    heights = np.array([row.get(name, 0) for row in counts.values()])
    axis.barh(list(counts), heights, left=bottom, label=name)
    bottom += heights
axis.set(xlabel="runs")
axis.invert_yaxis()
axis.legend(loc="upper left", bbox_to_anchor=(1, 1))
