r"""
Hüeber 2008: active sets from mesh to mesh
==========================================

S. Hüeber, G. Stadler and B. Wohlmuth write Coulomb's law at each node as a non-smooth equation and solve it by Newton's
method, which becomes a strategy of *active sets*: nodes are open, slip or stick by the sign of

.. math:: C_N = r_N - (r_N + c_n (-u_N))^+, \qquad
   C_T = \max(g, |r_T + c_t u_T|)\, r_T - g\, (r_T + c_t u_T) .
"""

# %%
# The cube of the paper's section 5 on three meshes. ``step.sets`` holds how many nodes are in which set after each step.
import matplotlib.pyplot as plt

import amontons as am


def cube(level):
    """Friction 1, 2^level cells along an edge."""
    block = am.Body(am.box((1, 1, 1), cells=2**level), am.LinearElastic(young=200, poisson=0.3))
    return am.Model(
        [block],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    ).assemble()


# %%
# Full Newton takes friction's bound :math:`g = \mu r_N` along in each step; the fixed point holds it for a step. Both end with
# the same sets.
figure, axes = plt.subplots(1, 3, figsize=(10, 3.4), sharey=True, layout="constrained")
for axis, level in zip(axes, (1, 2, 3), strict=True):
    for name, bound in (("full Newton", am.FrictionBound.NEWTON), ("fixed point", am.FrictionBound.FIXED_POINT)):
        solver = am.ActiveSet(bound=bound, c_normal=100, c_tangential=100)
        solution = am.solve(cube(level), solver, tolerance=1e-9, max_iterations=100, check=False)
        record = solution.convergence
        axis.semilogy([s.iteration for s in record.history], [s.error for s in record.history], ".-", label=name)
        print(level, name, record.iterations, "steps;", solution.counts)
    axis.set(title=f"{4**level} facets", xlabel="step")
axes[0].set(ylabel="error")
axes[0].legend()
