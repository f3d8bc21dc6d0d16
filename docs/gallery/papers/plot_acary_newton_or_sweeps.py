r"""
Acary 2017: Newton or Gauss-Seidel on elastic blocks
====================================================

V. Acary, M. Brémond and F. Dubois ask which solver should be used for walls of *elastic* blocks. For elastic blocks W has
full rank, and semismooth Newton converges in a few steps,

.. math:: F(r) = r - P_K (r - \rho \hat u) = 0, \qquad J\, \Delta r = -F ;

Gauss-Seidel solves contact by contact, each sweep cheap, and needs thousands of sweeps.
"""

# %%
# The wall of the built-in example on a coarse mesh. The problem of a step in which joints slip:
import matplotlib.pyplot as plt

import amontons as am

case = am.read_case("example:wall", ["wall.cells=[4,2,2]"])
*_, step = am.evolve(case.model, am.MoreauJean(1e-2, theta=1, reach=1e-5), until=0.14)
problem = step.problem.condensed()
print(problem.contacts, "contacts,", step.solution.counts)

# %%
# Error by the judge over iterations, both from zero. Newton without a line search is the paper's NSN-AC, its last steps
# double the digits; NSGS-AC is Gauss-Seidel with Newton's method for each contact.
solvers = {
    "NSN-AC": am.SemismoothNewton(am.AlartCurnier(), line_search=am.FullStep()),
    "NSN-JM": am.SemismoothNewton(am.JeanMoreau(), line_search=am.FullStep()),
    "NSN-NM": am.SemismoothNewton(am.NaturalMap(), line_search=am.FullStep()),
    "NSGS-AC": am.GaussSeidel(local=am.LocalSolver.NEWTON, batch=10),
}
figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
for name, solver in solvers.items():
    record = am.solve(problem, solver, max_iterations=200, check=False, tolerance=1e-10).convergence
    sweeps = 10 if name == "NSGS-AC" else 1
    axis.loglog([sweeps * max(s.iteration, 0.5) for s in record.history], [s.error for s in record.history],
                ".-", label=name)
axis.set(xlabel="Newton steps, or sweeps", ylabel="error")
axis.legend()
