r"""
Does a sliding block flutter?
=============================

A block is pressed onto a floor that runs below it.  Friction follows the pressure, so that the
stiffness is not symmetric and two modes may meet: from that friction on their motion grows,

.. math:: M \ddot v + K v = (n - \mu t) \, r_N, \qquad n^T v = 0 \text{ where it touches.}

``flutter`` finds where they meet by Newton's method on a double eigenvalue, without a sweep.
"""

# %%
import numpy as np

import amontons as am


def block(mu):
    """Ten by five cells, its top held and pushed down."""
    body = am.Body(am.box((1, 0.5), cells=(10, 5)), am.LinearElastic(200, 0.3, density=1.0))
    return am.Model(
        [body], [am.Fix("top", (0, -0.01))], [am.Contact("bottom", am.Plane((0, 1)), mu=mu)]
    )


modes = am.modes(block(0.5), 8, velocity=(1, 0))
print(modes)

# %%
# The shapes at the moment of their largest displacement.
modes.plot()

# %%
# The modes of the same state over its friction, as a sweep would find them, and where they meet.
import matplotlib.pyplot as plt

from dataclasses import replace

from amontons.analysis.stability.modes import modes_of

figure, (above, below) = plt.subplots(2, sharex=True, figsize=(6.5, 5))
for p in np.linspace(0.02, 1.2, 40):
    state = replace(modes.state, F_1=p * modes.state.F_1, mu=p * modes.state.mu)
    found = modes_of(state, 10)
    above.plot(np.full(len(found.s), state.mu), found.frequency, ".", color="0.4", markersize=2)
    below.plot(np.full(len(found.s), state.mu), found.s.real, ".", color="0.4", markersize=2)
for point in modes.flutter():
    print(f"flutter from friction {point.mu:.8f} on, at {point.frequency:.6f}")
    above.plot(point.mu, point.frequency, "o", markersize=8, markerfacecolor="none")
above.set(ylabel="frequency", ylim=(0, 40))
below.set(xlabel="friction", ylabel="growth, Re s")
figure.tight_layout()
