r"""
How one contact has three solutions
===================================

The smallest problem that shows it: one contact in 2D, whose tangential force also moves it along its normal.

.. math::
   u = \begin{pmatrix} 1 & 0.8 \\ 0.8 & 1 \end{pmatrix} r + q, \qquad q = (0.2,\ 1), \qquad \mu = 2

Without contact it is open, :math:`u_N = 0.2`. But pull it tangentially and the coupling draws it down.
"""

# %%
import amontons as am
from amontons.mechanics.ready.gallery import one_contact_2d

found = am.all_solutions(one_contact_2d(mu=2.0))
print(found)

# %%
# How many solutions have other loads? Each pixel is a problem of its own, solved completely. Where the numbers of
# solutions differ, the border is a load at which two of them meet: a fold.
import matplotlib.pyplot as plt
import numpy as np

problem = one_contact_2d(mu=2.0)
sides = np.linspace(-1, 1, 33)
count = [
    [len(am.all_solutions(am.FrictionProblem.from_delassus(problem.W, [[n, t]], problem.mu)))
     for n in sides] for t in sides
]
figure, axis = plt.subplots(figsize=(5.5, 4.5), layout="constrained")
filled = axis.pcolormesh(sides, sides, count, cmap="viridis", vmin=1, vmax=3)
axis.plot(0.2, 1, "r*")
axis.set(xlabel="q_N", ylabel="q_T", aspect="equal", title="number of solutions")
figure.colorbar(filled, ax=axis, ticks=[1, 2, 3])
