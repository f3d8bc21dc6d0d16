r"""
Several laws in one model
=========================

A machine has dry joints, lubricated ones and glued ones. Each contact of a model has its own law; the discrete problem
then has a law of several kinds, and all solvers of the discrete form take it.
"""

# %%
# A beam on three pads: dry, greased and glued, pulled to the right and lifted a little. Pads are strips of the bottom,
# chosen by ``where``.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am

beam = am.Body(am.box((9, 1), cells=(72, 8)), am.LinearElastic(young=1000, poisson=0.3))
plane = am.Plane(normal=(0, 1))


def pad(first, last):
    """Nodes of the bottom between two places."""
    return lambda p: (p[:, 0] >= first) & (p[:, 0] <= last)


model = am.Model(
    [beam],
    supports=[am.Fix("top", lambda x: (0.01, -0.012 + 0.002 * x[0]))],
    contacts=[
        am.Contact("bottom", plane, mu=0.5, where=pad(0, 2)),
        am.Contact("bottom", plane, tresca=0.5, where=pad(3.5, 5.5)),
        am.Contact("bottom", plane, mu=0.3, cohesion=3.0, where=pad(7, 9)),
    ],
)
solution = am.solve(model)
print(type(solution.solution.problem.law).__name__, solution.solution.counts)

# %%
# The dry pad at the left is pressed and slips at half the pressure. The greased one slides at 0.5, however much it is
# pressed. The glued one at the right is pulled by more than its cohesion: it has opened, and
# its sides still pull with 3.
fields = solution.fields
figure, axis = plt.subplots(figsize=(9, 3.5), layout="constrained")
axis.plot(fields.points[:, 0], fields.pressure, ".", label="pressure")
axis.plot(fields.points[:, 0], np.abs(fields.shear[:, 0]), ".", label="shear")
axis.axhline(0, color="grey", lw=0.5)
axis.set(xlabel="x", ylabel="traction", ylim=(-5, 20))
axis.legend()
