r"""
Ligurský 2014, example 5: one node on a disc
============================================

T. Ligurský and Y. Renard follow solutions of contact with friction through folds. Their smallest example with geometry is a
triangle whose corner lies on a disc of radius r and is pushed along it by :math:`(1, -\gamma)`. While it slips, its place is an
angle, and the load a function of it in closed form.

A small disc curves away from under the corner: the load that holds it first grows, then falls, and the curve folds.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import amontons as am


def model(radius):
    """The triangle of the paper, friction 0.5; contact is found where the corner is."""
    mesh = am.Mesh(
        [[0.0, 0.0], [0.0, 1.0], [-1.0, 0.0]], (am.Cells("tri", [[0, 1, 2]]),),
        {"held": (am.Facets("line", [[1, 2]]),), "contact": (am.Facets("line", [[0, 1]]),)},
    )
    disc = am.LevelSet(
        lambda x: (x[:, 0] - radius) ** 2 + x[:, 1] ** 2 - radius**2,
        lambda x: 2 * (x - [radius, 0.0]),
        lambda x: np.broadcast_to(2 * np.eye(2), (len(x), 2, 2)),
    )
    return am.Model(
        [am.Body(mesh, am.LinearElastic(young=2.5, poisson=0.25))],
        [am.Fix("held", 0)],
        [am.Contact("contact", disc, mu=0.5, kinematics="finite")],
        [am.BodyForce((6.0, lambda x, t: -6.0 * t))],
    )


figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
for radius in (0.5, 10.0):
    branch = am.follow(model(radius), "load", (0.0, 0.6))
    axis.plot(branch.parameter, branch.states[:, 1], ".-", ms=3, label=f"r = {radius:g}")
    print(radius, "folds at", [round(fold.parameter, 10) for fold in branch.folds])

# %%
# Slip begins at :math:`\gamma = F = 0.5`. On the disc of radius 0.5 that is a fold: the corner runs off in a jump, as the paper
# says; on that of radius 10 it goes on steadily.
axis.set(xlabel="load", ylabel="displacement along the disc")
axis.legend()
