"""Gradients against differences of solutions, and against formulas."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.analysis.gradients.cycles import CycleSystem
from amontons.analysis.gradients.gradient import Differentiable
from amontons.analysis.gradients.systems import GlobalSystem
from amontons.mechanics.ready.gallery import box_tower, one_contact_2d

STENCIL = ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))
EXACT = 1e-13  # error of solves that are compared


def slope(value, step):
    """f'(0) of fourth order."""
    return sum(share * value(k * step) for k, share in STENCIL) / step


def random_problem(seed, law=None):
    rng = np.random.default_rng(seed)
    d, nc = 2 + seed % 2, 1 + seed % 4
    A = rng.standard_normal((nc * d, nc * d))
    W = A @ A.T / (nc * d) + 0.2 * np.eye(nc * d)
    q = rng.standard_normal((nc, d))
    q[:, 0] -= 1.0
    mu = rng.uniform(0.1, 0.6, nc)
    return W, q, (mu if law is None else law(rng, nc, d)), rng


LAWS = {
    "coulomb": None,
    "tresca": lambda rng, nc, d: am.Tresca(rng.uniform(0.1, 0.6, nc)),
    "capped": lambda rng, nc, d: am.CappedCoulomb(rng.uniform(0.2, 0.8, nc),
                                                  rng.uniform(0.1, 0.3, nc)),
    "cohesive": lambda rng, nc, d: am.Cohesive(am.Coulomb(rng.uniform(0.2, 0.6, nc)),
                                               rng.uniform(0.1, 0.3, nc)),
    "compliant": lambda rng, nc, d: am.Compliant(am.Coulomb(rng.uniform(0.2, 0.6, nc)),
                                                 np.full(nc, 0.2), np.full(nc, 0.1)),
    "tied": lambda rng, nc, d: am.Tied(nc),
}  # fmt: skip


@pytest.mark.parametrize("law", LAWS)
def test_both_directions_agree_with_differences(law):
    compared = 0
    for seed in range(6):
        W, q, given, rng = random_problem(seed, LAWS[law])

        def solved(p, W=W, given=given):
            problem = am.FrictionProblem.from_delassus(W, p, given)
            return am.solve(problem, tolerance=EXACT, check=False)

        s = solved(q)
        if not s.converged or len(Differentiable(s).at.weak):
            continue
        dq, R, U = rng.standard_normal((3, *q.shape))
        change = s.jvp(load=dq)
        gradient = s.vjp(r=R, u=U)
        whole = (R * change.r).sum() + (U * change.u).sum()
        assert (gradient.load * dq).sum() == pytest.approx(whole, rel=1e-9, abs=1e-12)
        found = slope(lambda e, q=q, dq=dq: solved(q + e * dq).r, 1e-4)
        size = max(np.abs(found).max(), np.abs(dq).max())
        assert np.abs(found - change.r).max() <= 1e-7 * size
        compared += 1
    assert compared >= 3


@pytest.mark.parametrize("name", ["mu", "bound"])
def test_friction_as_a_field(name):
    law = LAWS["coulomb" if name == "mu" else "tresca"]
    for seed in (2, 3, 7):
        W, q, given, rng = random_problem(seed, law)
        numbers = given if name == "mu" else given.coefficient
        make = am.Coulomb if name == "mu" else am.Tresca

        def solved(x, W=W, q=q, make=make):
            problem = am.FrictionProblem.from_delassus(W, q, make(x))
            return am.solve(problem, tolerance=EXACT, check=False)

        R, change = rng.standard_normal(q.shape), rng.uniform(-1, 1, len(q))
        s = solved(numbers)

        def number(e, R=R, numbers=numbers, change=change, solved=solved):
            return (R * solved(numbers + e * change).r).sum()

        found = slope(number, 1e-4)
        gradient = s.vjp(r=R)
        assert getattr(gradient, name) @ change == pytest.approx(found, rel=1e-7, abs=1e-8)
        assert (R * s.jvp(**{name: change}).r).sum() == pytest.approx(found, rel=1e-7, abs=1e-8)


def test_one_sliding_contact_by_hand():
    """r_N = -q_N / (1 - .4 mu), r_T = -mu r_N: W = [[1, .4], [.4, 1]] and u_T > 0."""
    mu, q = 0.5, -2.0
    W = np.array([[1.0, 0.4], [0.4, 1.0]])
    s = am.solve(am.FrictionProblem.from_delassus(W, [[q, 5.0]], [mu]), tolerance=EXACT)
    assert s.pattern == "-"
    gradient = s.vjp(r=[[1.0, 0.0]])
    assert gradient.mu[0] == pytest.approx(-q * 0.4 / (1 - 0.4 * mu) ** 2, rel=1e-12)
    assert gradient.gap[0] == pytest.approx(-1 / (1 - 0.4 * mu), rel=1e-12)
    W_change = np.array([[0.0, 1.0], [0.0, 0.0]])  # of what multiplies r_T in u_N
    assert gradient.of_W(W_change) == pytest.approx(-q * mu / (1 - 0.4 * mu) ** 2, rel=1e-12)


@pytest.mark.parametrize("state", [1e-9, 1.0, 1e9])
def test_one_sided_derivatives_do_not_depend_on_the_length_of_the_direction(state):
    """A contact that just touches beside one that slides: sides(c x) = c sides(x)."""
    W = np.array([[2, 0.3, 0.2, 0.1], [0.3, 1.5, 0, 0.2], [0.2, 0, 1.8, -0.2],
                  [0.1, 0.2, -0.2, 1.2]])  # fmt: skip
    r = 1 / 1.8 / (1 - 0.2 * -0.4 / 1.8 * -1) * np.array([1.0, -0.4])  # u_N = 0, it slips
    load = np.array([[-(W[0, 2:] @ r), 0.5], [-(W[2, 2:] @ r), 1.0]]) * state
    found = am.solve(am.FrictionProblem.from_delassus(W, load, [0.3, 0.4]), tolerance=1e-13)
    direction = np.array([[-1.0, 0.3], [0.2, -0.1]])
    wanted = None
    for length in (1e-12, 1.0, 1e12):
        change = found.jvp(load=length * state * direction)
        (side,) = change.sides
        assert change.complete and len(change.weak) == 1
        wanted = side.r / length if wanted is None else wanted
        np.testing.assert_allclose(side.r / length, wanted, rtol=1e-7, atol=1e-9 * state)
    assert wanted[0, 0] > 0.1 * state


def test_weak_contacts_have_all_one_sided_derivatives():
    """A contact that grazes opens one way and closes the other; a word says so."""
    W = np.eye(2)
    problem = am.FrictionProblem.from_delassus(W, [[0.0, 0.5]], [0.3])
    s = am.solve(problem)
    closing, opening = s.jvp(load=[[-1.0, 0.0]]), s.jvp(load=[[1.0, 0.0]])
    assert [w.name for w in closing.warnings] == ["weak-contacts"] and closing.complete
    (closed,), (opened,) = closing.sides, opening.sides
    assert closed.r == pytest.approx(np.array([[1.0, -0.3]]))
    assert opened.r == pytest.approx(np.zeros((1, 2)))
    assert s.vjp(r=[[1.0, 0.0]]).warnings[0].contacts == (0,)


def test_several_one_sided_derivatives():
    """Without load at friction 2 the one contact has three solutions a step away."""
    base = one_contact_2d(2.0)
    s = am.solve(am.FrictionProblem.from_delassus(base.W, [[0.0, 0.0]], [2.0]))
    change = s.jvp(load=base.q)
    found = sorted(tuple(np.round(side.r.ravel(), 9)) for side in change.sides)
    wanted = [(0.0, 0.0), (1 / 3, -2 / 3), (5 / 3, -7 / 3)]
    assert np.array(found) == pytest.approx(np.array(wanted), abs=1e-8)


def test_a_fold_is_told_by_its_distance():
    """The slip solution of the contact meets the open one where 1 - .8 mu = 0, mu = 1.25."""
    W = np.array([[1.0, 0.8], [0.8, 1.0]])
    for off in (1e-2, 1e-8):
        problem = am.FrictionProblem.from_delassus(W, [[-off, 9.0]], [1.25 * (1 - off)])
        s = am.solve(problem, tolerance=1e-12, start=am.Iterate(np.array([[1.0, -1.25]])))
        assert s.pattern == "-"
        change = s.jvp(load=[[1.0, 0.0]])
        assert change.distance == pytest.approx(off, rel=20)
        near = [w.name for w in change.warnings]
        assert near == (["near-singular-gradient"] if off < 1e-6 else [])


def test_reactions_that_are_not_unique_are_refused():
    s = am.solve(box_tower(2))
    with pytest.raises(am.SingularOperator, match="not unique"):
        s.vjp(r=np.ones(s.r.shape))


def test_what_can_not_be_differentiated_is_refused():
    W, q, mu, _ = random_problem(2)
    s = am.solve(am.FrictionProblem.from_delassus(W, q, mu))
    with pytest.raises(am.InvalidInput, match=r"r: expected shape \(3, 2\)"):
        s.vjp(r=np.zeros((2, 2)))
    with pytest.raises(am.InvalidInput, match="not finite"):
        s.jvp(load=np.full(q.shape, np.nan))
    with pytest.raises(am.InvalidInput, match=r"W: expected shape \(6, 6\), got \(2, 2\)"):
        s.jvp(W=np.eye(2))
    with pytest.raises(am.InvalidInput, match="of_W.*: expected a finite number"):
        s.vjp(r=np.zeros(q.shape)).of_W(np.full((6, 6), np.nan))
    with pytest.raises(am.InvalidInput, match="Delassus form"):
        s.vjp(v=np.zeros(6))
    with pytest.raises(am.UnsupportedForm, match="see of_M|without M"):
        s.vjp(r=np.zeros(q.shape)).of_M(np.eye(6))
    curve = am.VaryingFriction(am.FrictionCurve([0.2, 0.4], pressure=[0.0, 1.0]), np.ones(3))
    problem = am.FrictionProblem.from_delassus(W, q, curve)
    found = am.solve(problem, check=False)
    with pytest.raises(am.UnsupportedLaw, match="follow the state"):
        found.vjp(r=np.zeros(q.shape))


def cube(cells):
    block = am.Body(am.box((1, 1, 1), cells=cells), am.LinearElastic(young=200, poisson=0.3))
    return am.Model(
        [block], supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )  # fmt: skip


def test_cycles_solve_both_systems(monkeypatch):
    """Multigrid against a factor, forwards and transposed, and beyond what rounding allows."""
    problem = cube(8).assemble()
    s = am.solve(problem, tolerance=1e-10)
    at = Differentiable(s).at
    cycles, direct = CycleSystem(at), GlobalSystem(at)
    assert cycles.fallback is None
    rng = np.random.default_rng(0)
    R, U = rng.standard_normal((2, *s.r.shape))
    V = rng.standard_normal(problem.unknowns)
    c = -at.by_mu * rng.standard_normal((len(R), 1))
    for found, wanted in ((cycles.adjoint(V, R, U), direct.adjoint(V, R, U)),
                          (cycles.change(V, c, U), direct.change(V, c, U))):  # fmt: skip
        for one, other in zip(found, wanted, strict=True):
            assert np.abs(one - other).max() <= 3e-8 * np.abs(other).max()
    assert cycles.iterations < 60
    monkeypatch.setattr("amontons.analysis.gradients.cycles.TOLERANCE", 1e-17)
    monkeypatch.setattr("amontons.analysis.gradients.cycles.SLOW", 0.0)  # GMRES takes over
    one, other = CycleSystem(at).adjoint(V, R, U).x, direct.adjoint(V, R, U).x
    assert np.abs(one - other).max() <= 1e-8 * np.abs(other).max()  # as s is known to 1e-10


# ------------------------------------------------------------------ models
def block(young=200.0, poisson=0.3, mu=0.4, points=None, obstacle=None):
    mesh = am.box((1, 0.5), cells=(4, 2))
    if points is not None:
        mesh = replace(mesh, points=mesh.points + points, grid=None, levels=())
    obstacle = obstacle or am.Sphere((0.5, -2.0), 2.01)
    return am.Model(
        [am.Body(mesh, am.LinearElastic(young, poisson), name="block")],
        [am.Fix("top", (0.03, -0.02))], [am.Contact("bottom", obstacle, mu=mu)],
        [am.NodalForce("left", (0.3, -0.1))],
    )  # fmt: skip


@pytest.fixture(scope="module")
def pressed():
    model = block()
    s = am.solve(model, tolerance=EXACT)
    rng = np.random.default_rng(1)
    of_u, of_r = rng.standard_normal((15, 2)), rng.standard_normal(s.r.shape)

    def number(model):
        found = am.solve(model, tolerance=EXACT, check=False)
        return float((of_u * found.displacement[0]).sum() + (of_r * found.r).sum())

    return s, number, s.vjp([of_u], of_r), (of_u, of_r), rng


@pytest.mark.parametrize(
    ("name", "make", "at", "step"),
    [("young", lambda x: block(young=x), 200.0, 0.1),
     ("poisson", lambda x: block(poisson=x), 0.3, 1e-4),
     ("mu", lambda x: block(mu=x), 0.4, 1e-4),
     ("load_factor", lambda x: block().with_load(x), 1.0, 1e-4)],
)  # fmt: skip
def test_model_parameters(pressed, name, make, at, step):
    _, number, gradient, _, _ = pressed
    found = slope(lambda e: number(make(at + e)), step)
    value = getattr(gradient, name)
    own = value["block"] if isinstance(value, dict) else np.sum(value)
    assert own == pytest.approx(found, rel=1e-7)
    assert gradient.along(make, at) == pytest.approx(found, rel=1e-7)


def test_node_positions_one_by_one(pressed):
    """The formula against differences, on a curved obstacle, whose frames turn."""
    s, number, gradient, (of_u, of_r), rng = pressed
    moved = 0.1 * rng.standard_normal((15, 2))
    found = slope(lambda e: number(block(points=e * moved)), 1e-3)
    assert (gradient.points[0] * moved).sum() == pytest.approx(found, rel=1e-7)
    change = s.jvp(points=[moved])
    own = (of_u * change.displacement[0]).sum() + (of_r * change.r).sum()
    assert own == pytest.approx(found, rel=1e-7)


def test_loads_supports_and_gaps_of_a_model(pressed):
    s, _, gradient, (of_u, of_r), rng = pressed
    load, prescribed = rng.standard_normal((2, 15, 2))
    free = ~s.model.discretisation.is_fixed.reshape(15, 2)
    prescribed[free], load[~free] = 0.0, 0.0
    gap = rng.standard_normal(len(s.r))
    change = s.jvp(load=[load], prescribed=[prescribed], gap=gap, young={"block": 3.0})
    own = (of_u * change.displacement[0]).sum() + (of_r * change.r).sum()
    whole = (gradient.load[0] * load).sum() + (gradient.prescribed[0] * prescribed).sum()
    whole += gradient.gap @ gap + 3.0 * gradient.young["block"]
    assert own == pytest.approx(whole, rel=1e-10)


def test_positions_that_loads_depend_on_are_refused_in_words(pressed):
    s = am.solve(replace(block(), loads=[am.Traction("left", (0.3, 0.0))]))
    with pytest.raises(am.UnsupportedForm, match=r"use along\(make, at\)"):
        _ = s.vjp([np.zeros((15, 2))]).points
    with pytest.raises(am.InvalidInput, match="4 bodies|each of 1 bodies"):
        s.vjp([np.zeros((15, 2))] * 2)


# ------------------------------------------------------------------ time
def moved(young=200.0, mu=0.3, density=1.0):
    body = am.Body(am.box((1, 0.5), (2, 1), origin=(0, 0.05)),
                   am.LinearElastic(young, 0.3, density=density))  # fmt: skip
    plane = am.Contact("bottom", am.Plane((0, 1)), mu=mu)
    return am.Model([body], contacts=[plane], loads=[am.BodyForce((0.8, -1.0))])


def pushed(young=200.0, mu=0.3, density=1.0):
    body = am.Body(am.box((1, 0.5), (2, 1)), am.LinearElastic(young, 0.3, density=density))
    support = am.Fix("top", (lambda x, t: 0.04 * np.sin(2 * t), lambda x, t: -0.02 * t))
    return am.Model([body], [support], [am.Contact("bottom", am.Plane((0, 1)), mu=mu)])


@pytest.mark.parametrize("method", [
    am.QuasiStatic(0.25), am.MoreauJean(0.04), am.MoreauJean(0.04, theta=0.7),
    am.MoreauJean(0.04, restitution=0.4, stiffness_damping=1e-3),
], ids=str)  # fmt: skip
def test_gradients_through_steps(method):
    slow = isinstance(method, am.QuasiStatic)
    make, until = (pushed, 1.5) if slow else (moved, 0.4)
    start = None if slow else am.at_rest(moved(), velocity=(1.0, -0.5))
    rng = np.random.default_rng(3)
    of_u, of_v = rng.standard_normal((2, 6, 2))
    of_r = rng.standard_normal((3, 2))

    def slopes(step):
        return {"displacement": [step.time * of_u], "velocity": [of_v], "force": of_r}

    def number(model):
        return sum(
            float((step.time * of_u * step.displacement[0]).sum() + (of_v * step.v[0]).sum()
                  + (of_r * step.state.force).sum())
            for step in am.evolve(model, method, until=until, start=start, tolerance=1e-12)
        )  # fmt: skip

    along = {"young": (lambda x: make(young=x), 200.0), "mu": (lambda x: make(mu=x), 0.3)}
    gradient = am.evolution_gradient(
        make(), method, slopes, until=until, start=start, tolerance=1e-12, along=along
    )
    assert not gradient.weak.any()
    for name, (family, at) in along.items():
        found = slope(lambda e, f=family, a=at: number(f(a + e)), 1e-4 * at)
        assert gradient.along[name] == pytest.approx(found, rel=2e-6)
    assert gradient.mu.sum() == pytest.approx(gradient.along["mu"], rel=1e-8)
