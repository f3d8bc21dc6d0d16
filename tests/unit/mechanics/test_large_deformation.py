"""Contact at finite strains: exact tangents, patch test, frames, limits, friction in steps."""

import numpy as np
import pytest
from scipy.optimize import brentq

import amontons as am
from amontons.mechanics.contact.geometry import frames
from amontons.mechanics.meshes import Mesh
from amontons.mechanics.model.large_deformation import large_deformation

NEO, CIARLET = am.NeoHookean(1.0, 0.3), am.CiarletGeymonat(1.0, 0.4)


def wave(dim):
    """A wavy ground as a level set that is no distance, with its derivatives."""

    def value(x):
        return 1.3 * x[:, -1] - 0.05 * np.sin(3 * x[:, 0]) - 0.1 * x[:, 0] ** 2

    def gradient(x):
        out = np.zeros_like(x)
        out[:, -1], out[:, 0] = 1.3, -0.15 * np.cos(3 * x[:, 0]) - 0.2 * x[:, 0]
        return out

    def hessian(x):
        out = np.zeros((*x.shape, x.shape[1]))
        out[:, 0, 0] = 0.45 * np.sin(3 * x[:, 0]) - 0.2
        return out

    return am.LevelSet(value, gradient, hessian)


def obstacles(dim):
    """A plane, a ball and a wave below a unit box."""
    normal, center = np.eye(dim)[-1], np.r_[0.3 * np.ones(dim - 1), -1.0]
    return {"plane": am.Plane(normal), "sphere": am.Sphere(center, 1.0), "wave": wave(dim)}


def block(mesh, law, obstacle, top, **options):
    """A box held at its top, over an obstacle."""
    options = {"mu": 0.5, "on": "top"} | options
    on, loads = options.pop("on"), options.pop("loads", ())
    return am.Model([am.Body(mesh, law)], supports=[am.Fix(on, top)], loads=loads,
                    contacts=[am.Contact("bottom", obstacle, **options)])  # fmt: skip


@pytest.mark.parametrize("friction", [{"mu": 0.5}, {"mu": 0.0}, {"tresca": 0.05, "mu": None}])
@pytest.mark.parametrize("name", ["plane", "sphere", "wave"])
@pytest.mark.parametrize("dim", [2, 3])
def test_tangent_is_exact_at_random_states(dim, name, friction):
    mesh = am.box((1,) * dim, cells=3 if dim == 2 else 2)
    law = NEO if name == "sphere" else CIARLET
    load = am.Traction("right", [0.1] * dim)
    model = block(mesh, law, obstacles(dim)[name], [0.0] * dim, loads=[load], **friction)
    problem = large_deformation(model)
    rng = np.random.default_rng(dim)
    checked, met = 0, set()
    for _ in range(12):
        v = 0.04 * rng.standard_normal(problem.unknowns)
        direction = rng.standard_normal(v.shape)
        pieces = problem.pieces(v)
        behind, ahead = v - 1e-6 * direction, v + 1e-6 * direction
        if not all((problem.pieces(x) == pieces).all() for x in (behind, ahead)):
            continue
        difference = (problem.residual(ahead) - problem.residual(behind)) / 2e-6
        found = problem.tangent(v) @ direction
        assert np.abs(found - difference).max() < 1e-6 * np.abs(found).max()
        checked += 1
        met |= set(pieces.tolist())
    assert checked > 4
    assert len(met) > 1


@pytest.mark.parametrize("name", ["plane", "sphere", "wave"])
@pytest.mark.parametrize("dim", [2, 3])
def test_the_tangent_problem_tells_the_same(dim, name):
    """Same gaps, slips and forces at its state, and the same change of them to first order."""
    mesh = am.box((1,) * dim, cells=2)
    problem = large_deformation(block(mesh, NEO, obstacles(dim)[name], [0.0] * dim))
    rng = np.random.default_rng(4)
    v = 0.04 * rng.standard_normal(problem.unknowns)
    tangent, r = problem.linearised(v), problem.reactions(v)
    assert np.abs(tangent.local_velocity(v) - problem.local_velocity(v)).max() < 1e-13
    forces = tangent.M @ v - tangent.f - tangent.H @ r.ravel()
    at = np.isin(problem.parts.free, problem.parts.at.ravel())
    assert np.abs(forces[at]).max() < 1e-13
    assert np.abs(forces[~at] - problem.residual(v)[~at]).max() < 1e-13
    if name == "plane":  # frames do not turn: M is the derivative
        direction = 1e-6 * rng.standard_normal(v.shape)
        inner = [problem.parts.forces(problem.displacement(v + s * direction)) for s in (1, -1)]
        change = (inner[0] - inner[1])[problem.parts.free] / 2
        assert np.abs(tangent.M @ direction - change).max() < 1e-6 * np.abs(change).max()


@pytest.mark.parametrize("law", [NEO, CIARLET], ids=["neo", "ciarlet"])
@pytest.mark.parametrize("kind", ["quad", "tri"])
@pytest.mark.parametrize("order", [1, 2])
def test_patch(law, kind, order):
    """A block between frictionless plates, 30 % shorter: one stretch everywhere."""
    mesh = am.box((1, 2), cells=(2, 3), kind=kind)
    supports = [am.Fix("top", (None, -0.6)), am.Fix("left", (0, None))]
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.0)
    model = am.Model([am.Body(mesh, law, order=order)], supports, contacts=[contact])
    solution = am.solve(model, tolerance=1e-11)

    def nominal(across):
        """(P_11, P_22) of F = diag(across, 0.7, 1)."""
        a, b, c, d, e = law.coefficients
        stretch = np.array([across, 0.7, 1.0])
        J, C = stretch.prod(), stretch**2
        g = 2 * c * J**2 - d + e * np.log(J)
        return (2 * a * stretch + 2 * b * stretch * (C.sum() - C) + g / stretch)[:2]

    across = brentq(lambda s: nominal(s)[0], 0.8, 1.6, xtol=1e-14)
    wanted = model.bodies[0].mesh.points * [across - 1, -0.3]
    assert np.abs(solution.displacement[0] - wanted).max() < 1e-9
    assert np.abs(solution.pressure + nominal(across)[1] / across).max() < 1e-9
    assert solution.resultant == pytest.approx([0, -nominal(across)[1]], abs=1e-10)


@pytest.mark.parametrize("law", [NEO, CIARLET], ids=["neo", "ciarlet"])
def test_pressed_and_slid_by_half_its_height_converges_quadratically(law):
    def top(x, t):
        return max(0.0, t - 1) * 0.5, -0.2 * min(t, 1.0)

    mesh = am.box((2, 1), cells=(12, 6))
    model = block(mesh, law, am.Plane((0, 1)), top, mu=0.1)
    *_, before, last = am.evolve(model, am.QuasiStatic(0.25), until=2.0)
    errors = [step.error for step in last.solution.convergence.history]
    assert set(before.solution.pattern) == set(last.solution.pattern) == {"-"}
    assert errors[-1] < 1e-8
    for one, two in zip(errors[-3:], errors[-2:], strict=False):
        assert two < 50 * one**2  # statuses no longer change
    force = last.resultant()
    assert force[0] == pytest.approx(-0.1 * force[1], rel=1e-8)  # all of it slides
    lawful(model, last)


def lawful(model, step):
    """Coulomb's law at the nodes, written from the displacements and forces alone."""
    fields = step.fields
    plane = model.contacts[0].obstacle
    at = fields.points + fields.displacement[0][fields.node]
    gap, n = plane.gap(at), plane.normals(at)
    normal = (fields.force * n).sum(axis=1)
    shear = fields.force - normal[:, None] * n
    size = np.abs(fields.force).max()
    assert gap.min() > -1e-8
    assert normal.min() > -1e-7 * size
    assert np.abs(normal * gap).max() < 1e-8 * size
    mu = model.contacts[0].mu
    assert (np.linalg.norm(shear, axis=1) <= mu * normal + 1e-6 * size).all()


def turned(model, angle):
    """The same model, all of it turned about the origin; supports are functions of (x, t)."""
    Q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    body = model.bodies[0]
    mesh = Mesh(body.mesh.points @ Q.T, body.mesh.cells, body.mesh.surfaces)
    value, ball = model.supports[0].value, model.contacts[0].obstacle
    top = am.Fix("top", lambda x, t: tuple(Q @ value(Q.T @ x, t)))
    contact = am.Contact("bottom", am.Sphere(Q @ ball.center, ball.radius), mu=0.4)
    return Q, am.Model([am.Body(mesh, body.material)], [top], [contact])


@pytest.mark.parametrize("law", [NEO, CIARLET], ids=["neo", "ciarlet"])
def test_ironing_does_not_depend_on_the_frame(law):
    """A block pressed on a ball and drawn over it, turned and not: the same to 1e-10."""

    def top(x, t):
        return 0.15 * max(0.0, t - 1), -0.2 * min(t, 1.0)

    mesh = am.box((1, 0.6), cells=(8, 4))
    model = block(mesh, law, am.Sphere((0.45, -1.0), 1.0), top, mu=0.4)
    Q, other = turned(model, 1.234)
    runs = [
        list(am.evolve(m, am.QuasiStatic(0.5), until=2.0, tolerance=1e-12))
        for m in (model, other)
    ]
    assert {"s", "-"} <= set("".join(step.solution.pattern for step in runs[0]))
    for one, two in zip(*runs, strict=True):
        assert one.solution.pattern == two.solution.pattern
        assert np.abs(one.displacement[0] @ Q.T - two.displacement[0]).max() < 1e-10
        assert np.abs(one.state.force - two.state.force).max() < 1e-10
        assert np.abs(Q @ one.resultant() - two.resultant()).max() < 1e-10
        lawful(model, one)


def test_frames_in_3d_do_not_depend_on_the_choice_of_tangents():
    """The axis from which tangents are made changes with the orientation; results must not."""
    mesh = am.box((1, 1, 1), cells=2)
    results = []
    for axis in range(3):
        P = np.roll(np.eye(3), axis, axis=0)  # a rotation: x -> y -> z
        body = am.Body(Mesh(mesh.points @ P.T, mesh.cells, mesh.surfaces), NEO)
        ball = am.Sphere(P @ [0.45, 0.6, -1.0], 1.0)
        model = am.Model([body], [am.Fix("top", tuple(P @ [0.1, 0.05, -0.15]))],
                         [am.Contact("bottom", ball, mu=0.3)])  # fmt: skip
        solution = am.solve(model, tolerance=1e-12)
        results.append((solution.displacement[0] @ P, solution.force @ P, solution.pattern))
        assert frames(solution.frames[:, 0]) == pytest.approx(solution.frames)
    for displacement, force, pattern in results[1:]:
        assert np.abs(displacement - results[0][0]).max() < 1e-10
        assert np.abs(force - results[0][1]).max() < 1e-10
        assert pattern == results[0][2]


@pytest.mark.parametrize("dim", [2, 3])
def test_small_strains_agree_with_the_linear_model(dim):
    """The difference falls with the square of the load."""
    top = np.r_[0.6, 0.1 * np.ones(dim - 2), -1.0]
    mesh = am.box((1,) * dim, cells=4 if dim == 2 else 2)
    differences = []
    for size in (1e-3, 1e-4):
        both = []
        for law in (NEO, am.LinearElastic(NEO.young, NEO.poisson)):
            model = block(mesh, law, obstacles(dim)["plane"], tuple(size * top), mu=0.3)
            both.append(am.solve(model, tolerance=1e-11))
        assert both[0].pattern == both[1].pattern
        assert set(both[0].pattern) != {"s"}
        apart = np.abs(both[0].displacement[0] - both[1].displacement[0]).max()
        differences.append(apart / size)
        assert both[0].resultant == pytest.approx(both[1].resultant, rel=10 * size)
    assert differences[1] == pytest.approx(differences[0] / 10, rel=0.1)


def test_friction_speaks_of_the_motion_since_the_last_step():
    """Forth and back: friction turns round at once; one step to the same place has none."""

    def top(x, t):
        return 0.2 * (1 - abs(t - 2)) if t > 1 else 0.0, -0.1 * min(t, 1.0)

    mesh = am.box((1, 0.5), cells=(4, 2))
    model = block(mesh, NEO, am.Plane((0, 1)), top, mu=0.1)
    steps = list(am.evolve(model, am.QuasiStatic(0.5), until=3.0))
    pushed = [step.resultant()[0] for step in steps]
    assert abs(pushed[1]) < 1e-9
    assert pushed[3] < -1e-3
    assert pushed[5] > 1e-3
    assert np.abs(steps[5].state.slip - steps[1].state.slip).max() > 1e-3
    for step in steps:
        rounding = 1e-12 * step.energies.elastic  # all of a step that nothing moves in
        assert abs(step.energies.defect) < 1e-7 * step.energies.turnover + rounding
        assert step.energies.contact < 1e-12


def test_a_body_that_contact_alone_holds():
    mesh = am.box((1, 1), cells=4)
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.3)
    model = am.Model([am.Body(mesh, NEO)], contacts=[contact],
                     loads=[am.BodyForce([0.02, -0.2])])  # fmt: skip
    solution = am.solve(model)
    assert solution.resultant == pytest.approx([-0.02, 0.2], abs=1e-8)


def test_several_bodies_and_symmetry_planes():
    """Half a block with a symmetry plane is half of the whole, beside a second body."""

    def body(width, name):
        mesh = am.box((width, 1), cells=(round(4 * width), 4))
        return am.Body(mesh, CIARLET, name=name)

    def model(bodies, supports):
        contacts = [am.Contact(f"{b.name}.bottom", am.Sphere((0, -1), 1.0), mu=0.3)
                    for b in bodies]  # fmt: skip
        tops = [am.Fix(f"{b.name}.top", (0, -0.1)) for b in bodies]
        return am.Model(bodies, tops + supports, contacts)

    half = am.solve(model([body(1, "a"), body(1, "b")], [am.Fix("b.left", (0, None))]))
    mesh = body(2, "c").mesh
    whole = am.Body(Mesh(mesh.points - [1, 0], mesh.cells, mesh.surfaces), CIARLET, name="c")
    full = am.solve(model([whole], []))
    assert len(half.displacement) == 2
    right = full.displacement[0][mesh.points[:, 0] >= 1]
    assert np.abs(half.displacement[1] - right).max() < 1e-7


def test_what_can_not_be_is_said():
    mesh = am.box((1, 1), cells=2)
    deep = block(mesh, NEO, am.Plane((0, 1)), (0, -1.5))
    with pytest.raises(am.NotConverged, match="no equilibrium found beyond 0") as failure:
        am.solve(deep)
    assert not failure.value.solution.converged
    assert np.isfinite(failure.value.solution.v).all()
    late = am.solve(deep, time_limit=1e-6, check=False).convergence
    assert late.outcome is am.Outcome.TIME_LIMIT
    fine = block(mesh, NEO, am.Plane((0, 1)), (0, -0.1))
    for ask in (fine.assemble, lambda: am.all_solutions(fine)):
        with pytest.raises(am.UnsupportedForm, match="hyperelastic"):
            ask()
    with pytest.raises(am.UnsupportedForm, match="NonlinearNewton"):
        am.solve(fine, am.GaussSeidel())
    with pytest.raises(am.InvalidInput, match="dynamics need its density"):
        next(am.evolve(fine, am.MoreauJean(0.1), until=1.0))
    two = [am.Body(mesh, NEO, name="a"), am.Body(mesh, am.LinearElastic(1, 0.3), name="b")]
    mixed = am.Model(two, [am.Fix("a.top", 0), am.Fix("b.top", 0)],
                     [am.Contact("a.bottom", am.Plane((0, 1)), mu=0)])  # fmt: skip
    with pytest.raises(am.UnsupportedForm, match="body 'b'"):
        am.solve(mixed)
    master = am.Model([am.Body(mesh, NEO)], [am.Fix("top", 0)],
                      [am.Contact("bottom", master="right", mu=0, method="nodal")])  # fmt: skip
    with pytest.raises(am.UnsupportedForm, match="method='mortar'"):
        am.solve(master)


def test_files_and_a_start(tmp_path):
    mesh = am.box((1, 1), cells=4)
    model = block(mesh, CIARLET, am.Sphere((0.5, -0.5), 0.5), (0.1, -0.2), mu=0.3)
    solution = am.solve(model)
    for name in ("a.vtu", "a.h5", "a.json"):
        solution.write(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 500
    assert solution.problem.error(solution.r, solution.v) < 1e-7
    again = am.solve(model.with_mu(0.301), start=solution)
    assert again.convergence.iterations < 4


@pytest.mark.parametrize("cells", [4, 6])
def test_contacts_that_close_all_at_once_find_their_statuses(cells):
    """Newton's steps alone go round in circles here, at however small a load."""
    mesh = am.box((1, 1), cells=cells)
    model = block(mesh, NEO, am.Plane((0, 1)), (0.05, -0.1), mu=0.3)
    solution = am.solve(model, tolerance=1e-12)
    r = solution.r
    assert (r[:, 0] >= 0).all()
    assert (np.abs(r[:, 1]) <= 0.3 * r[:, 0] + 1e-14).all()
    branch = am.follow(model)
    assert branch.stops == (am.Stop.INTERVAL, am.Stop.INTERVAL)
    followed = branch.problem.solution(branch[-1].state, 1.0).r
    assert np.abs(followed - r).max() < 1e-9 * np.abs(r).max()


def test_the_tangent_problem_towards_a_load_is_linear_elasticity_at_rest():
    mesh = am.box((1, 1), cells=4)
    loads = [am.Traction("right", (-0.01, 0.02))]
    models = [block(mesh, law, am.Sphere((0.3, -1.01), 1.0), (0.05, -0.1), loads=loads)
              for law in (NEO, am.LinearElastic(1.0, 0.3))]  # fmt: skip
    problem = large_deformation(models[0])
    tangent = problem.towards(0.0, 1.0, np.zeros(problem.unknowns))
    found = am.solve(tangent, tolerance=1e-11).r
    linear = am.solve(models[1], tolerance=1e-11).r
    assert np.abs(linear).max() > 0.01
    np.testing.assert_allclose(found, linear, atol=1e-9)


@pytest.mark.parametrize("law", [NEO, am.LinearElastic(1.0, 0.3)], ids=["neo", "linear"])
def test_steps_from_an_initial_displacement(law):
    """A block that is turned before the start: the turn is no part of the first step."""
    angle = 0.05
    c, s = np.cos(angle) - 1, np.sin(angle)

    def turned(x):
        return c * (x[0] - 0.5) - s * (x[1] - 1), s * (x[0] - 0.5) + c * (x[1] - 1)

    def top(x, t):
        return c * (x[0] - 0.5), s * (x[0] - 0.5) - t

    contact = am.Contact("bottom", am.Plane((0, 1), (0, -0.05)), mu=0.4,
                         configuration="current")  # fmt: skip
    mesh = am.box((1, 1), cells=4)
    model = am.Model([am.Body(mesh, law)], [am.Fix("top", top)], [contact])
    start = am.at_rest(model, displacement=turned)
    where = np.array([turned(x) for x in mesh.points])
    assert np.abs(start.displacement.reshape(-1, 2) - where).max() < 1e-15
    step = am.QuasiStatic(0.05)
    first, last = am.evolve(model, step, until=0.1, start=start)
    assert first.energies.supports > 0
    *_, plain = am.evolve(model, step, until=0.1)
    if law is NEO:
        assert plain.energies.elastic == pytest.approx(last.energies.elastic, rel=0.1)
    if law is NEO:  # a turn without contact leaves nothing
        still = am.Model([am.Body(mesh, law)], [am.Fix("top", lambda x, t: top(x, 0.0))],
                         [am.Contact("bottom", am.Plane((0, 1), (0, -1)), mu=0.4)])  # fmt: skip
        (only,) = am.evolve(still, step, until=0.05, start=start)
        assert np.abs(only.state.displacement - start.displacement).max() < 1e-12
        assert only.energies.turnover < 1e-15
    two = am.Model([am.Body(mesh, NEO, name="a"), am.Body(mesh, NEO, name="b")],
                   contacts=[am.Contact("a.bottom", am.Plane((0, 1)), mu=0),
                             am.Contact("b.bottom", am.Plane((0, 1)), mu=0)])  # fmt: skip
    both = am.at_rest(two, displacement=[(0, 1), turned]).displacement.reshape(2, -1, 2)
    assert (both[0] == [0, 1]).all()
    assert np.abs(both[1] - where).max() < 1e-15
    with pytest.raises(am.InvalidInput, match="displacement"):
        am.at_rest(model, displacement=3.0)
