r"""
A tower of boxes, without a mesh
================================

Four rigid boxes on top of each other; the top one is pushed by a quarter of its weight. Which of them move, and from which friction on?

No finite elements: with masses M, arms of the contacts in H and weights f, one step in time is the discrete problem
:math:`M v = H r + f,\ u = H^T v + w`, four contacts to each box.
"""

# %%
import amontons as am
from amontons.mechanics.ready.gallery import box_tower

problem = box_tower(boxes=4, push=0.25)
print(problem.contacts, "contacts;", problem.form)

# %%
# The top box slides as soon as :math:`\mu < 0.25`, and is then faster by what friction lacks, :math:`(0.25 - \mu) g`.
# The boxes below never move: the joint above passes on no more than :math:`\mu` times one weight, and the joint beneath
# could hold :math:`\mu` times two.
import matplotlib.pyplot as plt
import numpy as np

frictions = np.linspace(0.03, 0.35, 33)
speeds = []
for mu in frictions:
    solution = am.solve(problem.with_mu(mu))
    speeds.append(solution.v.reshape(4, 6)[:, 0])
figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
for k, speed in enumerate(np.transpose(speeds)):
    axis.plot(frictions, speed, label=f"box {k + 1}")
axis.plot(frictions, 9.81 * np.maximum(0.25 - frictions, 0), "k:", label="(0.25 - mu) g")
axis.set(xlabel="coefficient of friction", ylabel="speed after 1 s, m/s")
axis.legend()
