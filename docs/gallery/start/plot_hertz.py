r"""
Hertz: a block on a cylinder
============================

A block is pressed on a rigid cylinder of radius 2. Is the pressure that of Hertz?

For a half plane with :math:`E^* = E / (1 - \nu^2)` under the force P per length, Hertz's pressure is an ellipse,

.. math:: p(x) = \frac{2 P}{\pi a} \sqrt{1 - (x / a)^2}, \qquad a = \sqrt{\frac{4 P R}{\pi E^*}} .
"""

# %%
# The block has 64 by 32 cells; contact is closed on some twenty nodes of its bottom. The case file moves its top
# sideways as well, which hardly changes the pressure.
import amontons as am

case = am.read_case("example:hertz")
solution = am.solve(case.model)
print(solution)

# %%
# The force is summed up from the solution, so there is nothing to fit. What is left of a difference is the block: it is
# no half plane, but held at its top, and stiffer.
import matplotlib.pyplot as plt
import numpy as np

fields = solution.fields
x = fields.points[:, 0] - 1.0
load = float(fields.resultant[1])
modulus = 1000.0 / (1 - 0.3**2)
a = np.sqrt(4 * load * 2.0 / (np.pi * modulus))
line = np.linspace(-a, a, 201)
figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
axis.plot(line, 2 * load / (np.pi * a) * np.sqrt(1 - (line / a) ** 2), label="Hertz")
axis.plot(x, fields.pressure, "o", ms=4, label="computed")
shear = np.einsum("ci,cij->cj", fields.shear, fields.frames[:, 1:])[:, 0]
axis.plot(x, shear, ".-", lw=1, label="shear along x")
axis.set(xlim=(-2.5 * a, 2.5 * a), xlabel="x from the middle", ylabel="traction")
axis.legend()
print(f"a = {a:.4f}; largest pressure {fields.pressure.max():.1f}, Hertz {2 * load / np.pi / a:.1f}")
