"""Public results go to other processes and back, also when factors were made on the way."""

import copy
import pickle

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.mechanics.ready.gallery import random_delassus
from amontons.mechanics.ready.hild import hild_triangle as hild


def model(method="nodal", law=None, cells=4):
    body = am.Body(am.box((1, 1), cells), law or am.LinearElastic(1.0, 0.3, density=1.0))
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.3, method=method)
    return am.Model([body], supports=[am.Fix("top", (0, -0.01))], contacts=[contact])


def pair():
    upper = am.Body(am.box((1, 1), 4), am.LinearElastic(1.0, 0.3), "upper")
    lower = am.Body(am.box((1, 1), 3, origin=(0, -1)), am.LinearElastic(1.0, 0.3), "lower")
    return am.Model(
        [upper, lower], [am.Fix("upper.top", (0, -0.01)), am.Fix("lower.bottom", (0, 0))],
        [am.Contact("upper.bottom", master="lower.top", mu=0.3, method="mortar")],
    )  # fmt: skip


def chain():
    M = sparse.diags_array([[-1.0] * 99, [2.0] * 100, [-1.0] * 99], offsets=[-1, 0, 1]).tocsc()
    H = sparse.csc_array(np.eye(100, 2))
    return am.FrictionProblem.from_global(M, H, np.full(100, -0.01), np.zeros((1, 2)), [0.3])


def failure():
    with pytest.raises(am.NotConverged) as caught:
        am.solve(chain(), am.SemismoothNewton(), tolerance=1e-300, max_iterations=1)
    return caught.value


def last(given, method, until):
    return list(am.evolve(given, method, until=until))[-1]


def after_a_solve(given):
    am.solve(given)
    return given


RESULTS = {
    "problem": lambda: after_a_solve(chain()),
    "condensed problem": lambda: after_a_solve(chain().condensed()),
    "solution": lambda: am.solve(chain()),
    "model": lambda: after_a_solve(model()),
    "model solution": lambda: am.solve(model()),
    "mortar": lambda: am.solve(pair()),
    "nitsche": lambda: am.solve(model("nitsche")),
    "large deformation": lambda: am.solve(model(law=am.NeoHookean(1.0, 0.3), cells=2)),
    "multigrid": lambda: am.solve(model(cells=8), am.ContactMultigrid()),
    "active set": lambda: am.solve(model(cells=8), am.ActiveSet()),
    "compressed": lambda: am.solve(model(cells=8), am.CompressedDelassus()),
    "tracked branch": lambda: am.follow(random_delassus(1, 3, 2)),
    "branch over friction": lambda: am.follow(chain(), "friction", (0.0, 1.0)),
    "continued branch": lambda: am.follow(chain(), options=am.Continuation()),
    "branch in 3D": lambda: am.follow(random_delassus(1, 3, 3)),
    "branch of a model": lambda: am.follow(model()),
    "branch of Hild": lambda: am.follow(hild(2)),
    "branch at large strains": lambda: am.follow(model(law=am.NeoHookean(1.0, 0.3), cells=2)),
    "diagram": lambda: am.diagram(random_delassus(1, 3, 2)),
    "all solutions": lambda: am.all_solutions(random_delassus(1, 3, 2), keep_proof=True),
    "all solutions in 3D": lambda: am.all_solutions(random_delassus(1, 1, 3)),
    "some solutions": lambda: am.multistart(random_delassus(1, 3, 2), starts=5),
    "verdict": lambda: am.uniqueness(random_delassus(1, 3, 2)),
    "critical friction": lambda: am.critical_friction(random_delassus(1, 2, 2)),
    "criterion in 3D": lambda: am.p_matrix_friction(random_delassus(1, 1, 3)),
    "step in dynamics": lambda: last(model(), am.MoreauJean(0.1), 0.2),
    "quasi-static step": lambda: last(pair(), am.QuasiStatic(0.5), 1.0),
    "case": lambda: am.read_case("example:slab"),
    "failure": failure,
}


def locks(made):
    """Of every array in what is made, by its path: whether nobody can write to it."""
    found, seen = {}, {}

    def walk(value, path):
        if id(value) in seen:
            return
        seen[id(value)] = value
        if isinstance(value, np.ndarray):
            found[path] = not value.flags.writeable
        elif isinstance(value, (list, tuple)):
            for k, part in enumerate(value):
                walk(part, (*path, k))
        elif isinstance(value, dict):
            for key, part in value.items():
                walk(part, (*path, key))
        elif type(value).__module__.startswith("amontons") or sparse.issparse(value):
            for key, part in getattr(value, "__dict__", {}).items():
                if type(part).__name__ != "Prepared":  # starts anew elsewhere
                    walk(part, (*path, key))

    walk(made, ())
    return found


@pytest.mark.parametrize("name", RESULTS)
def test_results_are_pickled_and_copied(name):
    made = RESULTS[name]()
    there = pickle.loads(pickle.dumps(made))
    for other in (there, pickle.loads(pickle.dumps(there)), copy.deepcopy(made)):
        assert type(other) is type(made)
        assert str(other) == str(made)
        here, elsewhere = locks(made), locks(other)
        both = here.keys() & elsewhere.keys()
        assert [path for path in both if elsewhere[path] != here[path]] == []


def test_a_branch_is_the_same_elsewhere():
    branch = am.follow(chain(), "friction", (0.0, 1.0))
    other = pickle.loads(pickle.dumps(branch))
    assert other.record() == branch.record()
    assert other.at(0.5)[0] == pytest.approx(branch.at(0.5)[0], abs=1e-15)
    assert other.problem.at(0.5).mu == pytest.approx(branch.problem.at(0.5).mu)


def test_a_problem_is_solved_elsewhere_as_here():
    problem = after_a_solve(chain())
    other = pickle.loads(pickle.dumps(problem))
    assert am.solve(other).r == pytest.approx(am.solve(problem).r, rel=1e-12)
    assert other.factor().solve(problem.f) == pytest.approx(problem.factor().solve(problem.f))
