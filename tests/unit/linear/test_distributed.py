"""A stiffness in parts: without MPI by processes played in turn, with it by mpirun."""

import importlib.util
import json
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import InvalidInput, MissingDependency, UnsupportedForm
from amontons.linear.distributed import DistributedMatrix
from amontons.linear.petsc import mpi
from amontons.mechanics.meshes.partition import partition
from amontons.mechanics.model.assembly import discretise
from amontons.mechanics.model.processes import _check_held, _share

EXAMPLE = Path(__file__).parents[3] / "examples" / "distributed.py"
PACKAGES = ("mpi4py", "petsc4py", "pymetis")


def example():
    spec = importlib.util.spec_from_file_location("distributed_example", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Played:
    """A communicator of `size` processes in which this one, `rank`, hears nothing of others."""

    def __init__(self, rank, size):
        self.number, self.size, self.rank = rank, size, rank

    def Ibarrier(self):
        return self

    def Test(self):
        return True

    def bcast(self, given):
        return given

    def Reduce(self, mine, out):
        out[:] = mine

    def gather(self, mine):
        return [mine]


def played(model, rank, size, monkeypatch):
    """The share of one process; the cells go to the processes by turns."""
    monkeypatch.setattr(
        "amontons.mechanics.model.processes.partition",
        lambda meshes, parts: [np.arange(m.cell_count) % parts for m in meshes],
    )
    share = _share(model.bodies, Played(rank, size))
    share.comm.rank = 0  # so that it keeps what it would send to the first
    return share


class Stored(DistributedMatrix):
    """With a stored factor in the place of PETSc's."""

    def on(self, free):
        return Stored(self.share, free, self.solver)

    def factor(self):
        return am.Direct().factor(self.part(np.arange(len(self.free))))


@pytest.mark.parametrize("kind", ["cube", "blocks"])
def test_parts_sum_up_to_the_stiffness(kind, monkeypatch):
    model = getattr(example(), kind)(1)
    K = model.discretisation.K.tocsr()
    shares = [played(model, rank, 3, monkeypatch) for rank in range(3)]
    v = np.random.default_rng(1).standard_normal(K.shape[0])
    size = abs(K).max()
    assert abs(sum(s.times(v) for s in shares) - K @ v).max() < 1e-13 * size
    assert abs(sum(s.diagonal() for s in shares) - K.diagonal()).max() < 1e-13 * size
    some = np.arange(3, K.shape[0], 2)
    rows = sum(s.rows(some) for s in shares)
    assert abs(rows - K[some][:, some]).max() < 1e-13 * size
    inside = np.zeros(K.shape[0], dtype=bool)
    inside[5] = True
    coupled = np.any([s.coupled(inside) for s in shares], axis=0)
    np.testing.assert_array_equal(np.flatnonzero(coupled), np.sort(K.tocsc()[:, [5]].indices))


def test_entries_for_petsc_hold_the_free_stiffness(monkeypatch):
    model = example().blocks(1)
    parts = model.discretisation
    fixed = np.ones(parts.dofs, dtype=bool)
    fixed[parts.free] = False
    whole = np.zeros((parts.dofs, parts.dofs))
    for rank in range(2):
        share = played(model, rank, 2, monkeypatch)
        i, j, values = share._entries(fixed, np.flatnonzero(share.owner == rank))
        np.add.at(whole, (i, j), values)
    place = share._numbers(np.arange(parts.dofs))
    found = whole[np.ix_(place, place)]
    expected = parts.M.toarray()
    assert abs(found[np.ix_(parts.free, parts.free)] - expected).max() < 1e-13 * expected.max()
    assert not found[np.ix_(parts.free, parts.fixed)].any()
    assert (np.diag(found)[parts.fixed] > 0).all()
    np.testing.assert_array_equal(np.sort(place), np.arange(parts.dofs))


@pytest.mark.parametrize("solver", [am.CompressedDelassus(), am.Auto()])
def test_contact_needs_no_more_than_products_solves_and_some_rows(solver, monkeypatch):
    model = example().blocks(2)
    share = played(model, 0, 1, monkeypatch)
    K = Stored(share, np.arange(share.size), am.Petsc())
    twin = replace(model)
    parts = discretise(model.bodies, model.supports, model.loads, model.contacts, K)
    twin._shared.put(discretise, (), parts)
    found = am.drive(twin.assemble(), solver, tolerance=1e-9)
    expected = am.drive(model.assemble(), tolerance=1e-9)
    assert found.converged
    np.testing.assert_allclose(found.r, expected.r, atol=1e-7 * abs(expected.r).max())
    np.testing.assert_allclose(found.v, expected.v, atol=1e-7 * abs(expected.v).max())
    with pytest.raises(UnsupportedForm, match="CompressedDelassus"):
        np.asarray(K)
    with pytest.raises(UnsupportedForm, match="CompressedDelassus"):
        am.drive(twin.assemble(), am.SemismoothNewton(linear=am.Direct()))


def test_bodies_held_by_contact_alone_are_refused():
    cube = example().cube(1)
    loose = replace(cube, supports=[], loads=[am.BodyForce((0, 0, -1))])
    with pytest.raises(UnsupportedForm, match="body"):
        _check_held(loose.discretisation)


@pytest.mark.parametrize("package", PACKAGES)
def test_a_missing_package_is_named_with_its_installation(package, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    call = mpi if package == "mpi4py" else lambda: am.Petsc().factor(np.eye(3))
    if package == "pymetis":
        call = lambda: partition([am.box((1, 1), cells=2)], 2)  # noqa: E731
    with pytest.raises(MissingDependency, match=r"amontons\[distributed\]"):
        call()


def test_options_are_checked():
    with pytest.raises(InvalidInput, match="tolerance"):
        am.Petsc(tolerance=0.0)
    with pytest.raises(InvalidInput, match="max_iterations"):
        am.Petsc(max_iterations=0)


SERIAL = """
import numpy as np, amontons as am
rubber = am.LinearElastic(young=1, poisson=0.3)
problem = am.Model([am.Body(am.box((1, 1, 1), cells=3), rubber)],
    supports=[am.Fix("top", (0, 0, None)), am.Fix("left", (0, 0, 0))],
    contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)]).assemble()
factor = am.Petsc().factor(problem.M, problem.near_nullspace)
b = np.cos(np.arange(2.0 * problem.unknowns)).reshape(-1, 2)
assert abs(problem.M @ factor.solve(b) - b).max() < 1e-9 and factor.iterations > 2
try:
    am.Petsc(max_iterations=1).factor(problem.M).solve(b)
except am.SingularOperator:
    print("fine")
"""


def test_two_processes_find_the_answer_of_one(tmp_path):
    """The only test that needs the packages of the extra `distributed`."""
    missing = [name for name in PACKAGES if importlib.util.find_spec(name) is None]
    folder = str(Path(sys.executable).parent)
    mpirun = shutil.which("mpirun", path=folder) or shutil.which("mpirun")
    if missing or mpirun is None:
        needs = ", ".join(missing) or "mpirun"
        pytest.skip(f"not installed: {needs}; see docs/distributed.md")
    done = subprocess.run([sys.executable, "-c", SERIAL], capture_output=True, text=True)
    assert done.stdout.strip() == "fine", done.stderr
    for kind, level in (("cube", 2), ("blocks", 1)):
        saved = tmp_path / f"{kind}.npz"
        command = [mpirun, "-n", "2", sys.executable, str(EXAMPLE), kind, "--level", str(level),
                   "--save", str(saved)]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr
        record, found = json.loads(done.stdout), np.load(saved)
        expected = am.drive(getattr(example(), kind)(level).assemble(), tolerance=1e-9)
        assert record["outcome"] == "converged"
        assert record["counts"] == expected.counts
        for name in ("r", "v"):
            value = getattr(expected, name)
            np.testing.assert_allclose(found[name], value, atol=1e-7 * abs(value).max())
