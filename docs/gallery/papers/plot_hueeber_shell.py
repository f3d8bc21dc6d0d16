r"""
Hüeber 2008: a body pressed into a spherical shell
==================================================

Section 6: a block with a round cap is pressed into a shell that is a little wider, two elastic bodies with meshes that do not
match. Where on the cap does it stick, for which friction?

Between two bodies the gap is an average with dual functions of the slave,

.. math:: g_p = \frac{1}{D_p} \int \psi_p\, g, \qquad D_p = \int \psi_p\, \phi_p, \qquad \int \psi_p\, \phi_q = 0 \ (p \ne q).
"""

# %%
# The meshes of this problem lie beside its reproduction in full, in ``reproduce/hueeber2008``: 104 nodes, here refined once.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am

from reproduce.hueeber2008.shell import model  # run with PYTHONPATH=. at the root of the repository

solutions = {mu: am.solve(model(1, mu)) for mu in (0.2, 0.4, 0.6)}
for mu, solution in solutions.items():
    print(mu, solution.counts)

# %%
# The cap from above: pressure by colour; triangles slip, squares stick. With more friction more of the middle sticks. Where
# nodes slide, the shear lies on its bound.
figure, axes = plt.subplots(1, 3, figsize=(11, 3.6), sharey=True, layout="constrained")
for axis, (mu, solution) in zip(axes, solutions.items(), strict=True):
    fields = solution.fields
    x, y, _ = fields.points.T
    top = max(s.pressure.max() for s in solutions.values())
    for status, marker in zip(am.ContactStatus, ("o", "^", "s"), strict=True):
        here = solution.status == status
        points = axis.scatter(x[here], y[here], c=fields.pressure[here], marker=marker, vmin=0, vmax=top)
    axis.set(title=f"friction {mu}", xlabel="x", aspect="equal")
    slips = solution.status == am.ContactStatus.SLIP
    shear = np.linalg.norm(fields.shear[slips], axis=1)
    print(f"{mu}: shear less its bound {np.abs(shear - mu * fields.pressure[slips]).max():.1e}")
figure.colorbar(points, ax=axes, label="pressure")
