"""Active sets: linearised conditions, multigrid against the direct solver, many models."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import InvalidInput
from amontons.solvers import Iterate, Target
from amontons.solvers.active_set.conditions import (
    Modification,
    Settings,
    newton_conditions,
    robin,
)
from amontons.solvers.active_set.nested import coarser
from amontons.solvers.active_set.systems import Cycles, Saddle
from amontons.solvers.driver import drive

LAW = am.LinearElastic(200, 0.3)
FIXED = am.FrictionBound.FIXED_POINT


def complementarity(lam, u, g, c):
    """(3.1)."""
    s = lam + c * u
    return max(g, np.linalg.norm(s)) * lam - g * s


def full(r, u, mu, c):
    """(7.1), in our signs: r, u (3,)."""
    pressure = r[0] - c[0] * u[0]
    s = -r[1:] + c[1] * u[1:]
    size = max(mu * pressure, np.linalg.norm(s))
    return size * -r[1:] - mu * max(0, pressure) * s


def derivative(function, x):
    """Central differences, (out, in)."""
    steps = 1e-6 * np.eye(len(x))
    return np.stack([(function(x + e) - function(x - e)) / 2e-6 for e in steps], axis=1)


@pytest.mark.parametrize("seed", range(5))
def test_first_modification_is_newton_near_a_solution(seed):
    rng = np.random.default_rng(seed)
    g, c = 2.0, 3.0
    direction = rng.normal(size=2)
    lam = g * direction / np.linalg.norm(direction)
    u = 0.3 * lam + 0.05 * rng.normal(size=2)
    lam = lam / (1 + 0.1 * rng.random())  # feasible, so (3.11) changes nothing
    part = robin(lam[None], u[None], np.array([g]), np.array([c]), Modification.FIRST)
    new_u = rng.normal(size=2)
    new_lam = part.L[0] @ new_u - part.rhs[0]
    at = np.concatenate([lam, u])
    J = derivative(lambda x: complementarity(x[:2], x[2:], g, c), at)
    step = np.concatenate([new_lam, new_u]) - at
    np.testing.assert_allclose(J @ step, -complementarity(lam, u, g, c), atol=1e-7)


@pytest.mark.parametrize("stick", [True, False])
def test_newton_conditions_are_the_derivative_of_7_1(stick):
    rng = np.random.default_rng(2)
    c, mu = np.array([5.0, 3.0]), 0.7
    lam = np.array([0.4, 0.2]) if stick else np.array([1.1, 0.6])
    r = np.array([2.0, *-lam])
    u = np.array([0.01, *(0.01 * lam if stick else 0.4 * lam + [0.02, -0.03])])
    given = newton_conditions(
        r[None], u[None], am.Coulomb([mu]), Settings(c[:1], c[1:], Modification.FIRST)
    )
    assert given.tangential[0] != stick
    new_u = np.array([0.0, *rng.normal(size=2)])  # u_N = 0 as (4.1) asks
    A = given.G_r[0, 1:]
    free = given.b[0, 1:] - given.G_u[0, 1:] @ new_u
    if stick:  # any r that meets the rows
        new_r = np.array([0.0, *rng.normal(size=2)])
        new_u[1:] = given.b[0, 1:] - A @ new_r
    else:
        new_r = np.array([rng.normal(), 0, 0])
        new_r[1:] = free - A[:, 0] * new_r[0]
    J = derivative(lambda x: full(x[:3], x[3:], mu, c), np.concatenate([r, u]))
    step = np.concatenate([new_r - r, new_u - u])
    np.testing.assert_allclose(J @ step, -full(r, u, mu, c), atol=1e-6)


@pytest.mark.parametrize("kind", Modification)
def test_modified_conditions_stay_regular_far_from_a_solution(kind):
    rng = np.random.default_rng(0)
    lam, u = 5 * rng.normal(size=(2, 400, 2))
    c, g = np.full(400, 2.0), 0.5 * np.linalg.norm(lam + 2 * u, axis=1)
    L = robin(lam, u, g, c, kind).L
    if kind is Modification.UNMODIFIED:  # what the others are for
        assert np.linalg.eigvals(L).real.min() < -100
        return
    assert np.linalg.eigvals(L).real.min() > -1e-9
    if kind is not Modification.FIRST:
        np.testing.assert_allclose(L, L.transpose(0, 2, 1), atol=1e-8 * np.abs(L).max())


def cube(cells=4, mu=0.6, supports=(), **body):
    fixes = [am.Fix("top", lambda x: (0, 0.1, 0.03 - 0.1 * x[0])), *supports]
    return am.Model(
        [am.Body(am.box((1, 1, 1), cells, **body), LAW)],
        supports=fixes,
        contacts=[am.Contact("bottom", am.Plane((0, 0, 1)), mu=mu)],
    )


def sphere():
    return am.Model(
        [am.Body(am.box((1, 1, 1), 2, origin=(-0.5, -0.5, 0)), LAW)],
        supports=[am.Fix("top", (0.02, 0, -0.08))],
        contacts=[am.Contact("bottom", am.Sphere((0, 0, -2), 2), mu=0.4)],
    )


def planar():
    return am.Model(
        [am.Body(am.box((2, 1), (8, 4)), LAW)],
        supports=[am.Fix("top", (0.05, -0.03))],
        contacts=[am.Contact("bottom", am.Plane((0, 1)), mu=0.3)],
    )


def two_bodies():
    lower = am.Body(am.box((1, 1, 1), 3, origin=(0, 0, -1)), LAW, name="lower")
    upper = am.Body(am.box((0.8, 0.8, 1), 4, origin=(0.1, 0.1, 0)), LAW, name="upper")
    return am.Model(
        [upper, lower],
        supports=[am.Fix("upper.top", (0.01, 0, -0.02)), am.Fix("lower.bottom", (0, 0, 0))],
        contacts=[am.Contact("upper.bottom", master="lower.top", mu=0.3)],
    )


MODELS = {
    "cube": cube(),
    "tetrahedra": cube(2, kind="tet"),
    "held": cube(2, supports=[am.Fix("left", (0, None, None))]),
    "frictionless": cube(2, mu=0.0),
    "sphere": sphere(),
    "planar": planar(),
    "bodies": two_bodies(),
}
OPTIONS = {
    "newton": am.ActiveSet(),
    "fixed-point": am.ActiveSet(bound=FIXED, bound_steps=None),
    "second": am.ActiveSet(modification=Modification.SECOND),
    "third": am.ActiveSet(modification=Modification.THIRD),
    "exact-cycles": am.ActiveSet(bound=FIXED, multigrid=am.MultigridCycle()),
    "one-cycle": am.ActiveSet(bound=FIXED, multigrid=am.MultigridCycle(), cycles=1),
    "v": am.ActiveSet(bound=FIXED, multigrid=am.MultigridCycle(am.CycleShape.V, 2), cycles=2),
    "f": am.ActiveSet(
        bound=FIXED, multigrid=am.MultigridCycle(am.CycleShape.F), cycles=1, nested=True
    ),
}


CASES = [(option, "planar") for option in ("second", "third", "v")] + [
    (option, name)
    for option in ("newton", "fixed-point", "exact-cycles", "one-cycle", "f")
    for name in MODELS
]


def reference(problem):
    """Its solution by the driver's own choice."""
    return drive(problem, tolerance=1e-10)


@pytest.mark.parametrize(("option", "name"), CASES)
def test_all_strategies_solve_all_models(option, name):
    problem = MODELS[name].assemble()
    solution = drive(problem, OPTIONS[option], tolerance=1e-9, max_iterations=150)
    assert solution.converged, str(solution.convergence)
    other = problem.kept(reference)
    np.testing.assert_allclose(solution.r, other.r, atol=1e-6 * np.abs(other.r).max())
    assert solution.pattern == other.pattern


@pytest.mark.parametrize("name", ["cube", "sphere", "planar", "bodies", "held"])
def test_a_tresca_bound(name):
    base = MODELS[name].assemble()
    law = am.Tresca(np.linspace(0, 0.3, base.contacts))
    problem = replace(base, law=law)
    exact = drive(problem, am.ActiveSet(), tolerance=1e-10, max_iterations=50)
    cycles = am.ActiveSet(bound=FIXED, multigrid=am.MultigridCycle(), cycles=1)
    inexact = drive(problem, cycles, tolerance=1e-10, max_iterations=100)
    assert exact.converged and inexact.converged
    np.testing.assert_allclose(inexact.r, exact.r, atol=1e-7 * np.abs(exact.r).max())


@pytest.mark.parametrize("name", ["cube", "sphere", "planar", "bodies", "held"])
def test_cycles_solve_the_problem_that_the_direct_solver_solves(name):
    problem = MODELS[name].assemble()
    solver = am.ActiveSet(bound=FIXED, multigrid=am.MultigridCycle())
    steps = [], []
    for out, option in zip(steps, (solver, am.ActiveSet(bound=FIXED)), strict=True):
        start = Iterate(np.zeros((problem.contacts, problem.dimension)))
        for _, found in zip(range(4), option.iterates(problem, start, None), strict=False):
            out.append(found)
    assert isinstance(solver._system(problem), Cycles)
    assert isinstance(am.ActiveSet()._system(problem), Saddle)
    for one, other in zip(*steps, strict=True):
        np.testing.assert_array_equal(one.normal, other.normal)
        np.testing.assert_allclose(one.r, other.r, atol=1e-8 * max(np.abs(other.r).max(), 1))
        np.testing.assert_allclose(one.v, other.v, atol=1e-9)


def test_full_newton_needs_a_fraction_of_the_steps():
    problem = cube(2, mu=1.0).assemble()
    counts = [
        drive(problem, am.ActiveSet(bound=bound), tolerance=1e-10).convergence.iterations
        for bound in (am.FrictionBound.NEWTON, FIXED)
    ]
    assert 2 * counts[0] <= counts[1]


def test_a_nested_start_finds_the_sets_earlier():
    problem = cube(4).assemble()
    counts = []
    for nested in (True, False):
        patterns = []
        solver = am.ActiveSet(
            bound=FIXED, multigrid=am.MultigridCycle(), cycles=1, nested=nested
        )

        def note(step, iterate, seen=patterns):
            seen.append(
                (iterate.normal & ~iterate.tangential).sum() + 1000 * iterate.normal.sum()
            )

        drive(problem, solver, tolerance=1e-10, callback=note, max_iterations=100)
        counts.append(sum(p != patterns[-1] for p in patterns))
    assert counts[0] < counts[1]


def test_the_coarse_problem_is_that_of_the_coarser_mesh():
    """Also its load, although the fine one holds prescribed values lifted into fine cells."""
    below, found = cube(2).assemble(), coarser(cube(4).assemble())
    assert found is not None
    size = abs(below.f).max()
    np.testing.assert_allclose(found.problem.f, below.f, atol=1e-12 * size)
    np.testing.assert_allclose(found.problem.M.toarray(), below.M.toarray(), atol=1e-10 * size)
    np.testing.assert_array_equal(found.problem.H.toarray(), below.H.toarray())
    np.testing.assert_array_equal(found.problem.w, below.w)
    again = coarser(found.problem)
    assert again is not None
    np.testing.assert_allclose(again.problem.f, cube(1).assemble().f, atol=1e-12 * size)


def refined_pair(times, upper=((0, 0.01, -0.02)), tall=1.0):
    """Two bodies with meshes that do not match, refined with their levels."""
    bodies = [
        am.Body(am.refined(am.box(size, cells, origin=origin), times), LAW, name=name)
        for name, size, cells, origin in (
            ("upper", (0.8, 0.8, tall), (2, 2, 2), (0.1, 0.1, 0)),
            ("lower", (1, 1, 1), (3, 3, 2), (0, 0, -1)),
        )
    ]
    return am.Model(
        bodies,
        supports=[am.Fix("upper.top", upper), am.Fix("lower.bottom", (0, 0, 0))],
        contacts=[am.Contact("upper.bottom", master="lower.top", mu=0.3, method="mortar")],
    )


def steps_to(problem, solver, tolerance=1e-9):
    """(all iterates, the solution) of a run that converges."""
    seen = []
    found = drive(problem, solver, tolerance=tolerance, max_iterations=150,
                  callback=lambda step, iterate: seen.append(iterate) and None)  # fmt: skip
    assert found.converged, str(found.convergence)
    return seen, found


@pytest.mark.parametrize("multigrid", [None, am.MultigridCycle()])
def test_a_nested_start_between_two_bodies(multigrid):
    """It was ignored without a word: the same steps with it as without."""
    problem = refined_pair(1).assemble()
    option = {} if multigrid is None else {"multigrid": multigrid, "cycles": 1}
    (first, found), (zero, other) = (
        steps_to(problem, am.ActiveSet(bound=FIXED, nested=nested, **option))
        for nested in (True, False)
    )
    np.testing.assert_allclose(found.r, other.r, atol=1e-7 * np.abs(other.r).max())
    best = found.v
    assert np.linalg.norm(first[0].v - best) < 0.2 * np.linalg.norm(zero[0].v - best)
    assert found.convergence.sets_settled < other.convergence.sets_settled
    solver = am.ActiveSet(bound=FIXED, nested=True, **option)
    start = solver._nested_start(problem, Target(1e-9))
    closed = found.status > 0
    assert np.linalg.norm(start.v - best) < 0.1 * np.linalg.norm(best)
    assert np.abs(problem.local_velocity(start.v)[closed, 0]).max() < 1e-3


def test_the_coarse_problem_between_two_bodies_is_that_of_coarser_meshes():
    """Stiffness and load exactly; contacts at coarse slaves see the coarse other side."""
    below, found = refined_pair(1).assemble(), coarser(refined_pair(2).assemble())
    size = np.abs(below.f).max()
    np.testing.assert_allclose(found.problem.f, below.f, atol=1e-12 * size)
    np.testing.assert_allclose(found.problem.M.toarray(), below.M.toarray(), atol=1e-9)
    assert found.problem.contacts == below.contacts
    rigid = found.problem.near_nullspace[:, :3] @ np.array([0.3, -0.2, 0.1])
    np.testing.assert_allclose(found.problem.H.T @ rigid, 0, atol=1e-12)
    mine, theirs = (am.solve(problem) for problem in (found.problem, below))
    total = [solution.r[:, 0].sum() for solution in (mine, theirs)]
    assert total[0] == pytest.approx(total[1], rel=0.05)
    assert coarser(found.problem) is not None


def test_a_nested_start_over_a_curved_gap_keeps_closed_what_is():
    """u of a coarse contact is interpolated with its gap, not its displacement."""
    block = am.Body(am.refined(am.box((1, 1, 1), 2, origin=(-0.5, -0.5, 0)), 1), LAW)
    model = am.Model(
        [block],
        supports=[am.Fix("top", (0.02, 0, -0.08))],
        contacts=[am.Contact("bottom", am.Sphere((0, 0, -2), 2), mu=0.4)],
    )
    problem = model.assemble()
    found = am.solve(problem)
    start = am.ActiveSet(nested=True)._nested_start(problem, Target(1e-9))
    closed = (found.status > 0) & (np.abs(start.r[:, 0]) > 0)
    assert closed.any()
    assert problem.local_velocity(start.v)[closed, 0].min() > -1e-9


@pytest.mark.parametrize("option", [{}, {"bound": FIXED, "multigrid": am.MultigridCycle()}])
def test_nested_is_refused_where_there_is_nothing_coarser(option):
    block = am.Body(am.box((1, 1), (5, 5)), LAW)
    model = am.Model(
        [block],
        supports=[am.Fix("top", (0.05, -0.03))],
        contacts=[am.Contact("bottom", am.Plane((0, 1)), mu=0.3)],
    )
    problem = replace(model.assemble(), levels=())
    found = drive(problem, am.ActiveSet(nested=True, **option))
    assert found.convergence.outcome is am.Outcome.BREAKDOWN
    assert "nested needs a coarser level" in found.convergence.detail
    start = Iterate(np.zeros((problem.contacts, 2)), np.zeros(problem.unknowns))
    assert drive(problem, am.ActiveSet(nested=True, **option), start=start).converged


# ------------------------------------------------------------------------ stopping rule
@pytest.mark.parametrize("steps", [1, 3, 5, None])
def test_the_published_stopping_rule(steps):
    """k > k_f and |u^k - u^kc| / |u^k| < epsilon_u: k_f steps alone prove nothing."""
    problem = cube(2, mu=1.0).assemble()
    solver = am.ActiveSet(bound=FIXED, bound_steps=steps, change=1e-7)
    seen = []
    found = drive(problem, solver, tolerance=1e-300, max_iterations=400,
                  callback=lambda step, it: seen.append((step, it)) and None)  # fmt: skip
    record = found.convergence
    assert record.outcome is am.Outcome.STOPPED and "the change of u" in record.detail
    assert "is below 1e-07" in record.detail and not record.by_user
    assert record.error < 1e-5  # the last iterate is near a solution indeed
    changes = [it.change for _, it in seen]
    assert changes[-1] < 1e-7
    least = 1 if steps is None else steps
    assert len(seen) > least and min(changes[least:-1], default=1) >= 1e-7
    assert [it.ends for _, it in seen[:-1]] == [""] * (len(seen) - 1)


def test_the_rule_goes_on_where_the_judge_is_content_already():
    problem = cube(2, mu=1.0).assemble()
    plain = drive(problem, am.ActiveSet(bound=FIXED), tolerance=1e-6)
    longer = drive(problem, am.ActiveSet(bound=FIXED, change=1e-10), tolerance=1e-6)
    assert plain.converged and longer.converged
    assert longer.convergence.iterations > plain.convergence.iterations
    assert "the change of u" in longer.convergence.detail
    short = drive(
        problem, am.ActiveSet(bound=FIXED, change=1e-10), tolerance=1e-6, max_iterations=3
    )
    assert short.convergence.outcome is am.Outcome.MAX_ITERATIONS


def test_a_change_is_measured_where_the_option_says():
    problem = cube(2, mu=1.0).assemble()
    for norm in am.ChangeNorm:
        solver, last = am.ActiveSet(bound=FIXED, change_norm=norm), None
        start = Iterate(np.zeros((problem.contacts, 3)))
        for _, it in zip(range(4), solver.iterates(problem, start, None), strict=False):
            if last is not None:
                a, b = it.v, last
                if norm is am.ChangeNorm.CONTACT:
                    a, b = problem.H.T @ a, problem.H.T @ b
                expected = np.linalg.norm(a - b) / np.linalg.norm(a)
                assert it.change == pytest.approx(expected, rel=1e-9)
            last = it.v


def test_the_sets_of_every_step_are_counted():
    problem = cube(2, mu=1.0).assemble()
    seen, found = steps_to(problem, am.ActiveSet())
    steps = found.convergence.history[1:]
    assert len(steps) == len(seen)
    for step, iterate in zip(steps, seen, strict=True):
        sets = step.sets
        assert sets.open + sets.stick + sets.slip == problem.contacts
        assert sets.normal == iterate.normal.sum() == sets.stick + sets.slip
        assert sets.tangential == iterate.tangential.sum()
    masks = [np.concatenate([it.normal, it.tangential]) for it in seen]
    same = [np.array_equal(m, masks[-1]) for m in masks]
    first = len(same) - same[::-1].index(False) if False in same else 0
    assert found.convergence.sets_settled == first + 1
    assert drive(problem, am.Auto()).convergence.sets_settled is None


# ------------------------------------------------- (3.5b) as it stands, and (3.14)
def quotient(lam, u, g, c):
    """(3.14)."""
    s = lam + c * u
    return lam - g * s / max(g, np.linalg.norm(s))


@pytest.mark.parametrize(
    ("given", "function"),
    [
        (Settings(None, np.array([3.0]), Modification.UNMODIFIED), complementarity),
        (
            Settings(None, np.array([3.0]), Modification.FIRST, am.FrictionFunction.QUOTIENT),
            quotient,
        ),
    ],
    ids=["3.5b", "3.14"],
)
@pytest.mark.parametrize("seed", range(5))
def test_newton_steps_of_both_functions_far_from_a_solution(seed, given, function):
    """Also where lambda is not admissible: nothing is modified."""
    rng = np.random.default_rng(seed)
    g, c = 2.0, 3.0
    lam, u = 4 * rng.normal(size=2), 2 * rng.normal(size=2)
    part = given.sliding(lam[None], u[None], np.array([g]), np.array([0]))
    new_u = rng.normal(size=2)
    new_lam = part.L[0] @ new_u - part.rhs[0]
    at = np.concatenate([lam, u])
    J = derivative(lambda x: function(x[:2], x[2:], g, c), at)
    step = np.concatenate([new_lam, new_u]) - at
    size = np.abs(J).max() * np.abs(step).max()
    np.testing.assert_allclose(J @ step, -function(lam, u, g, c), atol=1e-8 * size)


@pytest.mark.parametrize("stick", [True, False])
def test_newton_conditions_of_the_quotient(stick):
    """(3.14) with g = mu max(0, lambda_n + c (u_n - d))."""
    c, mu = np.array([5.0, 3.0]), 0.7
    rng = np.random.default_rng(4)
    lam = np.array([0.4, 0.2]) if stick else np.array([1.6, -0.6])
    r = np.array([2.0, *-lam])
    u = np.array([0.01, *(0.01 * lam if stick else np.array([0.4, 0.3]))])
    settings = Settings(
        c[:1], c[1:], Modification.FIRST, am.FrictionFunction.QUOTIENT
    )
    given = newton_conditions(r[None], u[None], am.Coulomb([mu]), settings)
    assert given.tangential[0] != stick

    def law(x):
        return quotient(-x[1:3], x[4:], mu * max(0, x[0] - c[0] * x[3]), c[1])

    new_u = np.array([0.0, *(np.zeros(2) if stick else rng.normal(size=2))])
    new_r = np.array([rng.normal(), 0, 0])
    if not stick:
        rest = given.b[0, 1:] - given.G_u[0, 1:] @ new_u
        new_r[1:] = rest - given.G_r[0, 1:, 0] * new_r[0]
    else:
        np.testing.assert_array_equal(given.G_r[0, 1:], 0)
    J = derivative(law, np.concatenate([r, u]))
    step = np.concatenate([new_r - r, new_u - u])
    np.testing.assert_allclose(J @ step, -law(np.concatenate([r, u])), atol=1e-6)


@pytest.mark.parametrize("bound", am.FrictionBound)
def test_the_quotient_finds_the_same_solution(bound):
    problem = planar().assemble()
    found = drive(
        problem, am.ActiveSet(bound=bound, function="quotient"), tolerance=1e-9,
        max_iterations=100,
    )  # fmt: skip
    assert found.converged, str(found.convergence)
    other = drive(problem, am.ActiveSet(), tolerance=1e-10)
    np.testing.assert_allclose(found.r, other.r, atol=1e-7 * np.abs(other.r).max())


def test_a_body_that_only_contact_holds():
    model = am.Model(
        [am.Body(am.box((1, 1), 4), LAW)],
        supports=[am.Fix("left", (0, None))],
        contacts=[am.Contact("bottom", am.Plane((0, 1)), mu=0.2)],
        loads=[am.Traction("top", (0, -1))],
    )
    solution = drive(model.assemble(), am.ActiveSet(), tolerance=1e-9)
    assert solution.converged, str(solution.convergence)


def test_bad_options_are_named():
    with pytest.raises(InvalidInput, match="c_normal"):
        am.ActiveSet(c_normal=-1.0)
    with pytest.raises(InvalidInput, match="bound_steps"):
        am.ActiveSet(bound_steps=0)
    with pytest.raises(InvalidInput, match="cycles"):
        am.ActiveSet(cycles=1)
    with pytest.raises(InvalidInput, match="fixed-point"):
        am.ActiveSet(multigrid=am.MultigridCycle())
    with pytest.raises(InvalidInput, match="smoothing"):
        am.MultigridCycle(smoothing=0)
    with pytest.raises(InvalidInput, match="shape"):
        am.MultigridCycle(shape="spiral")


def test_cycles_say_where_they_do_not_apply():
    problem = am.FrictionProblem.from_global(
        np.eye(4), np.ones((4, 2)), np.zeros(4), [[-1.0, 0.1]], [0.3]
    )
    solver = am.ActiveSet(bound=FIXED, multigrid=am.MultigridCycle(), cycles=1)
    assert "slave node" in drive(problem, solver).convergence.detail
    assert drive(problem, am.ActiveSet()).convergence.iterations > 0
