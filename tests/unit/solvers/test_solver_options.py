"""Options of the solvers: rho strategies, line searches, adaptive judgements, in words too."""

import itertools

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import FileFormatError, InvalidInput
from amontons.io.case.settings import make_solver
from amontons.linear import Direct
from amontons.mechanics.ready import gallery
from amontons.problem.friction import FrictionProblem
from amontons.problem.judge import measures as judge
from amontons.problem.law import Coulomb, Tresca
from amontons.solvers.augmentation import LARGEST_CONDITION, RhoStrategy, augmentation
from amontons.solvers.contract import Iterate, Target
from amontons.solvers.driver import drive
from amontons.solvers.newton.functions import AlartCurnier, JeanMoreau, NaturalMap
from amontons.solvers.newton.line_search import Armijo, FullStep, GoldsteinPrice, NonMonotone
from amontons.solvers.newton.semismooth import Condensed, block_diagonal
from amontons.solvers.sweeps.gauss_seidel import LONGEST, Batch

TOLERANCE = 1e-9
SPLIT = [RhoStrategy.SPLIT, RhoStrategy.SPLIT_CONDITION]
FUNCTIONS = [AlartCurnier(), JeanMoreau(), NaturalMap()]
SEARCHES = [FullStep(), Armijo(), NonMonotone(), GoldsteinPrice()]


def random_state(d, nc=40):
    random = np.random.default_rng(d)
    return random.standard_normal((nc, d)), random.standard_normal((nc, d)), random


@pytest.mark.parametrize("law", [Coulomb, Tresca])
@pytest.mark.parametrize("parts", [1, 2])
@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: type(f).__name__)
@pytest.mark.parametrize("d", [2, 3])
def test_jacobians_against_differences(d, function, parts, law):
    if parts == 2 and isinstance(function, NaturalMap):
        return
    r, u, random = random_state(d)
    rho = random.uniform(0.2, 2, (len(r), 2)) if parts == 2 else random.uniform(0.2, 2, len(r))
    law, h = law(random.uniform(0, 1.5, len(r))), 1e-6
    F, A, B = function.linearise(r, u, law, rho)
    np.testing.assert_allclose(F, function.residual(r, u, law, rho), atol=1e-14)
    for k in range(d):
        e = h * np.eye(d)[k]
        in_r = function.residual(r + e, u, law, rho) - function.residual(r - e, u, law, rho)
        in_u = function.residual(r, u + e, law, rho) - function.residual(r, u - e, law, rho)
        np.testing.assert_allclose(A[:, :, k], in_r / (2 * h), atol=1e-7)
        np.testing.assert_allclose(B[:, :, k], in_u / (2 * h), atol=1e-7)


@pytest.mark.parametrize("function", [AlartCurnier(), JeanMoreau()])
def test_equal_parts_are_one_rho(function):
    r, u, random = random_state(3)
    rho, law = random.uniform(0.2, 2, len(r)), Coulomb(np.full(len(r), 0.4))
    together = function.linearise(r, u, law, rho)
    apart = function.linearise(r, u, law, np.column_stack([rho, rho]))
    for one, two in zip(together, apart, strict=True):
        np.testing.assert_array_equal(one, two)


def test_natural_map_needs_one_rho():
    r, u, _ = random_state(3)
    law, rho = Coulomb(np.ones(len(r))), np.ones((len(r), 2))
    with pytest.raises(InvalidInput, match="whole cone needs one per contact"):
        NaturalMap().residual(r, u, law, rho)
    with pytest.raises(InvalidInput, match="whole cone needs one per contact"):
        NaturalMap().linearise(r, u, law, rho)
    for strategy in SPLIT:
        with pytest.raises(InvalidInput, match=f"one rho per contact, got {strategy.value}"):
            am.SemismoothNewton(function=NaturalMap(), rho_strategy=strategy)


# ------------------------------------------------------------------------------- rho
def block_problem(*blocks):
    """Contacts that do not see each other, with given W_ii."""
    d, nc = len(blocks[0]), len(blocks)
    W = np.zeros((nc * d, nc * d))
    for i, block in enumerate(blocks):
        W[i * d : i * d + d, i * d : i * d + d] = block
    return FrictionProblem.from_delassus(W, -np.ones((nc, d)), np.full(nc, 0.5))


DIAGONAL = block_problem(np.diag([2.0, 8.0, 4.0]), np.diag([10.0, 5.0, 1.0]))
EXPECTED = {
    RhoStrategy.CONSTANT: [1, 1],
    RhoStrategy.GLOBAL: [1 / 10, 1 / 10],
    RhoStrategy.PER_CONTACT: [1 / 8, 1 / 10],
    RhoStrategy.SPLIT: [[1 / 2, 1 / 8], [1 / 10, 1 / 5]],
    RhoStrategy.SPLIT_CONDITION: [[1 / 2, 4 / 8**2], [1 / 10, 1 / 5**2]],
    RhoStrategy.SPECTRAL: [1 / np.sqrt(2 * 8), 1 / np.sqrt(10 * 1)],
}


@pytest.mark.parametrize("strategy", RhoStrategy)
def test_rho_of_known_blocks(strategy):
    expected = 3.0 * np.array(EXPECTED[strategy])
    np.testing.assert_allclose(augmentation(DIAGONAL, strategy, 3.0), expected)


@pytest.mark.parametrize("strategy", [s for s in RhoStrategy if s is not RhoStrategy.CONSTANT])
def test_rho_turns_with_the_tangents_and_scales_with_the_units(strategy):
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    random = np.random.default_rng(3)
    root = random.standard_normal((3, 3))
    block = root @ root.T
    rho = augmentation(block_problem(block), strategy, 1.0)
    turned = augmentation(block_problem(turn @ block @ turn.T), strategy, 1.0)
    scaled = augmentation(block_problem(1e9 * block), strategy, 1.0)
    np.testing.assert_allclose(turned, rho, rtol=1e-10)
    np.testing.assert_allclose(scaled, rho / 1e9, rtol=1e-10)


@pytest.mark.parametrize("strategy", RhoStrategy)
def test_rho_of_singular_blocks_is_positive(strategy):
    held = block_problem(
        np.diag([1.0, 0, 2]), np.zeros((3, 3)), np.ones((3, 3)), np.diag([1, 0, 0])
    )
    rho = augmentation(held, strategy, 1.0)
    assert (rho > 0).all()
    assert np.isfinite(rho).all()
    assert rho.max() <= LARGEST_CONDITION


@pytest.mark.parametrize("form", ["delassus", "global", "global-whole"])
@pytest.mark.parametrize("strategy", RhoStrategy)
def test_every_strategy_finds_the_solution(strategy, form):
    problem = gallery.random_delassus(5, 8, 3, mu=0.4)
    linear = None
    if form != "delassus":
        root = np.linalg.cholesky(problem.W).T
        problem = FrictionProblem.from_global(
            np.eye(24), root, np.zeros(24), problem.q, problem.law
        )
        linear = Direct() if form == "global-whole" else None
    solver = am.SemismoothNewton(rho_strategy=strategy, linear=linear)
    found = drive(problem, solver, tolerance=TOLERANCE, max_iterations=300)
    assert found.converged, str(found)


# ----------------------------------------------------------------------- line search
def test_full_step_is_newton_as_printed():
    """[ABD] eq. (11) with its own dense matrices."""
    problem = gallery.random_delassus(2, 6, 3, mu=0.3)
    rho = problem.rho
    iterates = am.SemismoothNewton(line_search=FullStep()).iterates(
        problem, Iterate(np.zeros((6, 3))), Target(1e-8)
    )
    r = np.zeros((6, 3))
    for iterate in itertools.islice(iterates, 4):
        u = problem.velocity(r)[0]
        F, A, B = AlartCurnier().linearise(r, u, problem.law, rho)
        Phi = np.zeros((18, 18))
        for i in range(6):
            own = slice(3 * i, 3 * i + 3)
            Phi[own] = B[i] @ problem.W[own]
            Phi[own, own] += A[i]
        r = r - np.linalg.solve(Phi, F.ravel()).reshape(r.shape)
        np.testing.assert_allclose(iterate.r, r, atol=1e-9)


def lengths(search, merit, *, values=(1.0,)):
    return search.length(merit, list(values))


def test_step_lengths_of_a_known_merit():
    for search in SEARCHES:
        assert lengths(search, lambda t: abs(1 - t)) == 1.0  # Newton's model is right
    half = lambda t: abs(1 - 2 * t)  # noqa: E731  the step is twice too long
    assert lengths(FullStep(), half) == 1.0
    assert lengths(Armijo(), half) == 0.5
    assert lengths(NonMonotone(memory=2), half, values=(1.1, 1.0)) == 1.0
    assert lengths(NonMonotone(memory=1), half, values=(1.1, 1.0)) == 0.5
    assert lengths(GoldsteinPrice(), half) == 0.75  # 1/2 falls by all of it: too short


def test_step_lengths_where_nothing_helps():
    worse = lambda t: 1 + t  # noqa: E731
    assert lengths(Armijo(halvings=3), worse) == 1 / 8
    assert lengths(NonMonotone(halvings=3), worse) == 1 / 8
    assert lengths(GoldsteinPrice(trials=5), worse) == 1.0
    assert lengths(Armijo(halvings=2), lambda t: np.nan) == 1 / 4


def test_goldstein_price_refuses_short_steps():
    """theta falls faster than the tangent up to t = 2: bisection goes beyond 1."""
    far = lambda t: np.sqrt(max(1 - 1.9 * min(t, 0.2) / 0.2, 0)) if t < 0.5 else 0.99  # noqa: E731
    search = GoldsteinPrice()
    t = lengths(search, far)
    fall = 1 - far(t) ** 2
    assert 2 * search.least * t <= fall <= 2 * search.most * t


@pytest.mark.parametrize("search", SEARCHES, ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: type(f).__name__)
def test_every_line_search_finds_the_solution(search, function):
    problem = gallery.random_delassus(7, 8, 3, mu=0.3)
    solver = am.SemismoothNewton(function, line_search=search)
    found = drive(problem, solver, tolerance=TOLERANCE, max_iterations=300)
    assert found.converged, str(found)


def test_armijo_is_monotone():
    problem = gallery.random_delassus(11, 12, 3, mu=0.8)
    merits = []

    def watch(step, iterate):
        u = problem.velocity(iterate.r)[0]
        F = AlartCurnier().residual(iterate.r, u, problem.law, problem.rho)
        merits.append(np.linalg.norm(F / problem.rho[:, None]))

    solver = am.SemismoothNewton(line_search=Armijo(halvings=40))
    drive(problem, solver, tolerance=TOLERANCE, max_iterations=100, callback=watch)
    assert len(merits) > 2
    assert (np.diff(merits) <= 0).all()


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: Armijo(halvings=0), "halvings"),
        (lambda: Armijo(decrease=1.0), "decrease"),
        (lambda: NonMonotone(memory=0), "memory"),
        (lambda: GoldsteinPrice(trials=0), "trials"),
        (lambda: GoldsteinPrice(most=0.005), "least"),
        (lambda: am.SemismoothNewton(rho=0.0), "rho"),
        (lambda: am.GaussSeidel(batch=Batch.ADAPTIVE, anderson_depth=3), "batch"),
    ],
)
def test_refused_values(make, field):
    with pytest.raises(InvalidInput, match=f"^{field}: "):
        make()


def test_steps_that_run_away_end_without_a_warning():
    """Full steps on a problem without solution: reactions grow until they overflow."""
    H = np.array([[1.0, 0, -1, 0], [0, 1, 0, 1]])
    problem = FrictionProblem.from_delassus(
        H.T @ H + 1e-14 * np.eye(4), [[-1.0, 0.3], [-1.0, 0.2]], np.full(2, 0.5)
    )
    start = Iterate(np.full((2, 2), 1e150))
    for function in FUNCTIONS:
        solver = am.SemismoothNewton(function, line_search=FullStep(), rho=1e10)
        found = drive(problem, solver, start=start, max_iterations=50)
        assert np.isfinite(found.r).all()


# ------------------------------------------------------- singular generalised Jacobians
@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: type(f).__name__)
@pytest.mark.parametrize("mu", [0.0, 0.5])
@pytest.mark.parametrize("rank", [1, 3, 6])
def test_rank_deficient_without_tangential_motion(rank, mu, function):
    """u_T = 0 in the start: the kink of the disk of radius zero."""
    random = np.random.default_rng(rank)
    root = random.standard_normal((12, rank))
    W = root @ root.T
    r = np.zeros((4, 3))
    r[:2, 0] = 1.0
    q = -(W @ r.ravel()).reshape(4, 3)
    q[2:, 0] += 1.0
    problem = FrictionProblem.from_delassus(W, q, np.full(4, mu))
    found = drive(problem, am.SemismoothNewton(function), tolerance=1e-8, max_iterations=100)
    assert np.isfinite(found.r).all()
    if found.converged:
        assert problem.error(found.r) <= 1e-8
    else:
        assert found.convergence.error > 1e-8


@pytest.mark.parametrize("function", [AlartCurnier(), JeanMoreau()])
def test_contacts_without_bound_have_a_regular_row(function):
    r, u = np.zeros((2, 3)), np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    _, A, B = function.linearise(r, u, Coulomb(np.array([0.5, 0.0])), np.ones(2))
    np.testing.assert_array_equal(A[0], np.eye(3))  # open, u_T = 0
    np.testing.assert_array_equal(B[0], np.zeros((3, 3)))
    np.testing.assert_array_equal(A[1], np.diag([0, 1, 1]))  # closed without friction
    np.testing.assert_array_equal(B[1], np.diag([1, 0, 0]))


def test_jean_moreau_knows_at_no_pressure_that_friction_comes_with_it():
    r, u = np.zeros((1, 3)), np.array([[-1.0, 0.0, -2.0]])
    _, A, _ = JeanMoreau().linearise(r, u, Coulomb(np.array([0.5])), np.ones(1))
    np.testing.assert_allclose(A[0, 1:, 0], [0.0, -0.5])
    np.testing.assert_array_equal(A[0, 1:, 1:], np.eye(2))


def test_all_open_in_one_step_whatever_W():
    """r = 0 in one step: each row is r_i = 0, though W has rank one."""
    root = np.ones((9, 1))
    problem = FrictionProblem.from_delassus(
        root @ root.T, np.tile([1.0, 0, 0], (3, 1)), np.full(3, 0.4)
    )
    start = Iterate(np.full((3, 3), 1e-3))
    found = drive(problem, am.SemismoothNewton(), start=start, max_iterations=2)
    assert found.converged
    assert np.abs(found.r).max() < 1e-12


# ------------------------------------------------------------------ adaptive criterion
@pytest.mark.parametrize("tolerance", [1e-2, 1e-5, 1e-9])
@pytest.mark.parametrize(
    "problem",
    [
        gallery.random_delassus(1, 20, 3, mu=0.3),
        gallery.random_delassus(1, 20, 3, rank=30, mu=0.3),
        gallery.random_delassus(3, 20, 2, mu=0.3),
    ],
    ids=["full", "deficient", "planar"],
)
def test_adaptive_sweeps_are_the_same_with_fewer_judgements(problem, tolerance):
    limits = {"tolerance": tolerance, "max_iterations": 20_000}
    each = drive(problem, am.GaussSeidel(), **limits).convergence
    solution = drive(problem, am.GaussSeidel(batch=Batch.ADAPTIVE), **limits)
    found = solution.convergence
    assert solution.converged
    assert problem.error(solution.r) <= tolerance
    assert each.iterations <= found.iterations <= 2 * each.iterations + 10
    if each.iterations > 50:
        assert len(found.history) <= 0.3 * len(each.history)


def test_adaptive_sweeps_are_plain_sweeps():
    problem = gallery.random_delassus(1, 10, 3, mu=0.3)
    start, target = Iterate(np.zeros((10, 3))), Target(1e-10)
    plain = am.GaussSeidel().iterates(problem, start, target)
    adaptive = am.GaussSeidel(batch=Batch.ADAPTIVE).iterates(problem, start, target)
    for iterate in itertools.islice(adaptive, 3):
        expected = next(itertools.islice(plain, iterate.iterations - 1, None))
        np.testing.assert_allclose(iterate.r, expected.r, rtol=1e-12, atol=1e-14)  # their order


def test_adaptive_hands_out_iterates_where_nothing_converges():
    problem = FrictionProblem.from_delassus(  # no solution: W_NN = 0 and u_N < 0
        np.diag([1.0, 1, 1, 0, 1, 1]), -np.ones((2, 3)), np.full(2, 0.3)
    )
    found = drive(problem, am.GaussSeidel(batch=Batch.ADAPTIVE), max_iterations=3 * LONGEST)
    assert not found.converged
    assert found.convergence.iterations <= 4 * LONGEST


# -------------------------------------------------------------------- published error
def test_published_natural_error():
    """|F_nat(r)| / |q| by hand: one sticking contact that is 0.1 off."""
    law = Coulomb(np.array([0.5]))
    r, q = np.array([[2.0, 0.0, 0.0]]), np.array([[-2.0, 0.0, 0.0]])
    u = np.array([[0.1, 0.0, 0.0]])
    assert judge.published_natural_error(r, u, q, law) == pytest.approx(0.1 / 2)
    assert judge.published_fclib_error(r, 3 * u, 0 * q, law) == pytest.approx(0.3 / 2)
    assert judge.published_natural_error(r, u, 0 * q, law) == np.inf
    assert judge.published_natural_error(0 * r, 0 * u, 0 * q, law) == 0


def test_published_natural_error_of_a_solution():
    problem = gallery.random_delassus(1, 10, 3, mu=0.3)
    found = drive(problem, am.GaussSeidel(), tolerance=1e-10, max_iterations=5000)
    q = problem.q
    assert found.natural_error == judge.published_natural_error(
        found.r, found.u, q, problem.law
    )
    assert found.natural_error < 1e-8


# -------------------------------------------------------------------------- in words
@pytest.mark.parametrize(
    ("method", "options", "solver"),
    [
        ("gauss-seidel", {"batch": "adaptive"}, am.GaussSeidel(batch=Batch.ADAPTIVE)),
        (
            "semismooth-newton",
            {"rho_strategy": "split-condition", "line_search": "full-step"},
            am.SemismoothNewton(
                rho_strategy=RhoStrategy.SPLIT_CONDITION, line_search=FullStep()
            ),
        ),
        (
            "semismooth-newton",
            {"line_search": {"kind": "goldstein-price", "trials": "7"}},
            am.SemismoothNewton(line_search=GoldsteinPrice(trials=7)),
        ),
        (
            "semismooth-newton",
            {"line_search": {"memory": 2}},
            am.SemismoothNewton(line_search=NonMonotone(memory=2)),
        ),
        (
            "hybrid",
            {"first": {"relaxation": 1.3}, "main": {"kind": "semismooth-newton", "rho": 2}},
            am.Hybrid(am.GaussSeidel(relaxation=1.3, batch=100), am.SemismoothNewton(rho=2.0)),
        ),
    ],
)
def test_words_make_solvers(method, options, solver):
    assert make_solver(method, options) == solver


@pytest.mark.parametrize(
    ("method", "options", "words"),
    [
        ("gauss-seidel", {"batch": "adaptiv"}, "batch: expected a whole number or adaptive"),
        ("semismooth-newton", {"line_search": "armijjo"}, "mean 'armijo'"),
        ("semismooth-newton", {"line_search": {"kind": "armijo", "memory": 1}},
         "line_search.memory: armijo has no such field"),
        ("semismooth-newton", {"line_search": {"memory": 0}},
         "solver.line_search.memory: expected at least 1, got 0"),
        ("semismooth-newton", {"linear": {"threads": 1}}, "solver.linear.kind: missing"),
        ("semismooth-newton", {"rho": {"a": 1}}, "solver.rho: expected a number"),
        ("semismooth-newton", {"rho_strategy": "spit"}, "rho_strategy: expected constant or"),
        ("semismooth-newton", {"rho_strategy": "split", "function": "natural-map"},
         "solver.rho_strategy: natural map works on the whole cone"),
        ("semismooth-newton", {"line_search": {"kind": ["a"]}}, "unknown value"),
        ("hybrid", {"first": {"relaxation": 3}}, "solver.first.relaxation: expected between"),
    ],
)  # fmt: skip
def test_words_refused(method, options, words):
    with pytest.raises(InvalidInput, match=words):
        make_solver(method, options)


def test_on_the_command_line(tmp_path):
    from click.testing import CliRunner

    from amontons.app.cli import main

    flags = ["--method", "semismooth-newton", "-o", str(tmp_path / "out"), "--quiet"]
    fields = ("rho_strategy=split", "line_search.kind=goldstein-price", "line_search.trials=9")
    sets = [part for text in fields for part in ("--set", f"solver.{text}")]
    done = CliRunner().invoke(main, ["solve", "example:cylinder", *flags, *sets])
    assert done.exit_code == 0, done.output
    for text, words in (
        ("solver.line_search.trals=9", "line_search.trals: non-monotone has no such field"),
        ("solver.tolerance.x=9", "expected solver.FIELD=VALUE"),
        ("solver=3", "expected solver.FIELD=VALUE"),
    ):
        done = CliRunner().invoke(main, ["solve", "example:cylinder", *flags, "--set", text])
        assert done.exit_code == 2, done.output
        assert words in done.output


CASE = """
[mesh]
box = [1, 1]
cells = 2
[material.default]
law = "linear-elastic"
young = 1.0
poisson = 0.3
[[fix]]
on = "top"
value = [0, -0.1]
[[contact]]
slave = "bottom"
obstacle = { plane = { point = [0, 0], normal = [0, 1] } }
friction = { coulomb = 0.5 }
[solver]
method = "semismooth-newton"
rho_strategy = "spectral"
line_search = { kind = "non-monotone", memory = 3 }
"""


def test_in_a_case_file(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    solver = am.read_case(path, ["solver.line_search.halvings=4"]).settings.solver()
    assert solver == am.SemismoothNewton(
        line_search=NonMonotone(memory=3, halvings=4), rho_strategy=RhoStrategy.SPECTRAL
    )
    with pytest.raises(FileFormatError, match="solver.line_search.halvings: expected at least"):
        am.read_case(path, ["solver.line_search.halvings=0"])


def test_newton_step_by_blocks_is_the_dense_one():
    """(A + B W) dr = -F in blocks against a dense solve, in 2D and 3D."""
    random = np.random.default_rng(7)
    for d in (2, 3):
        nc = 12
        root = random.normal(size=(nc * d, nc * d))
        problem = am.FrictionProblem.from_delassus(
            root @ root.T, random.normal(size=(nc, d)), np.full(nc, 0.5)
        )
        F = random.normal(size=(nc, d))
        A = np.eye(d) + 0.1 * random.normal(size=(nc, d, d))
        B = 0.3 * random.normal(size=(nc, d, d))
        matrix = block_diagonal(A).toarray() + block_diagonal(B).toarray() @ problem.W
        dr = Condensed(problem)._by_blocks(F, A, B)
        np.testing.assert_allclose(
            dr.ravel(), np.linalg.solve(matrix, -F.ravel()), rtol=1e-6, atol=1e-8
        )
        singular = Condensed(problem)._by_blocks(F, 0 * A, 0 * B)
        assert singular is None
