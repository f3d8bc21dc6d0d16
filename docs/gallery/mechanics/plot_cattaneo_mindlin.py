r"""
Partial slip: Cattaneo and Mindlin
==================================

A cylinder is pressed on a half plane of the same material, and then pushed sideways by less than friction could hold. Its
middle sticks; a rim on both sides slips, however small the push. In closed form (Johnson 1985, 7.2),

.. math::
   q(x) = \mu p_0 \sqrt{1 - x^2 / a^2} - \mu p_0 \frac{c}{a} \sqrt{1 - x^2 / c^2},
   \qquad \frac{c}{a} = \sqrt{1 - \frac{Q}{\mu P}}

with the second term for :math:`|x| \le c` only: half-width a of contact, c of the part that sticks.
"""

# %%
# Strips of constant traction on the half plane make W in closed form, so there is no mesh.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am
from amontons.mechanics.ready.gallery import cylinder_on_half_plane

problem = cylinder_on_half_plane(strips=201, shift=1.5e-3, mu=0.5)
solution = am.solve(problem, tolerance=1e-10)
print(solution)

# %%
# P and Q are the sums of the computed forces; all else follows from the formulas. The radius and the modulus E* are 1.
x, h = np.linspace(-0.2, 0.2, 201, retstep=True)
P, Q = solution.r[:, 0].sum(), abs(solution.r[:, 1].sum())
a = np.sqrt(4 * P / np.pi)
c, peak = a * np.sqrt(1 - Q / (0.5 * P)), 2 * P / (np.pi * a)


def ellipse(width):
    """Height 1 in the middle."""
    return np.sqrt(np.maximum(0, 1 - (x / width) ** 2))


exact = 0.5 * peak * (ellipse(a) - c / a * ellipse(c))
figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
axis.plot(x, peak * ellipse(a), label="Hertz")
axis.plot(x, solution.r[:, 0] / h, ".", label="pressure")
axis.plot(x, exact, label="Cattaneo, Mindlin")
axis.plot(x, np.abs(solution.r[:, 1]) / h, ".", label="shear")
axis.axvspan(-c, c, alpha=0.1, color="seagreen")
axis.set(xlabel="x", ylabel="traction")
axis.legend()
print("largest error of shear, relative to its peak:",
      f"{np.abs(np.abs(solution.r[:, 1]) / h - exact).max() / exact.max():.3f}")
