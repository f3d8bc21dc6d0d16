"""Cells with one mean gradient and a stiffness of bending: none of their modes is free."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.elements import stiffness
from amontons.mechanics.elements.hyperelasticity import HyperelasticBody

RUBBER = (
    am.NeoHookean(1.0, 0.4999), am.MooneyRivlin(0.15, 0.02, 1000.0),
    am.Ogden((0.2, 0.1), (2.0, -2.0), 500.0),
)  # fmt: skip


def box(size, cells, integration):
    mesh = am.box(size, cells)
    return replace(
        mesh, cells=tuple(replace(block, integration=integration) for block in mesh.cells)
    )


@pytest.mark.parametrize("law", RUBBER, ids=repr)
@pytest.mark.parametrize(("dim", "n"), [(2, 5), (3, 3)])
@pytest.mark.parametrize("stretch", [0.1, 0.3, 0.6, 1.0, 3.0])
def test_no_pressure_makes_the_modes_give_way(dim, n, stretch, law):
    """A block between rigid smooth walls, pressed or drawn at constant volume: the body is
    stable, and cells with enhanced strains are not ([WR] P. Wriggers, S. Reese, CMAME 135
    (1996) 201-209)."""
    mesh = box((1.0,) * dim, n, "hybrid-incompatible")
    body, stretches = HyperelasticBody(mesh, law), np.ones(dim)
    stretches[0], stretches[-1] = 1 / stretch, stretch
    blocks = body.tangent(mesh.points * (stretches - 1))[1]
    free = ((mesh.points > 0) & (mesh.points < 1)).ravel()
    K = body.matrix(blocks).toarray()[np.ix_(free, free)]
    assert np.linalg.eigvalsh(K)[0] > 1e-3 * law.shear


@pytest.mark.parametrize("law", [am.NeoHookean(1, 0.3), am.SaintVenantKirchhoff(1, 0.3)])
@pytest.mark.parametrize("dim", [2, 3])
def test_tangents_of_incompatible_cells_are_derivatives(dim, law):
    mesh = box((1.0,) * dim, 2, "incompatible")
    rng = np.random.default_rng(1)
    mesh = replace(mesh, points=mesh.points + 0.03 * rng.standard_normal(mesh.points.shape))
    body, way = HyperelasticBody(mesh, law), rng.standard_normal(mesh.points.shape)
    u = 0.05 * rng.standard_normal(way.shape) + 0.1 * mesh.points[:, ::-1]
    forces, blocks = body.tangent(u)
    slope = (body.matrix(blocks) @ way.ravel()).reshape(u.shape)
    for function, wanted in ((body.forces, slope), (body.energy, (forces * way).sum())):
        first, second = (function(u + h * way) - function(u - h * way) for h in (1e-4, 2e-4))
        np.testing.assert_allclose((8 * first - second) / 12e-4, wanted, rtol=1e-7,
                                   atol=1e-8 * abs(slope).max())  # fmt: skip


def bent(n, length, K, mesh, modulus):
    """Rise of the end of a beam of height 1 under a moment, over that of theory."""
    x, y = mesh.points[:, 0], mesh.points[:, 1] - 0.5
    end = np.flatnonzero(x == length)
    end = end[np.argsort(y[end])]
    force = np.zeros(mesh.points.shape)
    h = 1.0 / n
    for a, b in zip(end[:-1], end[1:], strict=True):
        force[a, 0] += h * (2 * y[a] + y[b]) / 6
        force[b, 0] += h * (y[a] + 2 * y[b]) / 6
    free = np.ones(mesh.points.shape, dtype=bool)
    free[x == 0, 0] = False
    free[np.flatnonzero((x == 0) & (y == -0.5)), 1] = False
    free = free.ravel()
    u = np.zeros(free.size)
    u[free] = np.linalg.solve(K.toarray()[np.ix_(free, free)], force.ravel()[free])
    return abs(u[2 * end[0] + 1]) / (length**2 / 2 / modulus)


@pytest.mark.parametrize("wide", [1, 4])
@pytest.mark.parametrize(("n", "more"), [(1, 2.0), (2, 8 / 7), (4, 32 / 31)])
def test_bent_cells_are_too_soft_by_what_a_free_volume_takes(n, more, wide):
    """Near incompressibility a bent cell has half its stiffness, a share 1 / n^2 of the beam:
    1 / (1 - 1 / (2 n^2)) of the rise, however long the cells are."""
    law, length = am.LinearElastic(1.0, 0.4999), 4.0
    mesh = box((length, 1.0), (int(length * n / wide), n), "hybrid-incompatible")
    rise = bent(n, length, stiffness(mesh, law), mesh, law.young / (1 - law.poisson**2))
    assert rise == pytest.approx(more, rel=1e-3)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.4999])
@pytest.mark.parametrize("finite", [False, True])
def test_incompatible_cells_bend_exactly(poisson, finite):
    mesh, law = box((4.0, 1.0), (2, 1), "incompatible"), am.LinearElastic(1.0, poisson)
    K = stiffness(mesh, law)
    if finite:
        body = HyperelasticBody(mesh, am.NeoHookean(1.0, poisson))
        K = body.matrix(body.tangent(np.zeros(mesh.points.shape))[1])
    rise = bent(1, 4.0, K, mesh, 1 / (1 - poisson**2))
    assert rise == pytest.approx(1.0, rel=1e-8)


def test_bodies_with_modes_are_solved_at_finite_strains():
    """A thin beam of one cell of height that a weight bends far: within 1 percent of quad9."""
    rise = {}
    for integration, order, cells in (
        ("incompatible", 1, (20, 1)), ("full", 1, (20, 1)), ("full", 2, (20, 2))
    ):  # fmt: skip
        mesh = box((10.0, 0.5), cells, integration)
        body = am.Body(mesh, am.NeoHookean(1000.0, 0.3), order=order)
        load = am.Traction("right", (0.0, 0.6))
        far = am.Contact("bottom", am.Plane((0, 1), (0, -9)), mu=0.0)
        model = am.Model([body], [am.Fix("left", (0, 0))], [far], [load])
        u = am.solve(model).displacement[0]
        rise[integration, order] = u[:, 1].max()
    true = rise["full", 2]
    assert true > 3
    assert rise["incompatible", 1] == pytest.approx(true, rel=0.01)
    assert rise["full", 1] < 0.95 * true
