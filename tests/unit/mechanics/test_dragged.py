"""Friction along components that supports hold on an obstacle, with finite kinematics."""

import numpy as np
import pytest
from tangent_checker import FOURTH, checked_tangents

import amontons as am
from amontons.mechanics.model.large_deformation import large_deformation

LAW = am.LinearElastic(1000.0, 0.3)
N = 0.5  # of the load, on a width of 1


def held_block(motion, *, kinematics="finite", **law):
    """A block whose underside supports move along x on a plane, under a load."""
    block = am.Body(am.box((1, 1), (4, 3)), LAW, name="up")
    contact = am.Contact("up.bottom", am.Plane((0, 1)), kinematics=kinematics, **law)
    return am.Model([block], [am.Fix("up.bottom", (motion, None))], [contact],
                    [am.Traction("up.top", (0, -N))])  # fmt: skip


@pytest.mark.parametrize(("law", "friction"), [
    ({"mu": 0.3}, 0.3 * N),
    ({"tresca": 0.1}, 0.1),
    ({"mu": 0.3, "cap": 0.08}, 0.08),
    ({"mu": 0.3, "cohesion": 0.2}, 0.3 * (N + 0.2)),
    ({"mu": 0.3, "stick_stiffness": 10.0}, 0.3 * N),
    ({"mu": 0.3, "stick_stiffness": 1.0}, 0.05),
], ids=["Coulomb", "Tresca", "cap", "cohesion", "slip of springs", "springs"])  # fmt: skip
def test_a_held_underside_bears_all_of_its_friction(law, friction):
    """Nodes of the underside stay apart as they were, so that areas are known, too."""
    solution = am.solve(held_block(0.05, **law), tolerance=1e-10)
    assert not solution.warnings
    np.testing.assert_allclose(solution.resultant, [-friction, N], rtol=1e-9)
    np.testing.assert_allclose(solution.supports["up.bottom"].force, [friction, 0], atol=1e-9)


@pytest.mark.parametrize("law", [{"mu": 0.3}, {"mu": 0.3, "stick_stiffness": 10.0}])
def test_steps_to_and_fro_and_a_restart_are_those_of_small_kinematics(law):
    """Friction turns with the motion, and stays where nothing moves (1 to 1.5)."""

    def motion(x, t):
        return 0.05 * min(t, 1) - 0.05 * max(t - 1.5, 0), None

    found = []
    for kinematics in ("small", "finite"):
        of = held_block(0, kinematics=kinematics, **law)
        model = am.Model(of.bodies, [am.Fix("up.bottom", motion)], of.contacts, of.loads)
        steps = list(am.evolve(model, am.QuasiStatic(0.25), until=2.0, tolerance=1e-10))
        found.append([(*s.resultant(), s.state.slip.sum()) for s in steps])
        assert max(abs(s.energies.defect) for s in steps) < 1e-12
        again = am.evolve(model, am.QuasiStatic(0.25), until=2.0, start=steps[4].state)
        np.testing.assert_allclose([s.resultant() for s in again],
                                   [s.resultant() for s in steps[5:]], rtol=1e-6)  # fmt: skip
    np.testing.assert_allclose(found[1], found[0], atol=1e-6)
    assert found[1][5][0] == pytest.approx(-0.3 * N, rel=1e-6)


ALONG = {"mu": 0.3, "mu_across": 0.1, "direction": (1, 0.5, 0)}
LAWS = [{"mu": 0.3}, {"tresca": 0.02}, {"mu": 0.3, "stick_stiffness": 30.0},
        ALONG | {"stick_stiffness": 30.0}]  # fmt: skip


@pytest.mark.parametrize("law", LAWS)
def test_a_tiny_drag_with_one_held_component_is_small_kinematics(law):
    """Nodes of one side are held along x, and slide along y by the motion of another."""
    scale = 1e-5
    law = law | {k: scale * law[k] for k in ("tresca",) if k in law}
    found = []
    for kinematics in ("small", "finite"):
        block = am.Body(am.box((1, 1, 1), 2), LAW, name="up")
        held = [am.Fix("up.left", (0.05 * scale, None, None)),
                am.Fix("up.front", (None, 0.02 * scale, None))]  # fmt: skip
        contact = am.Contact("up.bottom", am.Plane((0, 0, 1)), kinematics=kinematics, **law)
        model = am.Model([block], held, [contact], [am.Traction("up.top", (0, 0, -N * scale))])
        found.append(am.solve(model, tolerance=1e-10))
    np.testing.assert_allclose(found[1].resultant, found[0].resultant, rtol=1e-5)
    shear = np.linalg.norm(found[1].resultant[:2])
    assert shear > 0.9 * (0.1 if "mu_across" in law else 0.3) * N * scale * ("mu" in law)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("obstacle", [am.Sphere((0.5, 0.5, -3), 3), am.Plane((0, 0, 1))])
def test_tangents_are_exact(law, obstacle):
    block = am.Body(am.box((1, 1, 0.5), (2, 2, 1)), am.NeoHookean(10.0, 0.3), name="up")
    held = [am.Fix("up.left", (0.02, None, None)), am.Fix("up.top", (None, None, -0.01))]
    problem = large_deformation(
        am.Model([block], held, [am.Contact("up.bottom", obstacle, **law)])
    )
    rng = np.random.default_rng(3)
    draws = [rng.standard_normal((2, problem.unknowns)) * [[0.01], [1.0]] for _ in range(8)]
    assert checked_tangents(problem, draws, FOURTH) > 3
    assert any(problem.contact_point(v).held is not None for v, _ in draws)
