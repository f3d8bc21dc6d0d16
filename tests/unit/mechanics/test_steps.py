"""Evolution: exact motions, energy balance, impacts, friction, time-dependent data, restart."""

import numpy as np
import pytest

import amontons as am
from amontons.core.expressions import Expression
from amontons.mechanics.elements.mass import lumped, mass
from amontons.mechanics.steps import MoreauJean, QuasiStatic, at_rest, evolve
from amontons.mechanics.steps.timed import at_time, is_timed

RUBBER = am.LinearElastic(young=1e4, poisson=0.3, density=2.0)
GRAVITY = 10.0


def thrown(height=0.5, mu=0.3, dim=2, cells=3, load=None):
    """A free block above the floor, under its own weight."""
    up = (0,) * (dim - 1) + (1,)
    mesh = am.box((1,) * dim, cells, origin=tuple(height * k for k in up))
    force = tuple(-2.0 * GRAVITY * k for k in up)
    return am.Model([am.Body(mesh, RUBBER)], [], [am.Contact("bottom", am.Plane(up), mu=mu)],
                    loads=[am.BodyForce(force), *(load or [])])  # fmt: skip


def work(steps):
    """Sum of every work over several steps."""
    names = ("gain", "loads", "supports", "contact", "damping", "numerical")
    return {name: sum(getattr(s.energies, name) for s in steps) for name in names}


def check_balance(steps, tolerance=1e-6):
    for step in steps:
        e = step.energies
        assert abs(e.defect) <= tolerance * max(e.turnover, 1e-3 * e.total)
        assert e.contact <= 1e-8 * (e.total + abs(e.loads) + abs(e.supports))
        assert e.numerical >= 0
        assert e.damping >= 0


# ------------------------------------------------------------------ mass
@pytest.mark.parametrize(("dim", "kind"), [(2, "quad"), (2, "tri"), (3, "hex"), (3, "tet")])
def test_mass_is_density_times_volume_and_moment_of_inertia(dim, kind):
    mesh = am.box((2, 3, 1)[:dim], (2, 3, 2)[:dim], kind)
    M = mass(mesh, RUBBER)
    along = np.tile(np.eye(dim)[0], len(mesh.points))
    assert along @ M @ along == pytest.approx(2 * 6)
    x = np.outer(mesh.points[:, 1], np.eye(dim)[0]).ravel()
    assert x @ M @ x == pytest.approx(2 * 2 * 3**3 / 3)  # exact: linear fields squared
    assert abs(M - M.T).max() < 1e-15
    np.testing.assert_allclose(lumped(M).sum(), M.sum())


def test_dynamics_need_a_density():
    body = am.Body(am.box((1, 1), 1), am.LinearElastic(1, 0.3))
    model = am.Model([body], [], [am.Contact("bottom", am.Plane((0, 1)), mu=0)])
    with pytest.raises(am.InvalidInput, match="need its density"):
        next(evolve(model, MoreauJean(step=1), until=1))
    with pytest.raises(am.InvalidInput, match="density: expected"):
        am.LinearElastic(1, 0.3, density=0)


# ------------------------------------------------------------------ free motion
def test_free_flight_is_a_parabola():
    model = thrown(height=10)
    start = at_rest(model, velocity=(3, 1))
    steps = list(evolve(model, MoreauJean(step=0.01), until=1, start=start))
    assert len(steps) == 100
    last = steps[-1]
    assert last.time == pytest.approx(1)
    np.testing.assert_allclose(last.displacement[0], [[3, 1 - GRAVITY / 2]] * 16, atol=1e-9)
    np.testing.assert_allclose(last.v[0], [[3, 1 - GRAVITY]] * 16, atol=1e-9)
    assert last.problem.contacts == 0
    assert (last.status == 0).all()
    assert last.gap == pytest.approx(10 + 1 - 5)


def test_theta_one_half_keeps_the_energy_of_a_vibration():
    mesh = am.box((1, 1), 3, origin=(0, 5))
    model = am.Model([am.Body(mesh, RUBBER)], [am.Fix("left", 0)],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0)])  # fmt: skip
    start = at_rest(model, velocity=lambda x: (0.1 * x[0], 0.3 * x[0] ** 2))
    steps = list(evolve(model, MoreauJean(step=1e-3), until=0.2, start=start))
    first = steps[0].energies
    np.testing.assert_allclose([s.energies.total for s in steps], first.total, rtol=1e-9)
    damped = list(evolve(model, MoreauJean(step=1e-3, theta=0.7), until=0.2, start=start))
    check_balance(damped, 1e-9)
    assert damped[-1].energies.total < 0.9 * first.total
    rayleigh = MoreauJean(step=1e-3, mass_damping=1.0, stiffness_damping=1e-4)
    steps = list(evolve(model, rayleigh, until=0.2, start=start))
    check_balance(steps, 1e-9)
    assert all(s.energies.damping > 0 for s in steps)


# ------------------------------------------------------------------ contact
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("theta", [0.5, 0.7, 1.0])
def test_a_thrown_block_balances_its_energy(theta, restitution):
    model = thrown(height=0.1)
    method = MoreauJean(step=2e-3, theta=theta, restitution=restitution)
    start = at_rest(model, velocity=(1, -1))
    steps = list(evolve(model, method, until=0.5, start=start, tolerance=1e-9))
    check_balance(steps)
    total = work(steps)
    assert total["contact"] < 0
    assert any(s.problem.contacts for s in steps)
    assert min(s.gap.min() for s in steps) > -2 * 2e-3 * np.hypot(1, 2)  # of one impact


def test_without_the_second_law_contact_creates_energy(monkeypatch):
    """The law on u1 alone, as printed in the books, does: this is why steps are repeated."""
    from amontons.mechanics.steps import moreau_jean

    model = thrown(height=0.0, mu=0.5, cells=4)
    start = at_rest(model, velocity=(2, 0))
    method = MoreauJean(step=5e-3)

    def worst():
        steps = evolve(model, method, until=0.5, start=start, tolerance=1e-10)
        return max(s.energies.contact / (s.energies.total + 1e-3) for s in steps)

    assert worst() < 1e-8
    monkeypatch.setattr(moreau_jean, "CREATED", np.inf)
    assert worst() > 1e-6


def test_a_block_slides_to_a_stop_as_coulomb_says():
    """Stopping distance v^2 / (2 mu g), for a stiff block that does not bounce."""
    mu, speed = 0.4, 2.0
    model = thrown(height=0.0, mu=mu)
    method = MoreauJean(step=2e-3, theta=1.0)
    steps = list(evolve(model, method, until=0.8, start=at_rest(model, velocity=(speed, 0))))
    check_balance(steps)
    distance = steps[-1].displacement[0][:, 0].mean()
    assert distance == pytest.approx(speed**2 / (2 * mu * GRAVITY), rel=0.05)
    assert abs(steps[-1].v[0]).max() < 0.05 * speed
    weight = steps[-1].state.force[:, 0].sum()
    assert weight == pytest.approx(2 * GRAVITY, rel=1e-2)


def test_a_block_on_a_block_moves_as_one():
    """Two loose blocks in contact: dynamics needs no support at all."""
    low = am.Body(am.box((1, 1), 2), RUBBER, name="low")
    high = am.Body(am.box((1, 1), 2, origin=(0, 1)), RUBBER, name="high")
    model = am.Model(
        [low, high], [],
        [am.Contact("low.bottom", am.Plane((0, 1)), mu=0),
         am.Contact("high.bottom", master="low.top", mu=0.5)],
        loads=[am.BodyForce((0, -20)), am.Traction("low.left", (2, 0))],
    )  # fmt: skip
    steps = list(evolve(model, MoreauJean(step=5e-3, theta=1), until=0.3))
    check_balance(steps)
    last = steps[-1].v
    momentum = sum((mass(b.mesh, RUBBER) @ v.ravel())[::2].sum() for b, v in zip(
        model.bodies, last, strict=True))  # fmt: skip
    assert momentum == pytest.approx(2 * 0.3, rel=1e-6)  # the force times the time
    np.testing.assert_allclose([v[:, 0].mean() for v in last], 0.15, rtol=0.1)
    assert work(steps)["contact"] <= 1e-8


def test_tresca_bounds_are_forces_not_impulses():
    model = thrown(height=0.0)
    model = am.Model(model.bodies, [], [am.Contact("bottom", am.Plane((0, 1)), tresca=3.0)],
                     model.loads)  # fmt: skip
    start = at_rest(model, velocity=(50, 0))
    step = next(evolve(model, MoreauJean(step=1e-5, theta=1), until=1, start=start))
    weights = model.discretisation.placed[0].rows.weights
    np.testing.assert_allclose(abs(step.state.force[:, 1]), 3 * weights, rtol=1e-6)


# ------------------------------------------------------------------ data in time
def test_values_in_time():
    assert is_timed(Expression("2*t"))
    assert not is_timed(Expression("2*x"))
    assert is_timed([0, Expression("t")])
    assert is_timed(lambda x, t: 0)
    assert not is_timed(lambda x, scale=1: 0)
    assert not is_timed(np.sin)
    assert at_time(Expression("2*t"), 3.0)(np.zeros(2)) == 6
    assert at_time(lambda x, t: x[0] + t, 2.0)(np.ones(2)) == 3
    assert at_time([1, None], 2.0) == [1, None]


@pytest.mark.parametrize("value", [(Expression("0.2*t"), 0), lambda x, t: (0.2 * t, 0)],
                         ids=["expression", "function"])  # fmt: skip
def test_a_support_that_moves_takes_the_body_along(value):
    mesh = am.box((1, 1), 2)
    model = am.Model([am.Body(mesh, RUBBER)], [am.Fix("top", value)],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0)])  # fmt: skip
    steps = list(evolve(model, MoreauJean(step=1e-2, theta=1), until=1))
    check_balance(steps)
    top = mesh.surface_nodes("top")
    np.testing.assert_allclose(steps[-1].displacement[0][top], [[0.2, 0]] * 3, atol=2e-3)
    assert steps[-1].v[0][:, 0].mean() == pytest.approx(0.2, rel=1e-3)
    kinetic = 0.5 * 2 * 0.2**2
    assert steps[-1].energies.kinetic == pytest.approx(kinetic, rel=1e-2)
    # a sudden start takes twice the kinetic energy; implicit Euler loses the other half
    assert work(steps)["supports"] == pytest.approx(2 * kinetic, rel=1e-2)


def test_a_load_that_grows():
    model = thrown(height=100, load=[am.Traction("left", (lambda x, t: 6 * t, 0))])
    last = list(evolve(model, MoreauJean(step=1e-2), until=1))[-1]
    assert last.v[0][:, 0].mean() == pytest.approx(3 / 2, rel=1e-5)  # impulse over mass


# ------------------------------------------------------------------ quasi-static
def sheared(value):
    """A held block pressed on the floor and sheared."""
    body = am.Body(am.box((2, 1), (6, 3)), am.LinearElastic(100, 0.2))
    return am.Model([body], [am.Fix("top", value)],
                    [am.Contact("bottom", am.Plane((0, 1)), mu=0.4)])  # fmt: skip


def test_proportional_steps_end_where_one_step_ends():
    """Under a load that grows in proportion, from zero gaps, the steps agree with one."""
    model = sheared((0.002, -0.02))
    steps = list(evolve(model, QuasiStatic(step=0.25), until=1, tolerance=1e-11))
    assert [s.time for s in steps] == [0.25, 0.5, 0.75, 1.0]
    once = am.solve(model, tolerance=1e-11)
    np.testing.assert_allclose(steps[-1].solution.r, once.r, atol=1e-7 * abs(once.r).max())
    np.testing.assert_allclose(steps[-1].displacement[0], once.displacement[0], atol=1e-9)
    check_balance(steps)


def test_friction_remembers_its_way():
    """Shear forth and back: hysteresis, dissipation, and sticking at every turn."""

    def forth_and_back(x, t):
        return (0.05 * np.interp(t, [0, 0.2, 1, 2], [0, 0, 1, 0]), -0.02 * min(1, 5 * t))

    model = sheared(forth_and_back)
    steps = list(evolve(model, QuasiStatic(step=0.1), until=2, tolerance=1e-10))
    check_balance(steps)
    forces = np.array([s.state.force.sum(axis=0) for s in steps])
    assert forces[9, 1] < 0 < forces[19, 1]  # the same shear, the other force
    slips = np.array([s.solution.counts["slip"] for s in steps])
    assert slips[9] == 7
    assert slips[10] < 7
    assert work(steps)["contact"] < 0


# ------------------------------------------------------------------ restart and refusal
def test_an_evolution_goes_on_from_any_state():
    model = thrown(height=0.0, mu=0.5)
    method = MoreauJean(step=2e-3)
    start = at_rest(model, velocity=(1, 0))
    whole = list(evolve(model, method, until=0.1, start=start))
    half = list(evolve(model, method, until=0.05, start=start))
    rest = list(evolve(model, method, until=0.1, start=half[-1].state))
    assert len(half) + len(rest) == len(whole)
    for ours, theirs in zip(rest, whole[len(half) :], strict=True):
        assert ours.time == theirs.time
        np.testing.assert_array_equal(ours.state.displacement, theirs.state.displacement)
        np.testing.assert_array_equal(ours.state.force, theirs.state.force)


def test_states_survive_a_file(tmp_path):
    model = thrown(height=0.0, mu=0.5)
    step = next(evolve(model, MoreauJean(step=2e-3), until=0.1))
    am.save_state(tmp_path / "state.h5", step.state)
    found = am.load_state(tmp_path / "state.h5")
    assert (found.index, found.time) == (1, 2e-3)
    for name in ("displacement", "velocity", "force", "slip"):
        np.testing.assert_array_equal(getattr(found, name), getattr(step.state, name))
    with pytest.raises(am.FileFormatError, match="no such file"):
        am.load_state(tmp_path / "none.h5")
    (tmp_path / "text.h5").write_text("hello")
    with pytest.raises(am.FileFormatError, match=r"text\.h5: expected a saved state"):
        am.load_state(tmp_path / "text.h5")
    am.write_fclib(step.problem, tmp_path / "problem.h5")
    with pytest.raises(am.FileFormatError, match="amontons_state: missing"):
        am.load_state(tmp_path / "problem.h5")


def test_problems_of_steps_are_fclib_files(tmp_path):
    model = thrown(height=0.0, mu=0.5)
    steps = evolve(model, MoreauJean(step=2e-3), until=0.006)
    steps = list(am.export_fclib(steps, tmp_path / "files"))
    names = sorted(path.name for path in (tmp_path / "files").iterdir())
    assert names == [f"step-0000{k}.hdf5" for k in (1, 2, 3)]
    for step, name in zip(steps, names, strict=True):
        read = am.read_fclib(tmp_path / "files" / name)
        np.testing.assert_array_equal(read.M.toarray(), step.problem.M.toarray())
        again = am.drive(read)
        np.testing.assert_allclose(again.r, step.solution.r, atol=1e-7 * abs(again.r).max())


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: MoreauJean(step=[]), r"step: expected a number > 0, got \[\]"),
        (lambda: MoreauJean(0.1, restitution="1"), "restitution: .* from 0 to 1"),
        (lambda: QuasiStatic([]), r"step: expected a number > 0, got \[\]"),
        (lambda: MoreauJean(step=0), "step: expected a number > 0"),
        (lambda: MoreauJean(step=1, theta=0.4), "theta: .* from 1/2 to 1"),
        (lambda: MoreauJean(step=1, restitution=1.1), "restitution"),
        (lambda: MoreauJean(step=1, prediction=-1), "prediction"),
        (lambda: MoreauJean(step=1, mass_damping=-1), "mass_damping"),
        (lambda: QuasiStatic(step=float("nan")), "step: expected a number > 0"),
        (lambda: next(evolve(thrown(), MoreauJean(step=1), until=-1)), "until"),
        (lambda: next(evolve(thrown(), MoreauJean(step=1), until=[])), r"until: .*got \[\]"),
        (
            lambda: next(
                evolve(thrown(), MoreauJean(step=1), until=1, start=at_rest(thrown(cells=2)))
            ),
            "another model",
        ),
    ],
)
def test_bad_input_is_named(make, words):
    with pytest.raises(am.InvalidInput, match=words):
        make()


def test_a_step_that_fails_says_which():
    model = thrown(height=0.0)
    start = at_rest(model, velocity=(1, -1))
    steps = evolve(model, MoreauJean(step=1e-3), until=1, start=start, tolerance=1e-30)
    with pytest.raises(am.NotConverged, match=r"step 1: .*error"):
        next(steps)
    steps = evolve(model, MoreauJean(step=1e-3), until=1, start=start, tolerance=1e-30,
                   check=False)  # fmt: skip
    assert not next(steps).solution.converged


@pytest.mark.parametrize("solver", [None, am.GaussSeidel(), am.SemismoothNewton()],
                         ids=["auto", "local", "global"])  # fmt: skip
def test_either_form_gives_the_same_motion(solver):
    model = thrown(height=0.0, mu=0.5, dim=3, cells=2)
    start = at_rest(model, velocity=(1, 0.5, 0))
    solved = [
        list(evolve(model, MoreauJean(step=2e-3, condense=condense), until=0.02, start=start,
                    solver=None if condense is False and solver == am.GaussSeidel() else solver,
                    tolerance=1e-11))
        for condense in (True, False)
    ]  # fmt: skip
    for ours, theirs in zip(*solved, strict=True):
        force = abs(theirs.state.force).max()
        np.testing.assert_allclose(ours.state.force, theirs.state.force, atol=1e-6 * force)
        np.testing.assert_array_equal(ours.active, theirs.active)
        assert ours.problem.form is am.Form.GLOBAL
    resultant = solved[0][-1].resultant()
    frames = model.discretisation.placed[0].rows.frames
    np.testing.assert_allclose(
        resultant, np.einsum("ik,ikc->c", solved[0][-1].state.force, frames)
    )


def test_a_step_prints_itself():
    step = next(evolve(thrown(height=0.0), MoreauJean(step=1e-3), until=1))
    assert "t = 0.001" in str(step)
    assert "kinetic" in str(step)
