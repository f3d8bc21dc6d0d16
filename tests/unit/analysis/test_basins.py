"""Which solution each method finds: starts, names, counts, limits, and what is refused."""

import json
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

import amontons as am
from amontons.analysis import Ended
from amontons.analysis.basins.solutions import word_of
from amontons.io.plots import basins_figure, save_figure
from amontons.mechanics.ready.gallery import one_contact_2d, random_delassus
from amontons.solvers import Iterate

ONE = one_contact_2d()  # free, stick and slip


@pytest.fixture(scope="module")
def hild():
    return am.read_case("example:hild").model.with_mu(3.5).assemble()


def test_counts_are_those_of_the_runs_and_reproducible():
    found = am.basins(ONE, ["gauss-seidel", "uzawa"], {"uzawa.rho": [0.1, 10.0]}, draws=8)
    again = am.basins(ONE, ["gauss-seidel", "uzawa"], {"uzawa.rho": [0.1, 10.0]}, draws=8)
    assert [run.found for run in found.runs] == [run.found for run in again.runs]
    assert found.complete
    assert found.finished
    assert sorted(one.name for one in found.solutions) == ["free", "slip", "stick"]
    assert {len(one.pattern) for one in found.solutions} == {1}
    labels = ["gauss-seidel", "uzawa rho=0.1", "uzawa rho=10"]
    assert list(found.counts) == labels
    every = 1 + 8 + 3 * 8 + 3  # zero, cone, perturbed, exact
    assert all(sum(counts.values()) == every for counts in found.counts.values())
    assert sum(row["runs"] for row in found.table()) == 3 * every
    for k, start in enumerate(found.starts):
        if start.kind == "exact":
            assert found.found(0, k) == found.solutions[start.number].name
    other = am.basins(ONE, ["uzawa"], draws=8, seed=1)
    assert [s.iterate.r.tolist() for s in other.starts if s.kind == "cone"] != [
        s.iterate.r.tolist() for s in found.starts if s.kind == "cone"
    ]


@dataclass(frozen=True)
class Still:
    """A method that never moves, and says r = 0 with whatever v it has."""

    form: ClassVar[am.Form] = am.Form.ANY

    def iterates(self, problem, start, target):
        while True:
            yield Iterate(np.zeros_like(start.r), start.v)


def test_a_run_out_of_balance_is_no_solution(hild):
    """r = 0 is the open solution of Hild's triangle, but not with v = 0."""
    options = {"solutions": am.all_solutions(hild), "max_iterations": 20}
    found = am.basins(hild, {"still": Still()}, starts=["zero", "open", "exact"], **options)
    names = {s.label: found.found(0, k) for k, s in enumerate(found.starts)}
    assert names["zero"] == "failed"
    assert names["open"] == "free"
    exact = [names[s.label] for s in found.starts if s.kind == "exact"]
    assert exact == ["stick", "slip", "free"]
    run = next(run for run in found.runs if run.found == "failed")
    assert run.nearest == "stick"  # contacts that do not move
    assert run.error > 0.5


def test_forms_and_models_tell_the_same_solutions(hild):
    model = am.read_case("example:hild").model.with_mu(3.5)
    for problem in (hild, hild.condensed(), model):
        found = am.basins(problem, "semismooth-newton", starts=["zero", "exact"])
        assert [one.name for one in found.solutions] == ["stick", "slip", "free"]
        assert found.found(0, 2) == "slip"
    with pytest.raises(am.UnsupportedForm, match="'displacements' needs displacements"):
        am.basins(hild.condensed(), "uzawa", starts="displacements")


def test_nitsche_is_told_by_its_displacements():
    model = am.read_case("example:hild").model.with_mu(3.5)
    found = am.basins(model, "nitsche", {"kappa": [100.0]}, ["exact", "everywhere"], draws=2)
    assert [found.found(0, k) for k in range(3)] == ["stick", "slip", "free"]
    assert 1e-4 < next(r.distance for r in found.runs if r.found == "slip") < 0.1
    with pytest.raises(am.InvalidInput, match="expected one of .*got 'nitsche'"):
        am.basins(ONE, "nitsche")
    with pytest.raises(am.InvalidInput, match="kappa: expected a finite number > 0"):
        am.basins(model, "nitsche", {"kappa": [-1.0]})


def test_without_a_list_runs_add_what_they_find():
    free = {"nothing touches": Iterate(np.zeros((1, 2)))}
    found = am.basins(ONE, "semismooth-newton", starts={"cone": 40}, solutions=free)
    assert not found.complete
    assert found.solutions[0].name == "nothing touches"
    assert {one.source for one in found.solutions[1:]} == {"found"}
    assert all(one.error < 1e-9 for one in found.solutions)
    assert {one.pattern for one in found.solutions} <= {"f", "s", "+", "-"}
    tresca = am.FrictionProblem.from_delassus(np.eye(3), [[-1, 0.2, 0]], am.Tresca([0.5]))
    assert am.basins(tresca, "gauss-seidel", starts="zero").solutions[0].source == "found"


def test_three_dimensions_and_singular_w():
    problem = random_delassus(3, 4, rank=8)
    one = {"one": am.drive(problem, am.GaussSeidel(), tolerance=1e-12)}
    found = am.basins(problem, ["gauss-seidel"], starts="cone", draws=4, solutions=one)
    assert {run.found for run in found.runs} == {"one"}  # other reactions, the same motion


def test_every_kind_of_start_and_ones_own(hild):
    kinds = ["zero", "open", "cone", "reactions", "displacements", "everywhere", "both",
             "perturbed", "exact", "exact-reactions", "exact-displacements"]  # fmt: skip
    known = am.all_solutions(hild)
    found = am.basins(hild, "semismooth-newton", starts=kinds, draws=1, solutions=known,
                      max_iterations=30, displacement_size=0.5, reaction_size=2.0)  # fmt: skip
    at = {s.label: s.iterate for s in found.starts}
    assert list(dict.fromkeys(s.kind for s in found.starts)) == kinds
    law, r = hild.law, at["cone"].r
    assert (np.abs(r[:, 1]) <= law.bound(r)).all()
    assert 0 < r[:, 0].max() <= 2
    moved = hild.H.T @ at["displacements"].v
    assert 0.1 < np.abs(moved).max() <= 0.5 + 1e-12
    assert np.abs(at["everywhere"].v).max() <= 0.5
    assert not at["zero"].v.any()
    own = am.basins(hild, "uzawa", starts={"mine": at["cone"], "two": [at["zero"]] * 2},
                    solutions=known)  # fmt: skip
    assert [s.label for s in own.starts] == ["mine", "two", "two 2"]


def test_time_limits_are_kept_and_said():
    found = am.basins(ONE, "gauss-seidel", time_limit=1e-9, solutions={}, starts=["zero"])
    assert found.missing == 1
    assert "the time is over" in found.ended
    assert "1 runs are missing" in str(found)
    cut = am.basins(ONE, "uzawa", starts="reactions:3", run_limit=1e-9, tolerance=1e-14)
    assert {run.outcome for run in cut.runs} <= {"time_limit", "converged"}
    assert cut.finished


def test_methods_of_ones_own_are_only_believed_near_a_solution():
    @dataclass(frozen=True)
    class Liar:
        label: str = "liar"
        method: str = "liar"
        parameters: ClassVar[dict] = {}
        within: float | None = None

        def run(self, problem, start, limits):
            return Ended(np.array([[0.7, 0.1]]), None, True, 0.0, 1, "converged")

    found = am.basins(ONE, [Liar()], starts="zero")
    assert found.found(0, 0) == "other"
    assert found.counts["liar"]["other"] == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"methods": "newton"}, "methods: expected one of .*got 'newton'"),
        ({"methods": []}, "at least one"),
        ({"methods": am.Uzawa}, "expected names of solvers"),
        ({"methods": 3}, "expected names of solvers"),
        ({"methods": ["uzawa", "uzawa"]}, "'uzawa' twice"),
        ({"parameters": {"kappa": [1]}}, "kappa: no such field of uzawa"),
        ({"parameters": {"rho": []}}, "rho: expected at least one value"),
        ({"parameters": {"rho": [-1.0]}}, "rho: expected a positive number"),
        ({"parameters": [1]}, "expected fields with values"),
        ({"starts": "cones"}, "expected kinds among .*got 'cones'"),
        ({"starts": "cone:many"}, "number of draws"),
        ({"starts": {"cone": 0}}, "number of draws"),
        ({"starts": ["cone", "cone:3"]}, "each kind once"),
        ({"starts": []}, "at least one start"),
        ({"starts": {"mine": Iterate(np.zeros((2, 2)))}}, "expected r of shape"),
        ({"starts": {"mine": Iterate(np.full((1, 2), np.nan))}}, "not finite"),
        ({"solutions": {"one": Iterate(np.ones((1, 2)))}}, "its error is .*it is none"),
        ({"solutions": {"failed": Iterate(np.zeros((1, 2)))}}, "'failed' is what"),
        ({"solutions": 3}, "solutions: expected"),
        ({"draws": 0}, "draws: expected a whole number >= 1"),
        ({"seed": -1}, "seed: expected a whole number >= 0"),
        ({"tolerance": 2}, "tolerance: expected a number between 0 and 1"),
        ({"within": 0}, "within: expected a number between 0 and 1"),
        ({"run_limit": -1}, "run_limit: expected a number > 0"),
        ({"callback": 3}, "callback: expected a function"),
        ({"problem": 3}, "problem: expected a Model"),
    ],
)
def test_bad_input_is_refused_in_words(arguments, words):
    given = {"problem": ONE, "methods": "uzawa", "starts": "zero", **arguments}
    with pytest.raises(am.InvalidInput, match=words):
        am.basins(**given)


def test_record_and_picture(tmp_path):
    found = am.basins(ONE, ["uzawa", "gauss-seidel"], draws=3)
    data = json.loads(json.dumps(found.record(), allow_nan=False, default=str))
    assert data["schema"] == "amontons/basins/1"
    assert len(data["runs"]) == len(found.runs)
    assert data["runs"][0].keys() >= {"method", "start", "found", "outcome", "distance"}
    assert data["counts"] == found.counts
    for draws in (3, 30):
        one = am.basins(ONE, ["uzawa"], draws=draws)
        save_figure(basins_figure(one, title="one contact"), tmp_path / f"{draws}.png")
        assert (tmp_path / f"{draws}.png").stat().st_size > 5000


def test_names_of_patterns():
    words = {"": "free", "ff": "free", "ss": "stick", "fs": "free+stick", "f+s": "slip"}
    assert {pattern: word_of(pattern) for pattern in words} == words
    assert word_of("l") == "slip"


def test_points_with_multipliers_are_the_same_law():
    """The augmented Lagrangian at Gauss points keeps free and stick, which are exact there."""
    model = am.read_case("example:hild").model.with_mu(3.5)
    contacts = [replace(one, method=am.Nitsche(points=4)) for one in model.contacts]
    points = replace(model, contacts=contacts).discrete_problem()
    problem = points.with_multipliers()
    assert problem.contacts == points.contacts
    nodal = model.assemble()
    free = nodal.velocity(np.zeros((nodal.contacts, 2)))[1]
    found = am.drive(problem, am.Uzawa(), start=Iterate(np.zeros((problem.contacts, 2)), free))
    assert found.converged
    assert set(found.pattern) == {"f"}
