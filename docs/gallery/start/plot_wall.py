r"""
A masonry wall, pressed and sheared
===================================

Twelve elastic blocks between two rigid supports: the upper one presses by up to 30 kN and moves sideways at 1 mm/s.
Where do the joints slip and open?

Steps in time by the scheme of Moreau and Jean, on velocities and impulses,

.. math:: \hat M (v_{k+1} - v_k) = -h K q_k - h^2 \theta K v_k + h f + H r, \qquad \hat M = M + h^2 \theta^2 K .
"""

# %%
# A coarse wall keeps this page quick; ``amontons run example:wall`` has 7 212 unknowns. The first second, in steps of
# 50 ms.
import amontons as am

case = am.read_case("example:wall", ["wall.cells=[4,2,2]"])
steps = list(am.evolve(case.model, am.MoreauJean(0.05, theta=1, reach=5e-5), until=1.0))
last = steps[-1]
print(last.solution)

# %%
# In the first 0.1 s the wall is only pressed, and sticks. Then the shear begins: most contacts slip, and some joints
# open. Elastic energy grows with load and shear; the blocks hardly move, so kinetic energy stays far below it.
import matplotlib.pyplot as plt

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
for status in am.ContactStatus:
    left.plot([s.time for s in steps], [s.solution.counts[status.name.lower()] for s in steps],
              ".-", label=status.name.lower())
left.set(xlabel="time, s", ylabel="contacts that take part")
left.legend()
energies = [s.energies for s in steps]
right.plot([s.time for s in steps], [e.elastic for e in energies], label="elastic")
right.plot([s.time for s in steps], [e.kinetic for e in energies], label="kinetic")
right.set(xlabel="time, s", ylabel="energy, J", yscale="log")
right.legend()
