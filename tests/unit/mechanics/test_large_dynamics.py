"""Dynamics of large deformations: momenta and energy are kept, impacts create none."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import amontons as am
from amontons.mechanics.elements.discrete_gradient import DiscreteBody
from amontons.mechanics.elements.hyperelasticity import HyperelasticBody
from amontons.mechanics.elements.mass import mass

SOFT = am.NeoHookean(100.0, 0.3, density=1.0)
CELLS = [  # kind of cells, integration, law
    ("quad", "full", SOFT), ("quad", "hybrid", am.NeoHookean(1.0, 0.45)),
    ("quad", "hybrid-incompatible", am.MooneyRivlin(0.3, 0.1, 10.0)),
    ("quad", "incompatible", am.SaintVenantKirchhoff(1.0, 0.3)),
    ("tri", "full", am.CiarletGeymonat(1.0, 0.3)), ("hex", "hybrid", am.NeoHookean(1.0, 0.45)),
    ("hex", "hybrid-incompatible", am.Ogden((0.5, 0.1), (1.5, -2.0), 8.0)),
    ("hex", "incompatible", SOFT), ("tet", "full", am.ReducedPolynomial((0.4, 0.1), 2.0)),
]  # fmt: skip


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(("kind", "integration", "law"), CELLS)
def test_forces_between_two_states_keep_energy_and_momenta(kind, integration, law, order):
    if order == 2 and "incompatible" in integration:
        pytest.skip("of first order alone")
    dim = 2 if kind in ("quad", "tri") else 3
    mesh = am.Body(am.box((1.0,) * dim, 2, kind), law, order=order,
                   integration=integration).mesh  # fmt: skip
    rng, x = np.random.default_rng(3), mesh.points
    before = 0.02 * rng.standard_normal(x.shape)
    after = before + 0.02 * rng.standard_normal(x.shape)
    after += x @ rng.uniform(-0.2, 0.2, (dim, dim))
    elastic = HyperelasticBody(mesh, law)
    between = DiscreteBody(mesh, dict.fromkeys(mesh.regions, law)).between
    force, size = between(before, after), law.young + law.lame_lambda()
    gain = elastic.energy(after) - elastic.energy(before)
    assert (force * (after - before)).sum() == pytest.approx(gain, abs=1e-13 * size)
    assert abs(force.sum(axis=0)).max() < 1e-13 * size
    moment = np.einsum("ai,aj->ij", x + (before + after) / 2, force)
    assert abs(moment - moment.T).max() < 1e-13 * size
    np.testing.assert_allclose(between(before, before), elastic.forces(before),
                               atol=1e-13 * size)  # fmt: skip


def momenta(body, state):
    """Momentum and moment of momentum about the origin."""
    X = body.mesh.points
    x = X + state.displacement.reshape(X.shape)
    p = (mass(body.mesh, body.material) @ state.velocity).reshape(X.shape)
    moment = np.einsum("ai,aj->ij", x, p)
    return np.concatenate([p.sum(axis=0), (moment - moment.T).ravel()])


@pytest.mark.parametrize(("size", "law", "steps"), [
    ((1.0, 0.6), SOFT, 120),
    ((1.0, 0.6), am.MooneyRivlin(15.0, 2.0, 400.0, density=1.0), 60),
    ((1.0, 0.6, 0.3), SOFT, 60),
])  # fmt: skip
def test_a_free_block_that_spins_keeps_all(size, law, steps):
    """In steps of a third of a period of its first vibration; the first makes a turn."""
    body = am.Body(am.box(size, 2), law)

    def velocity(x):
        turn = [-3 * x[1] + 0.5, 3 * x[0]]
        return (*turn, 0.5 * x[1]) if len(size) == 3 else tuple(turn)

    model = am.Model([body], [], [])
    start = am.at_rest(model, velocity=velocity)
    wanted, energy = momenta(body, start), None
    for step in am.evolve(model, am.MoreauJean(0.02), until=0.02 * steps, start=start):
        energy = step.energies.total if energy is None else energy
        assert step.energies.total == pytest.approx(energy, rel=1e-10)
        np.testing.assert_allclose(momenta(body, step.state), wanted,
                                   atol=1e-10 * abs(wanted).max())  # fmt: skip
    assert step.state.index == steps
    assert step.energies.elastic > 5e-5 * energy  # it is stretched


def test_steps_are_of_second_order():
    body = am.Body(am.box((1.0, 0.5), (2, 1)), SOFT)
    model = am.Model([body], [am.Fix("left", (0, 0))], [], [am.BodyForce((0.0, -20.0))])
    ends = {}
    for h in (0.02, 0.01, 0.0025):
        *_, step = am.evolve(model, am.MoreauJean(h), until=0.2)
        ends[h] = step.state.displacement
    off = [abs(ends[h] - ends[0.0025]).max() for h in (0.02, 0.01)]
    assert 3.3 < off[0] / off[1] < 4.8
    assert abs(ends[0.0025]).max() > 0.05


def dropped(restitution, mu, law, until=0.6, h=0.005):
    mesh = am.box((1.0, 0.6), (3, 2))
    mesh = replace(mesh, points=mesh.points + [0.0, 0.2])
    body = am.Body(mesh, law)
    model = am.Model([body], [], [am.Contact("bottom", am.Plane((0, 1)), mu=mu)],
                     [am.BodyForce((0.0, -9.81))])  # fmt: skip
    start = am.at_rest(model, velocity=(1.0, -2.0))
    return body, list(am.evolve(model, am.MoreauJean(h, restitution=restitution), until=until,
                                start=start))  # fmt: skip


@pytest.mark.parametrize(("restitution", "mu"), [(0.0, 0.3), (0.5, 0.5), (1.0, 0.0)])
def test_energy_of_a_bouncing_block_never_grows(restitution, mu):
    body, steps = dropped(restitution, mu, SOFT)
    M, X = mass(body.mesh, SOFT), body.mesh.points
    total = []
    for step in steps:
        u = step.state.displacement
        height = (M @ (X.ravel() + u)).reshape(X.shape)[:, 1].sum()
        total.append(step.energies.total + 9.81 * height)
        assert abs(step.energies.defect) < 1e-10 * total[0]
        assert step.energies.contact <= 1e-8 * total[0]
    assert np.diff(total).max() <= 1e-8 * total[0]  # the tolerance of contact solves
    assert sum(len(step.active) > 0 for step in steps) > 10
    if restitution == 1.0:
        assert total[-1] == pytest.approx(total[0], rel=1e-6)
    else:
        assert total[-1] < 0.9 * total[0]


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_stiff_blocks_leave_with_their_restitution(restitution):
    """As a rigid one, whose period is below the step: a column of one cell."""
    law = am.NeoHookean(1e7, 0.0, density=1.0)
    body = am.Body(am.box((1.0, 1.0), 1), law)
    mesh = replace(body.mesh, points=body.mesh.points + [0.0, 0.0995])
    model = am.Model([am.Body(mesh, law)], [], [am.Contact("bottom", am.Plane((0, 1)), mu=0.0)])
    start = am.at_rest(model, velocity=(0.0, -1.0))
    *_, step = am.evolve(model, am.MoreauJean(0.01, restitution=restitution), until=0.2,
                         start=start)  # fmt: skip
    mean = (mass(mesh, law) @ step.state.velocity).reshape(-1, 2).sum(axis=0)[1]
    # the stress that is left gives back 1e-5 of the energy of the impact
    assert -1e-9 <= mean <= np.hypot(restitution, np.sqrt(1e-5))


def test_rods_that_hit_each_other_press_as_a_shock_says():
    """[P] = rho U^2 [F], v = U (1 - F) at a fifth of the speed of sound."""
    c, v, n = np.sqrt(SOFT.young), 2.0, 6
    law = am.NeoHookean(SOFT.young, 0.0, density=1.0)

    def stress(F):  # P of one direction, as Poisson's ratio is 0
        return law.young / 2 * (F - 1 / F)

    F = brentq(lambda F: np.sqrt(stress(F) / (F - 1)) * (1 - F) - v, 0.3, 1 - 1e-9)
    rods = [am.Body(am.box((1.0, 0.1), (cells, rows), origin=(x, 0.0)), law, name=name)
            for name, x, cells, rows in (("a", 0.0, n, 1), ("b", 1.0, n + 3, 2))]  # fmt: skip
    model = am.Model(rods, [], [am.Contact("a.right", master="b.left", mu=0.3)])
    start = am.at_rest(model, velocity=[(v, 0.0), (-v, 0.0)])
    method = am.MoreauJean(0.5 / n / c)
    force = [abs(step.resultant()[0]) for step in
             am.evolve(model, method, until=1.4 / c, start=start)]  # fmt: skip
    late = force[len(force) // 5 :]  # what a mesh makes of a front has settled there
    assert np.mean(late) == pytest.approx(-0.1 * stress(F), rel=5e-3)
    assert -stress(F) > 1.05 * c * v


@pytest.mark.parametrize("prediction", [0.5, 1.0])
def test_an_impact_overlaps_by_no_more_than_is_said(prediction):
    """h (2 - prediction - theta) |u_N|, reached by who is not quite predicted to touch."""
    h = 0.01
    mesh = am.box((1.0, 1.0), 1, origin=(0.0, (2 + prediction + 1e-3) * h))
    model = am.Model([am.Body(mesh, am.NeoHookean(1e9, 0.0, density=1.0))], [],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0.0)])  # fmt: skip
    start = am.at_rest(model, velocity=(0.0, -1.0))
    *_, step = am.evolve(model, am.MoreauJean(h, prediction=prediction), until=4 * h,
                         start=start)  # fmt: skip
    assert step.gap.min() == pytest.approx(-(1.5 - prediction) * h, abs=2e-3 * h)


def test_small_motions_are_those_of_small_strains():
    """A thousandth of the load: both schemes are the same up to squares."""
    found = []
    for law in (SOFT, am.LinearElastic(100.0, 0.3, density=1.0)):
        body = am.Body(am.box((1.0, 0.5), (3, 2)), law)
        floor = am.Contact("bottom", am.Plane((0, 1), (0, -1)), mu=0.2)
        model = am.Model([body], [am.Fix("left", (0, 0))], [floor], [am.BodyForce((0, -0.02))])
        *_, step = am.evolve(model, am.MoreauJean(0.01, mass_damping=0.5), until=0.3)
        found.append(step.state.displacement)
    np.testing.assert_allclose(found[0], found[1], atol=2e-3 * abs(found[1]).max())
    assert abs(found[1]).max() > 1e-5


def test_moving_supports_and_friction_do_their_work():
    """A block is drawn over a floor by its top, which is lifted in the end."""
    law = am.NeoHookean(100.0, 0.45, density=1.0)
    body = am.Body(am.box((1.0, 0.5), (3, 2)), law)
    top = am.Fix("top", lambda x, t: (0.5 * t, -0.02 * min(1.0, 10 * t)))
    model = am.Model([body], [top], [am.Contact("bottom", am.Plane((0, 1)), mu=0.3)])
    work = 0.0
    for step in am.evolve(model, am.MoreauJean(0.01), until=0.4):
        size = step.energies.turnover + step.energies.total
        assert abs(step.energies.defect) < 1e-7 * size
        work += step.energies.contact
    assert work < -1e-3
    assert step.resultant()[1] > 0


@pytest.mark.parametrize(("method", "law", "message"), [
    (am.MoreauJean(0.1, theta=1.0), SOFT, "theta: expected 0.5"),
    (am.MoreauJean(0.1, stiffness_damping=1.0), SOFT, "stiffness_damping: expected 0"),
    (am.MoreauJean(0.1, reach=0.1), SOFT, "reach: expected 0"),
    (am.MoreauJean(0.1), am.NeoHookean(1.0, 0.3), "need its density"),
])  # fmt: skip
def test_what_these_dynamics_do_not_have(method, law, message):
    model = am.Model([am.Body(am.box((1, 1), 1), law)], [],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0.2)])  # fmt: skip
    with pytest.raises(am.AmontonsError, match=message):
        am.evolve(model, method, until=1.0)


def test_a_step_that_is_too_long_says_so():
    body = am.Body(am.box((1.0, 1.0), 2), am.NeoHookean(1.0, 0.3, density=1.0))
    model = am.Model([body], [], [])
    start = am.at_rest(model, velocity=lambda x: (0.0, -10 * x[1]))
    with pytest.raises(am.NotConverged, match="step 1: no state at its end is found"):
        list(am.evolve(model, am.MoreauJean(1.0), until=1.0, start=start))


FORCES = [{"tresca": 0.3}, {"mu": 0.5, "cap": 0.3}, {"mu": 0.3, "stiffness": 1e3},
          {"mu": 0.3, "cohesion": 0.2}, {"mu": 0.3, "stick_stiffness": 100.0}]  # fmt: skip


@pytest.mark.parametrize("law", FORCES)
def test_laws_of_stresses_are_those_of_small_strains(law):
    """A stiff block that slides under its weight: bounds, tensions and springs of impulses."""
    found = []
    for material in (am.LinearElastic(1e4, 0.0, density=1.0), am.NeoHookean(1e4, 0.0, 1.0)):
        body = am.Body(am.box((1, 0.1), (4, 1)), material)
        contact = am.Contact("bottom", am.Plane((0, 1)), **law)
        model = am.Model([body], [], [contact], [am.BodyForce((0, -10.0))])
        start = am.at_rest(model, velocity=(1.0, 0.0))
        *_, step = am.evolve(model, am.MoreauJean(2e-3), until=0.05, start=start)
        found.append([step.v[0][:, 0].mean(), step.energies.total, step.state.path.mean()])
        assert abs(step.energies.defect) < 1e-12
        assert step.energies.contact <= 0
    np.testing.assert_allclose(*found, rtol=2e-3)
    if "tresca" in law:  # 0.3 per area on a mass of 0.1
        assert found[1][0] == pytest.approx(1 - 3 * 0.05, abs=1e-9)


def test_stresses_of_laws_act_on_areas_of_now(tmp_path):
    """A slab on springs and a cap, made twice as long, then moved: books close, it restarts."""
    K, deep, cap = 2.0, 1e-2, 1e-3
    slab = am.Body(am.box((2, 1), (2, 1)), am.NeoHookean(1e4, 0.0, density=1e-5))

    def moved(x, t):
        return x[0] * min(t, 1.0) + 0.1 * max(t - 1.0, 0.0)

    held = [am.Fix(side, (moved, None)) for side in ("left", "right")]
    held += [am.Fix("top", (None, 0))]
    contact = am.Contact("bottom", am.Plane((0, 1), (0, deep)), mu=0.9, cap=cap, stiffness=K)
    model, method = am.Model([slab], held, [contact]), am.MoreauJean(0.1, mass_damping=10.0)
    steps = list(am.evolve(model, method, until=1.6))
    last, fields = steps[-1], steps[-1].fields
    np.testing.assert_allclose(fields.pressure, K * deep, rtol=2e-4)
    assert last.resultant()[1] == pytest.approx(4 * K * deep, rel=2e-4)
    assert abs(fields.shear[1, 0]) == pytest.approx(cap, rel=1e-9)
    assert all(abs(step.energies.defect) < 1e-13 * step.energies.total for step in steps)
    brought = -sum(step.energies.numerical for step in steps)
    grown = 4 - 2 * steps[0].state.growth[0]  # since it stands on its springs
    assert brought == pytest.approx(0.5 * K * deep**2 * grown, rel=2e-3)
    am.save_state(tmp_path / "half.h5", steps[7].state)
    *_, again = am.evolve(model, method, until=1.6, start=am.load_state(tmp_path / "half.h5"))
    np.testing.assert_array_equal(again.state.force, last.state.force)


def all_momenta(model, step):
    """Momentum and moment of momentum of all bodies."""
    both = zip(model.bodies, step.displacement, step.v, strict=True)
    return sum(
        momenta(body, replace(step.state, displacement=u.ravel(), velocity=v.ravel()))
        for body, u, v in both
    )


def round_end(cells, d, name, law, sign, **options):
    """A block with a round end that touches the origin from above or below."""
    mesh = am.box((1.0,) * d, cells)
    x = mesh.points - np.append([0.5] * (d - 1), 0.0)
    x[:, -1] += 0.3 * (x[:, :-1] ** 2).sum(axis=1) * (1 - x[:, -1])
    turn = np.ones(d)
    turn[[0, -1]] = sign
    return am.Body(replace(mesh, points=x * turn), law, name=name, **options)


@pytest.mark.parametrize(("d", "law"), [
    (2, SOFT), (2, am.LinearElastic(50.0, 0.3, density=1.0)), (3, SOFT)])  # fmt: skip
def test_blocks_that_turn_and_hit_each_other_keep_all_momenta(d, law):
    """Off their centres and with friction, though sides leave gaps where they act."""
    turns = {} if law is SOFT else {"corotational": True}
    upper, lower = (round_end(5 - d - (sign > 0), d, name, law, sign, **turns)
                    for name, sign in (("upper", 1), ("lower", -1)))  # fmt: skip
    model = am.Model([upper, lower], [],
                     [am.Contact("upper.bottom", master="lower.bottom", mu=0.3)])  # fmt: skip

    def velocity(x):
        side = np.sign(x[-1])
        return (0.4 * side - 0.8 * x[-1], *[0.0] * (d - 2), 0.8 * x[0] - 0.6 * side)

    start = am.at_rest(model, velocity=velocity)
    steps = list(am.evolve(model, am.MoreauJean(2e-2), until=0.4, start=start))
    assert sum(abs(step.state.force).max() > 0.1 for step in steps) > 5
    first = all_momenta(model, steps[0])
    for step in steps[1:]:
        np.testing.assert_allclose(all_momenta(model, step), first, atol=1e-10)
        assert abs(step.energies.defect) < 1e-10 * step.energies.total


@pytest.mark.parametrize("law", [SOFT, am.LinearElastic(1e3, 0.3, density=1.0)])
def test_glued_bodies_spin_and_keep_energy_and_momenta(law):
    """Meshes that do not match: the tie stays closed, and its impulses do no work."""
    turns = {"corotational": True} if law is not SOFT else {}
    lower = am.Body(am.box((1, 0.5), (4, 2)), law, name="lower", **turns)
    upper = am.Body(am.box((1, 0.5), (3, 2), origin=(0, 0.5)), law, name="upper", **turns)
    model = am.Model([lower, upper], [],
                     [am.Contact("upper.bottom", master="lower.top", tied=True)])  # fmt: skip
    start = am.at_rest(model, velocity=lambda x: (-3 * x[1], 3 * x[0] + 0.2))
    steps = list(am.evolve(model, am.MoreauJean(5e-3), until=0.1, start=start, tolerance=1e-11))

    ends = [np.append(all_momenta(model, s), s.energies.total) for s in (steps[-1], steps[0])]
    np.testing.assert_allclose(*ends, atol=1e-10)
    assert max(abs(step.gap).max() for step in steps) < 1e-11
    assert abs(steps[-1].state.force).max() > 1e-2


def test_a_glued_mesh_moves_as_one_that_is_whole():
    """Matching meshes: the same motion; an elastic bond that is stiff comes near to it."""
    def ends(bodies, contacts):
        model = am.Model(bodies, [], contacts)
        start = am.at_rest(model, velocity=lambda x: (x[1] ** 2, 2 * x[0] ** 2))
        *_, step = am.evolve(model, am.MoreauJean(1e-2), until=0.1, start=start)
        return step.displacement[-1][-1]

    whole = ends([am.Body(am.box((1, 1), 4), SOFT)], [])
    halves = [am.Body(am.box((1, 0.5), (4, 2), origin=(0, y)), SOFT, name=name)
              for y, name in ((0, "lower"), (0.5, "upper"))]  # fmt: skip
    for bond, near in (({}, 1e-7), ({"stiffness": 1e6, "stick_stiffness": 1e6}, 1e-3)):
        glue = am.Contact("upper.bottom", master="lower.top", tied=True, **bond)
        np.testing.assert_allclose(ends(halves, [glue]), whole, atol=near)


def test_a_plate_drifts_to_the_easier_direction_of_orthotropic_friction():
    """m v' = -m g D^2 v / |D v|, D the coefficients along and across: integrated beside it."""
    from scipy.integrate import solve_ivp

    squares, weight, end = np.array([0.04, 0.25]), 10.0, 0.04
    plate = am.Body(am.box((1, 1, 0.1), (1, 1, 1)), am.NeoHookean(1e4, 0.0, density=1.0))
    floor = am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.2, mu_across=0.5,
                       direction=(1, 0, 0))  # fmt: skip
    model = am.Model([plate], [], [floor], [am.BodyForce((0, 0, -weight))])
    start = am.at_rest(model, velocity=(1.0, 1.0, 0.0))
    *_, step = am.evolve(model, am.MoreauJean(4e-3), until=end, start=start)
    way = solve_ivp(lambda t, v: -weight * squares * v / np.sqrt(squares @ v**2), (0, end),
                    [1.0, 1.0], rtol=1e-10)  # fmt: skip
    np.testing.assert_allclose(step.v[0][:, :2].mean(axis=0), way.y[:, -1], rtol=5e-3)
    assert step.energies.contact < 0
