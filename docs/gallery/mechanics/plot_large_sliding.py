r"""
A rubber block pressed and dragged
==================================

At large strains contact is found where the nodes are, and friction opposes the motion since the last step. A neo-Hookean
block is pressed by a fifth of its height, and then its top is dragged by two fifths of it. Does it slide?

.. math:: W = \tfrac{G}{2} (\mathrm{tr}\, C - 3) - G \ln J + \tfrac{\lambda}{2} (\ln J)^2
"""

# %%
import matplotlib.pyplot as plt

import amontons as am


def top(x, t):
    """Press for t < 1, then slide."""
    return max(0.0, t - 1) * 0.5, -0.2 * min(t, 1.0)


block = am.Body(am.box((2, 1), cells=(16, 8)), am.NeoHookean(young=1.0, poisson=0.3))
model = am.Model(
    [block],
    supports=[am.Fix("top", top)],
    contacts=[am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.4)],
)
steps = list(am.evolve(model, am.QuasiStatic(0.1), until=1.8))
for step in steps[9::2]:
    print(f"t = {step.time:.1f}: {step.solution.pattern}")

# %%
# The deformed block at three times, and the force on it. Pressed, the bottom sticks everywhere. Dragged, its rear corner
# lifts off (f), slip (-) begins between the middle and the front and spreads, while the tip of the front goes on
# sticking: it does not slide as a block. The way ends here: a step further the front corner folds under, and
# its side, which is no contact surface in this model, would go through the floor. There is no equilibrium near, which
# the solver says.
figure, axes = plt.subplots(1, 4, figsize=(12, 2.8), layout="constrained")
mesh = model.bodies[0].mesh
for axis, k in zip(axes, (9, 15, 17), strict=False):
    x, y = (mesh.points + steps[k].displacement[0]).T
    axis.plot(x[mesh.cells[0].nodes[:, [0, 1, 2, 3, 0]]].T, y[mesh.cells[0].nodes[:, [0, 1, 2, 3, 0]]].T,
              color="tab:blue", lw=0.6)
    axis.axhline(0, color="k")
    axis.set(title=f"t = {steps[k].time:.1f}", aspect="equal", xlim=(-0.4, 2.7), ylim=(-0.1, 1.1))
time = [step.time for step in steps]
axes[3].plot(time, [step.resultant()[1] for step in steps], label="normal")
axes[3].plot(time, [-step.resultant()[0] for step in steps], label="friction")
axes[3].set(xlabel="t")
axes[3].legend()
