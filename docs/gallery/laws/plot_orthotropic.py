r"""
Orthotropic friction: sliding off to the side
=============================================

Brushed metal, wood and tyres have other friction along than across. The bound is an ellipse, and slip is normal to it:

.. math:: (r_1 / \mu_1)^2 + (r_2 / \mu_2)^2 \le r_N^2, \qquad u_T = -\lambda\, (r_1 / \mu_1^2,\; r_2 / \mu_2^2)

So a body that is dragged at an angle drifts to where friction is less.
"""

# %%
# One contact pressed by 1, dragged by 1 in all directions.
import matplotlib.pyplot as plt
import numpy as np
from scipy import sparse

import amontons as am

angles = np.linspace(0, 2 * np.pi, 49)
q = np.column_stack([-np.ones_like(angles), np.cos(angles), np.sin(angles)])
law = am.Orthotropic(np.full(49, 0.6), np.full(49, 0.2))
solution = am.solve(am.FrictionProblem.from_delassus(sparse.eye(q.size), q, law))
print(solution.counts)

# %%
# Left: friction forces lie on the ellipse, not opposite to the drag (grey). Right: the way that is slipped, and the
# way that it would be without friction. Along the first direction a good part is held back, across it little.
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4.2), layout="constrained")
left.plot(-solution.r[:, 1], -solution.r[:, 2], ".-")
left.quiver(*(0 * q[:, 1:]).T, *q[:, 1:].T, angles="xy", scale_units="xy", scale=1.5,
            width=0.002, color="lightgrey")
left.set(title="friction, turned round", aspect="equal", xlabel="1", ylabel="2")
right.plot(q[:, 1], q[:, 2], ":", label="without friction")
right.plot(solution.u[:, 1], solution.u[:, 2], ".-", label="slip")
right.set(title="slip", aspect="equal", xlabel="1")
right.legend(loc="center")
