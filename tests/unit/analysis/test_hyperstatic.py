"""Where W is singular: the motion and the reactions apart, against closed forms."""

import numpy as np
import pytest
from block_assemblies import SQUARE, table
from scipy import sparse
from status_polytopes import Polytopes

import amontons as am
from amontons.analysis.certificates.verdict import Verdict
from amontons.analysis.hyperstatic.ball import motion_bound
from amontons.analysis.hyperstatic.face import centred, face_of, longest
from amontons.analysis.hyperstatic.held_tangents import held_tangents
from amontons.analysis.hyperstatic.indeterminacy import indeterminacy
from amontons.analysis.hyperstatic.motion import other_motion, rest
from amontons.analysis.hyperstatic.ranges import reaction_ranges
from amontons.core.clock import Deadline
from amontons.mechanics.ready.hild import hild_triangle
from amontons.mechanics.ready.packings import SpherePacking
from amontons.solvers.newton.frictionless import without_friction


@pytest.mark.parametrize("form", ["global", "delassus"])
def test_a_table_on_four_legs_rests_in_one_way_and_stands_in_many(form):
    """Every leg may carry nothing, or half of the weight; twelve forces, six balances.

    In the Delassus form W of the same table, which is what the twelve forces are felt by.
    """
    legs = SQUARE * 6  # more rows than lists are made of: six times the same legs
    problem = table(legs)
    problem = problem if form == "global" else problem.condensed()
    found = am.uniqueness(problem, time_limit=60)
    apart = found.indeterminacy
    assert found.verdict is Verdict.NOT_UNIQUE
    assert apart.motion == "unique_this_load"
    assert apart.reactions.dimension == 3 * 24 - 6
    assert apart.reactions.open.all()
    ranges = apart.reactions
    assert ranges.exact.any()
    np.testing.assert_allclose(ranges.low[ranges.exact, 0], 0.0, atol=1e-6)
    np.testing.assert_allclose(ranges.high[ranges.exact, 0], 2.0, rtol=1e-5)
    assert (ranges.most >= 2.0 * (1 - 1e-5)).all()  # a bound of what was attained
    assert problem.error(ranges.other) < 1e-8
    assert "motion is unique" in found.in_full
    assert found.record["reactions"]["contacts"] == list(range(24))


def test_three_legs_leave_the_floor_only_horizontal_forces_to_choose():
    legs = [(-1.0, -1.0), (1.0, -1.0), (0.0, 2.0)]
    problem = table(legs, weight=3.0)
    solution = am.solve(problem)
    face = face_of(problem, solution, Deadline.after(10))
    found = reaction_ranges(face, solution.r, Deadline.after(20))
    assert found.dimension == 3  # nine forces
    np.testing.assert_allclose(found.low[:, 0], 1.0, atol=1e-6)
    np.testing.assert_allclose(found.high[:, 0], 1.0, atol=1e-6)
    assert (found.high[:, 1] - found.low[:, 1]).max() > 0.1
    assert (np.hypot(found.other[:, 1], found.other[:, 2]) <= 0.5 * found.other[:, 0]).all()


def test_what_is_attained_solves_the_problem_with_the_same_motion():
    problem = SpherePacking(40, mu=0.8, seed=3).problem(1e-3)
    solution = am.solve(problem, tolerance=1e-10)
    apart = am.uniqueness(problem, solution, time_limit=30).indeterminacy
    other = apart.reactions.other
    assert problem.error(other) < 1e-8
    u = problem.condensed().motion(other)[0]
    speed = np.abs(problem.free_velocity).max()
    np.testing.assert_allclose(u, solution.u, atol=1e-8 * speed)


def test_the_ball_holds_all_motions():
    """Friction at random: none moves farther from another than the bound says."""
    problem = SpherePacking(30, mu=0.3, seed=1).problem(1e-3, shake=0.02)
    solution = am.solve(problem)
    bound = motion_bound(problem, solution, Deadline.after(20))
    free = np.sqrt(problem.f @ problem.solve_M(problem.f))
    random = np.random.default_rng(0)
    for mu in random.uniform(0, 2, (5, problem.contacts)):
        v = am.solve(problem.with_mu(mu)).v
        assert np.sqrt(v @ problem.M @ v) <= np.sqrt(bound.energy) * free * (1 + 1e-6)
    local = problem.condensed()
    in_forces = motion_bound(local, am.solve(local), Deadline.after(20))
    assert in_forces.distance == pytest.approx(bound.distance, rel=1e-4)


def test_another_motion_is_found_beside_doubled_contacts():
    """Hild's triangle above its second friction, every contact twice: W has half its rank."""
    single = hild_triangle(6).assemble().condensed().with_mu(4.8)
    W = single.W if isinstance(single.W, np.ndarray) else single.W.toarray()
    n = single.contacts
    twice = np.arange(2 * n).reshape(n, 2)
    rows = np.concatenate([twice, twice]).ravel()
    problem = am.FrictionProblem.from_delassus(
        W[np.ix_(rows, rows)], single.q[np.r_[:n, :n]], np.full(2 * n, 4.8)
    )
    listed = am.all_solutions(single)
    assert len(listed) > 1
    stuck = next(s for s in listed.solutions if s.pattern == "ssssss")
    first = am.solve(problem, start=am.Iterate(np.concatenate([stuck.r, stuck.r]) / 2))
    assert np.abs(first.r[:n] + first.r[n:] - stuck.r).max() < 1e-6
    other, compared = other_motion(problem, first, Deadline.after(30))
    assert compared > 0
    assert other is not None
    assert max(other.errors) < 1e-9
    summed = other.solution.r[:n] + other.solution.r[n:]
    assert min(np.abs(summed - s.r).max() for s in listed.solutions) < 1e-5


def test_held_tangents_are_zero_rows_at_rest():
    W = np.diag([1.0, 0.0, 2.0, 1.0, 0.0, 0.0])
    q = np.array([[-1.0, 0.0], [-1.0, 0.5], [1.0, 0.0]])
    held = held_tangents(W, q)
    assert held.tolist() == [[False, True], [False, False], [False, False]]


def test_the_way_to_the_edge_of_a_cone():
    """From (1, 0, 0) sideways to |r_T| = mu r_N, and downwards along the axis."""
    problem = table([(0.0, 0.0)], mu=0.5)
    face = face_of(problem, am.solve(problem), Deadline.after(5))
    p = np.array([[0.0, -1.0, 1.0, 0.0], [1.0, 0.0, 0.5, 2.0], [0.0, 0.0, 0.0, 0.0]])
    np.testing.assert_allclose(longest(face, face.c0, p), [0.5, 1.0, np.inf, 0.25])
    assert centred(face, Deadline.after(5))[0] == pytest.approx(face.c0, abs=1e-6)


# --------------------------------------------------------- against polytopes of all statuses
def plane(seed):
    """(M, H, f, w, mu) with fewer unknowns than reactions; every third has a contact twice."""
    random = np.random.default_rng(seed)
    nc = int(random.integers(2, 4))
    n = int(random.integers(2, min(2 * nc - 1, 5)))
    H = random.standard_normal((n, 2 * nc))
    if seed % 3 == 0:
        H = random.integers(-2, 3, (n, 2 * nc)).astype(float)
    if seed % 3 == 2:
        H[:, 2:4] = H[:, :2]
    M = np.diag(random.uniform(0.5, 2, n))
    f = -H[:, ::2] @ random.uniform(0, 1, nc) + 0.5 * random.standard_normal(n)
    w = np.zeros((nc, 2))
    if random.random() < 0.4:
        w[random.integers(nc), 0] = random.uniform(0, 0.5)
    return M, H, f, w, random.uniform(0.02, 1.0 if seed % 2 else 0.2, nc)


def examined(parts):
    """(problem, solution, what is known of it)."""
    M, H, f, w, mu = parts
    problem = am.FrictionProblem.from_global(
        sparse.csc_array(M), sparse.csc_array(H), f, w, mu
    )
    solution = am.solve(problem, tolerance=1e-10, check=False)
    assert solution.converged
    return problem, solution, indeterminacy(problem, solution, Deadline.after(20))


# rest excluded, unique and not, with reactions that are and are not; a contact that moves at
# the solution's error (16), one that may carry on the edge alone (192), unbounded ones (73)
@pytest.mark.parametrize("seed", [5, 16, 47, 73, 192])
def test_nothing_is_claimed_that_the_statuses_refute(seed):
    parts = M, H, f, w, mu = plane(seed)
    problem, solution, apart = examined(parts)
    every = Polytopes(*parts)
    low, high = every.motions()
    size = np.abs(np.linalg.solve(M, f)).max()
    one = (high - low).max() < 1e-6 * size
    assert not apart.motion_is_unique or one
    assert apart.other is None or not one
    if apart.confined is not None and not apart.confined.everywhere:
        least, most = Polytopes(*parts, most=apart.confined.within * (1 - 1e-6)).motions()
        assert (most - least).max() < 1e-6 * size
    if apart.bound is not None:
        worst = max(np.abs(low - solution.v).max(), np.abs(high - solution.v).max())
        free = np.sqrt(f @ np.linalg.solve(M, f))
        assert worst * np.sqrt(np.diag(M).min()) <= apart.bound.distance * free * (1 + 1e-6)
    if not one:
        return
    for k, component in enumerate(np.eye(every.m + every.n)[: every.m]):
        least, most = every.extremes(component)
        i, axis = divmod(k, 2)
        if apart.reactions_are_unique:
            assert most - least < 1e-6
        assert least - 1e-6 <= apart.reactions.low[i, axis]
        assert apart.reactions.high[i, axis] <= most + 1e-6 * (1 + abs(most))
        assert axis or apart.reactions.most[i] >= most * (1 - 1e-6) - 1e-7


def test_bounded_reactions_prove_motions_that_slip():
    """Of random plane problems whose W is singular; the bound of reactions holds, too."""
    proved = 0
    for seed in range(30, 42):
        parts = plane(seed)
        _, _, apart = examined(parts)
        if apart.confined is None or not apart.confined.everywhere:
            continue
        proved += 1
        every = Polytopes(*parts)
        low, high = every.motions()
        assert (high - low).max() < 1e-6
        normals = np.eye(every.m + every.n)[: every.m : 2]
        assert max(every.extremes(c)[1] for c in normals) <= apart.confined.bound
    assert proved >= 2


def test_rest_is_found_beside_a_motion():
    """A weight between two walls: falls where they do not press, hangs where they do."""
    H = np.array([[1.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 1.0]])
    M, mu = sparse.eye_array(2).tocsc(), np.full(2, 0.5)
    problem = am.FrictionProblem.from_global(
        M, sparse.csc_array(H), [0.0, -1.0], np.zeros((2, 2)), mu
    )
    falls = am.solve(problem.with_mu(0.0))
    falls = am.solve(problem, start=falls)
    assert np.abs(falls.v).max() > 0.5
    apart = indeterminacy(problem, falls, Deadline.after(20))
    assert apart.motion == "not_unique" and not apart.rest_excluded
    assert np.abs(apart.other.solution.u - falls.u).max() > 0.01
    resting = rest(problem, Deadline.after(10))
    np.testing.assert_allclose(H @ resting.r.ravel(), [0.0, 1.0], atol=1e-9)
    assert rest(problem.with_mu(0.0), Deadline.after(10)).excluded


def test_a_ball_of_strains_where_contact_holds_the_bodies():
    """A block on a floor under its weight: static, so that its motion as a whole is loose."""
    block = am.Body(am.box((1, 1), 2), am.LinearElastic(10.0, 0.3))
    model = am.Model([block], contacts=[am.Contact("bottom", am.Plane((0, 1)), mu=0.3)],
                     loads=[am.BodyForce((0.0, -1.0))])  # fmt: skip
    problem = model.assemble()
    bound = motion_bound(problem, am.solve(problem), Deadline.after(20))
    assert bound.strains
    K, energies = problem.M, []
    for mu in (0.0, 0.1, 0.3, 1.0):
        v = am.solve(problem.with_mu(mu)).v
        energies.append(v @ (K @ v))
    at = energies[2]
    assert max(energies) <= bound.energy * at * (1 + 1e-6)


def test_blocks_on_blocks_without_friction_press_and_lie_as_by_other_methods():
    """Contact alone holds three of them; without friction nothing holds them sideways."""
    stone = am.LinearElastic(10.0, 0.3, density=1.0)
    made = am.Wall(2, 1, size=(2.0, 1.0), cells=(4, 2), material=stone)
    problem, aside = (made.model([], [am.BodyForce((x, -1.0))]).assemble() for x in (0.0, 0.5))
    assert problem.loose_modes.shape[1] >= 9
    found = without_friction(problem, Deadline.after(20))
    assert found.balance < 1e-10 and found.p.min() >= 0
    u = problem.H.T[::2] @ found.v + problem.w[:, 0]
    assert u.min() > -1e-8 * np.abs(u).max() and np.abs(u * found.p).max() < 1e-8
    other = am.solve(problem.with_mu(0.0)).v
    energy = [v @ (problem.M @ v) for v in (found.v, other)]
    assert energy[0] == pytest.approx(energy[1], rel=1e-6)
    pushed = without_friction(aside, Deadline.after(20))
    assert pushed is None or pushed.balance > 1e-3  # nothing but friction would hold them


def test_an_unsymmetric_matrix_gets_no_bounds_that_need_symmetry():
    """The ball of the symmetric part is a point there, at rest, and the only motion slips."""
    W = np.kron(np.ones((2, 2)), [[1.0, 0.1], [-0.1, 0.01]])
    problem = am.FrictionProblem.from_delassus(W, [[-1.0, 0.0]] * 2, [0.3] * 2)
    solution = am.solve(problem, tolerance=1e-10)
    np.testing.assert_allclose(solution.u, [[0.0, -0.097 / 1.03]] * 2, atol=1e-9)
    found = indeterminacy(problem, solution, Deadline.after(5.0))
    assert found.bound is None and found.reactions is None and found.confined is None
    assert found.motion == "undecided" and "W is not symmetric, by 2.0e-01" in str(found)
