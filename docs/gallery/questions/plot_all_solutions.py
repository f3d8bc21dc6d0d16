r"""
All solutions, over friction
============================

How many solutions has a load, and what do they look like? ``am.all_solutions`` decides one contact after the other, and cuts
a branch of the search only where multipliers prove that no point is left: the list comes with a proof that it is
complete.
"""

# %%
# Hild's triangle with eight contacts, and friction that grows.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am

model = am.read_case("example:hild").model
frictions = np.arange(0.5, 8.01, 0.25)
lists = [am.all_solutions(model.with_mu(mu)) for mu in frictions]
print(all(found.complete for found in lists), max(len(found) for found in lists))
print(lists[-1])

# %%
# Energies of all solutions above that of the open state. One up to 3, then three: free, stuck, and one between them with
# orientation -1 (cross). From 5 on more come, always in pairs of a dot and a cross, up to thirteen. Orientations add up to
# one, always: if they did not, a solution would be missing.
figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
for mu, found in zip(frictions, lists, strict=True):
    for solution in found.solutions:
        axis.plot(mu, solution.energy, {1: "o", -1: "x", 0: "d"}[solution.orientation], color="tab:blue")
axis.set(xlabel="friction", ylabel="energy")
