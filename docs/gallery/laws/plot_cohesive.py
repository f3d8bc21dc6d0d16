r"""
Cohesion: contact that pulls
============================

A glued or mortared joint carries tension up to c, and shear :math:`\mu (r_N + c)`. How far does a strip lift off when its
end is pulled up?

.. math:: 0 \le u_N \perp r_N + c \ge 0, \qquad |r_T| \le \mu (r_N + c)

It is no damage: what has opened still pulls with c.
"""

# %%
# A strip lies on a plane, and the end at the left is lifted. ``mu=0.3, cohesion=c`` is short for
# ``law=am.Cohesive(am.Coulomb(0.3), c)``.
import matplotlib.pyplot as plt

import amontons as am

strip = am.Body(am.box((8, 0.5), cells=(96, 6)), am.LinearElastic(young=1000, poisson=0.3))
figure, (above, below) = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
for cohesion in (0.0, 0.5, 2.0):
    model = am.Model(
        [strip],
        supports=[am.Fix("left", (None, 0.05)), am.Fix("right", (0, 0))],
        loads=[am.BodyForce((0, -0.2))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.3, cohesion=cohesion)],
    )
    solution = am.solve(model)
    fields = solution.fields
    above.plot(fields.points[:, 0], fields.gap, label=f"cohesion {cohesion}")
    below.plot(fields.points[:, 0], fields.pressure)
above.set(ylabel="gap")
above.legend()
below.set(xlabel="x", ylabel="pressure, < 0 is tension", ylim=(-3, 6))

# %%
# Without cohesion the strip lifts off over some five times its height; with it the crack is shorter, its faces pull with
# just c where they are open, and the pressure beyond its tip is higher.
