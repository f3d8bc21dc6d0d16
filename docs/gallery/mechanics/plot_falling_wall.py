r"""
A wall that is struck
=====================

Blocks of a wall in running bond are elastic, each in a frame that turns with it; joints open, close and slide where they
are. A blow gives every point the velocity v y / h to the right, h the height of the wall: does it come back, or fall?
As one stiff block of its outline, of width b, which begins to turn about its foot with the moment of momentum of the
blow about it, it would fall where its energy lifts its centre over the foot,

.. math:: \tfrac{1}{2} I \omega^2 \ge m g (R - \tfrac{h}{2}), \quad I = \tfrac{4}{3} m R^2, \quad
   \omega = \frac{m h v}{3 I}, \quad R = \tfrac{1}{2} \sqrt{b^2 + h^2}
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import amontons as am

stone = am.LinearElastic(1e8, 0.2, plane="stress", density=2000.0)
wall = am.Wall(4, 1, size=(1.0, 0.5), cells=(6, 1), material=stone, mu=0.7, mu_support=0.7, corotational=True)
model = wall.model(loads=[am.BodyForce((0, -2000 * 9.81))])
h, R = wall.height, np.hypot(1.0, wall.height) / 2
v = 4 * R**2 / h * np.sqrt(1.5 * 9.81 * (R - h / 2)) / R
print(f"one stiff block falls from v = {v:.2f} m/s on")

# %%
# Twice: a blow of a good half of that, and of twice.
ways = {}
for blow in (2.0, 6.0):
    start = am.at_rest(model, velocity=lambda x, blow=blow: (blow * x[1] / h, 0.0))
    method = am.MoreauJean(5e-3, stiffness_damping=2e-3)
    ways[blow] = list(am.evolve(model, method, until=0.45, start=start))
    top = [step.displacement[-1][-1, 0] for step in ways[blow]]
    books = max(abs(step.energies.defect) for step in ways[blow])
    print(f"blow {blow}: top at {top[-1]:.2f} m after {max(top):.2f} m, energy kept to {books:.0e} J")

# %%
# The weaker blow opens joints above the first row, on one side, and the wall leans, ever more slowly. Under the stronger
# one its rows turn over their edges and come apart. An edge that pokes into the face of a block between two of its
# nodes is felt by averages over the cells beside it: finer cells feel it sooner. Joints are all that meets here: other
# faces of blocks that have fallen pass through each other and through the floor.
figure, axes = plt.subplots(2, 4, figsize=(12, 6), layout="constrained", sharex=True, sharey=True)
for row, (blow, steps) in zip(axes, ways.items(), strict=True):
    for axis, k in zip(row, (0, 29, 59, 89), strict=True):
        for body, u in zip(model.bodies, steps[k].displacement, strict=True):
            for facets in body.mesh.boundary:
                x, y = (body.mesh.points + u)[facets.nodes].transpose(2, 1, 0)
                axis.plot(x, y, color="tab:brown", lw=1)
        axis.axhline(0, color="k", lw=0.8)
        axis.set(title=f"blow {blow} m/s, t = {steps[k].time:.2f} s", aspect="equal")
