r"""
An evolution of your own
========================

.. math:: G(x, x') = x^3 - x = t

A cubic spring under a load that grows: between two steps the problem of the next state may have several solutions.
``am.StepPath`` lays a path from the last state to the next one, and lists all next states that it reaches.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import amontons as am

snap = am.RateEquation(G=lambda x, rate: x**3 - x, F=lambda t, x: np.array([t]))
before, now = (float(np.roots([1, 0, -1, -t]).real.min()) for t in (0.2, 0.3))
path = am.StepPath(snap, states=([before], [now]), times=(0.2, 0.3, 0.4))
branch = path.branch()
print(branch)
print("next states:", [round(float(y[0]), 4) for y in branch.at(1.0)])

# %%
# The whole curve of equilibria is the S of the cubic, with folds at :math:`t = \pm 2 / (3 \sqrt 3) = \pm 0.385`. The next
# step, to 0.4, is beyond the fold: the path turns back there, goes along the unstable states, turns again, and arrives at
# the only state that is left, far away. That is the snap.
x = np.linspace(-1.4, 1.4, 200)
figure, axis = plt.subplots(figsize=(6.5, 4), layout="constrained")
axis.plot(x**3 - x, x, color="lightgrey", lw=4, label="all equilibria")
axis.plot(0.3 + 0.1 * branch.parameter, branch.states[:, 0], ".-", ms=3, label="path of the step")
for fold in branch.folds:
    axis.plot(0.3 + 0.1 * fold.parameter, fold.state[0], "ro")
axis.set(xlabel="t", ylabel="x", xlim=(-1.5, 1.5))
axis.legend()
