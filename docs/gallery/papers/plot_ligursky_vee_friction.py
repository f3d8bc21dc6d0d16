r"""
Ligurský 2014: from which friction on are there folds?
======================================================

Figure 11 of the paper follows the V-shaped body for several coefficients of friction. Up to 1.4 the force of contact follows
the load; from 1.6 on there are two folds, three solutions between them, and a jump.
"""

# %%
import matplotlib.pyplot as plt

import amontons as am
from amontons.mechanics.ready.vee import vee

figure, axis = plt.subplots(figsize=(7.5, 4.2), layout="constrained")
for mu in (0.8, 1.2, 1.4, 1.6, 1.8, 2.2):
    branch = am.follow(vee(0, mu=mu), "load", (0, 1))
    force = [solution.r[:, 0].sum() for solution in branch.solutions]
    axis.plot(branch.parameter, force, label=f"mu = {mu}: {len(branch.folds)} folds")
axis.set(xlabel="load", ylabel="normal force, GN/m", xlim=(0.2, 0.6), ylim=(-0.02, 0.6))
axis.legend()

# %%
# Each curve is piecewise straight and was computed from one change of status to the next, without any step size. The
# upper fold, where the separated state ends, hardly moves. The lower one does: the more friction, the farther the load has to
# fall until the body in contact lets go.
