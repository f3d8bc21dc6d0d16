r"""
Is there a solution at all?
===========================

A body between two walls that form a V can jam so firmly that statics has no answer for some loads: reactions hold each
other, as large as they like. ``am.existence`` looks for a motion that opens all contacts at once,

.. math:: u_N > \mu |u_T| \quad \text{at every contact}, \qquad u = H^T v + w .

Where there is one, *every* load has a solution. Else it shows reactions in the cone that hold each other.
"""

# %%
# A body without rotation between walls at the half-angle :math:`\alpha`. Only a motion straight out of the V can open both:
# there :math:`u_N = \sin \alpha` and :math:`|u_T| = \cos \alpha`, so that it does as long as :math:`\mu < \tan \alpha`: the old rule for
# wedges and self-locking tapers.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am


def wedge(angle, mu):
    """The body of mass 1 with velocities (x, y); columns of H: normal and tangent of both walls."""
    c, s = np.cos(angle), np.sin(angle)
    H = np.array([[c, -s, -c, s], [s, c, s, c]])
    return am.FrictionProblem.from_global(np.eye(2), H, [0, -1], np.zeros((2, 2)), [mu, mu])


angles, frictions = np.linspace(2, 60, 15), np.linspace(0.05, 1.5, 15)
assured = [
    [am.existence(wedge(np.radians(a), mu)).verdict is am.Existence.ASSURED for a in angles]
    for mu in frictions
]
print(am.existence(wedge(np.radians(10), 0.5)).reason)

# %%
# Green: assured. Red: reactions can hold each other. The line is the rule.
figure, axis = plt.subplots(figsize=(6.5, 4), layout="constrained")
axis.pcolormesh(angles, frictions, np.array(assured, float), cmap="RdYlGn", vmin=-0.3, vmax=1.3)
axis.plot(angles, np.tan(np.radians(angles)), "k", label="tan(angle)")
axis.set(xlabel="half-angle of the V, degrees", ylabel="friction", ylim=(0.05, 1.5))
axis.legend()
