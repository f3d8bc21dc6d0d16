r"""
A rubber block pressed askew, at large strains
==============================================

A tall block, its top turned by 0.023 and pressed down by t. Its solution curve begins with a rigid rotation and has two
folds: a corner that sticks or slips.

The energy per volume is that of Ciarlet and Geymonat, :math:`a (\mathrm{tr}\, C - 3) + b (\mathrm{tr\, cof}\, C - 3) + c (J^2 - 1)
- d \ln J`; contact is found where the nodes are.
"""

# %%
# A coarse mesh; ``amontons follow example:block`` has 200 cells.
import amontons as am

model = am.read_case("example:block", ["mesh.cells=[4,8]"]).model
branch = am.follow(model, "load", (0, 1))
print(branch)

# %%
# The force of the floor over the load; dotted lines are the folds, between which there are three solutions.
import matplotlib.pyplot as plt

figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
forces = [solution.r.sum(axis=0) for solution in branch.solutions]
axis.plot(branch.parameter, [normal for normal, _ in forces], ".-", label="normal")
axis.plot(branch.parameter, [tangential for _, tangential in forces], ".-", label="tangential")
for fold in branch.folds:
    axis.axvline(fold.parameter, color="grey", ls=":")
axis.set(xlabel="load", ylabel="force on the block, N/mm")
axis.legend()
