r"""
A wedge angle for a wanted jamming load
=======================================

A soft wedge is pushed by a given way into a notch of the same angle.  The steeper it is, the less
force that takes.  Which half angle :math:`\alpha` needs exactly 12 N per mm?  Newton's method finds it,

.. math:: \alpha \leftarrow \alpha + \frac{F_w - F(\alpha)}{F'(\alpha)},

with the derivative of the force in the angle from ``along``: mesh, normals and gaps all change
with the angle, and still no further solve is needed.
"""

# %%
from dataclasses import replace

import numpy as np

import amontons as am


def wedge(angle):
    """Sides lean by the half angle, in radians; pushed in by 0.2 mm."""
    mesh = am.box((2, 10), cells=(4, 20), origin=(-1, 0))
    x, y = mesh.points.T
    points = np.column_stack([x * (4 + y * np.tan(angle)), y])
    mesh = replace(mesh, points=points, grid=None, levels=())
    c, s = np.cos(angle), np.sin(angle)
    right, left = am.Plane((-c, s), (4.0, 0.0)), am.Plane((c, s), (-4.0, 0.0))
    return am.Model(
        [am.Body(mesh, am.LinearElastic(young=100, poisson=0.3))], [am.Fix("top", (0, -0.2))],
        [am.Contact(side, plane, mu=0.15, where=lambda points: points[:, 1] < 9.9)
         for side, plane in (("right", right), ("left", left))],
    )


# %%
# The force is the resultant of the contacts upwards, so its slopes in r are the vertical parts of
# the contacts' axes.  These turn with the angle themselves: that is the second part of its slope.


def axes(angle):
    """Vertical parts of the axes of all contacts, (contacts, 2)."""
    return wedge(angle).discretisation.sites.frames[:, :, 1]


wanted, angle, steps = 12.0, np.radians(10), []
for _ in range(6):
    solution = am.solve(wedge(angle), tolerance=1e-10)
    force = solution.resultant[1]
    gradient = solution.vjp(r=solution.frames[:, :, 1])
    steps.append((angle, force))
    print(f"{np.degrees(angle):.6f} degrees: {force:.9f} N/mm")
    if abs(force - wanted) < 1e-8 * wanted:
        break
    turning = (axes(angle + 1e-5) - axes(angle - 1e-5)) / 2e-5
    slope = gradient.along(wedge, angle) + (solution.r * turning).sum()
    angle += (wanted - force) / slope

# %%
# A picture of the force over the angle, and of the steps that Newton's method took on it.
import matplotlib.pyplot as plt

angles = np.radians(np.linspace(4, 16, 13))
forces = [am.solve(wedge(a)).resultant[1] for a in angles]
figure, plot = plt.subplots(figsize=(6, 3.5))
plot.plot(np.degrees(angles), forces)
plot.plot(*zip(*[(np.degrees(a), f) for a, f in steps], strict=True), "o--")
plot.axhline(wanted, color="0.7", linewidth=1)
plot.set(xlabel="half angle, degrees", ylabel="force to push it in, N/mm")
figure.tight_layout()
