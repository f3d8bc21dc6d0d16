"""Ties in models: patch tests between meshes that do not match, obstacles, bonds, steps."""

import numpy as np
import pytest
from block_case import block_case, command

import amontons as am

YOUNG = 100.0
SOFT = am.LinearElastic(young=YOUNG, poisson=0.3)


def pair(supports, loads=(), cells=(4, 3), dim=2, material=SOFT, **contact):
    """A unit cube tied onto another one."""
    top = am.Body(am.box((1,) * dim, cells[0]), material, "upper")
    below = (0,) * (dim - 1) + (-1,)
    bottom = am.Body(am.box((1,) * dim, cells[1], origin=below), material, "lower")
    contact = contact or {"law": am.Tied()}
    tie = am.Contact("upper.bottom", master="lower.top", **contact)
    return am.Model([top, bottom], supports, [tie], loads)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("cells", [(4, 3), (3, 4), (2, 5)])
@pytest.mark.parametrize("motion", ["pulled", "pressed", "sheared"])
def test_patch(dim, cells, motion):
    """A linear field on both: only the tie makes the bodies one."""
    slope = np.zeros((dim, dim))
    if motion == "sheared":
        slope[0, -1] = slope[-1, 0] = 0.01
    else:
        slope[-1, -1] = 0.02 if motion == "pulled" else -0.02
        slope[0, 0] = -0.3 * slope[-1, -1]

    def field(x):
        return slope @ x

    sides = ["left", "right", "top", "bottom"] + (["front", "back"] if dim == 3 else [])
    held = [am.Fix(f"{body}.{side}", field) for body in ("upper", "lower") for side in sides
            if (body, side) not in (("upper", "bottom"), ("lower", "top"))]  # fmt: skip
    model = pair(held, cells=cells, dim=dim)
    found = am.solve(model, tolerance=1e-12)
    for body, moved in zip(model.bodies, found.fields.displacement, strict=True):
        np.testing.assert_allclose(moved, body.mesh.points @ slope.T, atol=1e-11)
    assert set(found.status) == {am.ContactStatus.STICK}


@pytest.mark.parametrize("method", ["mortar", "nodal"])
def test_tied_halves_are_one_body(method):
    """Meshes that match: the displacements of a bar in one piece, bent and pulled."""
    load = [am.Traction("upper.top", (0.03, 0.1))]
    found = am.solve(pair([am.Fix("lower.bottom", 0)], load, (4, 4), tied=True, method=method))
    mesh = am.box((1, 2), (4, 8), origin=(0, -1))
    whole = am.Model([am.Body(mesh, SOFT)], [am.Fix("bottom", 0)],
                     [am.Contact("left", am.Plane((1, 0), (-9, 0)), mu=0)],
                     [am.Traction("top", (0.03, 0.1))])  # fmt: skip
    expected = am.solve(whole).fields.displacement[0]
    for body, moved in zip(("upper", "lower"), found.fields.displacement, strict=True):
        points = found.model.bodies[0 if body == "upper" else 1].mesh.points
        at = np.abs(points[:, None] - mesh.points).sum(axis=2).argmin(axis=1)
        np.testing.assert_allclose(moved, expected[at], atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(found.solution.r.sum(axis=0), [-0.1, -0.03], atol=1e-8)
    assert not found.warnings


def test_a_body_that_ties_alone_hold_is_held():
    model = pair([am.Fix("lower.bottom", 0)], [am.Traction("upper.top", (5.0, 90.0))])
    assert am.solve(model).converged
    assert "perhaps they do not suffice" in str(model.imbalance())


def test_ties_keep_the_distance_that_there_was():
    """A curved or open joint has no stress of its own."""
    lower = am.Body(am.box((1, 1), 3, origin=(0, -1.05)), SOFT, "lower")
    upper = am.Body(am.box((1, 1), 4), SOFT, "upper")
    tie = am.Contact("upper.bottom", master="lower.top", tied=True)
    fixed = [am.Fix("upper.top", 0), am.Fix("lower.bottom", 0)]
    found = am.solve(am.Model([upper, lower], fixed, [tie]))
    assert not found.solution.r.any() and found.converged
    apart = am.Body(am.box((1, 1), 3, origin=(0, -1.5)), SOFT, "lower")
    with pytest.raises(am.InvalidInput, match=r"farther from the other side .* where="):
        am.solve(am.Model([upper, apart], fixed, [tie]))


def test_a_tie_to_an_obstacle_is_a_support():
    body = am.Body(am.box((1, 1, 1), 3), SOFT)
    load = am.Traction("top", (0.1, 0.2, 1.0))
    held = am.Model([body], [], [am.Contact("bottom", am.Plane((0, 0, 1)), tied=True)], [load])
    far = am.Contact("left", am.Plane((1, 0, 0), (-9, 0, 0)), mu=0)
    fixed = am.Model([body], [am.Fix("bottom", 0)], [far], [load])
    found, expected = am.solve(held), am.solve(fixed)
    np.testing.assert_allclose(
        found.fields.displacement[0], expected.fields.displacement[0], atol=1e-9
    )
    np.testing.assert_allclose(found.fields.resultant, [-0.1, -0.2, -1.0], atol=1e-7)


def test_a_bond_is_elastic_with_a_stiffness():
    """Pulled by 1: each block lengthens by 1 / E, the bond opens by 1 / k; sheared alike."""
    stiff = am.LinearElastic(young=1e6, poisson=0.0)
    for law in ({"tied": True, "stiffness": 50.0, "stick_stiffness": 20.0},
                {"law": am.Compliant(am.Tied(), 1 / 50, 1 / 20)}):  # fmt: skip
        top = [am.Fix("upper.top", [0.01, 0.02]), am.Fix("lower.bottom", 0)]
        found = am.solve(pair(top, material=stiff, **law)).fields
        np.testing.assert_allclose(found.pressure, -1.0, rtol=1e-3)
        np.testing.assert_allclose(found.gap, 0.02, rtol=1e-3)
        np.testing.assert_allclose(found.shear[:, 0], -0.2, rtol=1e-2)
    bond = am.Contact("bottom", am.Plane((0, 1)), tied=True, stiffness=50.0)
    body = am.Body(am.box((1, 1), 2), stiff)
    held = am.Model([body], [am.Fix("top", [0, 0.02])], [bond])
    assert am.solve(held).fields.pressure == pytest.approx(-1.0, rel=1e-3)


def test_nitsche_ties_too():
    model = pair([am.Fix("lower.bottom", 0), am.Fix("upper.top", [0.002, 0.02])], tied=True,
                 method="nitsche")  # fmt: skip
    found = am.solve(model)
    expected = am.solve(pair(list(model.supports))).fields.displacement[0]
    np.testing.assert_allclose(found.fields.displacement[0], expected, atol=1e-4)
    assert found.fields.gap == pytest.approx(0, abs=2e-4)


def test_ties_beside_contacts_with_friction():
    """A block tied to a sledge that slides: friction is the sledge's alone."""
    upper = am.Body(am.box((1, 1), 4), SOFT, "upper")
    lower = am.Body(am.box((1, 1), 3, origin=(0, -1)), SOFT, "lower")
    model = am.Model(
        [upper, lower], [am.Fix("upper.top", [0.1, -0.02])],
        [am.Contact("upper.bottom", master="lower.top", tied=True),
         am.Contact("lower.bottom", am.Plane((0, 1), (0, -1)), mu=0.3)],
    )  # fmt: skip
    found = am.solve(model)
    pressed = found.fields.force[:, 1][4 + 1 :].sum()
    assert found.fields.force[5:, 0].sum() == pytest.approx(-0.3 * pressed, rel=1e-6)
    other = am.solve(model.with_mu(0.1))
    assert other.fields.force[5:, 0].sum() == pytest.approx(
        -0.1 * other.fields.force[5:, 1].sum(), rel=1e-6
    )


def test_quasi_static_steps_hold_what_they_tie():
    def top(x, t):
        return (0.01 * np.sin(t), 0.02 * np.sin(2 * t))

    model = pair([am.Fix("lower.bottom", 0), am.Fix("upper.top", top)])
    for step in am.evolve(model, am.QuasiStatic(0.5), until=3.0):
        assert np.abs(step.gap).max() <= 1e-9 and np.abs(step.state.slip).max() <= 1e-9
        assert abs(step.energies.contact) <= 1e-9
        assert abs(step.energies.defect) <= 1e-7 * max(step.energies.turnover, 1e-9)


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_tied_bodies_move_as_one(theta):
    """Thrown up with a tie, both fly; no energy is made."""
    heavy = am.LinearElastic(young=1e3, poisson=0.2, density=1.0)
    model = pair([], [am.BodyForce((0.0, -1.0))], (2, 3), material=heavy, tied=True)
    start = am.at_rest(model, velocity=[(0.0, 1.0), (0.0, 1.0)])
    steps = list(am.evolve(model, am.MoreauJean(0.01, theta=theta), start=start, until=0.5))
    assert all(np.abs(step.gap).max() <= 1e-9 for step in steps)
    assert all(np.abs(step.state.slip).max() <= 1e-9 for step in steps)
    heights = [moved[:, 1].mean() for moved in steps[-1].displacement]
    np.testing.assert_allclose(heights, 0.5 - 0.125, rtol=2e-2)
    assert max(step.energies.contact for step in steps) <= 1e-9


def test_what_does_not_go_with_ties_is_refused():
    floor = am.Plane((0, 1))
    for more, words in (({"mu": 0.3}, "no friction; expected no mu"),
                        ({"cohesion": 1.0}, "expected no cohesion"),
                        ({"law": am.Tied()}, "got both")):  # fmt: skip
        with pytest.raises(am.InvalidInput, match=words):
            am.Contact("bottom", floor, tied=True, **more)
    with pytest.raises(am.InvalidInput, match="tied: expected True or False"):
        am.Contact("bottom", floor, tied="yes")
    rubber = am.Body(am.box((1, 1), 2), am.NeoHookean(young=1.0, poisson=0.3))
    tied = am.Model([rubber], [am.Fix("top", 0)], [am.Contact("bottom", floor, tied=True)])
    with pytest.raises(am.UnsupportedForm, match="use Fix"):
        am.solve(tied)


CASE = block_case('[0, "0.02*t"]', '"tied"')


def test_case_files_and_the_command_line(tmp_path):
    case = tmp_path / "case.toml"

    for k, (words, pull) in enumerate({
        '"tied"': -2.0, "{ tied = true, stiffness = 100.0 }": -1.0
    }.items()):  # fmt: skip
        case.write_text(CASE.replace('"tied"', words))
        ran = command("run", case, "--output", tmp_path / f"run{k}")
        assert ran.exit_code == 0, ran.output
        state = am.load_state(next((tmp_path / f"run{k}").glob("*.h5")))
        assert state.force[:, 0].sum() == pytest.approx(pull)
    case.write_text(CASE.replace("*t", "").partition("[evolution]")[0])
    assert command("info", case, "--json", tmp_path / "facts.json").exit_code == 0
    assert "Infinity" not in (tmp_path / "facts.json").read_text()
    solved = command("solve", case, "--output", tmp_path / "out")
    assert solved.exit_code == 0, solved.output
    assert "Infinity" not in (tmp_path / "out" / "solution.json").read_text()
    for wrong, told in (('{ tied = false }', "expected true"), ('"glued"', "or 'tied'"),
                        ('{ tied = true, coulomb = 0.3 }', "coulomb")):  # fmt: skip
        case.write_text(CASE.replace('"tied"', wrong))
        refused = command("solve", case)
        assert refused.exit_code != 0
        assert told in refused.output
