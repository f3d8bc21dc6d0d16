r"""
An FCLib file, written and read
===============================

FCLib is the collection of frictional contact problems by which methods are compared. How does a problem get into such
a file, and out again?
"""

# %%
# A packing of spheres, one step in time; the file has W, q and mu in HDF5, as the library's own programs write it.
import tempfile
from pathlib import Path

import amontons as am
from amontons.mechanics.ready.gallery import sphere_packing

problem = sphere_packing(count=5, layers=3)
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "spheres.hdf5"
    am.write_fclib(problem, path, title="three layers of spheres")
    print(path.stat().st_size, "bytes")
    again = am.read_fclib(path)

# %%
# Four methods on it. All errors are by the same judge, :math:`|(r_i - P_K(r_i - \rho_i \hat u_i)) / \rho_i| / |q|`, whatever a
# method thinks of itself. W is singular here (spheres have more contacts than they need), so reactions are not unique;
# velocities are.
import matplotlib.pyplot as plt

figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
for solver in (am.GaussSeidel(), am.GaussSeidel(anderson_depth=5), am.Jacobi(), am.ProximalPoint()):
    record = am.solve(again, solver=solver, max_iterations=400, check=False).convergence
    name = type(solver).__name__ + (" with Anderson" if getattr(solver, "anderson_depth", 0) else "")
    axis.semilogy([s.iteration for s in record.history], [s.error for s in record.history], label=name)
axis.axhline(1e-8, color="grey", ls=":")
axis.set(xlabel="iterations", ylabel="error by the judge", xscale="log")
axis.legend()
