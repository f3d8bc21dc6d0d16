r"""
A V-shaped body: a load that grows, a contact that jumps
========================================================

Two legs, clamped at their ends, are pushed against a plane by a body force that grows with :math:`\gamma`. The force of
contact does not follow it steadily.

All solutions :math:`(v, r, \gamma)` lie on a curve. In 2D with Coulomb friction it is piecewise straight: between two
changes of status :math:`F_y y' + F_\gamma \gamma' = 0` has one direction, computed once. At a *fold* :math:`\gamma'`
changes its sign.
"""

# %%
import amontons as am

model = am.read_case("example:vee").model
branch = am.follow(model, "load", (0, 1))
print(branch)

# %%
# Between the folds there are three solutions. A load that grows from zero holds on to the first of them up to the upper
# fold, and then jumps; one that falls from 1 jumps elsewhere: hysteresis without any plasticity.
import matplotlib.pyplot as plt

force = [solution.r[:, 0].sum() for solution in branch.solutions]
figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
axis.plot(branch.parameter, force, ".-")
for fold in branch.folds:
    axis.axvline(fold.parameter, color="grey", ls=":")
for y in branch.at(0.38):
    axis.plot(0.38, branch.problem.solution(y, 0.38).r[:, 0].sum(), "o", color="tab:red")
axis.set(xlabel="load factor", ylabel="normal force, GN/m")
