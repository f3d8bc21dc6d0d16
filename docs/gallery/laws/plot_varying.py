r"""
Friction that follows the speed: a Stribeck curve
=================================================

A lubricated joint has much friction at rest, least at some speed, and more again beyond. How long does a block slide that starts
at speed 1?

.. math:: \dot v = -\mu(v)\, g, \qquad |r_T| \le \mu(|u_T|)\, r_N

``mu`` of a contact may be a ``FrictionCurve``, over the slip speed or over the pressure.
"""

# %%
# Four rigid blocks: three with a coefficient of their own, one on the curve. A block with fixed friction loses speed
# along a straight line.
import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_ivp

import amontons as am

speeds, values = [0.0, 0.3, 1.0], [0.4, 0.1, 0.3]
body = am.Body(am.box((4, 0.1), (4, 1)), am.Rigid(density=1.0))


def sliding(mu):
    """Times and speeds of a block that starts at speed 1."""
    model = am.Model([body], [], [am.Contact("bottom", am.Plane((0, 1)), mu=mu)], [am.BodyForce((0, -1))])
    start = am.at_rest(model, velocity=(1.0, 0.0))
    steps = am.evolve(model, am.MoreauJean(0.02, theta=1.0), start=start, until=6.0)
    return np.array([(step.time, step.v[0][:, 0].mean()) for step in steps]).T


curve = am.FrictionCurve(values, speed=speeds)
exact = solve_ivp(lambda t, v: -np.interp(v, speeds, values), (0, 5.5), [1.0], dense_output=True, rtol=1e-9)

# %%
# Left: the curve. Right: the block's speed. On the curve it slows down fast, coasts where there is little friction, and is
# caught when the speed is low: points are steps in time, the line is the equation above.
figure, (left, right) = plt.subplots(1, 2, figsize=(9.5, 3.8), layout="constrained")
left.plot(speeds, values, "k", label="curve")
for mu in (0.4, 0.3, 0.1):
    left.axhline(mu, ls=":", color="grey")
    right.plot(*sliding(mu), ":", label=f"friction {mu}")
left.set(xlabel="speed", ylabel="friction", ylim=(0, 0.5))
time, speed = sliding(curve)
right.plot(time[::8], speed[::8], "ko", ms=3, label="Stribeck curve, steps")
t = np.linspace(0, 5.5, 300)
right.plot(t, np.maximum(exact.sol(t)[0], 0), "k", lw=0.8, label="the same, equation")
right.set(xlabel="time", ylabel="speed", ylim=(-0.02, 1))
right.legend()
