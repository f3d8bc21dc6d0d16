r"""
Ligurský 2014: tangents where statuses change
=============================================

At a point where contacts are about to slip or to open, the tangents solve a small complementarity problem of their own. The
paper gives conditions for their existence and uniqueness; ``point.rates`` has them.
"""

# %%
# The V-shaped body, its branch, and what is proved at each of its points: a tangent for every load (existence), and at
# most one (uniqueness).
import matplotlib.pyplot as plt

import amontons as am
from amontons.mechanics.ready.vee import vee

branch = am.follow(vee(0), "load", (0, 1))
answers = {"existence": [], "uniqueness": [], "full_rank": []}
for point in branch:
    rates = point.rates
    for name, values in answers.items():
        values.append(getattr(rates, name).name.lower())
print(branch[20].rates)

# %%
# One row for each condition: where it is proved, refuted or undecided along the branch. "Refuted" says that the condition fails,
# which is sufficient and not necessary, and not that a tangent is missing.
names = sorted({word for values in answers.values() for word in values})
figure, axis = plt.subplots(figsize=(8, 2.6), layout="constrained")
for row, values in enumerate(answers.values()):
    for word, colour in zip(names, ("seagreen", "firebrick", "grey"), strict=False):
        here = [k for k, value in enumerate(values) if value == word]
        axis.plot(here, [row] * len(here), "s", color=colour, label=word if row == 0 else None)
axis.set(xlabel="point of the branch", yticks=range(3), yticklabels=list(answers), ylim=(-0.5, 3))
axis.legend(ncols=3, loc="upper right")
