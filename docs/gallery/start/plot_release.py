r"""
A brake that lets go in a jump
==============================

The arm of the last page in time: pressed and dragged until t = 1, then its head is lifted. When does it let go?

Friction holds the jammed foot far above the height at which it first touched. A solver that takes *some* solution of each
step lets go as soon as there is an open one, at t = 1.25. The body has to follow its path to the fold, at t = 1.687.
"""

# %%
# ``crossing`` follows the path of solutions from each step to the next, and says where it turned back.
import amontons as am

model = am.read_case("example:release").model
records = {}
for label, crossing in (("solver's choice", None), ("followed", am.PathCrossing())):
    steps = list(am.evolve(model, am.QuasiStatic(0.05, crossing=crossing), until=2.0))
    records[label] = [(step.time, step.resultant()[1]) for step in steps]
    for step in steps:
        if step.passage is not None and step.passage.jumped:
            print(label, step.passage)

# %%
# Both agree while the arm is loaded. In the followed one the force falls along a straight line until it vanishes in a
# jump.
import matplotlib.pyplot as plt

figure, axis = plt.subplots(figsize=(7, 3.5), layout="constrained")
for (label, record), style in zip(records.items(), ("o--", ".-"), strict=True):
    axis.plot(*zip(*record, strict=True), style, mfc="none", label=label)
axis.set(xlabel="time", ylabel="force on the foot, N/mm")
axis.legend()
