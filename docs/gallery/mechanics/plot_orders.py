r"""
First or second order, coarse or fine
=====================================

How fast does the force of contact converge, with linear and with quadratic cells? A block is pressed by a rigid plane that is
tilted; the borders of contact are not known beforehand, so that no order can be better than about 3/2 in energy.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import amontons as am


def force(cells, order):
    """Normal force on the bottom."""
    mesh = am.box((2, 1), cells=(2 * cells, cells))
    block = am.Body(mesh, am.LinearElastic(young=1000, poisson=0.3), order=order)
    model = am.Model(
        [block],
        supports=[am.Fix("top", lambda x: (0, -0.02 + 0.015 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.3)],
    )
    return am.solve(model, tolerance=1e-9).fields.resultant[1]


sizes = np.array([4, 8, 16])
reference = force(32, 2)
figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
for order in (1, 2):
    errors = [abs(force(n, order) / reference - 1) for n in sizes]
    axis.loglog(sizes, errors, "o-", label=f"order {order}")
axis.loglog(sizes, 0.3 / sizes, "k:", label="1 / n")
axis.set(xlabel="cells over the height", ylabel="relative error of the force")
axis.legend()
