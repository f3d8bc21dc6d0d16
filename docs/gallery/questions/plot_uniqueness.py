r"""
Is it the only solution?
========================

Nothing in a residual tells whether there is another solution. ``am.uniqueness`` looks for a proof that there is none, or
for a second one. Hild's triangle, over its coefficient of friction:

Below a *critical friction* every load has one solution, because none of the :math:`4^n` patterns of statuses makes the
linear problem singular. Above it some load has several; whether this one has is another question.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import amontons as am

model = am.read_case("example:hild").model
colours = {
    am.Verdict.UNIQUE_EVERY_LOAD: "seagreen", am.Verdict.UNIQUE_THIS_LOAD: "gold",
    am.Verdict.NOT_UNIQUE: "firebrick", am.Verdict.UNDECIDED: "grey",
}
figure, axis = plt.subplots(figsize=(8, 2.5), layout="constrained")
for mu in np.arange(0.25, 5, 0.25):
    answer = am.uniqueness(model.with_mu(mu))
    axis.bar(mu, 1, width=0.23, color=colours[answer.verdict])
for verdict, colour in colours.items():
    axis.bar(0, 0, color=colour, label=verdict.name.lower().replace("_", " "))
axis.axvline(answer.lower, color="k", ls=":")
axis.set(xlabel="coefficient of friction", yticks=[], ylim=(0, 1.9))
axis.legend(ncols=2, loc="upper center")
print(f"critical friction between {answer.lower:.4f} and {answer.upper:.4f}")
print(answer.reason)

# %%
# Green: proved for every load, up to the dotted line. Yellow: proved for this load. Red: a second solution is in
# ``answer.other``, with its own error by the judge. At exactly 3, where the others appear, a set of solutions may or may
# not be there within rounding, and nothing is claimed.
print("a second solution:", answer.other.pattern)
