r"""
Rey 2026: the older criteria, in 3D
===================================

The P-matrix criterion and that of full contact come from 2D. In 3D slip has a direction, and the values as printed depend on the
tangents that somebody chose. Which readings are safe?
"""

# %%
# Hild's triangle extruded to a tetrahedron: one contact node in 3D.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am

points = [[0, 0, 0], [1, 0, 0], [0.75, 0.25, 0], [1, 0, 0.5]]
mesh = am.Mesh(
    np.array(points, float), (am.Cells("tet", [[0, 1, 2, 3]]),),
    {"held": (am.Facets("tri", [[1, 2, 3]]),), "floor": (am.Facets("tri", [[0, 1, 3]]),)},
)
model = am.Model(
    [am.Body(mesh, am.LinearElastic(young=1, poisson=0.2))],
    supports=[am.Fix("held", 0.0)],
    contacts=[am.Contact("floor", am.Plane(normal=(0, 1, 0)), mu=1.0)],
)
problem = model.assemble().condensed()
values = {
    "P-matrix, discs (safe)": am.p_matrix_friction(problem, gap=0.03),
    "P-matrix, as printed": am.p_matrix_friction(problem, given_tangents=True),
    "full contact, sharp": am.full_contact_friction(problem, sharp=True, gap=0.03),
    "full contact, as printed": am.full_contact_friction(problem, gap=0.03),
}

# %%
# A bar is the interval in which a value is known to lie. Only the first is safe: below it every load has at most one
# solution, whatever the direction of slip.
figure, axis = plt.subplots(figsize=(7.5, 2.8), layout="constrained")
for name, value in values.items():
    axis.barh(name, max(value.upper - value.lower, 0.01), left=value.lower, height=0.5)
    print(f"{name}: {value.lower:.4f} to {value.upper:.4f}")
axis.set(xlabel="friction", xlim=(1.8, 2.3))
axis.invert_yaxis()
