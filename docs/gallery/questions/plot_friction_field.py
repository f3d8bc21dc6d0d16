r"""
A friction field from measured displacements
============================================

How large is friction, place by place, under a strip that was dragged?  Only the displacement of
its lower side is measured, with noise.  The field of 1 000 coefficients is what fits best,

.. math:: \min_\mu\ \tfrac12 \sum_i \frac{(u_{T,i}(\mu) - \bar u_i)^2}{\sigma^2}
          + \tfrac{\alpha}{2} \int \mu''(x)^2 dx ,

and the slope of each attempt in all coefficients comes from one transposed solve, ``vjp``.
"""

# %%
import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import minimize

import amontons as am

nodes = 1000
strip = am.Body(am.box((10, 0.25), cells=(nodes - 1, 4)), am.LinearElastic(100, 0.3))
model = am.Model(
    [strip], [am.Fix("top", (0.03, -0.01))], [am.Contact("bottom", am.Plane((0, 1)), mu=0.3)]
)
problem = model.assemble()
x = model.discretisation.sites.points[:, 0]

# %%
# The truth, and what is measured of it: a thousandth of the largest displacement is noise.
truth = 0.3 + 0.1 * np.sin(2 * np.pi * x / 4) + 0.05 * np.cos(2 * np.pi * x / 1.7)
last = am.solve(problem.with_mu(truth))
noise = 1e-3 * np.abs(last.u[:, 1]).max()
measured = last.u[:, 1] + noise * np.random.default_rng(0).standard_normal(nodes)

# %%
# The number to make small, and its slope.
h = x[1] - x[0]
bends = np.diff(np.eye(nodes), 2, axis=0) / h**2


def misfit(mu):
    """Its value and its slope, (nodes,)."""
    global last
    last = am.solve(problem.with_mu(mu), am.SemismoothNewton(),
                    start=am.Iterate(last.r, last.v))
    rest = (last.u[:, 1] - measured) / noise
    slope = np.zeros_like(last.u)
    slope[:, 1] = rest / noise
    bent = bends @ mu
    gradient = last.vjp(u=slope).mu + h * bends.T @ bent
    return 0.5 * rest @ rest + 0.5 * h * bent @ bent, gradient


# %%
# In the variables z of mu = 0.3 + L^-T z, with L L^T near the second derivative, steps are good.
L = np.linalg.cholesky(20 * np.eye(nodes) + h * bends.T @ bends)


def in_z(z):
    """The same in z."""
    mu = np.maximum(0.3 + solve_triangular(L.T, z), 0.02)
    value, gradient = misfit(mu)
    return value, solve_triangular(L, gradient, lower=True)


start = np.zeros(nodes)
found = minimize(in_z, start, jac=True, method="L-BFGS-B", options={"maxiter": 40})
mu = 0.3 + solve_triangular(L.T, found.x)
error = np.linalg.norm(mu - truth) / np.linalg.norm(truth)
print(f"{found.nfev} solves; the field is {error:.2%} from the truth")

# %%
# The found field lies on the true one; it begins as 0.3 everywhere.
import matplotlib.pyplot as plt

figure, (above, below) = plt.subplots(2, sharex=True, figsize=(7, 4.5))
above.plot(x, measured, ".", markersize=1, color="0.6", label="measured")
above.plot(x, last.u[:, 1], linewidth=1, label="of the found field")
above.set_ylabel("slip")
above.legend()
below.plot(x, truth, linewidth=3, color="0.8", label="truth")
below.plot(x, mu, linewidth=1, label=f"found, {error:.2%} off")
below.set(xlabel="x", ylabel="friction")
below.legend()
figure.tight_layout()
