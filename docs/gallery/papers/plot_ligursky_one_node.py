r"""
Ligurský 2014, example 4: friction so large that nothing moves on
=================================================================

One node with the stiffness :math:`\begin{pmatrix} a & -b \\ -b & a \end{pmatrix}` rests on an obstacle and is pushed
along it by :math:`-\gamma`. At :math:`F = a / b` the linear problem of slip is singular. What does the solution do where the
load reaches the bound of friction?

With :math:`u = 0` the node sticks for :math:`\gamma \le F`. At :math:`\gamma = F` a whole line of slipping states begins, at
one and the same load, until the pressure is gone; from there the node is free.
"""

# %%
# The paper's signs: the obstacle fills :math:`x_1 > 0`. Ours: the normal is :math:`-e_1`, a reaction is positive in
# compression. The load at the parameter p is :math:`(1, -p)`.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am

a, b = 2.0, 1.0
F = a / b


def node(load, friction):
    """The node under a load (2,)."""
    stiffness = np.array([[a, -b], [-b, a]])
    return am.FrictionProblem.from_global(stiffness, np.diag([-1.0, 1.0]), load, [[0, 0]], [friction])


# %%
# Three coefficients of friction: below a / b the node slips on steadily; at a / b the line is vertical; above it the curve
# turns back, and that is a fold.
figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
for friction in (0.6 * F, F, 1.3 * F):
    branch = am.follow(node([1, -1], friction), base=node([1, 0], friction), interval=(0.0, 4.0))
    along = [solution.u[0, 1] for solution in branch.solutions]
    axis.plot(branch.parameter, along, ".-", label=f"F = {friction:.1f}: {len(branch.folds)} folds")
    print(friction, [(event.before, event.after, round(event.parameter, 12)) for event in branch.events[1:-1]])
axis.set(xlabel="load", ylabel="slip")
axis.legend()

# %%
# Without any pressure at the start, example 4 (ii), there are more directions than one can count: all between two edges,
# a *cone* of tangents.
system = am.first_order(node([b, -a], F), base=node([0, 0], F), start=[[0.0, 0.0]], at=0.0)
for cone in system.cones:
    print(cone.piece, "edges", np.round(cone.edges, 6).tolist())
