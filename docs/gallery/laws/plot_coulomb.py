r"""
Coulomb: one contact, all loads
===============================

A single contact in 2D, on a body for which normal and tangential compliance are one. Which load leads to which status?

.. math:: u = r + q, \qquad 0 \le u_N \perp r_N \ge 0, \qquad |r_T| \le \mu r_N

For every q there is exactly one solution here: :math:`r` is the projection of :math:`-\hat q` onto the cone.
"""

# %%
# q is the motion that there would be without contact: :math:`q_N < 0` presses, :math:`q_T` drags. A thousand loads are one
# problem of a thousand contacts that know nothing of each other.
import matplotlib.pyplot as plt
import numpy as np
from scipy import sparse

import amontons as am

normal, tangential = np.meshgrid(np.linspace(-1, 0.5, 31), np.linspace(-1, 1, 41))
q = np.column_stack([normal.ravel(), tangential.ravel()])
mu = 0.5
problem = am.FrictionProblem.from_delassus(sparse.eye(q.size), q, am.Coulomb(np.full(len(q), mu)))
solution = am.solve(problem)
print(solution)

# %%
# Left: the status. A contact that is pressed by 1 sticks while it is dragged by less than :math:`\mu`. Right: the reactions
# themselves. Those of sticking contacts fill the cone, those of slipping ones lie on its edges.
figure, (left, right) = plt.subplots(1, 2, figsize=(9.5, 4), layout="constrained")
for status, colour in zip(am.ContactStatus, ("lightgrey", "orange", "seagreen"), strict=True):
    here = solution.status == status
    left.plot(*q[here].T, ".", color=colour, label=status.name.lower())
    right.plot(*solution.r[here].T, ".", color=colour)
left.set(xlabel="q_N", ylabel="q_T", title="status of the load")
left.legend(loc="upper right")
right.plot([1, 0, 1], [mu, 0, -mu], "k", lw=0.8)
right.set(xlabel="r_N", ylabel="r_T", title="reactions")
