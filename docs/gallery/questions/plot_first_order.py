r"""
At a kink: which ways lead on?
==============================

Where a contact is just about to change its status, several linear pieces meet, and the first-order system

.. math:: F_y^{(i)} y' + F_\gamma^{(i)} \gamma' = 0, \qquad (y', \gamma') \in \text{cone of piece } i

has a solution for each way on. Usually there are two: where one came from, and where one goes.
"""

# %%
# A ball on a spring meets a wall, which has a spring too, at y = 1. Three functions are all that a problem of your own
# needs.
import numpy as np

import amontons as am


class Wall:
    """y - p + k max(0, y - 1) = 0: free below 1, stiffer (or softer) beyond."""

    def __init__(self, k):
        self.k = k

    def residual(self, y, p):
        return y - p + self.k * np.maximum(0, y - 1)

    def jacobian(self, y, p):
        return np.array([[1 + self.k * (y[0] > 1)]]), np.array([-1.0])

    def piece(self, y, p):
        return "wall" if y[0] > 1 else "free"


# %%
# With k > -1 the curve has a kink; with k < -1 beyond the wall y falls as p grows: a fold that no smooth theory knows.
import matplotlib.pyplot as plt

figure, axis = plt.subplots(figsize=(6.5, 4), layout="constrained")
for k in (2.0, 0.0, -0.5, -2.0):
    branch = am.follow(Wall(k), start=[0.0], at=0.0, interval=(-1.0, 3.0))
    axis.plot(branch.parameter, branch.states[:, 0], label=f"k = {k}: {len(branch.folds)} fold(s)")
axis.set(xlabel="p", ylabel="y")
axis.legend()

# %%
# And the tangents of a contact problem: the V-shaped body at a load where all statuses are settled has two, forth and
# back, on one piece.
from amontons.mechanics.ready.vee import vee

system = am.first_order(vee(0), "load", (0, 1), at=0.7)
for tangent in system.tangents:
    print(tangent.piece, round(tangent.rate, 4))
