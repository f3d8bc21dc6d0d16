"""Laws of two bodies that slide far: forces of a dragged block that are known beforehand."""

import numpy as np
import pytest
from tangent_checker import checked_tangents

import amontons as am
from amontons.mechanics.model.large_deformation import large_deformation, large_step

SOFT, STIFF = am.NeoHookean(1.0, 0.3), am.NeoHookean(20.0, 0.3)
PRESS, DRAG = 0.06, 0.5
CHORDS = 1e-4  # relative: facets of both sides are not quite parallel


def top(x, t):
    """Press until 1, then drag."""
    return DRAG * max(t - 1.0, 0.0), -PRESS * min(t, 1.0)


def model(*, order=1, **law):
    """A stiff block of width 1 on a softer slab."""
    lower = am.Body(am.box((3, 1), (15, 4), origin=(-0.7, -1)), SOFT, name="lower", order=order)
    upper = am.Body(am.box((1, 1), (4, 3)), STIFF, name="upper", order=order)
    return am.Model([lower, upper], [am.Fix("lower.bottom", 0), am.Fix("upper.top", top)],
                    [am.Contact("upper.bottom", master="lower.top", **law)])  # fmt: skip


def dragged(*, until=2.0, **law):
    """(normal, shear) forces at contacts after the drag, and the step."""
    *_, step = am.evolve(model(**law), am.QuasiStatic(0.25), until=until)
    return step.state.force[:, 0], np.abs(step.state.force[:, 1:]).sum(axis=1), step


def areas(step):
    """Half of the two edges beside every node of the slave, between corners, where they are."""
    mesh = step.model.bodies[1].mesh
    at = mesh.points + step.state.displacement.reshape(-1, 2)[-len(mesh.points) :]
    edge = np.linalg.norm(np.diff(at[step.fields.node], axis=0), axis=1)
    return 0.5 * (np.append(edge, 0.0) + np.append(0.0, edge))


def test_a_given_bound_is_the_shear_of_the_whole_area():
    """Force per area where it is now, whatever the pressure."""
    _, shear, step = dragged(tresca=0.004)
    np.testing.assert_allclose(shear, 0.004 * areas(step), rtol=1e-8)


@pytest.mark.parametrize("order", [1, 2])
def test_a_cap_holds_where_the_pressure_is_high(order):
    normal, shear, step = dragged(mu=0.5, cap=0.006, order=order)
    most = 0.006 * areas(step)
    np.testing.assert_allclose(shear, np.minimum(0.5 * normal, most), rtol=1e-6)
    assert (shear < 0.4 * normal).any()
    assert step.solution.converged


def test_cohesion_adds_to_the_pressure():
    """Mohr and Coulomb: mu times (pressure + cohesion), over the whole area."""
    normal, shear, step = dragged(mu=0.3, cohesion=0.01)
    np.testing.assert_allclose(shear, 0.3 * (normal + 0.01 * areas(step)), rtol=1e-6)


def test_cohesion_bears_its_tension_and_no_more():
    """A block that is lifted: it hangs on until the tension is reached, then with just that."""
    for lift, torn in ((0.001, False), (0.2, True)):
        bodies = model(mu=0.3, cohesion=0.02)
        supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0, lift))]
        lifted = am.Model(bodies.bodies, supports, bodies.contacts)
        solution = am.solve(lifted)
        assert solution.converged
        pulled = solution.resultant.ravel()[1]  # over an area that Poisson's ratio narrows
        assert (pulled == pytest.approx(-0.02, rel=1e-3)) == torn


def test_friction_over_pressure():
    """mu = a / p: the shear is a, whatever the pressure."""
    curve = am.FrictionCurve(lambda p, s: 0.004 / np.maximum(p, 0.005))
    normal, shear, step = dragged(mu=curve)
    assert (normal > 0.005 * areas(step)).all()
    np.testing.assert_allclose(shear, 0.004 * areas(step), rtol=1e-6)


def test_friction_over_the_speed_of_the_slip():
    """The block slides by 0.5 in unit time, where all of it slides."""
    curve = am.FrictionCurve([0.4, 0.1], speed=[0.0, 1.0])
    normal, shear, _ = dragged(mu=curve)
    assert shear.sum() == pytest.approx((0.4 - 0.3 * DRAG) * normal.sum(), rel=0.02)


@pytest.mark.parametrize("order", [1, 2])
def test_sides_that_give_way_overlap_by_pressure_over_stiffness(order):
    normal, _, step = dragged(mu=0.1, stiffness=0.5, order=order, until=1.0)
    np.testing.assert_allclose(-step.gap, normal / (0.5 * areas(step)), rtol=CHORDS)
    assert abs(step.energies.defect) < 1e-6 * step.energies.turnover


def test_sides_that_give_way_along_a_curve():
    """Overclosures and pressures lie on it, on other pieces than where pressure begins."""
    curve = am.OverclosureCurve([0.0, 0.005, 0.02, 1.0], [-0.01, 0.01, 0.03, 0.2])
    normal, shear, step = dragged(mu=0.1, stiffness=curve)
    pressure = normal / areas(step)
    assert (pressure > 0.02).any()
    np.testing.assert_allclose(-step.gap, curve.needed(pressure)[0], rtol=1e-6)
    assert shear.sum() == pytest.approx(0.1 * normal.sum(), rel=1e-6)


def test_friction_over_pressure_of_sides_that_give_way():
    """A stiffness is no overlap, whatever friction follows."""
    curve = am.FrictionCurve(lambda p, s: 0.004 / np.maximum(p, 0.005))
    normal, shear, step = dragged(mu=curve, stiffness=0.5)
    np.testing.assert_allclose(-step.gap, normal / (0.5 * areas(step)), rtol=CHORDS)
    np.testing.assert_allclose(shear, 0.004 * areas(step), rtol=CHORDS)


LAWS = [{"tresca": 0.01}, {"mu": 0.4, "cap": 0.02}, {"mu": 0.3, "cohesion": 0.01},
        {"mu": 0.3, "stiffness": 2.0},
        {"tresca": 0.01, "cohesion": 0.02, "stiffness": 1.0}]  # fmt: skip


@pytest.mark.parametrize("law", LAWS)
def test_tangents_are_exact(law):
    rng, bodies = np.random.default_rng(3), model(**law)
    dofs = large_deformation(bodies).parts.X.size
    before = 0.01 * rng.standard_normal(dofs)
    problem = large_step(bodies, np.zeros(dofs), np.zeros(dofs), before)
    draws = (rng.standard_normal((2, problem.unknowns)) * [[0.01], [1.0]] for _ in range(20))
    assert checked_tangents(problem, draws) > 8


def test_what_has_slid_off_carries_no_force():
    """Half of the block beyond the slab's end: the bound of what is left alone."""
    short = am.Body(am.box((1.5, 1), (8, 4), origin=(-0.5, -1)), SOFT, name="lower")

    def far(x, t):
        return 0.5 * max(t - 1.0, 0.0), -PRESS * min(t, 1.0)

    upper, contact = model(tresca=0.004).bodies[1], model(tresca=0.004).contacts[0]
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", far)]
    slid = am.Model([short, upper], supports, [contact])
    *_, step = am.evolve(slid, am.QuasiStatic(0.1), until=2.0)
    assert step.solution.converged
    shear = -step.state.force[:, 1]
    np.testing.assert_allclose(shear[:2], 0.004 * areas(step)[:2], rtol=CHORDS)
    assert np.abs(shear[3:]).max() < 1e-9
    corner = short.mesh.points[:, 0] + short.mesh.points[:, 1] == 1.0
    at = short.mesh.points + step.state.displacement.reshape(-1, 2)[: len(corner)]
    first = upper.mesh.points + step.state.displacement.reshape(-1, 2)[len(corner) :]
    covered = np.linalg.norm(at[corner] - first[step.fields.node[0]])
    assert shear.sum() == pytest.approx(0.004 * covered, rel=1e-2)  # along another normal
