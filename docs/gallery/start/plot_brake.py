r"""
A brake that releases, or jams
==============================

An arm leans by 20 degrees against a drum. Its head is lifted by 0.02 mm while the drum drags the foot. Is the brake
released? The answer is: that depends on how it came here. The same load has three solutions.

A rigid arm jams from :math:`\mu = \tan 20^\circ = 0.364` on; this one is elastic and gives way a little longer.
"""

# %%
# ``am.all_solutions`` searches all patterns of statuses, and proves that there is no other solution.
import amontons as am

model = am.read_case("example:brake").model
found = am.all_solutions(model)
print(found)

# %%
# A solve that starts from the reactions of a solution returns it with displacements. All three arms, displacements 100 times enlarged. A free foot is clear of the drum; a jammed one carries forces that
# the load does not need. The one between them is unstable: its orientation is -1.
import matplotlib.pyplot as plt
from matplotlib.collections import PolyCollection

mesh = model.bodies[0].mesh
cells = mesh.cells[0].nodes
figure, axes = plt.subplots(1, 3, figsize=(9, 5), sharey=True, layout="constrained")
for axis, solution in zip(axes, found.solutions, strict=True):
    moved = mesh.points + 100 * am.solve(model, start=am.Iterate(solution.r)).fields.displacement[0]
    for points, colour in ((mesh.points, "lightgrey"), (moved, "tab:blue")):
        axis.add_collection(PolyCollection(points[cells], fc="none", ec=colour, lw=0.7))
    axis.autoscale_view()
    axis.axhline(0, color="k")
    force = solution.r[:, 0].sum()
    axis.set(title=f"{solution.pattern}\nforce on the foot {force:.1f} N/mm", aspect="equal")
