"""Where the work of a step goes: loads by their means, impacts with their restitution."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import amontons as am
from amontons.mechanics.steps import MoreauJean, QuasiStatic, at_rest, evolve
from amontons.mechanics.steps.energy import Forces, slow_energies

SOFT = am.LinearElastic(100.0, 0.2)
FLOOR = am.Plane((0, 1))


def total(steps, name):
    return sum(getattr(step.energies, name) for step in steps)


def pressed(loads, supports=(), mu=0.0, material=SOFT):
    body = am.Body(am.box((2, 1), (4, 2)), material)
    held = [am.Fix("left", (0, None)), *supports]
    return am.Model([body], held, [am.Contact("bottom", FLOOR, mu=mu)], loads)


# ------------------------------------------------------------------ quasi-static
@pytest.mark.parametrize("loads", [
    [am.Traction("top", (0, -3.0))],
    [am.Traction("top", (0, lambda x, t: -3 * t)), am.BodyForce((0, lambda x, t: -t))],
    [am.Traction("top", (0, lambda x, t: -3 * t)), am.BodyForce((0, -1.0))],
    [am.Traction("top", (0, lambda x, t: -3 * np.sin(2 * t))), am.BodyForce((0, -1.0))],
], ids=["grows", "timed", "at once", "there and back"])  # fmt: skip
@pytest.mark.parametrize("step", [1.0, 0.125])
def test_without_friction_nothing_is_lost(loads, step):
    """The work of the loads is stored, whatever the number of steps."""
    steps = list(evolve(pressed(loads), QuasiStatic(step), until=1, tolerance=1e-12))
    size = sum(s.energies.turnover for s in steps)
    last = steps[-1]
    assert abs(total(steps, "numerical")) <= 1e-10 * size
    assert abs(total(steps, "contact")) <= 1e-10 * size
    assert abs(total(steps, "defect")) <= 1e-10 * size
    assert total(steps, "loads") == pytest.approx(last.energies.elastic, rel=1e-9)
    force = last.problem.f @ last.solution.v  # of the free dofs: twice what is stored
    assert last.energies.elastic == pytest.approx(force / 2, rel=1e-9)


def test_supports_are_booked_by_their_mean_too():
    way = am.Fix("top", (None, lambda x, t: -0.02 * t))
    steps = list(evolve(pressed([], [way]), QuasiStatic(0.25), until=1, tolerance=1e-12))
    last = steps[-1].energies
    assert total(steps, "supports") == pytest.approx(last.elastic, rel=1e-9)
    assert abs(total(steps, "numerical")) <= 1e-10 * last.elastic


def test_proportional_slip_is_booked_exactly():
    """Pressed and sheared in proportion, it slides from the first: one step or many."""
    loads = [am.Traction("top", (lambda x, t: 2.0 * t, lambda x, t: -3 * t))]
    works = []
    for step in (1.0, 0.1):
        model = pressed(loads, mu=0.2)
        steps = list(evolve(model, QuasiStatic(step), until=1, tolerance=1e-11))
        works.append([total(steps, name) for name in ("loads", "contact", "numerical")])
        assert works[-1][1] < 0
    np.testing.assert_allclose(works[0], works[1], rtol=1e-6, atol=1e-9 * works[0][0])


def slid(ways):
    """A block pushed at its top under a constant weight."""
    xs = np.array([0.0, *ways])
    top = am.Fix("top", (lambda x, t: np.interp(t, range(len(xs)), xs), -0.05))
    return am.Model([am.Body(am.box((2, 1), (4, 2)), SOFT)], [top],
                    [am.Contact("bottom", FLOOR, mu=0.1)])  # fmt: skip


def test_steady_sliding_dissipates_its_friction():
    first, second, third = evolve(slid([0.0, 0.5, 1.0]), QuasiStatic(1.0), until=3)
    assert abs(first.energies.contact) < 0.02 * abs(second.energies.contact)
    e, weight = third.energies, third.resultant()[1]
    assert e.contact == pytest.approx(-0.1 * weight * 0.5, rel=1e-6)
    assert e.supports == pytest.approx(0.1 * weight * 0.5, rel=1e-6)
    assert abs(e.numerical) < 1e-9 * e.supports


def test_a_turn_within_a_step_is_told_by_its_sign():
    """The mean of forces forth and back is none: what it misses is negative, and shrinks."""
    missed = []
    for step in (1.0, 0.25, 0.0625):
        steps = list(evolve(slid([0.5, 0.0]), QuasiStatic(step), until=2, tolerance=1e-11))
        assert all(s.energies.contact <= 1e-8 for s in steps)
        assert all(abs(s.energies.defect) <= 1e-9 * s.energies.elastic for s in steps)
        missed.append(total(steps, "numerical"))
    assert missed[0] < 0
    assert abs(missed[2]) < 0.25 * abs(missed[0])


def test_finite_strains_miss_third_order():
    law = am.NeoHookean(100.0, 0.3)
    missed = []
    for step in (0.5, 0.25):
        way = am.Fix("top", (None, lambda x, t: -0.3 * t))
        steps = list(evolve(pressed([], [way], material=law), QuasiStatic(step), until=1,
                            tolerance=1e-11))  # fmt: skip
        stored = steps[-1].energies.elastic
        assert total(steps, "supports") - total(steps, "numerical") == pytest.approx(stored)
        missed.append(abs(total(steps, "numerical")) / stored)
    assert missed[0] < 0.05
    assert missed[1] < 0.3 * missed[0]


def test_the_balance_of_one_spring_by_hand():
    """K = 2; from q = 1 under load 2 and no contact to q = 2 pushed by 1 beside a load of 3."""
    one = np.ones(1)
    before = Forces(2 * one, 2 * one, 0 * one, 1.0)
    after = Forces(4 * one, 3 * one, 1 * one, 4.0)
    e = slow_energies(before, after, one, np.array([], dtype=int), friction=0.0)
    assert (e.gain, e.loads, e.supports) == (3.0, 2.5, 0.0)
    assert (e.contact, e.numerical) == (0.0, -0.5)
    assert e.defect == 0


# ------------------------------------------------------------------ restitution
def stiff_block(gravity=9.81, mu=0.0):
    body = am.Body(
        am.box((0.1, 0.1), 1, origin=(0, 0.05)), am.LinearElastic(1e13, 0.2, density=1e3)
    )
    return am.Model([body], [], [am.Contact("bottom", FLOOR, mu=mu)],
                    [am.BodyForce((0, -1e3 * gravity))])  # fmt: skip


@pytest.mark.parametrize("theta", [0.5, 0.6, 0.75, 1.0])
@pytest.mark.parametrize("e", [0.0, 0.3, 0.8, 0.95])
def test_a_stiff_block_rebounds_with_its_restitution(theta, e):
    method = MoreauJean(1e-3, theta=theta, restitution=e)
    steps = list(evolve(stiff_block(), method, until=0.15))
    v = [s.state.velocity[1::2].mean() for s in steps]
    i = int(np.argmin(v))
    assert v[i] < -0.9
    assert v[i + 1] / -v[i] == pytest.approx(e, abs=1e-4)
    impact = steps[i + 1].energies
    lost = (1 - e**2) * 10 * v[i] ** 2 / 2
    assert impact.contact == pytest.approx(-lost, abs=0.03 * 5 * v[i] ** 2)
    assert all(s.energies.contact <= 1e-8 * (s.energies.turnover + 1) for s in steps)
    assert all(s.energies.numerical >= 0 for s in steps)


def test_full_restitution_is_cut_by_what_the_step_would_create_only():
    """Leaving at once for a whole implicit step lifts the block by h v: of order h g / v."""
    steps = list(
        evolve(stiff_block(), MoreauJean(1e-3, theta=1.0, restitution=1.0), until=0.15)
    )
    v = [s.state.velocity[1::2].mean() for s in steps]
    i = int(np.argmin(v))
    assert 1 - 3 * 1e-3 * 9.81 / -v[i] < v[i + 1] / -v[i] < 1


@settings(max_examples=25, deadline=None)
@given(
    theta=st.floats(0.5, 1.0), restitution=st.floats(0.0, 1.0), mu=st.floats(0.0, 1.0),
    young=st.sampled_from([1e3, 1e5, 1e8]), velocity=st.tuples(*[st.floats(-3.0, 3.0)] * 2),
    spin=st.floats(-3.0, 3.0), gravity=st.sampled_from([0.0, 10.0]), step=st.floats(5e-4, 5e-3),
)  # fmt: skip
def test_closed_systems_never_gain_energy(  # noqa: PLR0913
    theta, restitution, mu, young, velocity, spin, gravity, step
):
    """Kinetic + elastic + that of the weight, in every step; nor do contacts by themselves."""
    body = am.Body(
        am.box((1, 1), 2, origin=(0, 0.01)), am.LinearElastic(young, 0.3, density=2.0)
    )
    model = am.Model([body], [], [am.Contact("bottom", FLOOR, mu=mu)],
                     [am.BodyForce((0, -2.0 * gravity))])  # fmt: skip
    start = at_rest(model, velocity=lambda x: (velocity[0] + spin * x[1],
                                               velocity[1] - spin * (x[0] - 0.5)))  # fmt: skip
    method = MoreauJean(step, theta=theta, restitution=restitution)
    steps = evolve(model, method, until=20 * step, start=start, tolerance=1e-10)
    for e in (s.energies for s in steps):
        size = e.total + abs(e.loads) + 1e-6
        assert e.gain - e.loads <= 1e-7 * size
        assert e.contact <= 1e-7 * size
        assert e.numerical >= 0
