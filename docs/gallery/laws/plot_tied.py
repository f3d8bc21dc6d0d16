r"""
Tied: two leaves, loose, rubbing and glued
==========================================

A spring of two leaves is four times as soft as one of the same height in one piece, because the leaves slide on each other. ``tied=True``
glues them, though their meshes do not match. What is the deflection between loose and tied?

.. math:: \delta = \frac{F L^3}{3 E I}, \qquad I_{tied} = \frac{(2 h)^3}{12}, \quad I_{loose} = 2\, \frac{h^3}{12}

"""

# %%
# Two leaves of 10 by 0.5, one with 80 cells along, the other with 60, pressed together by a pressure and bent by a force at
# their end. With friction the first load finds the leaves stuck; above some force they slip.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am

E, L, h, force = 1e5, 10.0, 0.5, 1.0
steel = am.LinearElastic(young=E, poisson=0.0)
lower = am.Body(am.box((L, h), cells=(80, 4)), steel, name="lower")
upper = am.Body(am.box((L, h), cells=(60, 4), origin=(0, h)), steel, name="upper")


def deflection(contact, pressure=0.0):
    """Of the end, and the shear between the leaves."""
    model = am.Model(
        [lower, upper],
        supports=[am.Fix("lower.left", (0, 0)), am.Fix("upper.left", (0, 0))],
        contacts=[am.Contact("upper.bottom", master="lower.top", **contact)],
        loads=[am.Pressure("upper.top", pressure), am.Pressure("lower.bottom", pressure),
               am.Traction("upper.right", (0, -force / h))],
    )
    solution = am.solve(model)
    fields = solution.fields
    end = fields.displacement[1][upper.mesh.surface_nodes("right"), 1].mean()
    return -end, fields.points[:, 0], fields.shear[:, 0]


loose = force * L**3 / (3 * E * 2 * h**3 / 12)
tied = force * L**3 / (3 * E * (2 * h) ** 3 / 12)
print(f"loose: {deflection({'mu': 0.0})[0]:.4f}, by beams {loose:.4f}")
print(f"tied:  {deflection({'tied': True})[0]:.4f}, by beams {tied:.4f}")

# %%
# The meshes are a little stiff: leaves of four cells by 4 %, one piece of eight by 1 %.
#
# Left: pressed harder, the leaves become one. Right: the shear between them; what beam theory gives for one piece,
# 3 F / (2 * 2 h), is the dashed line, and the tie carries it over the whole length but the ends.
pressures = np.array([0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 9.0])
found = [deflection({"mu": 0.3}, p) for p in pressures]
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.8), layout="constrained")
left.plot(pressures, [f[0] for f in found], ".-", label="friction 0.3")
left.axhline(loose, ls=":", color="tab:red", label="loose, beam theory")
left.axhline(tied, ls=":", color="tab:green", label="one piece, beam theory")
left.set(xlabel="pressure on the leaves", ylabel="deflection", ylim=(0, None))
left.legend()
for p in (1, 3, 6):
    _, x, shear = found[p]
    right.plot(x, np.abs(shear), label=f"friction, pressure {pressures[p]:g}")
_, x, shear = deflection({"tied": True})
right.plot(x, np.abs(shear), "k", lw=1, label="tied")
right.axhline(1.5 * force / (2 * h), ls="--", color="grey")
right.set(xlabel="x", ylabel="shear between the leaves", ylim=(0, 3))
right.legend()
