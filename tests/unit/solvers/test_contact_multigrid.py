"""Contact multigrid against reference data and other solvers; linear multigrid against LU."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.core.errors import InvalidInput, SingularOperator
from amontons.linear import GeometricMultigrid
from amontons.linear.hierarchy import Nodes
from amontons.problem.friction import FrictionProblem
from amontons.problem.solution import Outcome
from amontons.solvers import ContactMultigrid, SemismoothNewton
from amontons.solvers.driver import drive
from amontons.solvers.multigrid import cycles
from amontons.solvers.multigrid.levels import ContactLevels
from amontons.solvers.multigrid.nodes import ContactNodes

REFERENCE = json.loads((Path(__file__).parents[2] / "data/cube.json").read_text())


def cube(cells, mu=1.0, kind="hex", unit=1.0, **friction):
    """The pressed and dragged cube; unit: of length."""
    friction = friction or {"mu": mu}
    mesh = am.box((unit,) * 3, cells=cells, kind=kind)
    return am.Model(
        [am.Body(mesh, am.LinearElastic(young=200, poisson=0.3))],
        supports=[am.Fix("top", lambda x: (0, 0.2 * unit, 0.06 * unit - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), **friction)],
    )


def block(**friction):
    """A rectangle, pushed down and aside."""
    friction = friction or {"mu": 0.4}
    return am.Model(
        [am.Body(am.box((2, 1), cells=(16, 8)), am.LinearElastic(young=10, poisson=0.3))],
        supports=[am.Fix("top", (0.05, -0.02))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 1)), **friction)],
    )


def ball(kind="tet"):
    """A block pressed on a sphere: every contact has its own frame."""
    return am.Model(
        [am.Body(am.box((1, 1, 1), cells=4, kind=kind), am.LinearElastic(50, 0.25))],
        supports=[am.Fix("top", (0.02, 0.01, -0.05))],
        contacts=[am.Contact("bottom", am.Sphere((0.4, 0.5, -2), 2.0), mu=0.3)],
    )


def symmetric():
    """A quarter: supports hold single components of nodes, some of them in contact."""
    return am.Model(
        [am.Body(am.box((1, 1, 1), cells=4), am.LinearElastic(50, 0.25))],
        supports=[
            am.Fix("left", (0, None, None)),
            am.Fix("front", (None, 0, None)),
            am.Fix("top", (None, None, -0.05)),
        ],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=0.2)],
    )


def two_bodies(method):
    """Cubes whose meshes do not match."""
    lower = am.Body(am.box((1, 1, 0.5), cells=(6, 6, 2)), am.LinearElastic(80, 0.3), "lower")
    upper = am.Body(
        am.box((0.8, 0.8, 0.5), cells=(4, 4, 2), origin=(0.1, 0.1, 0.5)),
        am.LinearElastic(50, 0.2),
        "upper",
    )
    return am.Model(
        [lower, upper],
        supports=[am.Fix("lower.bottom", (0, 0, 0)), am.Fix("upper.top", (0.02, 0, -0.03))],
        contacts=[am.Contact("upper.bottom", master="lower.top", mu=0.3, method=method)],
    )


def loose(gap=0.05):
    """A block that nothing but contact can hold, above the ground."""
    return am.Model(
        [am.Body(am.box((1, 1, 1), cells=6), am.LinearElastic(200, 0.3))],
        loads=[am.Traction("top", (0.5, 0.2, -3.0))],
        contacts=[am.Contact("bottom", am.Plane((0, 0, 1), (0, 0, -gap)), mu=0.5)],
    )


MODELS = {
    "cube": lambda: cube(4),
    "tetrahedra": lambda: cube(4, kind="tet"),
    "odd": lambda: cube(3),
    "tresca": lambda: cube(4, tresca=2.0),
    "frictionless": lambda: cube(4, mu=0.0),
    "plane": block,
    "plane tresca": lambda: block(tresca=0.1),
    "ball": ball,
    "symmetric": symmetric,
    "closest points": lambda: two_bodies("nodal"),
    "mortar": lambda: two_bodies("mortar"),
}


@pytest.mark.parametrize("name", MODELS)
def test_the_same_solution_as_newton(name):
    problem = MODELS[name]().assemble()
    found = drive(problem, ContactMultigrid(), tolerance=1e-9)
    assert found.converged, str(found)
    assert found.convergence.iterations <= 25
    expected = drive(problem, SemismoothNewton(), tolerance=1e-11)
    assert expected.converged
    size = np.abs(expected.r).max()
    assert np.abs(found.r - expected.r).max() < 1e-6 * size


@pytest.mark.parametrize("level", [1, 2, 3])
def test_reference_counts_and_resultant(level):
    model = cube(2**level)
    solution = drive(model.assemble(), ContactMultigrid(), tolerance=1e-8, max_iterations=15)
    expected = REFERENCE[f"level{level}"]
    assert solution.converged
    assert solution.counts["slip"] == expected["slip"]
    assert solution.counts["slip"] + solution.counts["stick"] == expected["contact"]
    resultant = np.array(expected["resultant"])
    off = model.recover(solution).resultant - resultant
    assert np.abs(off).max() < 1e-6 * np.abs(resultant).max()


@pytest.mark.parametrize("mu", [0.1, 0.3, 3.0])
def test_cycles_do_not_depend_on_friction(mu):
    solution = drive(cube(8, mu).assemble(), ContactMultigrid(), tolerance=1e-10)
    assert solution.converged
    assert solution.convergence.iterations <= 20


@pytest.mark.parametrize("mu", [0.3, 1.0])
def test_a_tall_body_does_not_swing(mu):
    """Full steps of the tangent carry its foot past the solution, to and fro."""
    model = am.Model(
        [am.Body(am.box((1, 1, 2), cells=(6, 6, 12)), am.LinearElastic(200, 0.3))],
        supports=[am.Fix("top", (0, 0.04, -0.04))],
        contacts=[am.Contact("bottom", am.Plane((0, 0, 1)), mu=mu)],
    )
    problem = model.assemble()
    found = drive(problem, ContactMultigrid(), tolerance=1e-9)
    exact = drive(problem.condensed(), SemismoothNewton(), tolerance=1e-11)
    assert found.converged
    assert found.convergence.iterations <= 16
    assert np.abs(found.r - exact.r).max() <= 1e-6 * np.abs(exact.r).max()
    assert found.counts["stick"] > 0.4 * problem.contacts


@pytest.mark.parametrize("size", [(4, 1, 1), (1, 1, 4), (8, 8, 1), (10, 3, 1)])
def test_stretched_cells_take_no_more_cycles(size):
    model = am.Model(
        [am.Body(am.box(size, cells=8), am.LinearElastic(200, 0.3))],
        supports=[am.Fix("top", (0, 0.02 * size[2], -0.02 * size[2]))],
        contacts=[am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.3)],
    )
    found = drive(model.assemble(), ContactMultigrid(), tolerance=1e-8)
    assert found.converged
    assert found.convergence.iterations <= 14


@pytest.mark.parametrize("gap", [0.0, 0.05, 2.0])
def test_a_body_held_by_contact_alone(gap):
    problem = loose(gap).assemble()
    solution = drive(problem, ContactMultigrid(), tolerance=1e-8)
    assert solution.converged, str(solution)
    pushed = problem.H @ solution.r.ravel() + problem.f
    assert np.abs(problem.near_nullspace.T @ pushed).max() < 1e-6 * np.abs(problem.f).sum()


@pytest.mark.parametrize("method", ["nodal", "mortar"])
def test_coarse_levels_of_two_bodies_have_contacts_of_their_own(method):
    problem = two_bodies(method).assemble()
    levels = ContactLevels.of(problem)
    assert [len(contacts.node) for _, contacts in levels.coarse] == [9, 4]
    # the coarse space is that of the meshes: v is interpolated from its values at coarse nodes
    finest, P = levels.hierarchy.levels[0], problem.levels[0]
    coarse = np.random.default_rng(1).standard_normal((finest.P.coarse, 3))
    coarse.reshape(-1)[finest.P.coarse_idle] = 0.0
    fine = np.zeros((finest.A.nodes, 3))
    finest.P.add(coarse, fine)
    v = levels.displacement(fine)
    same, place = (P == 1).nonzero()
    values = np.zeros(P.shape[1])
    values[place] = v[same]
    assert np.abs(P @ values - v).max() < 1e-12


def test_without_levels_coarse_ones_are_made():
    problem = replace(cube(8).assemble(), levels=(), guess=None)
    solution = drive(problem, ContactMultigrid(), tolerance=1e-8)
    assert solution.converged
    assert solution.convergence.iterations <= 25
    assert solution.counts["slip"] == REFERENCE["level3"]["slip"]


def test_units_do_not_matter():
    ours = drive(cube(4).assemble(), ContactMultigrid(), tolerance=1e-9)
    scaled = drive(cube(4, unit=1e3).assemble(), ContactMultigrid(), tolerance=1e-9)
    assert ours.convergence.iterations == scaled.convergence.iterations
    assert np.allclose(1e6 * ours.r, scaled.r, rtol=0, atol=1e-3 * np.abs(ours.r).max())


def test_nesting_and_acceleration_save_cycles():
    problem = cube(8).assemble()
    cycles = {
        key: drive(problem, solver, tolerance=1e-8).convergence.iterations
        for key, solver in {
            "full": ContactMultigrid(),
            "zero start": ContactMultigrid(nested=False),
            "plain": ContactMultigrid(depth=0),
        }.items()
    }
    assert cycles["full"] < cycles["zero start"] <= 20
    assert cycles["full"] < cycles["plain"] <= 30


def test_an_old_tangent_is_renewed_where_it_slows_the_cycles(monkeypatch):
    """However few states have changed since, and however little the error has fallen."""
    monkeypatch.setattr("amontons.solvers.multigrid.cycles.FEW", 1.0)
    solver = ContactMultigrid(nested=False, update_ratio=1e-12)
    solution = drive(cube(8).assemble(), solver, tolerance=1e-8)
    assert solution.convergence.iterations <= 20  # 60 with the first tangent


def test_contacts_solve_once_where_the_rows_they_touch_hold_little_residual(monkeypatch):
    problem = two_bodies("mortar").assemble()
    sweep, solved = ContactNodes.sweep, []

    def counted(self, *arguments):
        solved[-1] += len(self.node)
        sweep(self, *arguments)

    monkeypatch.setattr(ContactNodes, "sweep", counted)
    for little in (0.0, cycles.LITTLE, np.inf):
        monkeypatch.setattr(cycles, "LITTLE", little)
        solved.append(0)
        assert drive(problem, ContactMultigrid()).convergence.iterations <= 11
    assert solved[0] > solved[1] > solved[2]


def test_a_start_near_the_solution_is_used():
    problem = cube(4).assemble()
    first = drive(problem, ContactMultigrid(), tolerance=1e-6)
    again = drive(problem, ContactMultigrid(), tolerance=1e-8, start=first)
    assert again.converged
    assert again.convergence.iterations < first.convergence.iterations


def test_two_solves_at_once_do_not_disturb_each_other():
    problem = cube(4).assemble()
    other = problem.with_mu(0.1)
    expected = [drive(p, ContactMultigrid(), tolerance=1e-10).r for p in (problem, other)]
    runs = [_states(p) for p in (problem, other)]
    for _ in range(25):
        found = [next(run) for run in runs]
    for r, reference in zip(found, expected, strict=True):
        assert np.abs(r - reference).max() < 1e-7 * np.abs(reference).max()


def _states(problem):
    from amontons.solvers.contract import Iterate, Target

    start = Iterate(np.zeros((problem.contacts, problem.dimension)))
    for iterate in ContactMultigrid(report=1).iterates(problem, start, Target(1e-14)):
        yield iterate.r


@pytest.mark.parametrize("make", [lambda: cube(4), lambda: two_bodies("mortar")])
def test_matrices_of_the_problem_are_not_touched(make):
    problem = make().assemble()
    hierarchies = [problem.hierarchy, ContactLevels.of(problem).hierarchy]

    def arrays_of(hierarchy):
        matrices = [part for level in hierarchy.levels for part in vars(level.A).values()]
        blocks = [x for part in matrices for x in (part if isinstance(part, tuple) else [part])]
        return [*(x for x in blocks if isinstance(x, np.ndarray)), hierarchy.coarse_inverse]

    before = [[array.copy() for array in arrays_of(h)] for h in hierarchies]
    assert drive(problem, ContactMultigrid(), tolerance=1e-8).converged
    for hierarchy, arrays in zip(hierarchies, before, strict=True):
        for old, new in zip(arrays, arrays_of(hierarchy), strict=True):
            np.testing.assert_array_equal(old, new)


def test_a_problem_without_nodes_is_refused_with_a_reason():
    rng = np.random.default_rng(0)
    problem = FrictionProblem.from_global(
        np.eye(6) * 2, rng.standard_normal((6, 6)), np.ones(6), np.zeros((2, 3)), [0.5, 0.5]
    )
    solution = drive(problem, ContactMultigrid())
    assert solution.convergence.outcome is Outcome.BREAKDOWN
    assert "node" in solution.convergence.detail


@pytest.mark.parametrize(
    "options", [{"depth": -1}, {"coarse_tolerance": 0.0}, {"contact_sweeps": 0}]
)
def test_bad_options(options):
    with pytest.raises(InvalidInput, match=next(iter(options))):
        ContactMultigrid(**options)


# ------------------------------------------------------------------ the linear counterpart
@pytest.mark.parametrize("given", [True, False], ids=["geometric", "algebraic"])
@pytest.mark.parametrize("name", ["cube", "tetrahedra", "plane", "symmetric"])
def test_linear_multigrid_solves(name, given):
    model = cube(8) if name == "cube" else MODELS[name]()
    problem = model.assemble()
    solver = GeometricMultigrid(
        problem.levels if given else (), dimension=problem.dimension, tolerance=1e-10
    )
    factor = solver.factor(problem.M, problem.near_nullspace)
    b = np.cos(np.arange(problem.unknowns))
    x = factor.solve(b)
    assert np.linalg.norm(problem.M @ x - b) <= 1e-9 * np.linalg.norm(b)
    assert factor.iterations <= 25
    assert factor.solve(np.stack([b, 2 * b], axis=1)).shape == (len(b), 2)


def test_linear_multigrid_cycles_do_not_grow_with_the_mesh():
    counts = []
    for cells in (4, 8):
        problem = cube(cells).assemble()
        factor = GeometricMultigrid(problem.levels, tolerance=1e-8).factor(
            problem.M, problem.near_nullspace
        )
        factor.solve(problem.f)
        counts.append(factor.iterations)
    assert counts[1] <= counts[0] + 1 <= 13


def test_linear_multigrid_says_what_it_can_not_do():
    with pytest.raises(InvalidInput, match="nodes of 3"):
        GeometricMultigrid().factor(sparse.eye_array(4, format="csc"))
    with pytest.raises(InvalidInput, match="tolerance"):
        GeometricMultigrid(tolerance=2)
    problem = cube(4).assemble()
    hard = GeometricMultigrid(problem.levels, max_iterations=1)
    with pytest.raises(SingularOperator, match="1 iterations"):
        hard.factor(problem.M, problem.near_nullspace).solve(problem.f)


def test_nodes_with_some_unknowns_left():
    nodes = Nodes.of(np.array([0, 1, 2, 1, 2, 0, 2]))
    assert nodes.count == 3
    x = np.arange(1.0, 8)
    assert (nodes.spread(x) == [[1, 2, 3], [0, 4, 5], [6, 0, 7]]).all()
    assert (nodes.gather(nodes.spread(x)) == x).all()
