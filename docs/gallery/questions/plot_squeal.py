r"""
Squeal of a disc between two pads
=================================

Two pads are pressed onto a disc that turns between them, friction 0.3.  A mode whose motion grows
is heard.  Material and friction are those of the benchmark *td-1* (E = 200 GPa, nu = 0.3,
7850 kg/m3), whose published unstable pair is 6474 ± 21.6 Hz on a mesh that is not at hand.  The
geometry here is our own, so that the numbers can not be compared: a disc of radii 40 and 150 mm,
20 mm thick, held at its inner rim; pads from 95 to 132 mm over 60 degrees,
15 mm thick, their backs pushed by 2 micrometres and held sideways.
"""

# %%
import numpy as np

import amontons as am

STEEL = am.LinearElastic(200e9, 0.3, density=7850)  # N, m, kg, s
radii, angles = np.linspace(0.04, 0.15, 7), np.linspace(0, 2 * np.pi, 37)
disc = am.ring(radii, angles, [-0.01, 0, 0.01])
upper = am.ring(radii[3:6], angles[6:13], [0.01, 0.0175, 0.025])
lower = am.ring(radii[3:6], angles[6:13], [-0.025, -0.0175, -0.01])
model = am.Model(
    [am.Body(disc, STEEL, "disc"), am.Body(upper, STEEL, "upper"), am.Body(lower, STEEL, "lower")],
    [am.Fix("disc.inner", 0), am.Fix("upper.top", (0, 0, -2e-6)),
     am.Fix("lower.bottom", (0, 0, 2e-6))],
    [am.Contact("upper.bottom", master="disc.top", mu=0.3),
     am.Contact("lower.top", master="disc.bottom", mu=0.3)],
)

# %%
# The disc turns, so the pads slide against it.  Slip that changes its direction is damped by
# friction, the more the slower the disc: at 10 rad/s nothing is heard, at 100 rad/s a pair of
# bending modes of the disc grows.

def turning(speed):
    """Velocity of the pads against a disc that turns."""
    return lambda x: (speed * x[1], -speed * x[0], 0.0)


for speed in (10, 100):
    modes = am.modes(model, 8, near=6474, velocity=turning(speed))
    print(f"at {speed} rad/s: {modes}")

# %%
# Those that grow are marked above the pictures.
modes.plot()
