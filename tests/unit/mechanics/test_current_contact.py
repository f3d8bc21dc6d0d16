"""Contact where the nodes are with linear elasticity: tangents, limits, steps, example 5."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from tangent_checker import checked_tangents

import amontons as am
from amontons.mechanics.meshes import Cells, Facets, Mesh
from amontons.mechanics.model.large_deformation import large_deformation

SOFT = am.LinearElastic(1.0, 0.3)


def block(obstacle, top, law=SOFT, cells=4, **contact):
    """A unit box moved at its top against an obstacle."""
    dim = 2 if np.size(cells) == 1 else 3
    mesh = am.box((1,) * dim, cells=cells)
    options = {"mu": 0.3, "configuration": "current"} | contact
    return am.Model([am.Body(mesh, law)], [am.Fix("top", top)],
                    [am.Contact("bottom", obstacle, **options)])  # fmt: skip


@pytest.mark.parametrize("law", [
    SOFT, am.LinearElastic(1.0, 0.3, plane="stress"),
], ids=["strain", "stress"])  # fmt: skip
@pytest.mark.parametrize("order", [1, 2])
def test_on_a_plane_both_configurations_are_the_same(law, order):
    models = []
    for where in ("reference", "current"):
        mesh = am.box((1, 1), cells=3, kind="tri")
        contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.3, configuration=where)
        models.append(am.Model([am.Body(mesh, law, order=order)],
                               [am.Fix("top", (0.05, -0.1))], [contact]))  # fmt: skip
    assert [model.is_large for model in models] == [False, True]
    found = [am.solve(model, tolerance=1e-12) for model in models]
    assert np.abs(found[0].displacement[0] - found[1].displacement[0]).max() < 1e-11
    assert np.abs(found[0].force - found[1].force).max() < 1e-11
    assert found[0].pattern == found[1].pattern
    assert len(set(found[0].pattern)) > 1


@pytest.mark.parametrize("cells", [3, (2, 2, 2)])
def test_the_tangent_is_exact(cells):
    dim = 2 if cells == 3 else 3
    ball = am.Sphere(np.r_[0.3 * np.ones(dim - 1), -1.0], 1.0)
    problem = large_deformation(block(ball, 0, cells=cells))
    rng = np.random.default_rng(dim)
    draws = (
        rng.standard_normal((2, problem.unknowns)) * [[0.04], [1.0]] for _ in range(10)
    )
    assert checked_tangents(problem, draws) > 3


def test_nodes_meet_the_ball_where_they_are():
    ball = am.Sphere((0.4, -1.0), 1.0)
    current, reference = (
        am.solve(block(ball, (0.2, -0.2), configuration=where), tolerance=1e-12)
        for where in ("current", "reference")
    )
    assert {"f"} < set(current.pattern)
    at = current.points + current.displacement[0][current.fields.node]
    closed = current.pressure > 0
    assert np.abs(ball.gap(at[closed])).max() < 1e-12
    assert ball.gap(at).min() > -1e-12
    at = reference.points + reference.displacement[0][reference.fields.node]
    assert np.abs(ball.gap(at[reference.pressure > 0])).max() > 1e-3
    assert np.abs(current.displacement[0] - reference.displacement[0]).max() > 5e-3
    assert "sliding-beyond-curvature" not in {w.name for w in current.warnings}


def test_steps_paths_and_the_warning_of_turns():
    ball = am.Sphere((0.4, -1.0), 1.0)
    model = block(ball, lambda x, t: (0.2 * t, -0.2 * t), cells=3)
    steps = list(am.evolve(model, am.QuasiStatic(0.25), until=1.0, tolerance=1e-11))
    for step in steps:
        assert abs(step.energies.defect) < 1e-8 * step.energies.turnover
    branch = am.follow(model)
    found = am.solve(block(ball, (0.2, -0.2), cells=3), tolerance=1e-12)
    assert np.abs(branch.solutions[-1].v - found.solution.v).max() < 1e-9
    far, turn = am.Plane((0, 1), (0, -1)), lambda x: (0.1 * (1 - x[1]), 0.1 * (x[0] - 1))
    (warning,) = am.solve(block(far, turn)).warnings
    assert warning.name == "large-rotation"
    assert "gaps" not in str(warning)
    assert not am.solve(block(far, turn, am.NeoHookean(1.0, 0.3))).warnings


def test_linear_beside_hyperelastic_bodies():
    """Each on its own ground: as if alone."""
    mesh = am.box((1, 1), cells=3)
    two = [am.Body(mesh, am.NeoHookean(1.0, 0.3), name="a"), am.Body(mesh, SOFT, name="b")]
    ball = am.Sphere((0.5, -1.0), 1.0)
    both = am.solve(am.Model(
        two, [am.Fix(f"{k}.top", (0, -0.1)) for k in "ab"],
        [am.Contact(f"{k}.bottom", ball, mu=0.3, configuration="current") for k in "ab"],
    ), tolerance=1e-11)  # fmt: skip
    for body, moved in zip(two, both.displacement, strict=True):
        alone = am.solve(block(ball, (0, -0.1), body.material, cells=3), tolerance=1e-11)
        assert np.abs(moved - alone.displacement[0]).max() < 1e-9


def test_what_can_not_be_is_said():
    ground = am.Plane((0, 1))
    with pytest.raises(am.InvalidInput, match="configuration: expected one of"):
        am.Contact("bottom", ground, mu=0, configuration="deformed")
    with pytest.raises(am.InvalidInput, match="hyperelastic laws and corotational bodies have"):
        block(ground, 0, am.NeoHookean(1, 0.3), configuration="reference")
    mesh = am.box((1, 1), cells=2)
    with pytest.raises(am.InvalidInput, match="one kinematics for all"):
        am.Model([am.Body(mesh, SOFT)], [am.Fix("top", 0)],
                 [am.Contact("bottom", ground, mu=0, configuration="current"),
                  am.Contact("left", ground, mu=0)])  # fmt: skip
    for options in ({"method": "mortar"}, {"method": "nitsche"}):
        with pytest.raises(am.UnsupportedForm, match="nodal contact with an obstacle only"):
            am.solve(block(ground, (0, -0.1), **options))
    with pytest.raises(am.UnsupportedForm, match="dynamics of large deformations need"):
        next(am.evolve(block(ground, (0, -0.1)), am.MoreauJean(0.1), until=1.0))
    with pytest.raises(am.UnsupportedForm, match="no one linear problem"):
        block(ground, (0, -0.1)).assemble()


def test_case_files(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text("""
[mesh]
box = [1, 1]
cells = [3, 3]
[material.default]
young = 1.0
poisson = 0.3
[[fix]]
on = "top"
value = [0.1, -0.1]
[[contact]]
slave = "bottom"
obstacle = { sphere = { center = [0.4, -1.0], radius = 1.0 } }
friction = { coulomb = 0.3 }
configuration = "current"
""")
    old = path.read_text()
    path.write_text(old.replace('configuration = "current"', 'kinematics = "finite"'))
    assert am.read_case(path).model.contacts[0].kinematics == "finite"
    path.write_text(old.replace('configuration = "current"', 'kinematics = "large"'))
    with pytest.raises(am.FileFormatError, match=r"contact\[0\]\.kinematics.*finite, small"):
        am.read_case(path)
    path.write_text(old)
    found = am.solve(am.read_case(path).model, tolerance=1e-11)
    wanted = am.solve(block(am.Sphere((0.4, -1), 1), (0.1, -0.1), cells=3), tolerance=1e-11)
    assert np.abs(found.displacement[0] - wanted.displacement[0]).max() < 1e-12


# ------------------------------------------------------------------------- kinematics
def contact(**options):
    return am.Contact("bottom", am.Plane((0, 1)), mu=0.3, **options)


def test_kinematics_is_said_on_the_contact():
    assert contact().kinematics is None
    for old, new, other in (("reference", "small", "finite"), ("current", "finite", "small")):
        for found in (contact(configuration=old), contact(kinematics=new),
                      contact(kinematics=new, configuration=old)):  # fmt: skip
            assert found.kinematics == new
            assert replace(found, mu=0.1).kinematics == new
        with pytest.raises(am.InvalidInput, match="contradict each other"):
            contact(kinematics=other, configuration=old)
    with pytest.raises(am.InvalidInput, match="kinematics: expected one of small, finite"):
        contact(kinematics="large")
    soft, rubber = am.LinearElastic(1.0, 0.3), am.NeoHookean(1.0, 0.3)
    ground = am.Plane((0, 1))
    for law, kinematics, large in ((soft, None, False), (soft, "small", False),
                                   (soft, "finite", True), (rubber, None, True),
                                   (rubber, "finite", True)):  # fmt: skip
        model = block(ground, 0, law, configuration=None, kinematics=kinematics)
        assert model.is_large == large
    with pytest.raises(am.InvalidInput, match="kinematics='finite', as by default"):
        block(ground, 0, rubber, configuration=None, kinematics="small")


# ---------------------------------------------------------------- example 5 of the 2014 paper
@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_supports_hold_a_node_across_its_obstacle(mu):
    """One corner of a block on a slope is held along x: small loads as with small strains."""
    turn = np.array([[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]])
    mesh = am.box((1, 1), 2)
    mesh = am.Mesh(mesh.points @ turn, mesh.cells, mesh.surfaces)
    slope = am.Contact("bottom", am.Plane(tuple(turn[1])), mu=mu)
    supports = [am.Fix("top", (0, -1e-6)), am.Fix("left", (0, None))]
    found, forces = [], []
    for law in (am.LinearElastic(100.0, 0.3), am.SaintVenantKirchhoff(100.0, 0.3)):
        step = am.solve(am.Model([am.Body(mesh, law)], supports, [slope]), tolerance=1e-9)
        found.append(np.concatenate(step.displacement))
        forces.append(np.einsum("pk,pkc->pc", step.solution.r, step.fields.frames))
    small, finite = found
    np.testing.assert_allclose(finite, small, atol=1e-5 * np.abs(small).max())
    size = np.abs(forces[0]).max()
    np.testing.assert_allclose(forces[1][:, 1], forces[0][:, 1], atol=1e-5 * size)
    np.testing.assert_allclose(forces[1][0, 0], 0.0, atol=1e-12 * size)  # the support takes it


def triangle(radius, friction=0.5):
    """One triangle, a free corner in the origin, before a disc: the printed curved g.

    Lame constants 1 and 1, so that a = 2 and b = 1; forces (1, -p).
    """
    mesh = Mesh([[0.0, 0.0], [0.0, 1.0], [-1.0, 0.0]], (Cells("tri", [[0, 1, 2]]),),
                {"held": (Facets("line", [[1, 2]]),),
                 "contact": (Facets("line", [[0, 1]]),)})  # fmt: skip
    disc = am.LevelSet(
        lambda x: (x[:, 0] - radius) ** 2 + x[:, 1] ** 2 - radius**2,
        lambda x: 2 * (x - [radius, 0.0]),
        lambda x: np.broadcast_to(2 * np.eye(2), (len(x), 2, 2)),
    )
    contact = am.Contact("contact", disc, mu=friction, configuration="current")
    return am.Model([am.Body(mesh, am.LinearElastic(2.5, 0.25))], [am.Fix("held", 0)],
                    [contact], [am.BodyForce((6.0, lambda x, t: -6.0 * t))])  # fmt: skip


def slip_force(angle, radius, friction):
    """(p, lambda_nu) with which the corner slips at an angle along the disc, by hand.

    A u - (1, -p) = lambda_nu (nu - F tau), eliminated along the line across nu - F tau.
    """
    n = np.array([np.cos(angle), np.sin(angle)])
    nu, tau = n, np.array([-n[1], n[0]])
    u = radius * np.array([1.0, 0.0]) - radius * n
    push = nu - friction * tau
    need = np.array([[2.0, -1.0], [-1.0, 2.0]]) @ u - [1.0, 0.0]  # = lambda push - (0, p)
    lam = need[0] / push[0]
    return lam * push[1] - need[1], lam


def second_fold(radius, friction):
    """The smallest force of the slip along the disc, to rounding."""
    def slope(angle):
        h = 1e-3  # differences of order eight: errors of the size of rounding
        weights = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
        return sum(
            w * (slip_force(angle + k * h, radius, friction)[0]
                 - slip_force(angle - k * h, radius, friction)[0])
            for k, w in enumerate(weights, 1)
        ) / h  # fmt: skip

    angle = brentq(slope, 0.05, 0.5, xtol=1e-14)
    return angle, slip_force(angle, radius, friction)[0]


def test_example_5_of_a_model():
    """Slip begins at p = F, goes back to a smooth fold, and forth again: both folds by hand."""
    model = triangle(0.5)
    corner = model.discretisation.stored_stiffness.toarray()[:2, :2]
    assert corner == pytest.approx(np.array([[2, -1], [-1, 2]]))
    branch = am.follow(model, "load", (0.0, 0.6))
    angle, force = second_fold(0.5, 0.5)
    assert force == pytest.approx(0.4457, abs=5e-5)
    assert [fold.parameter for fold in branch.folds] == pytest.approx([0.5, force], abs=1e-10)
    turn = branch.folds[1].state
    assert turn == pytest.approx([0.5 - 0.5 * np.cos(angle), -0.5 * np.sin(angle)], abs=1e-6)
    statuses = [str(status) for status in branch.status]
    assert statuses[0] == "s"
    assert statuses[-1] == "+"
    states = branch.at(0.47)
    assert len(states) == 3
    for y in states:
        solution = branch.problem.solution(y, 0.47)
        assert solution.convergence.error < 1e-10
        gap = (y[0] - 0.5) ** 2 + y[1] ** 2 - 0.25
        assert abs(gap) < 1e-12


def test_example_5_with_little_curvature_has_no_fold():
    branch = am.follow(triangle(10.0), "load", (0.0, 0.6))
    assert branch.folds == ()
    assert [str(status) for status in (branch.status[0], branch.status[-1])] == ["s", "+"]
