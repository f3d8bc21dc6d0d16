r"""
Capped Coulomb: friction up to the yield of the material
========================================================

Under high pressure a surface does not carry :math:`\mu r_N`: the softer material yields in shear first. So the bound is
:math:`\min(\mu r_N, \tau)`; Abaqus calls :math:`\tau` ``TAUMAX``. How does it compare with Coulomb's and with Tresca's law?

.. math:: |r_T| \le g(r_N), \qquad g = \mu r_N, \quad g = \tau, \quad g = \min(\mu r_N, \tau)
"""

# %%
# The slab of the built-in example, dragged with three laws. ``law=`` of a contact takes any of them; the short words
# ``mu=``, ``cap=`` and ``tresca=`` say the same.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am

laws = {
    "Coulomb 0.4": {"mu": 0.4},
    "Tresca 4": {"tresca": 4.0},
    "capped: 0.4, 4": {"mu": 0.4, "cap": 4.0},
}
slab = am.Body(am.box((2, 1), cells=(48, 24)), am.LinearElastic(young=1000, poisson=0.3))
figure, axes = plt.subplots(1, 3, figsize=(10, 3.2), sharey=True, layout="constrained")
for axis, (name, numbers) in zip(axes, laws.items(), strict=True):
    contact = am.Contact("bottom", am.Plane(normal=(0, 1)), **numbers)
    model = am.Model([slab], supports=[am.Fix("top", (0.012, -0.01))], contacts=[contact])
    solution = am.solve(model)
    fields = solution.fields
    shear = np.abs(fields.shear[:, 0])
    axis.plot(fields.points[:, 0], 0.4 * fields.pressure, ":", label="0.4 times pressure")
    axis.plot(fields.points[:, 0], shear, ".", label="shear")
    axis.axhline(4, color="grey", lw=0.5)
    axis.set(title=f"{name}: {solution.solution.counts['slip']} slip", xlabel="x", ylim=(0, 12))
axes[0].legend()

# %%
# Coulomb's shear follows the pressure up to the peak at the right edge. Tresca's knows no pressure: its shear goes up to
# 4 also where there is little. The capped law has the lower of both.
