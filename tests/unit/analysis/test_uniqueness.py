"""The verdict on a problem, by hand, against all solutions, and on the command line."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from uniqueness_checker import check_witness

import amontons as am
from amontons.analysis.certificates.uniqueness import Cause, Verdict, quick_verdict
from amontons.app.cli import main
from amontons.core.errors import InvalidInput
from amontons.mechanics.ready.gallery import box_tower, one_contact_2d
from amontons.mechanics.ready.hild import hild_triangle
from amontons.solvers import Iterate

EVERY, THIS = Verdict.UNIQUE_EVERY_LOAD, Verdict.UNIQUE_THIS_LOAD
SEVERAL, UNDECIDED = Verdict.NOT_UNIQUE, Verdict.UNDECIDED


@pytest.mark.parametrize(
    ("mu", "verdict"), [(0.0, EVERY), (1.0, EVERY), (1.3, THIS), (2, SEVERAL)]
)
def test_one_contact_by_hand(mu, verdict):
    # critical friction 1.25; for this load the open state is alone up to 1.4
    problem = one_contact_2d(mu)
    found = am.uniqueness(problem)
    assert found.verdict is verdict
    assert found.friction == mu
    assert found.verdict.value in str(found).replace(" ", "_")
    assert (found.other is not None) == (verdict is SEVERAL)
    if found.other is not None:
        assert problem.error(found.other.r) < 1e-8
    assert found.lower <= 1.25 <= found.upper * (1 + 1e-9)


def random_problem(seed):
    random = np.random.default_rng(seed)
    nc = int(random.integers(1, 6))
    A = random.standard_normal((2 * nc, 2 * nc))
    W = A @ A.T / nc + np.eye(2 * nc) * random.uniform(0.05, 1)
    q = random.standard_normal((nc, 2))
    return am.FrictionProblem.from_delassus(W, q, random.uniform(0, 3, nc))


@pytest.mark.parametrize("seed", range(30))
def test_verdicts_agree_with_all_solutions(seed):
    problem = random_problem(seed)
    every = am.all_solutions(problem)
    assert every.complete
    found = am.uniqueness(problem)
    assert found.verdict in ((EVERY, THIS) if len(every) == 1 else (SEVERAL,))
    assert (found.friction < found.lower) == (found.verdict is EVERY)
    if found.verdict is EVERY:
        assert len(every) == 1
    if found.other is not None:
        assert problem.error(found.other.r) < 1e-8
    if found.witness is not None and np.isfinite(found.upper):
        mu = problem.mu
        assert check_witness(problem.W, mu / mu.max(), found.witness, found.upper)


@pytest.mark.parametrize("seed", [0, 1, 3, 4])
def test_above_the_critical_friction_some_load_has_several_solutions(seed):
    problem = random_problem(seed)
    bounds = am.critical_friction(problem)
    r, u = np.zeros((2, problem.contacts, 2))  # inside the piece of the witness
    for i, letter in enumerate(bounds.witness.pattern):
        if letter == "f":
            u[i, 0] = 1
        else:
            slip = {"s": 0, "+": 1, "-": -1}[letter]
            r[i], u[i, 1] = (1, slip), -slip
    shape = problem.mu / problem.mu.max()
    for part, several in ((1.01, True), (0.99, False)):
        mu = part * bounds.upper * shape
        here = r * np.column_stack([np.ones(len(mu)), mu])
        load = u - (problem.W @ here.ravel()).reshape(-1, 2)
        found = am.all_solutions(problem.with_mu(mu).with_load(load))
        assert found.complete
        assert len(found) >= 3 if several else len(found) == 1
        assert sum(s.orientation for s in found.solutions) == 1


def test_a_solution_at_hand_is_used_and_models_are_taken():
    model = hild_triangle(3, mu=1.0)
    assert am.uniqueness(model, am.solve(model)).verdict is EVERY
    model = hild_triangle(2, mu=3.5)
    found = am.uniqueness(model, am.solve(model))
    assert found.verdict is SEVERAL
    assert model.assemble().error(found.other.r) < 1e-8


def test_rigid_blocks_have_many_reactions():
    found = am.uniqueness(box_tower(2), time_limit=2)
    assert found.verdict in (SEVERAL, UNDECIDED)
    assert found.lower == 0
    assert "singular" in quick_verdict(box_tower()).reason


def test_small_friction_is_safe_in_3d():
    random = np.random.default_rng(0)
    A = random.standard_normal((9, 9))
    W = A @ A.T / 9 + np.eye(9)
    problem = am.FrictionProblem.from_delassus(W, random.standard_normal((3, 3)), [0.1] * 3)
    found = am.uniqueness(problem)
    assert found.verdict is EVERY
    assert found.criterion == "energy"
    assert quick_verdict(problem).verdict is EVERY
    assert quick_verdict(problem.with_mu(50.0)).verdict is UNDECIDED


def test_given_friction_has_one_solution():
    W = np.array([[1.0, 0.8], [0.8, 1.0]])
    problem = am.FrictionProblem.from_delassus(W, [[0.2, 1.0]], am.Tresca(np.array([5.0])))
    assert am.uniqueness(problem).verdict is EVERY
    singular = am.FrictionProblem.from_delassus(
        np.ones((2, 2)), [[0.2, 1.0]], am.Tresca(np.array([5.0]))
    )
    assert am.uniqueness(singular).verdict is UNDECIDED


def test_without_contacts_or_load():
    empty = am.FrictionProblem.from_delassus(np.zeros((0, 0)), np.zeros((0, 2)), [])
    assert am.uniqueness(empty).verdict is EVERY
    rest = one_contact_2d(2.0).with_load(np.zeros((1, 2)))
    assert am.uniqueness(rest).verdict is UNDECIDED
    assert am.uniqueness(rest.with_mu(1.0)).verdict is EVERY


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(
    ("gap", "verdict"), [(-1e-3, UNDECIDED), (-1e-17, EVERY), (1.0, EVERY)]
)
def test_a_contact_that_can_not_react(dimension, gap, verdict):
    W = np.diag([1.0] * dimension + [0.0] * dimension)
    q = np.zeros((2, dimension))
    q[0, 0], q[1, 0] = -1.0, gap
    problem = am.FrictionProblem.from_delassus(W, q, [0.3, 0.3])
    found = am.uniqueness(problem)
    assert found.verdict is quick_verdict(problem).verdict is verdict
    assert ("no solution" in found.reason) == (verdict is UNDECIDED)
    every = am.all_solutions(problem)
    assert every.complete
    assert len(every) == (verdict is EVERY)


@pytest.mark.parametrize("W", [np.diag([1.0, 0.0]), np.diag([0.0, 1.0]), np.diag([-1.0, 1.0])])
def test_without_coupling_w_must_be_definite(W):
    problem = am.FrictionProblem.from_delassus(W, [[-1.0, 0.0]], [0.5])
    assert quick_verdict(problem).verdict is UNDECIDED
    assert quick_verdict(problem).lower == 0


def test_the_other_solution_is_not_the_given_one():
    problem = one_contact_2d(2.0)
    for known in am.all_solutions(problem).solutions:
        solution = am.solve(problem, start=Iterate(np.array(known.r)))
        found = am.uniqueness(problem, solution)
        assert found.solution is solution
        assert np.abs(found.other.r - solution.r).max() > 0.1


def test_contacts_given_twice_share_their_reactions_in_many_ways():
    W = np.tile(np.eye(2), (2, 2))
    problem = am.FrictionProblem.from_delassus(W, [[-1.0, 0.1]] * 2, [0.5, 0.5])
    assert am.uniqueness(problem).verdict is SEVERAL


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(
    ("unit", "far", "able"), [(1.0, 1e10, 1.0), (1e20, 0.5, 0.0), (1e-12, 1e7, 0.0)]
)
def test_a_second_contact_hides_no_solution_of_the_first(dimension, unit, far, able):
    # W = [[1, .8], [.8, 1]] at mu = 2 has three solutions; the second contact stays open
    W = np.eye(2 * dimension)
    W[0, 1] = W[1, 0] = 0.8
    W[dimension:] *= able
    q = np.zeros((2, dimension))
    q[0, :2], q[1, 0] = (0.2, 1.0), far
    problem = am.FrictionProblem.from_delassus(unit * W, q, [2.0, 2.0])
    assert am.uniqueness(problem, time_limit=20).verdict is SEVERAL
    assert len(am.all_solutions(problem, time_limit=20)) == 3
    assert len(am.multistart(problem, starts=100)) == 3


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("larger", [1e4, 1e10])
@pytest.mark.parametrize("second", [(-1.0, 0.0), (0.2, 1.0)])
def test_loads_of_different_size_are_resolved_or_nothing_is_claimed(dimension, larger, second):
    # three solutions at the first contact; the second has one and is loaded much more
    W = np.eye(2 * dimension)
    W[0, 1] = W[1, 0] = 0.8
    q = np.zeros((2, dimension))
    q[0, :2], q[1, :2] = (0.2, 1.0), np.multiply(larger, second)
    problem = am.FrictionProblem.from_delassus(W, q, [2.0, 0.5])
    limit = 20 if larger < 1e6 else 2  # the larger ones in space end by it
    found = am.all_solutions(problem, time_limit=limit)
    assert found.complete == (larger < 1e6)
    assert len(found) == 3 or not found.complete
    assert am.uniqueness(problem, time_limit=limit).verdict in (SEVERAL, UNDECIDED)


def test_large_problems_are_not_examined_quickly():
    n = 201
    problem = am.FrictionProblem.from_delassus(np.eye(2 * n), np.ones((n, 2)), np.ones(n))
    found = quick_verdict(problem)
    assert found.cause is Cause.LARGE
    assert found.record["cause"] == "large"
    assert "a bound takes" in found.brief
    rested = quick_verdict(problem, spent=1e10)  # a fifth of which is enough
    assert rested.verdict is EVERY


def test_bad_input_is_refused():
    with pytest.raises(InvalidInput, match="time_limit"):
        am.uniqueness(one_contact_2d(), time_limit=-1)
    with pytest.raises(InvalidInput, match="problem"):
        am.uniqueness(3)
    with pytest.raises(InvalidInput, match="problem"):
        am.critical_friction("hild")


# ------------------------------------------------------------------- command line
def run(*arguments):
    return CliRunner().invoke(main, list(arguments))


def test_command_line():
    result = run("uniqueness", "example:hild", "--json", "-")
    assert result.exit_code == 0
    data = json.loads(result.stdout)
    assert data.keys() >= {"lower", "upper", "criterion", "verdict", "witness", "other"}
    assert data["verdict"] == "not_unique"
    assert data["other"]["error"] < 1e-8
    assert len(data["witness"]["pattern"]) == 8
    assert 1.548 < data["lower"] < data["upper"] < 1.549
    text = run("uniqueness", "example:hild", "--mu", "1").stdout
    assert "unique every load" in text
    assert "full contact only: 2.157, which is not safe" in text.replace("2.1571", "2.157")
    assert run("uniqueness", "example:hild", "--mu", "-1").exit_code == 2
    assert "--time-limit" in run("uniqueness", "example:hild", "--time-limit", "0").stderr


def test_solve_prints_the_cheap_part(tmp_path):
    plain = run("solve", "example:hild", "--set", "mesh.refine=1", "-o", str(tmp_path))
    assert "uniqueness: not settled. Friction is above the critical one" in plain.stdout
    safe = ["--set", "contact.friction.coulomb=0.2"]
    assert "one solution for every load" in run(
        "solve", "example:hild", *safe, "-o", str(tmp_path)
    ).stdout  # fmt: skip
    data = json.loads((tmp_path / "solution.json").read_text())
    assert data["uniqueness"]["verdict"] == "unique_every_load"
    full = run("solve", "example:hild", "--uniqueness", "-o", str(tmp_path))
    assert "not unique" in full.stdout
    assert full.exit_code == 0


@pytest.mark.parametrize("ask", [am.uniqueness, am.all_solutions, am.multistart])
def test_friction_without_limits_is_refused(ask):
    problem = am.FrictionProblem.from_delassus(np.eye(2), [[-1.0, 0.5]], [1e50])
    with pytest.raises(InvalidInput, match="mu: expected friction of at most"):
        ask(problem)
    assert len(am.all_solutions(problem.with_mu(1e6)).solutions) == 1


def test_a_tangent_that_supports_hold_makes_other_reactions_not_other_motions():
    """Half of a block pressed on another: any r_T will do where the plane of symmetry is."""
    steel = am.LinearElastic(young=1e3, poisson=0.3)
    low = am.Body(am.box((1, 1), cells=(20, 2)), steel, name="low")
    high = am.Body(am.box((1, 1), cells=(26, 2), origin=(0, 1)), steel, name="high")
    fixes = [am.Fix("low.bottom", (None, 0)), am.Fix("high.top", (None, -0.01))]
    sides = [am.Fix("low.left", (0, None)), am.Fix("high.left", (0, None))]
    contact = am.Contact("high.bottom", master="low.top", mu=0.3, method="mortar")
    found = am.uniqueness(am.Model([low, high], supports=fixes + sides, contacts=[contact]))
    assert found.verdict is SEVERAL
    assert found.indeterminacy.motion == "unique_every_load"
    assert found.indeterminacy.reactions.open.sum() == 1  # that contact alone


def test_no_w_is_told_in_plain_words():
    block = am.Body(am.box((1, 1), cells=2), am.LinearElastic(young=1e3, poisson=0.3))
    contact = am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.3)
    found = am.uniqueness(am.Model([block], [], [contact], [am.Traction("top", (0, -1))]))
    assert found.verdict is UNDECIDED
    assert found.reason == "Contact alone holds a body, so there is no W."
