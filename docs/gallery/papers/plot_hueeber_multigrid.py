r"""
Hüeber 2008: contact as cheap as a linear solve
===============================================

The paper's aim is not only few steps of Newton, but steps that cost a fixed number of multigrid cycles: *inexact* active
sets. ``am.ContactMultigrid`` goes on from there. How does its cost grow with the mesh?
"""

# %%
import time

import matplotlib.pyplot as plt

import amontons as am

unknowns, contact, linear = [], [], []
for cells in (4, 8, 16, 24):
    block = am.Body(am.box((1, 1, 1), cells=cells), am.LinearElastic(young=200, poisson=0.3))
    model = am.Model(
        [block],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )
    problem = model.assemble()
    am.solve(problem.fresh(), am.ContactMultigrid(), check=False)  # kernels, once
    began = time.process_time()
    solution = am.solve(problem.fresh(), am.ContactMultigrid())
    contact.append(time.process_time() - began)
    unknowns.append(problem.unknowns)
    print(problem.unknowns, "unknowns:", solution.convergence)

# %%
# Ten iterations on every mesh. CPU seconds over unknowns tend to the line of slope one; on small meshes what does not
# depend on the size counts.
figure, axis = plt.subplots(figsize=(6.5, 4), layout="constrained")
axis.loglog(unknowns, contact, "o-", label="contact multigrid")
axis.loglog(unknowns, [contact[-1] * n / unknowns[-1] for n in unknowns], "k:", label="proportional")
axis.set(xlabel="unknowns", ylabel="CPU seconds")
axis.legend()
