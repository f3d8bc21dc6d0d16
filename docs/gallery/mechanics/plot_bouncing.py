r"""
A stone that bounces
====================

A rigid body falls from 1 m with a restitution of 0.7: :math:`u_N^+ = -e\, u_N^-` at each impact. Each bounce reaches
:math:`e^2` of the height of the last one, so infinitely many of them end after

.. math:: t_\infty = \sqrt{2 H / g}\ \frac{1 + e}{1 - e} = 2.56\ \mathrm{s}.

A scheme that looks for each impact could never get past that time.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import amontons as am

g, e, height = 9.81, 0.7, 1.0
stone = am.Body(am.box((0.1, 0.1), cells=1), am.Rigid(density=1000))
model = am.Model(
    [stone],
    loads=[am.BodyForce((0, -1000 * g))],
    contacts=[am.Contact("bottom", am.Plane(normal=(0, 1), point=(0, -height)), mu=0.5)],
)
steps = list(am.evolve(model, am.MoreauJean(0.005, restitution=e), until=3.5))

# %%
# Heights at the summits by hand are the dots. The energy only falls, in the impacts; in free flight it is kept.
time = [step.time for step in steps]
figure, (above, below) = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
above.plot(time, [height + step.displacement[0][:, 1].min() for step in steps])
fall = np.sqrt(2 * height / g)
k = np.arange(6)
summit = fall + 2 * fall * np.cumsum(e ** (k + 1)) - fall * e ** (k + 1)
above.plot(summit, height * e ** (2 * (k + 1)), "o", mfc="none")
above.axvline(fall * (1 + e) / (1 - e), color="grey", ls=":")
above.set(ylabel="height, m")
below.plot(time, np.cumsum([step.energies.contact for step in steps]))
below.set(xlabel="t, s", ylabel="work of impacts, J/m")
