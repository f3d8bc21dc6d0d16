r"""
A block pushed harder and harder
================================

A rigid block of 1 kg lies on a floor, friction 0.3, and is pushed by a force that grows by 1 N each second. By hand: it
sticks until :math:`F = \mu m g`, at t = 2.94 s, and then

.. math:: v(t) = \frac{1}{m} \int_{t_0}^{t} (s - \mu m g)\, ds = \tfrac{1}{2} (t - t_0)^2 .
"""

# %%
# ``am.Rigid`` makes a body with six unknowns, its mesh only says where it is touched. Steps in time are those of Moreau and
# Jean, on velocities and impulses, so that stick and slip need no threshold.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am

g, mu = 9.81, 0.3
block = am.Body(am.box((1, 1, 0.2), cells=(2, 2, 1)), am.Rigid(density=5.0))
model = am.Model(
    [block],
    loads=[am.BodyForce((lambda x, t: 5.0 * t, 0, -5.0 * g))],  # per volume: 1 kg in 0.2 m^3
    contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=mu)],
)
steps = list(am.evolve(model, am.MoreauJean(0.05), until=5.0))

# %%
# The computed velocity, and the one by hand.
time = np.array([step.time for step in steps])
speed = np.array([step.v[0][0, 0] for step in steps])
exact = 0.5 * np.maximum(time - mu * g, 0) ** 2
figure, axis = plt.subplots(figsize=(7, 3.8), layout="constrained")
axis.plot(time, exact, label="by hand")
axis.plot(time, speed, ".", label="computed")
axis.axvline(mu * g, color="grey", ls=":")
axis.set(xlabel="t, s", ylabel="velocity, m/s")
axis.legend()
print(f"largest difference {np.abs(speed - exact).max():.1e} m/s")
