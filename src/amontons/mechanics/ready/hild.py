"""Hild's triangle: a static contact problem that has several solutions from mu = 3 on.

An elastic triangle A (0, 0), B (1, 0), C (3/4, 1/4) over the obstacle y <= 0: young 1, poisson
1/5, plane strain, thickness 1.  BC is held at `held_displacement`, AC pulled along -x, AB can
touch.  Two fields solve it for every mesh of linear triangles, as both are linear in x and y:
all nodes free, for every mu, and all nodes sticking with r_T = 3 r_N, for mu >= 3.  From mu = 3
on there is also a partly slipping solution, which depends on the mesh.

[Hild] P. Hild, "Multiple solutions of stick and separation type in the Signorini model with
Coulomb friction", Z. Angew. Math. Mech. 85 (2005).
[Rey] section 5.1; the load there is printed along y, with which `free_displacement` does not
balance it.  It acts along x.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.errors import InvalidInput
from ..contact import Plane
from ..elements import LinearElastic
from ..meshes import Cells, Facets, Mesh
from ..model import Body, Contact, Fix, Model, Traction

Array = NDArray[np.float64]
TRACTION = 35 / 48 * np.sqrt(10)  # on AC along -x, for delta = 1
CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.75, 0.25]])
SAME = 1e-9  # distance to a side of the triangle that counts as none


def hild_triangle(
    mesh: int | Mesh = 1, *, mu: float = 3.5, delta: float = 1.0, name: str = "hild"
) -> Model:
    """Hild's triangle on n^2 similar triangles, or on a mesh with surfaces AB, BC and CA.

    The contact nodes are those of AB but B, which is held: n of them.  delta scales the load.
    """
    if not isinstance(mesh, Mesh):
        mesh = triangle_mesh(mesh)
    if not 0 < delta < 4 / 3:  # the range of [Rey]
        raise InvalidInput(f"delta: expected a number between 0 and 4/3, got {delta!r}")
    return Model(
        [Body(mesh, LinearElastic(young=1.0, poisson=0.2))],
        supports=[Fix("BC", partial(_held, delta))],
        loads=[Traction("CA", (-TRACTION * delta, 0.0))],
        contacts=[Contact("AB", Plane(normal=(0, 1)), mu=mu)],
        name=name,
    )


def _held(delta: float, x: Array) -> Array:
    return delta * held_displacement(x)


def triangle_mesh(n: int) -> Mesh:
    """n^2 similar triangles on the triangle ABC, n edges on each side."""
    if not (isinstance(n, int | np.integer) and n >= 1):
        raise InvalidInput(f"n: expected a whole number >= 1, got {n!r}")
    rows = [np.arange(n + 1 - j) for j in range(n + 1)]
    first = np.concatenate([[0], np.cumsum([len(row) for row in rows])])
    weights = np.array([[n - i - j, i, j] for j, row in enumerate(rows) for i in row]) / n
    cells = []
    for j in range(n):
        low, high = first[j], first[j + 1]
        for i in range(n - j):
            cells.append([low + i, low + i + 1, high + i])
            if i < n - j - 1:
                cells.append([low + i + 1, high + i + 1, high + i])
    return mesh_of_triangle(weights @ CORNERS, cells)


def mesh_of_triangle(points: ArrayLike, triangles: ArrayLike) -> Mesh:
    """A mesh of ABC from its nodes (k, 2) and triangles (t, 3), with surfaces AB, BC and CA."""
    points = np.asarray(points, dtype=float)
    plain = Mesh(points, (Cells("tri", np.asarray(triangles, dtype=np.int64)),))
    (outer,) = plain.boundary
    x, y = points.T
    distances = {"AB": y, "BC": 1 - x - y, "CA": x / 3 - y}
    surfaces = {}
    for side, distance in distances.items():
        on = (np.abs(distance) < SAME)[outer.nodes].all(axis=1)
        surfaces[side] = (Facets("line", outer.nodes[on]),)
    if sum(len(facets.nodes) for (facets,) in surfaces.values()) != len(outer.nodes):
        raise InvalidInput(
            "triangles: expected a mesh of the triangle (0, 0), (1, 0), (3/4, 1/4)"
        )
    return Mesh(points, plain.cells, surfaces)


def held_displacement(x: Sequence[float] | Array) -> Array:
    """(u_x, u_y) on BC for delta = 1 at one point x, (2,)."""
    return np.array([6 * (x[0] - 1), 0.75 * (x[0] - 1)])


def free_displacement(points: Array) -> Array:
    """The solution without contact, (k, 2), for delta = 1 and every mu."""
    x, y = points.T
    return np.column_stack([7 * x + y - 7, 1 - x - 1.75 * y])


def stick_displacement(points: Array) -> Array:
    """The solution that sticks on all of AB, (k, 2), for delta = 1 and mu >= 3."""
    y = points[:, 1]
    return np.column_stack([-6 * y, -0.75 * y])
