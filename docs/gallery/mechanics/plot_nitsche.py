r"""
Nitsche's method beside multipliers
===================================

Multipliers are one more unknown at each node. Nitsche's method has none: the stress of the body itself takes the place of
the reaction, and the law is asked for at Gauss points, with a number :math:`\kappa` that has to be large enough.

.. math:: \sigma_N = -\left( \kappa\, (-u_N) - \sigma_N(v) \right)^+

Do both find the same?
"""

# %%
# A block pressed on a cylinder, on finer and finer meshes.
import matplotlib.pyplot as plt

import amontons as am

cylinder = am.Sphere(center=(1, -2), radius=2)
figure, axes = plt.subplots(1, 3, figsize=(10, 3.3), sharey=True, layout="constrained")
for axis, cells in zip(axes, (16, 32, 64), strict=True):
    block = am.Body(am.box((2, 1), cells=(cells, cells // 2)), am.LinearElastic(young=1000, poisson=0.3))
    for method, style in (("nodal", "o"), ("nitsche", ".-")):
        model = am.Model(
            [block],
            supports=[am.Fix("top", (0.001, -0.012))],
            contacts=[am.Contact("bottom", cylinder, mu=0.3, method=method)],
        )
        fields = am.solve(model).fields
        print(f"{cells} cells, {method}: force {fields.resultant[1]:.4f}")
        axis.plot(fields.points[:, 0], fields.pressure, style, mfc="none", label=method)
    axis.set(title=f"{cells} cells", xlabel="x", xlim=(0.7, 1.3))
axes[0].set(ylabel="pressure")
axes[0].legend()

# %%
# Nitsche's pressures are told at Gauss points: within a facet they follow the overlap of straight facet and round
# cylinder, and swing about the nodal ones. Their sums, the forces printed above, agree the better the finer the mesh.
