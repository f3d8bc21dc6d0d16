"""Tractions averaged around contacts: what is even stays even, what scatters is halved."""

import numpy as np
import pytest

import amontons as am

STEEL = am.LinearElastic(100.0, 0.0)


def uneven(mesh, size, seed=3):
    """Inner nodes of every face and of the inside moved at random, by parts of a cell."""
    low, high = mesh.bounding_box()
    rng, x = np.random.default_rng(seed), mesh.points.copy()
    for k in range(x.shape[1]):
        inner = (x[:, k] > low[k] + 1e-9) & (x[:, k] < high[k] - 1e-9)
        x[inner, k] += size * rng.uniform(-1, 1, inner.sum())
    return am.Mesh(x, mesh.cells, mesh.surfaces)


def stacked(  # noqa: PLR0913
    dim, kinds, order=1, method="mortar", wider=0.0,
    law: am.LinearElastic | am.NeoHookean = STEEL,
):  # fmt: skip
    """A block on another one, pressed evenly; the slave may be wider than its master."""
    size, flat = (1.0,) * (dim - 1), (0,) * (dim - 1)
    lower = uneven(am.box((*size, 1.0), 2, kinds[0], origin=(*flat, -1)), 0.06)
    wide = (1.0 + wider, *size[1:], 1.0)
    upper = am.box(wide, 3, kinds[1], origin=(-wider / 2, *flat[1:], 0))
    bodies = [am.Body(lower, law, "lower", order=order),
              am.Body(uneven(upper, 0.04), law, "upper", order=order)]  # fmt: skip
    return am.Model(
        bodies, [am.Fix("lower.bottom", 0), am.Fix("upper.top", (*flat, -0.02))],
        [am.Contact("upper.bottom", master="lower.top", mu=0.5, method=method)],
    )  # fmt: skip


@pytest.mark.parametrize(("dim", "kinds", "order"), [
    (2, ("quad", "tri"), 1), (2, ("tri", "quad"), 2), (3, ("hex", "tet"), 1),
    (3, ("tet", "hex"), 2),
])  # fmt: skip
def test_a_uniform_pressure_stays_uniform(dim, kinds, order):
    found = am.solve(stacked(dim, kinds, order), tolerance=1e-12)
    wanted = np.zeros((len(found.pressure), dim))
    wanted[:, -1] = 1.0  # E eps: 100 x 0.02 / 2
    np.testing.assert_allclose(am.mean_tractions(found), wanted, atol=1e-9)


def test_a_slave_beyond_its_master_has_its_mean_over_what_has_contacts():
    found = am.solve(stacked(3, ("hex", "tet"), wider=0.6), tolerance=1e-12)
    means, own = am.mean_tractions(found), found.force / found.weights[:, None]
    assert (means.min(axis=0) >= own.min(axis=0) - 1e-12).all()
    assert (means.max(axis=0) <= own.max(axis=0) + 1e-12).all()


def test_contacts_at_gauss_points_keep_their_own():
    found = am.solve(stacked(2, ("quad", "quad"), method="nitsche"))
    own = found.force / found.weights[:, None]
    np.testing.assert_array_equal(am.mean_tractions(found), own)


def test_weights_are_integrals_of_products_of_shape_functions():
    """Two facets of lengths 1 and 2 on a plane: by hand."""
    mesh = am.box((3, 1), (2, 1))
    x = mesh.points.copy()
    x[np.isclose(x[:, 0], 1.5), 0] = 1.0
    body = am.Body(am.Mesh(x, mesh.cells, mesh.surfaces), STEEL)
    found = am.solve(am.Model(
        [body], [am.Fix("top", (0, lambda x: -0.01 - 0.002 * x[0] ** 2))],
        [am.Contact("bottom", am.Plane((0, 1)), mu=0.0)], []))  # fmt: skip
    order = np.argsort(found.points[:, 0])
    a, b, c = found.pressure[order]
    wanted = [(2 * a + b) / 3, (a + 6 * b + 2 * c) / 9, (b + 2 * c) / 3]
    np.testing.assert_allclose(am.mean_tractions(found)[order, 1], wanted, rtol=1e-12)


def test_steps_at_finite_strains_have_means_too():
    """nu = 0: sigma = E / 2 (l - 1 / l) with l = 0.99."""
    model = stacked(2, ("quad", "tri"), law=am.NeoHookean(100.0, 0.0))
    step = next(iter(am.evolve(model, am.QuasiStatic(1.0), until=1.0, tolerance=1e-11)))
    wanted = np.tile([0.0, 50 * (1 / 0.99 - 0.99)], (len(step.fields.pressure), 1))
    np.testing.assert_allclose(am.mean_tractions(step), wanted, atol=1e-7)


def test_what_has_no_model_is_refused():
    with pytest.raises(am.InvalidInput, match="expected the solution of a model"):
        am.mean_tractions(np.zeros(3))  # type: ignore[arg-type]  # that is what is tested


def test_shear_that_uneven_tetrahedra_lock_in_is_halved():
    """Two bodies alike, pressed: none at all in theory (Johnson 1985, 4.2 and 7.1)."""
    bodies = []
    for seed, (name, z) in enumerate((("lower", -2), ("upper", 0))):
        mesh = am.box((4, 4, 2), (9, 9, 4), "tet", origin=(-2, -2, z))
        bodies.append(am.Body(uneven(mesh, 0.11, seed), STEEL, name))
    found = am.solve(am.Model(
        bodies, [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0, 0, -0.06))],
        [am.Contact("upper.bottom", master="lower.top", mu=0.5,
                    clearance=lambda p: (p[:, 0] ** 2 + p[:, 1] ** 2) / 60)]))  # fmt: skip
    own = found.force / found.weights[:, None]
    locked, mean = (np.linalg.norm(t[:, :2]) for t in (own, am.mean_tractions(found)))
    assert locked > 0.02 * np.linalg.norm(own[:, 2])
    assert mean < 0.6 * locked
