r"""
A slab pressed and sheared
==========================

A rubber-like pad is pressed on a plane and then moved sideways by 0.012. How far does slip reach from its edges?

The plane carries shear up to :math:`\mu r_N`. Where the elastic pad asks for more, it slips; in between it sticks.
"""

# %%
# ``am.read_case`` reads the same case file as ``amontons solve example:slab``; its model can be changed before it is
# solved, here to several coefficients of friction.
import amontons as am

model = am.read_case("example:slab").model
solutions = {mu: am.solve(model.with_mu(mu)) for mu in (0.2, 0.4, 1.0)}
for mu, solution in solutions.items():
    print(mu, solution.solution.counts)

# %%
# Lines are the shear tractions on the pad, dots the most that friction allows, :math:`\mu r_N`. They meet where the
# pad slips: everywhere at 0.2, on half of it at 0.4, nowhere at 1. The pad is moved to the right and the plane
# holds it back, so the shear on it points to the left.
import matplotlib.pyplot as plt
import numpy as np

figure, axes = plt.subplots(1, 3, figsize=(10, 3.2), sharey=True, layout="constrained")
for axis, (mu, solution) in zip(axes, solutions.items(), strict=True):
    fields = solution.fields
    shear = np.einsum("ci,cij->cj", fields.shear, fields.frames[:, 1:])[:, 0]
    along = np.argsort(fields.points[:, 0])
    axis.plot(fields.points[along, 0], -shear[along], label="shear, to the left")
    axis.plot(fields.points[along, 0], mu * fields.pressure[along], ".", label="mu times pressure")
    axis.set(title=f"mu = {mu}", xlabel="x")
axes[0].legend()
