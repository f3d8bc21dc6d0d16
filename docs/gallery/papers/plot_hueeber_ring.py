r"""
Hüeber 2008: a ring over a tool
===============================

Section 7 pushes a ring over a conical tool that it overlaps at first: two deformable bodies whose meshes do not match. The
overlap has to vanish; pressure and friction 0.7 follow from it.
"""

# %%
# Both are tubes of hexahedra, made here by hand: around, along and through.
import matplotlib.pyplot as plt
import numpy as np

import amontons as am


def tube(around, along, through, inner, outer, low, high):
    """A tube about z; inner and outer are radii as functions of z."""
    k, j, i = (a.ravel() for a in np.meshgrid(*map(np.arange, (through + 1, along + 1, around)), indexing="ij"))
    z = low + (high - low) * j / along
    radius = inner(z) + (outer(z) - inner(z)) * k / through
    angle = 2 * np.pi * i / around
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
    k, j, i = (a.ravel() for a in np.meshgrid(*map(np.arange, (through, along, around)), indexing="ij"))

    def face(c):
        """Nodes on the inner (0) or outer (1) side of each cell."""
        corners = ((0, 0), (1, 0), (1, 1), (0, 1))
        return [((k + c) * (along + 1) + j + b) * around + (i + a) % around for a, b in corners]

    cells = np.column_stack([*face(0), *face(1)])
    last, top = k == through - 1, j == along - 1
    sides = {"inner": cells[k == 0][:, :4], "outer": cells[last][:, 4:],
             "bottom": cells[j == 0][:, [0, 1, 5, 4]], "rim": cells[last & top][:, 4:]}
    surfaces = {name: (am.Facets("quad", nodes),) for name, nodes in sides.items()}
    return am.Mesh(points, (am.Cells("hex", cells),), surfaces)


ring = am.Body(
    tube(48, 6, 2, lambda z: 1 + 0 * z, lambda z: 1.3 + 0 * z, 0.0, 0.5),
    am.LinearElastic(young=9e7, poisson=0.3), "ring",
)
tool = am.Body(
    tube(40, 8, 2, lambda z: 0.7 + 0 * z, lambda z: 1.02 - 0.025 * (z + 0.2) / 0.9, -0.2, 0.7),
    am.LinearElastic(young=8.13e8, poisson=0.3), "tool",
)
model = am.Model(
    [ring, tool],
    supports=[am.Fix("ring.rim", (0, 0, 0)), am.Fix("tool.bottom", (0, 0, 0))],
    contacts=[am.Contact("ring.inner", master="tool.outer", mu=0.7)],
)
solution = am.solve(model)
print(solution)

# %%
# The inside of the ring, unrolled. Below, where the tool is wider, the pressure is largest. The problem is the same all
# around, its meshes are not; mortar averages keep the pressure even to a few percent.
fields = solution.fields
x, y, z = fields.points.T
angle = np.degrees(np.arctan2(y, x))
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
filled = left.scatter(angle, z, c=fields.pressure, s=14)
left.set(xlabel="angle", ylabel="z", title="pressure")
figure.colorbar(filled, ax=left)
heights = np.unique(z.round(9))
for status in am.ContactStatus:
    share = [(solution.solution.status[np.isclose(z, h)] == status).mean() for h in heights]
    right.plot(heights, share, "o-", label=status.name.lower())
right.set(xlabel="z", ylabel="share of the nodes")
right.legend()
