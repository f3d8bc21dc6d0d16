r"""
Acary 2017: rigid or elastic
============================

Between rigid blocks :math:`H` loses rank as soon as there are more rows than velocities: W is singular, reactions are not unique,
and Newton's method has nothing to invert. That is the paper's reason for elastic blocks.
"""

# %%
# Towers of rigid boxes: six velocities a box, twelve rows to a joint.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am
from amontons.mechanics.ready.gallery import box_tower

sizes = np.arange(1, 9)
ranks = [np.linalg.matrix_rank(box_tower(n).H.toarray()) for n in sizes]
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
left.plot(sizes, 12 * sizes, "o-", label="rows of H")
left.plot(sizes, ranks, "s-", label="rank of H")
left.set(xlabel="boxes")
left.legend()

# %%
# Reactions of the corners of the lowest joint from random starts: all are solutions, all carry the same total, and how
# it is shared among four corners is anybody's guess. Velocities agree to rounding.
problem = box_tower(4, push=0.1).condensed()
random = np.random.default_rng(0)
velocities = []
for _ in range(6):
    start = am.Iterate(random.random((problem.contacts, 3)) * [20, 0, 0])
    solution = am.solve(problem, am.GaussSeidel(), start=start, tolerance=1e-10)
    right.plot(solution.r[:4, 0], "o-", label=f"sum {solution.r[:4, 0].sum():.4f}")
    velocities.append(solution.u)
right.set(xlabel="corner of the lowest joint", ylabel="normal impulse, N s", xticks=range(4))
right.legend()
print(f"velocities differ by {np.ptp(velocities, axis=0).max():.0e} m/s")
