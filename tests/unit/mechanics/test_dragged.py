"""Friction along components that supports hold, with finite kinematics."""

import numpy as np
import pytest
from tangent_checker import FOURTH, checked_tangents

import amontons as am
from amontons.mechanics.model.large_deformation import large_deformation

LAW = am.LinearElastic(1000.0, 0.3)
N = 0.5  # of the load, on a width of 1


def held_block(motion, *, kinematics="finite", on="plane", material=LAW, **law):
    """A block whose underside supports move along x on a plane or a slab, under a load."""
    block = am.Body(am.box((1, 1), (4, 3)), material, name="up")
    held, load = am.Fix("up.bottom", (motion, None)), am.Traction("up.top", (0, -N))
    law["kinematics"] = kinematics
    if on == "plane":
        contact = am.Contact("up.bottom", am.Plane((0, 1)), **law)
        return am.Model([block], [held], [contact], [load])
    slab = am.Body(am.box((3, 1), (9, 2), origin=(-1, -1)), material, name="low")
    contact = am.Contact("up.bottom", master="low.top", **law)
    return am.Model([slab, block], [am.Fix("low.bottom", 0), held], [contact], [load])


@pytest.mark.parametrize(("law", "friction"), [
    ({"mu": 0.3}, 0.3 * N),
    ({"tresca": 0.1}, 0.1),
    ({"mu": 0.3, "cap": 0.08}, 0.08),
    ({"mu": 0.3, "cohesion": 0.2}, 0.3 * (N + 0.2)),
    ({"mu": 0.3, "stick_stiffness": 10.0}, 0.3 * N),
    ({"mu": 0.3, "stick_stiffness": 1.0}, 0.05),
], ids=["Coulomb", "Tresca", "cap", "cohesion", "slip of springs", "springs"])  # fmt: skip
@pytest.mark.parametrize("on", ["plane", "slab"])
def test_a_held_underside_bears_all_of_its_friction(on, law, friction):
    """Nodes of the underside stay apart as they were, so that areas are known, too."""
    solution = am.solve(held_block(0.05, on=on, **law), tolerance=1e-9)
    assert not solution.warnings
    exact = 1e-9 if on == "plane" else 1e-2 if "stick_stiffness" in law else 1e-3
    np.testing.assert_allclose(solution.resultant, [-friction, N], rtol=exact)
    np.testing.assert_allclose(solution.supports["up.bottom"].force, [friction, 0], rtol=exact,
                               atol=1e-9)  # fmt: skip
    if on == "slab":
        np.testing.assert_allclose(solution.supports["low.bottom"].force,
                                   solution.resultant, rtol=1e-7)  # fmt: skip


@pytest.mark.parametrize("far", [1e-5, 1e-4])
def test_what_sticks_to_a_held_underside_is_that_of_small_kinematics(far):
    small, finite = (am.solve(held_block(far, on="slab", mu=0.3, kinematics=kinematics))
                     for kinematics in ("small", "finite"))  # fmt: skip
    assert finite.converged
    np.testing.assert_allclose(finite.resultant, small.resultant, rtol=2e-4)
    assert abs(finite.resultant[0]) < 0.2 * N


@pytest.mark.parametrize("material", [am.LinearElastic(1000.0, 0.4999),
                                      am.NeoHookean(10.0, 0.4999)])  # fmt: skip
@pytest.mark.parametrize("far", [1e-4, 3e-3])
def test_nearly_incompressible_bodies_find_which_way_they_slip(material, far):
    """The slab spreads under the block: slip to both sides, stick between."""
    solution = am.solve(held_block(far, on="slab", material=material, mu=0.3))
    assert solution.convergence.iterations <= 15
    assert not solution.warnings
    assert 0 < -solution.resultant[0] <= 0.3 * N * (1 + 1e-6)
    np.testing.assert_allclose(solution.supports["up.bottom"].force[0], -solution.resultant[0],
                               rtol=1e-6)  # fmt: skip


@pytest.mark.parametrize(("on", "law"), [
    ("plane", {"mu": 0.3}), ("plane", {"mu": 0.3, "stick_stiffness": 10.0}),
    ("slab", {"mu": 0.3}),
])  # fmt: skip
def test_steps_to_and_fro_and_a_restart_are_those_of_small_kinematics(on, law):
    """Friction turns with the motion, and stays where nothing moves (1 to 1.5)."""

    def motion(x, t):
        return 0.05 * min(t, 1) - 0.05 * max(t - 1.5, 0), None

    found = []
    for kinematics in ("small", "finite"):
        of = held_block(0, on=on, kinematics=kinematics, **law)
        supports = [*of.supports[:-1], am.Fix("up.bottom", motion)]
        model = am.Model(of.bodies, supports, of.contacts, of.loads)
        steps = list(am.evolve(model, am.QuasiStatic(0.25), until=2.0, tolerance=1e-10))
        found.append([(*s.resultant(), s.state.slip.sum()) for s in steps])
        assert max(abs(s.energies.defect) for s in steps) < 1e-12
        again = am.evolve(model, am.QuasiStatic(0.25), until=2.0, start=steps[4].state)
        np.testing.assert_allclose([s.resultant() for s in again],
                                   [s.resultant() for s in steps[5:]], rtol=1e-6)  # fmt: skip
    np.testing.assert_allclose(found[1], found[0], atol=1e-6 if on == "plane" else 2e-3)
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
@pytest.mark.parametrize("obstacle", [am.Sphere((0.5, 0.5, -3), 3), None])
def test_tangents_are_exact(law, obstacle):
    block = am.Body(am.box((1, 1, 0.5), (2, 2, 1)), am.NeoHookean(10.0, 0.3), name="up")
    held = [am.Fix("up.left", (0.02, None, None)), am.Fix("up.top", (None, None, -0.01))]
    bodies, contact = [block], am.Contact("up.bottom", obstacle, **law) if obstacle else None
    if contact is None:
        mesh = am.box((2, 2, 0.5), (3, 3, 1), origin=(-0.5, -0.5, -0.5))
        bodies = [am.Body(mesh, am.NeoHookean(3.0, 0.3), name="low"), block]
        held.append(am.Fix("low.bottom", 0))
        contact = am.Contact("up.bottom", master="low.top", **law)
    problem = large_deformation(am.Model(bodies, held, [contact]))
    rng = np.random.default_rng(3)
    draws = [rng.standard_normal((2, problem.unknowns)) * [[0.005], [1.0]] for _ in range(6)]
    assert checked_tangents(problem, draws, FOURTH) > 3
    assert any(problem.contact_point(v).held is not None for v, _ in draws)
