r"""
Where the other solutions come from: following friction
=======================================================

The brake has one solution at :math:`\mu = 0.4` and three at 0.5. Somewhere between two of them appear, together, at a *fold* of
the curve of solutions over friction. Where?
"""

# %%
# The free arm exists for every friction. The branch that begins at a jammed solution is followed both ways.
import matplotlib.pyplot as plt

import amontons as am

model = am.read_case("example:brake").model
diagram = am.diagram(model, "friction", (0.3, 1.0), at=(0.5, 1.0))
print(diagram)

# %%
# The nose of the curve is the least friction at which the arm can jam: 0.4201. A rigid arm would jam from tan 20° =
# 0.364 on.
figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
for branch in diagram:
    force = [solution.r[:, 0].sum() for solution in branch.solutions]
    axis.plot(branch.parameter, force, ".-")
    for fold in branch.folds:
        axis.axvline(fold.parameter, color="grey", ls=":")
        axis.annotate(f"{fold.parameter:.4f}", (fold.parameter + 0.01, 2))
axis.set(xlabel="friction", ylabel="force on the foot, N/mm")
