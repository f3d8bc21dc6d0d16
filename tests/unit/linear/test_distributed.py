"""A model in parts: without MPI the parts put together again, with it by mpirun."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.core.errors import InvalidInput, MissingDependency, UnsupportedForm
from amontons.linear.petsc import mpi
from amontons.mechanics.meshes.partition import Cut, partition
from amontons.mechanics.model.cutting import shares, whole
from amontons.mechanics.model.processes import (
    _basis,
    _made,
    _rows,
    ended_together,
    together,
)
from amontons.solvers.active_set.spread import OwnContacts, SpreadActiveSet, SpreadProblem

EXAMPLE = Path(__file__).parents[3] / "examples" / "distributed.py"
PACKAGES = ("mpi4py", "petsc4py")
ROOT = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}


def slab(**law):
    """The slave, held at one end and beyond the block that is pushed onto it at the other."""
    low = am.box((3, 1), cells=(6, 2), origin=(0, -1))
    high = am.box((2.1, 1), cells=(4, 2), origin=(-0.1, 0))
    return am.Model(
        [am.Body(low, STEEL, name="low"), am.Body(high, STEEL, name="high")],
        supports=[am.Fix("low.bottom", 0), am.Fix("low.left", 0),
                  am.Fix("high.top", (0.01, -0.02))],
        contacts=[am.Contact("low.top", master="high.bottom", method="mortar", **law)],
    )  # fmt: skip


def example():
    spec = importlib.util.spec_from_file_location("distributed_example", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


STEEL = am.LinearElastic(young=200, poisson=0.3)
FLOOR = am.Plane(normal=(0, 0, 1))


def quarter(law):
    """A quarter of a block on a sphere: contacts on two planes of symmetry."""
    return am.Model(
        [am.Body(am.box((1, 1, 1), cells=4), STEEL)],
        supports=[am.Fix("left", (0, None, None)), am.Fix("front", (None, 0, None)),
                  am.Fix("top", (None, None, -0.05))],
        contacts=[am.Contact("bottom", am.Sphere(center=(0, 0, -4), radius=4.0), **law)],
    )  # fmt: skip


def flat(**law):
    """A block in 2D pressed down and pushed."""
    return am.Model(
        [am.Body(am.box((2, 1), cells=(8, 4)), STEEL)],
        supports=[am.Fix("top", (0.01, -0.02))],
        loads=[am.Traction("right", (-1.0, 0.0))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 1)), **law)],
    )


class Stored:
    """What SpreadMatrix does, on one process with a stored matrix."""

    def __init__(self, K):
        self.K, self.iterations, self.rebuilt = K, 0, 0

    def total(self, value):
        return value

    def times(self, x):
        return self.K @ x

    def blocks(self, dofs):
        return np.array([self.K[np.ix_(own, own)] for own in dofs]).reshape(*dofs.shape, -1)

    def hold(self, held, sliding):
        A = np.where(held[None, :], 0.0, self.K)
        rows = [
            np.einsum("ab,bn->an", sliding.G_r[k], A[own]) for k, own in enumerate(sliding.rows)
        ]
        for k, own in enumerate(sliding.rows):
            rows[k][:, own] += np.where(held[own], 0.0, sliding.G_u[k])
            A[own[sliding.wanted[k]]] = rows[k][sliding.wanted[k]]
        A[held] = np.eye(len(A))[held]
        self.A, self.held = A, held

    def solve(self, b, reduction):
        return np.linalg.solve(self.A, np.where(self.held, 0.0, b))


def in_parts(model, processes):
    """The shares, K (n, n) and T (n, n) of all in PETSc's numbers."""
    given, owner = _made(model, processes)
    found = dict(shares(given, owner, processes))
    every = [found[rank] for rank in range(processes)]
    K = np.vstack([_rows(share).toarray() for share in every])
    T = np.vstack([_basis(share, rank).toarray() for rank, share in enumerate(every)])
    return every, K, T


def put_together(model, processes):
    """The problem of all processes on one, and who is who."""
    every, K, T = in_parts(model, processes)
    d = model.dimension
    nodes = np.concatenate([s.nodes[s.own] for s in every])
    first = [int(s.starts[rank]) for rank, s in enumerate(every)]
    node = np.concatenate([s.contacts.node + a for s, a in zip(every, first, strict=True)])
    parts = [s.contacts for s in every]
    number, gap, frames, turn, able, part = (
        np.concatenate([getattr(c, name) for c in parts])
        for name in ("number", "gap", "frames", "turn", "able", "part")
    )
    F = np.tile(np.eye(d), (len(nodes), 1, 1))
    F[node] = frames
    F = sparse.block_diag(F).toarray()
    fixed = np.concatenate([s.fixed for s in every]).ravel()
    y = np.linalg.solve(T, F @ np.concatenate([s.prescribed for s in every]).ravel())
    y[~fixed] = 0
    f = T.T @ F @ np.concatenate([s.load for s in every]).ravel()
    law = model.law.at(number).scaled(1 / part)
    dofs = node[:, None] * d + np.arange(d)
    p = SpreadProblem(Stored(T.T @ K @ T), f, y, fixed, OwnContacts(dofs, gap, law, able))
    return p, (nodes, number, turn, part[:, None], F.T @ T)


def test_nodes_are_cut_evenly_and_alike_everywhere():
    points = am.box((3, 1, 1), cells=(9, 4, 3)).points
    for parts in (1, 2, 3, 7):
        owner = partition(points, parts)
        sizes = np.bincount(owner, minlength=parts)
        assert sizes.max() - sizes.min() <= parts.bit_length()
        assert sizes.sum() == len(points)
    with pytest.raises(InvalidInput, match="fewer processes"):
        partition(points[:3], 4)


def test_a_part_has_all_cells_of_its_nodes():
    mesh = am.box((1, 1), cells=4, kind="tri")
    owner = np.zeros(len(mesh.points), dtype=int)
    owner[7] = 2
    cut = Cut(mesh, owner, 3)
    table = mesh.cells[0].nodes
    for number, expected in ((2, (table == 7).any(axis=1)), (0, (table != 7).any(axis=1))):
        part, nodes = cut.part(number)
        np.testing.assert_array_equal(nodes[part.cells[0].nodes], table[expected])
        again = am.Mesh(part.points, part.cells)  # what is not checked twice holds
        np.testing.assert_array_equal(again.cells[0].nodes, part.cells[0].nodes)
        assert not part.points.flags.writeable and not part.surfaces and not part.levels
        np.testing.assert_array_equal(part.points, mesh.points[nodes])
    assert cut.part(1)[0] is None


@pytest.mark.parametrize("processes", [1, 3])
@pytest.mark.parametrize("model", [example().cube(1), example().blocks(1), slab(mu=0.3)])
def test_parts_hold_the_stiffness_and_contacts_of_the_whole(model, processes):
    p, (nodes, number, turn, part, basis) = put_together(model, processes)
    parts, d = model.discretisation, model.dimension
    dofs = (nodes[:, None] * d + np.arange(d)).ravel()
    K = parts.K.toarray()[np.ix_(dofs, dofs)]
    scale = abs(K).max()
    assert abs(p.K.K - basis.T @ K @ basis).max() < 1e-12 * scale
    y = np.random.default_rng(1).standard_normal(len(dofs))
    v = np.empty(len(dofs))
    v[dofs] = basis @ y
    u = np.einsum("kab,kb->ka", turn, y[p.contacts.dofs]) / part
    np.testing.assert_allclose((parts.whole_H.T @ v).reshape(-1, d)[number], u, atol=1e-12)


@pytest.mark.parametrize(
    ("model", "processes"),
    [
        (example().cube(2), 2), (example().blocks(1), 3),
        (quarter({"mu": 0.3}), 2), (quarter({"tresca": 2.0}), 2), (flat(tied=True), 1),
        (quarter({"mu": 0.5, "cap": 3.0}), 1), (flat(mu=0.4), 3), (flat(mu=0.0), 1),
        (slab(mu=0.3), 3), (slab(mu=0.5, cap=1.0), 1),
    ],
)  # fmt: skip
def test_steps_on_parts_find_the_answer_of_other_methods(model, processes):
    p, (nodes, number, turn, part, basis) = put_together(model, processes)
    found = SpreadActiveSet(p).solve(1e-11)
    assert found.converged, found.why
    expected = am.drive(model.assemble(), tolerance=1e-11)
    r = np.empty_like(found.r)
    r[number] = np.einsum("kab,kb->ka", turn, part * found.r)
    np.testing.assert_allclose(r, expected.r, atol=1e-9 * abs(expected.r).max())
    d = model.dimension
    v = (basis @ found.y).reshape(-1, d)
    moved = np.concatenate(model.recover(expected).displacement)[nodes]
    np.testing.assert_allclose(v, moved, atol=1e-9 * abs(moved).max())


def refused():
    """Models that several processes can not solve, and a word of what they are told."""
    box = am.box((1, 1, 1), cells=2)
    cube = example().cube(1)
    held = [am.Fix("top", (0, 0, -0.01))]
    floor = am.Contact("bottom", FLOOR, mu=0.3)
    yield replace(cube, supports=[], loads=[am.BodyForce((0, 0, -1))]), "held by supports"
    stresses = am.Contact("bottom", FLOOR, mu=1.0, method="nitsche")
    yield replace(cube, contacts=[stresses]), "small"
    rubber = am.NeoHookean(young=1.0, poisson=0.3)
    yield am.Model([am.Body(box, rubber)], held, [floor]), "small strains"
    rigid = am.Body(box, am.Rigid())
    yield am.Model([am.Body(am.box((1, 1, 1), cells=1, origin=(3, 0, 0)), STEEL, "a"), rigid],
                   [am.Fix("a.top", (0, 0, 0))]), "Rigid"  # fmt: skip
    soft = am.Contact("bottom", FLOOR, mu=0.3, stiffness=10.0)
    yield replace(cube, contacts=[soft]), "Coulomb"
    tilted = am.Contact("bottom", am.Plane(normal=(0.6, 0, 0.8)), mu=0.3)
    yield replace(cube, supports=[*held, am.Fix("left", (0, None, None))],
                  contacts=[tilted]), "neither normal nor tangential"  # fmt: skip
    dragged = [am.Fix("left", (0, 0.1, None)), am.Fix("top", (None, None, -0.01))]
    yield replace(cube, supports=dragged, contacts=[floor]), "along the surface"


@pytest.mark.parametrize(("model", "word"), list(refused()))
def test_what_several_processes_can_not_solve_is_named(model, word):
    with pytest.raises(UnsupportedForm, match=word):
        whole(model)


@pytest.mark.parametrize(("where", "held", "words", "at"), [
    (lambda x: x[:, 0] > 40, [], r"from \[0, 0\] to \[1, 0\]; got False for all",
     ("contacts", 0, "where")),
    (None, [am.Fix("bottom", 0)], "every slave node is fixed by a support, no contact is left$",
     ("contacts",)),
])  # fmt: skip
def test_why_no_contact_is_left_is_said(where, held, words, at):
    """A `where` that selects nobody, or supports that hold all."""
    body = am.Body(am.box((1, 1), 2), STEEL)
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.3, where=where)
    model = am.Model([body], [am.Fix("top", 0), *held], [contact])
    with pytest.raises(InvalidInput, match=words) as told:
        whole(model)
    assert told.value.at == at


def test_an_error_of_one_process_is_raised_on_all():
    class Comm:
        def allgather(self, mine):
            return [None, InvalidInput("the other's"), mine]

    with pytest.raises(InvalidInput, match="the other's"), ended_together(Comm()):
        together(Comm(), lambda: 1)


def test_what_is_no_model_is_refused():
    with pytest.raises(InvalidInput, match="function that returns one"):
        _made(lambda: 3, 1)


@pytest.mark.parametrize("package", PACKAGES)
def test_a_missing_package_is_named_with_its_installation(package, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    calls = [mpi] if package == "mpi4py" else []
    calls += [lambda: am.Petsc().factor(np.eye(3)), lambda: am.distributed(example().cube(1))]
    for call in calls:
        with pytest.raises(MissingDependency, match=r"amontons\[distributed\]"):
            call()


def test_options_are_checked():
    with pytest.raises(InvalidInput, match="tolerance"):
        am.Petsc(tolerance=0.0)
    with pytest.raises(InvalidInput, match="max_iterations"):
        am.Petsc(max_iterations=0)
    with pytest.raises(InvalidInput, match="tolerance"):
        am.distributed(example().cube(1), tolerance=2.0)


def test_the_extra_names_what_is_imported():
    table = tomllib.loads((EXAMPLE.parents[1] / "pyproject.toml").read_text())
    names = table["project"]["optional-dependencies"]["distributed"]
    assert {name.split(">")[0] for name in names} == set(PACKAGES)


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
WRONG = """
import amontons as am
def make():
    raise am.InvalidInput("no such mesh")
try:
    am.distributed(make)
except am.InvalidInput as error:
    print(error, flush=True)
box, steel = am.box((1, 1, 1), cells=2), am.LinearElastic(young=200, poisson=0.3)
above = am.Body(box, steel, "a")
beside = am.Body(am.box((1, 1, 1), cells=2, origin=(9, 0, 0)), steel, "b")
held = [am.Fix("a.top", (0, 0.01, -0.02)), am.Fix("b.top", (0, 0, 0))]
floor = am.Contact("a.bottom", am.Plane(normal=(0, 0, 1)), mu=0.3)
for contacts in ([], [floor]):  # the second process, which has body b, has none
    solution = am.distributed(lambda: am.Model([above, beside], held, contacts))
    solution.check()
    assert sum(solution.counts.values()) == 9 * len(contacts)
    expected = 0.012 * 200 if contacts else 0.0
    print("solved" if (solution.resultant[2] > expected) == bool(contacts) else "wrong")
"""

FOLLOWED = """
import numpy as np, amontons as am
from scipy import sparse
from petsc4py import PETSc
from amontons.linear import spread_levels
from amontons.linear.distributed import FAINT, SpreadMatrix
spread_levels.DIRECT = 10  # GAMG below
plain, off, numbers = SpreadMatrix.solve, [], []
def whole(P):
    k, (_, d, w) = P.rows.own, P.blocks.shape
    end = P.pointers[k]
    parts = P.blocks[:end], P.numbers[P.units[:end]], P.pointers[: k + 1]
    rows = sparse.bsr_array(parts, shape=(d * k, w * P.starts[-1])).tocsr()
    csr = rows.indptr.astype("i4"), rows.indices.astype("i4"), rows.data
    return PETSc.Mat().createAIJ(((d * k, None), (w * P.own, None)), csr=csr)
def solve(self, b, reduction):
    x = plain(self, b, reduction)
    fine = spread_levels.spread_matrix(self.comm, self.A.whole(), 3)
    diagonal = fine.getDiagonal()
    diagonal.array = np.where(self.held, FAINT * self.diagonal, diagonal.array)
    fine.setDiagonal(diagonal)
    cycle, depth = self.cycle, 0
    while isinstance(cycle, spread_levels.SpreadCycle):
        fine, above, cycle, depth = fine.PtAP(whole(cycle.P)), cycle, cycle.below, depth + 1
        if isinstance(cycle, spread_levels.SpreadCycle):
            compare(spread_levels.spread_matrix(self.comm, cycle.rows.whole(), 3), fine)
    levels = cycle.pc.getMGLevels()
    numbers.append((depth, above.P.starts[-1], levels))
    down = [None, *(cycle.pc.getMGInterpolation(k) for k in range(levels - 1, 0, -1))]
    coarse = [cycle.pc.getMGSmoother(k).getOperators()[0] for k in range(levels - 1, -1, -1)]
    for P, A in zip(down, coarse, strict=True):
        fine = fine if P is None else fine.PtAP(P)
        compare(A, fine)
    return x
def compare(A, expected):
    difference = A.copy()
    difference.axpy(-1.0, expected, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
    off.append(difference.norm() / expected.norm())
SpreadMatrix.solve = solve
for spread_levels.OURS, depth in ((10_000, 1), (10, 2)):
    off, numbers = [], []
    solution = am.distributed(lambda: am.Model(
        [am.Body(am.box((1, 1, 1), cells=8), am.LinearElastic(young=1, poisson=0.3))],
        supports=[am.Fix("top", lambda x: (0.05, 0.1, -0.02 - 0.1 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=0.5)]))
    solution.check()
    assert solution.rebuilt == 1 and len(off) > 4 and max(off) < 1e-12, (solution.rebuilt, off)
    assert {n[0] for n in numbers} == {depth}, numbers
    assert depth > 1 or (min(numbers)[1] > 10 and min(numbers)[2] > 1), numbers
print("fine", flush=True)
"""

ROWS = """
import numpy as np, amontons as am
from mpi4py import MPI
from amontons.linear.spread_rows import SpreadRows
from amontons.mechanics.elements.elasticity import stiffness
comm = MPI.COMM_WORLD
for d in (2, 3):
    mesh = am.box((4, 1, 1)[:d], cells=(8, 2, 2)[:d])
    K = stiffness(mesh, am.LinearElastic(young=1, poisson=0.45)).tocsr()
    K.setdiag(1.001 * K.diagonal())
    n = len(mesh.points)
    ends = d * np.array([0, n // 3, n])[[comm.rank, comm.rank + 1]]
    A = SpreadRows(comm, K[slice(*ends)].tobsr((d, d)), d)
    assert len(A.ghosts) and abs(A.whole().toarray() - K[slice(*ends)].toarray()).max() == 0
    x = np.random.default_rng(0).standard_normal(d * n)  # the same everywhere
    assert abs(A.times(x[slice(*ends)]) - (K @ x)[slice(*ends)]).max() < 1e-13
    mine, b, energies = A.vector(), np.zeros((A.own, 3)), []
    A.put(x[slice(*ends)], mine)
    for step in range(6):  # with b = 0 no sweep may add energy
        y = A.taken(mine)
        energies.append(comm.allreduce(float(y @ A.times(y))))
        A.borders.fetch(mine)
        A.sweep(b, mine, backward=bool(step % 2))
    assert (np.diff(energies) < 0).all(), energies
print("fine", flush=True)
"""


@pytest.fixture
def on_two():
    """Runs a command on two processes; skips where the packages are missing."""
    missing = [name for name in PACKAGES if importlib.util.find_spec(name) is None]
    folder = str(Path(sys.executable).parent)
    mpirun = shutil.which("mpirun", path=folder) or shutil.which("mpirun")
    if missing or mpirun is None:
        needs = ", ".join(missing) or "mpirun"
        pytest.skip(f"not installed: {needs}; see docs/distributed.md")
    environment = {**os.environ, **ROOT}
    version = subprocess.run([mpirun, "--version"], capture_output=True, env=environment)
    over = "--oversubscribe" if b"Open MPI" in version.stdout else None

    def run(*command):
        start = [mpirun, *([over] if over else []), "-n", "2", sys.executable]
        return subprocess.run([*start, *map(str, command)], capture_output=True, text=True,
                              timeout=300, env=environment)  # fmt: skip

    return run


def test_petsc_solves_on_one_process(on_two):
    done = subprocess.run([sys.executable, "-c", SERIAL], capture_output=True, text=True)
    assert done.stdout.strip() == "fine", done.stderr


def test_two_processes_find_the_answer_of_one(on_two, tmp_path):
    for kind, level in (("cube", 2), ("blocks", 2)):
        saved, parts = tmp_path / f"{kind}.npz", tmp_path / f"{kind}.pvtu"
        done = on_two(EXAMPLE, kind, "--level", level, "--tolerance", 1e-12, "--save", saved,
                      "--write", parts)  # fmt: skip
        assert done.returncode == 0, done.stderr
        record = json.JSONDecoder().raw_decode(done.stdout)[0]  # mpirun may add to it
        found = np.load(saved)
        assert record["converged"]
        model = getattr(example(), kind)(level)
        expected = am.drive(model.assemble(), tolerance=1e-12)
        fields = model.recover(expected)
        assert record["counts"] == expected.counts
        whole_v = np.concatenate(fields.displacement)
        assert abs(found["r"] - expected.r).max() < 1e-10 * abs(expected.r).max()
        assert abs(found["v"] - whole_v).max() < 1e-10 * abs(whole_v).max()
        _check_files(parts, model, fields)


def _check_files(path, model, fields):
    """Parts have every cell once, and the displacement and supports' forces of the whole."""
    meshio = pytest.importorskip("meshio")
    pieces = [meshio.read(path.with_name(f"{path.stem}_{rank}.vtu")) for rank in range(2)]
    assert all(f"{path.stem}_{rank}.vtu" in path.read_text() for rank in range(2))
    count = sum(len(block.data) for piece in pieces for block in piece.cells)
    assert count == sum(body.mesh.cell_count for body in model.bodies)
    points = np.concatenate([body.mesh.points for body in model.bodies])
    moved, reaction = (np.concatenate(part) for part in (fields.displacement, fields.reaction))
    for piece in pieces:
        near = abs(piece.points[:, None] - points[None]).max(axis=2) < 1e-12
        same = abs(piece.point_data["displacement"][:, None] - moved[None]).max(axis=2)
        assert (near & (same < 1e-9)).any(axis=1).all()
        force = abs(piece.point_data["reaction"][:, None] - reaction[None]).max(axis=2)
        assert (near & (force < 1e-7 * abs(reaction).max())).any(axis=1).all()


def test_an_error_reaches_both_and_parts_without_contacts_solve(on_two):
    done = on_two("-c", WRONG)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("no such mesh") == 2
    assert done.stdout.count("solved") == 4


def test_rows_of_two_processes_make_one_matrix_and_their_sweeps_add_no_energy(on_two):
    done = on_two("-c", ROWS)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("fine") == 2


def test_coarse_matrices_follow_the_contacts(on_two):
    """They are the products P' A P of the matrix of every step, though made once."""
    done = on_two("-c", FOLLOWED)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("fine") == 2
