r"""
Compliance: asperities that give way
====================================

Rough surfaces do not meet at once: a pressure :math:`r_N` presses their asperities by :math:`c\, r_N`. Other programs have such
a *penalty* in every contact; here it is a law, for those who mean it.

.. math:: 0 \le u_N + c\, r_N \perp r_N \ge 0

It adds c to the diagonal of W, so the problem becomes easier and the pressure smoother.
"""

# %%
# The cylinder on a half plane of Hertz, with more and more compliance.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am
from amontons.mechanics.ready.gallery import cylinder_on_half_plane

plain = cylinder_on_half_plane(strips=101)
x = np.linspace(-0.2, 0.2, 101)
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
for c in (0.0, 1.0, 10.0, 100.0):
    law = plain.law if c == 0 else am.Compliant(plain.law, c, c)
    solution = am.solve(am.FrictionProblem.from_delassus(plain.W, plain.q, law))
    left.plot(x, solution.r[:, 0] / (x[1] - x[0]), label=f"c = {c:g}")
    right.plot(x, solution.u[:, 0])
left.set(xlabel="x", ylabel="pressure")
left.legend()
right.set(xlabel="x", ylabel="gap", ylim=(-2e-3, 5e-3))
print(f"largest overlap: {solution.max_penetration:.2e} at c = 100")

# %%
# Hertz's ellipse becomes a bell that is wider than the true contact. The gap turns negative where sides press: that is
# c times the force, by intent. With c = 0 the overlap is zero to rounding.
