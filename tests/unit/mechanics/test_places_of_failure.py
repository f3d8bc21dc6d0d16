"""Words where no equilibrium is found further on."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.model.large_deformation import large_deformation
from amontons.mechanics.model.places_of_failure import places_of_failure

NEO = am.NeoHookean(1.0, 0.3)


def bodies(dim, at, fine=1.0):
    """A block on a wider slab, moved along by `at`; fine: of the slab."""
    deep = (1,) * (dim - 2)
    cells = [round(fine * count) for count in (10, *(6 * k for k in deep))]
    boxes = [("lower", (2, *(2 * k for k in deep), 1), (*cells, 2),
              (-0.5, *(-0.5 * k for k in deep), -1)),
             ("upper", (1, *deep, 1), (4, *(3 * k for k in deep), 2),
              (at, *(0 for _ in deep), 0))]  # fmt: skip
    return [am.Body(am.box(size, cells, origin=origin), NEO, name=name)
            for name, size, cells, origin in boxes]  # fmt: skip


def problem_of(parts, *, exchanged):
    """And which nodes are the block's."""
    sides = ["upper.bottom", "lower.top"][:: -1 if exchanged else 1]
    pair = am.Contact(sides[0], master=sides[1], mu=0.3)
    held = [am.Fix("lower.bottom", 0), am.Fix("upper.top", 0)]
    problem = large_deformation(am.Model(parts, held, [pair]))
    return problem, np.arange(len(problem.parts.X)) >= len(parts[0].mesh.points)


@pytest.mark.parametrize(("way", "edge", "exchanged"), [
    ("leans", True, False),  # on the edge of the slave
    ("hangs over", True, True),  # on that of the slab, which is the slave
    ("hangs over", True, False),  # or the master
    ("sags", False, False), ("sags", False, True),  # one node bears, and no side ends there
    ("lies", False, False), ("lies", False, True),
    ("lies coarsely", False, True),  # on parts of the slab's facets, as slaves
])  # fmt: skip
@pytest.mark.parametrize("dim", [2, 3])
def test_what_bears_along_an_edge_alone_is_told(way, edge, exchanged, dim):
    """A block that leans on its edge, or hangs on the slab's by its underside."""
    parts = bodies(dim, 1.0 if way == "hangs over" else 0.0, 0.2 if "coarsely" in way else 1.0)
    problem, upper = problem_of(parts, exchanged=exchanged)
    X, u = problem.parts.X, np.zeros(problem.parts.X.shape)
    x, z = X[upper, 0], X[upper, -1]
    tilt = {"leans": 0.1, "hangs over": -0.1}.get(way, 0.0)
    centre = 0.0 if way == "leans" else 1.5
    u[upper, 0] = -np.sin(tilt) * z + (np.cos(tilt) - 1) * (x - centre)
    u[upper, -1] = np.sin(tilt) * (x - centre) + (np.cos(tilt) - 1) * z
    if way == "sags":
        u[upper, -1] += ((X[upper, :-1] - (0.5 if dim == 2 else 1 / 3)) ** 2).sum(axis=1) / 4
    here = problem.parts.meet(u)
    closed = here.gap < here.gap.min() + 1e-3
    told = places_of_failure(problem.parts, u, here, closed)
    assert ("along an edge alone" in told) == edge


def test_nodes_that_hardly_faced_anything_are_not_told_as_lost():
    """The block reached over the slab's last facet by a thousandth, and does no more."""
    problem, upper = problem_of(bodies(2, 0.0), exchanged=True)
    u = np.zeros(problem.parts.X.shape)
    met = []
    for way in (-0.299, -0.31):  # its right end at .701 and .69; nodes of the slab at .7 and .9
        u[upper, 0] = way
        met.append(problem.parts.meet(u))
    before, after = (one.parts[0].met for one in met)
    assert (before & ~after).any()
    closed = np.zeros(len(met[0].gap), dtype=bool)
    assert not places_of_failure(problem.parts, u, met[0], closed)
