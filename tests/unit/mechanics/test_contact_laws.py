"""Caps, cohesion and different laws at the contacts of a model: blocks with known forces."""

import json

import numpy as np
import pytest
from block_case import block_case, command

import amontons as am

YOUNG = 100.0


def block(dim=2, pull=0.0, slide=0.05, cells=4, where="bottom", **law):
    """A unit block on a floor whose top moves: traction `pull` upwards, all contacts slide."""
    floor = am.Plane((0,) * (dim - 1) + (1,))
    top = [slide] + [0] * (dim - 2) + [pull / YOUNG]
    body = am.Body(am.box((1,) * dim, cells), am.LinearElastic(young=YOUNG, poisson=0.0))
    return am.Model([body], [am.Fix("top", top)], [am.Contact(where, floor, **law)])


def resultant(model, **options):
    return am.solve(model, **options).solution.r.sum(axis=0)


@pytest.mark.parametrize("method", ["nodal", "nitsche"])
@pytest.mark.parametrize(
    ("law", "pull", "normal", "shear"),
    [
        ({"mu": 0.3}, -1.0, 1.0, 0.3),
        ({"mu": 0.3, "cap": 0.1}, -1.0, 1.0, 0.1),
        ({"mu": 0.3, "cap": 3.0}, -1.0, 1.0, 0.3),
        ({"mu": 0.3, "cohesion": 2.0}, 1.0, -1.0, 0.3),  # mu (r_N + c)
        ({"mu": 0.3, "cohesion": 2.0, "cap": 0.05}, 1.0, -1.0, 0.05),
        ({"tresca": 0.2, "cohesion": 2.0}, 1.0, -1.0, 0.2),
        ({"mu": 0.3, "cohesion": 0.5}, 1.0, -0.5, 0.0),  # open, and it pulls on
        ({"mu": 0.3, "cohesion": lambda x: 0.25 + 0.5 * x[:, 0]}, 1.0, -0.5, 0.0),
        ({"law": am.CappedCoulomb([0.3], [0.1])}, -1.0, 1.0, 0.1),
        ({"law": am.Cohesive(am.Coulomb([0.3]), [2.0])}, 1.0, -1.0, 0.3),
    ],
)
def test_forces_of_a_block(law, pull, normal, shear, method):
    model = block(pull=pull, method=method, **law)
    np.testing.assert_allclose(resultant(model), [normal, -shear], atol=2e-3)


def test_bounds_are_stresses_in_3d():
    found = resultant(block(3, pull=1.0, mu=0.3, cohesion=2.0, cap=0.2))
    np.testing.assert_allclose(found, [-1.0, -0.2, 0.0], atol=0.02)


def test_cohesion_acts_where_the_sides_touch():
    gap = am.Plane((0, 1), (0, -0.001))
    body = am.Body(am.box((1, 1), 4), am.LinearElastic(young=YOUNG, poisson=0.0))
    contact = am.Contact("bottom", gap, mu=0.3, cohesion=1.0)
    model = am.Model([body], [am.Fix("top", 0)], [contact])
    assert not model.law.cohesion.any()
    assert not am.solve(model).solution.r.any()


def test_each_contact_has_its_law():
    floor, side = am.Plane((0, 1)), am.Plane((-1, 0), (1, 0))
    body = am.Body(am.box((1, 1), 4), am.LinearElastic(young=YOUNG, poisson=0.0))
    model = am.Model(
        [body], [am.Fix("top", [None, -0.01]), am.Fix("left", [0.02, None])],
        [am.Contact("bottom", floor, mu=0.3), am.Contact("right", side, tresca=0.1)],
    )  # fmt: skip
    found = am.solve(model)
    r, law = found.solution.r, model.law
    assert (np.linalg.norm(r[:, 1:], axis=1) <= law.bound(r) + 1e-9).all()
    assert set(law.kind) == {0, 1}
    assert found.solution.problem.error(r, found.solution.v) < 1e-8


def test_pairs_take_cohesion():
    mesh = am.box((1, 1), 4)
    upper = am.Body(mesh, am.LinearElastic(young=YOUNG, poisson=0.0), "upper")
    lower = am.Body(am.box((1, 1), 3, origin=(0, -1)), upper.material, "lower")
    for cohesion, force in ((2.0, -0.5), (0.2, -0.2)):
        model = am.Model(
            [upper, lower], [am.Fix("upper.top", [0, 0.01]), am.Fix("lower.bottom", 0)],
            [am.Contact("upper.bottom", master="lower.top", mu=0.3, cohesion=cohesion)],
        )  # fmt: skip
        np.testing.assert_allclose(resultant(model)[0], force, rtol=1e-6)


def test_a_body_hangs_by_cohesion_or_falls():
    """Without supports: what contact can not hold is said to have no solution."""
    floor = am.Plane((0, 1))
    body = am.Body(am.box((1, 1), 4), am.LinearElastic(young=YOUNG, poisson=0.0))
    up = am.BodyForce((0.0, 1.0))
    held = am.Model([body], [], [am.Contact("bottom", floor, mu=0.3, cohesion=1.5)], [up])
    np.testing.assert_allclose(resultant(held), [-1, 0], atol=1e-6)
    loose = am.Model([body], [], [am.Contact("bottom", floor, mu=0.3, cohesion=0.5)], [up])
    with pytest.raises(am.NotConverged, match="there is no solution"):
        am.solve(loose)


def test_steps_keep_the_law():
    model = block(pull=-1.0, slide=0.0, mu=0.3, cap=0.1)
    drag = am.Fix("top", lambda x, t: (0.05 * t, -0.01))
    moving = am.Model(model.bodies, [drag], model.contacts)
    steps = list(am.evolve(moving, am.QuasiStatic(0.25), until=1.0))
    last = steps[-1].solution
    np.testing.assert_allclose(last.r.sum(axis=0), [1, -0.1], atol=1e-3)


@pytest.mark.parametrize(("cohesion", "hangs"), [(3.0, True), (0.5, False)])
def test_cohesion_in_dynamics_is_a_force_not_an_impulse(cohesion, hangs):
    """A load of 1 put on at once pulls with up to 2."""
    body = am.Body(am.box((1, 1), 2), am.LinearElastic(young=1e4, poisson=0.2, density=1.0))
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.3, cohesion=cohesion)
    model = am.Model([body], [], [contact], [am.BodyForce((0.0, 1.0))])
    last = list(am.evolve(model, am.MoreauJean(0.01), until=0.1))[-1]
    rise = last.state.displacement.reshape(-1, 2)[:, 1].mean()
    assert (rise < 1e-3) == hangs
    assert last.energies.contact <= 1e-9


def test_large_deformations_take_caps():
    floor = am.Plane((0, 1))
    body = am.Body(am.box((1, 1), 3), am.NeoHookean(young=YOUNG, poisson=0.0))
    capped = am.Contact("bottom", floor, mu=0.3, cap=0.1)
    model = am.Model([body], [am.Fix("top", [0.1, -0.02])], [capped])
    found = am.solve(model)
    r, u = found.solution.r, found.displacement[0][found.fields.node]
    edge = np.linalg.norm(np.diff(body.mesh.points[found.fields.node] + u, axis=0), axis=1)
    area = 0.5 * (np.append(edge, 0.0) + np.append(0.0, edge))  # of now
    assert np.linalg.norm(r[:, 1:], axis=1) == pytest.approx(0.1 * area, rel=1e-5)
    assert r[:, 1].sum() == pytest.approx(-0.1 * area.sum(), rel=1e-5)


CASE = block_case(
    '["0.05*t", "0.01*t"]', '{ coulomb = 0.3, cap = 0.2, cohesion = "2.0" }', cells=4
)


def test_case_files_and_the_command_line(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(CASE)

    assert command("run", case, "--output", tmp_path / "run").exit_code == 0
    case.write_text(CASE.replace("*t", "").partition("[evolution]")[0])
    assert command("info", case, "--json", tmp_path / "facts.json").exit_code == 0
    facts = json.loads((tmp_path / "facts.json").read_text())
    assert facts["friction coefficient"] == [0.3, 0.3]
    assert facts["friction bound"][1] == pytest.approx(0.2 / 4)
    assert facts["cohesion"][1] == pytest.approx(2 / 4)
    refused = command("convert", case, tmp_path / "a.hdf5")
    assert refused.exit_code != 0
    assert "stores a coefficient of Coulomb friction" in refused.output
