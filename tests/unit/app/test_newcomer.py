"""What newcomers stumbled over: decks from Python, words of results, doubts of no solution."""

import gzip

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.app.cli.info import describe

DECK = """*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 1, 1, 0
4, 0, 1, 0
*ELEMENT, TYPE=CPE4, ELSET=ALL
1, 1, 2, 3, 4
*MATERIAL, NAME=M
*ELASTIC
100, 0
*SOLID SECTION, ELSET=ALL, MATERIAL=M
*BOUNDARY
1, 1, 2
2, 2, 2
*STEP
*STATIC
*CLOAD
3, 2, -1
4, 2, -1
*END STEP
"""


def pushed(push):
    """A block of weight 1 on a plane with friction 0.3, held by nothing else."""
    block = am.Body(am.box((1, 1), cells=2), am.LinearElastic(young=100, poisson=0.3))
    ground = am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.3)
    return am.Model([block], [], [ground], [am.BodyForce((push, -1.0))])


def test_read_case_takes_what_the_commands_take(tmp_path):
    problem = am.FrictionProblem.from_delassus([[1, 0.2], [0.2, 1]], [[-1, 0.5]], [0.3])
    am.write_fclib(problem, tmp_path / "one.hdf5")
    read = am.read_case(tmp_path / "one.hdf5", ["solver.tolerance=1e-5"])
    np.testing.assert_allclose(read.target.W.toarray(), problem.W)
    assert read.settings.tolerance == 1e-5
    assert am.read_case("example:hild").has_model


@pytest.mark.parametrize("packed", [False, True])
def test_read_case_reads_decks(tmp_path, packed):
    path = tmp_path / ("part.inp.gz" if packed else "PART.INP")
    path.write_bytes(gzip.compress(DECK.encode()) if packed else DECK.encode())
    assert "no contact in this deck" in "".join(am.read_case(str(path)).notes)


def test_results_have_a_word_each():
    problem = am.FrictionProblem.from_delassus([[1, 0.2], [0.2, 1]], [[-1, 0.5]], [0.3])
    solution = am.solve(problem)
    results = (solution, solution.convergence, am.all_solutions(problem),
               am.uniqueness(problem), am.existence(problem))  # fmt: skip
    for result in results:
        first = str(result).splitlines()[0]
        assert repr(result) == f"<{type(result).__name__}: {first}>"


def test_what_slides_off_is_diagnosed_and_its_motion_not_doubted():
    held, lost = (am.solve(pushed(push), check=False) for push in (0.2, 0.5))
    assert held.solution.converged and not lost.solution.converged
    assert "translation along x" in lost.solution.convergence.detail
    assert not {w.name for w in lost.warnings} & {"large-rotation", "sliding-beyond-pairs"}
    with pytest.raises(am.NotConverged, match="translation along x"):
        list(am.evolve(pushed(0.5), am.QuasiStatic(0.5), until=1))


def test_an_unknown_method_says_how_to_name_ones_own(tmp_path):
    problem = am.FrictionProblem.from_delassus([[1, 0.2], [0.2, 1]], [[-1, 0.5]], [0.3])
    am.write_fclib(problem, tmp_path / "one.hdf5")
    told = CliRunner().invoke(main, ["solve", str(tmp_path / "one.hdf5"), "--method", "mine"])
    assert told.exit_code == 2 and "package.module:Class" in told.stderr.replace("\n", " ")


@pytest.mark.parametrize("small", [am.Rigid(), am.LinearElastic(young=1.0, poisson=0.0)])
def test_a_body_that_contact_alone_holds_can_be_described(small):
    body = am.Body(am.box((2.0, 1.0), 1), small)
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.5)
    model = am.Model([body], [], [contact], [am.Traction("top", (0.0, -1.0))])
    facts = describe(model.discrete_problem())
    assert "elastic bodies" in facts["scales (a guess)"]
