r"""
Acary 2017: a profile of methods
================================

Which method is best depends on the problem; a *performance profile* shows all at once. :math:`\rho_s(\tau)` is the share of
problems that method s solves within :math:`\tau` times the best cost, Dolan and Moré 2002. The value at 1 says how often it
wins; the end, how often it arrives.
"""

# %%
# Eight random problems and four packings of spheres; cost is the number of floating point operations, as in the
# paper, which is the same on every machine.
import matplotlib.pyplot as plt

import amontons as am
from amontons.mechanics.ready.gallery import random_delassus, sphere_packing

problems = [random_delassus(seed, 20, mu=0.6) for seed in range(8)]
problems += [sphere_packing(3, layers=2, seed=seed) for seed in range(4)]
solvers = {
    "Newton": am.SemismoothNewton(),
    "Gauss-Seidel": am.GaussSeidel(),
    "with Anderson": am.GaussSeidel(anderson_depth=5),
    "Jacobi": am.Jacobi(),
}
costs = []
for problem in problems:
    records = [
        am.solve(problem, solver, tolerance=1e-6, max_iterations=2000, check=False).convergence
        for solver in solvers.values()
    ]
    costs.append([r.flops if r.outcome is am.Outcome.CONVERGED else float("inf") for r in records])
tau, rho = am.performance_profile(costs)

# %%
# Curves that are high at the left win often; curves that are high at the right fail seldom.
figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
for name, shares in zip(solvers, rho, strict=True):
    axis.step(tau, shares, where="post", label=name)
axis.set(xscale="log", xlabel="operations / fewest operations", ylabel="share solved", ylim=(0, 1.05))
axis.legend()
