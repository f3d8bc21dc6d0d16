"""What a motion leaves open of its reactions, by rank: cases counted by hand."""

import pickle

import numpy as np
import pytest
from block_assemblies import SQUARE, table
from click.testing import CliRunner

import amontons as am
from amontons.analysis.certificates.uniqueness import quick_verdict
from amontons.analysis.certificates.verdict import Cause
from amontons.analysis.hyperstatic.freedom import freedom_of
from amontons.app.cli import main
from amontons.core.clock import Deadline

THREE = [(-1.0, -1.0), (1.0, -1.0), (0.0, 2.0)]


def block(mu):
    """A rigid square on a floor, at its two corners: four forces, three balances."""
    mesh = am.box((1, 1), 1)
    return am.Model([am.Body(mesh, am.Rigid(1.0))],
                    contacts=[am.Contact("bottom", am.Plane((0, 1)), mu=mu)],
                    loads=[am.BodyForce((0, -1.0))])  # fmt: skip


def wedge(mu):
    """A rigid triangle in a groove of the same angle, at its corner and two others."""
    angle = np.radians(30)
    c, s = np.cos(angle), np.sin(angle)
    normals, places = [(c, s), (c, s), (-c, s), (-c, s)], [(0, 0), (-s, c), (0, 0), (s, c)]
    H = np.zeros((3, 8))
    for k, (n, x) in enumerate(zip(normals, places, strict=True)):
        for a, axis in enumerate((n, (-n[1], n[0]))):
            H[:, 2 * k + a] = *axis, x[0] * axis[1] - x[1] * axis[0]
    return am.FrictionProblem.from_global(np.eye(3), H, np.array([0.0, -1.0, 0.0]),
                                          np.zeros((4, 2)), np.full(4, mu))  # fmt: skip


CASES = {  # problem, free numbers: forces of what sticks less balances
    "table on four corners": (table(SQUARE), 6),
    "its W alone": (table(SQUARE).condensed(), 6),
    "table on three legs": (table(THREE, weight=3.0), 3),
    "four legs without friction": (table(SQUARE, mu=0.0), 1),
    "three legs without friction": (table(THREE, weight=3.0, mu=0.0), 0),
    "square on two corners": (block(0.5).assemble(), 1),
    "wedge": (wedge(0.3), 5),
    "wedge without friction": (wedge(0.0), 1),
}


@pytest.mark.parametrize("name", CASES)
def test_free_numbers_counted_by_hand(name):
    problem, wanted = CASES[name]
    found = am.solve(problem, tolerance=1e-10)
    told = freedom_of(problem, found, Deadline.counted(1.0))
    assert told.dimension == wanted and told.sure
    assert told.unique is (wanted == 0)
    assert told.open.all() if wanted else not told.open.any()


def test_only_what_holds_itself_is_open():
    """A table on four legs and one on three without friction, side by side."""
    one, other = table(SQUARE, mu=0.0), table(THREE, weight=3.0, mu=0.0)
    zeros = np.zeros((6, 12))
    H = np.block([[one.H.toarray(), zeros[:, :9]], [zeros, other.H.toarray()]])
    both = am.FrictionProblem.from_global(
        np.eye(12), H, np.concatenate([one.f, other.f]), np.zeros((7, 3)), np.zeros(7)
    )
    told = freedom_of(both, am.solve(both), Deadline.counted(1.0))
    assert told.dimension == 1
    assert told.open.tolist() == [True] * 4 + [False] * 3
    assert "reactions of 4 of 7 contacts are not unique, in 1 free number." in str(told)


def test_what_is_not_affordable_is_said():
    problem = table(SQUARE).condensed()
    told = freedom_of(problem, am.solve(problem), Deadline.counted(1e-12))
    assert told.dimension is None and told.unique is None
    assert str(told).startswith("Whether its reactions are unique is not known: stopped")


def test_other_starts_say_what_they_can_not_see():
    found = am.solve(table(SQUARE))
    others = am.maybe_others(found, starts=1)
    assert others == () and others.reactions.dimension == 6
    told = str(others)
    assert told.startswith("No other motion was found. With this motion the reactions of 4")
    assert str(pickle.loads(pickle.dumps(others))) == told
    sphere = am.drive(am.SpherePacking(12, seed=3).problem().condensed())
    assert am.maybe_others(sphere, starts=1).reactions.dimension is not None


def test_the_quick_verdict_names_motion_and_reactions():
    problem = table(SQUARE)
    found = am.solve(problem)
    verdict = quick_verdict(problem, 0.0, found)
    assert verdict.cause is Cause.SINGULAR
    assert "With this motion the reactions of 4 of 4 contacts" in verdict.brief
    assert verdict.record["reactions"]["dimension"] == 6
    assert verdict.record["reactions"]["unique"] is False
    held = quick_verdict(block(0.5).assemble(), 0.0, am.solve(block(0.5)).solution)
    assert held.freedom.dimension == 1
    assert quick_verdict(problem).freedom is None  # nobody gave a solution


def test_solve_prints_it(tmp_path):
    told = CliRunner().invoke(main, ["solve", "example:tower", "-o", str(tmp_path)])
    assert "With this motion the reactions of" in told.output
