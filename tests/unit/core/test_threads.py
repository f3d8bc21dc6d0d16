"""Parts of kernels in threads: the same bits, errors that arrive, and processes that fork."""

import hashlib
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.core import threads as threads_
from amontons.linear import chunks, grid
from amontons.linear.chunks import near_numbers
from amontons.linear.grid import GridBlocks
from amontons.linear.vectors import (
    BESIDE,
    LEFT_OUT,
    advance,
    copy_both,
    dot,
    norm,
    norm_of_rest,
    norms_of,
)
from amontons.mechanics.elements import slabs
from amontons.mechanics.elements.elasticity import stiffness as stiffness_of
from amontons.mechanics.model import assembly
from amontons.solvers.driver import drive
from amontons.solvers.multigrid.levels import ContactLevels
from amontons.solvers.sweeps.kernels import Acceleration, SweepOrder, sweep_data, watch_for

COUNTS = (1, 2, 3, 5)


@pytest.fixture(autouse=True)
def small_parts(monkeypatch):
    """Small problems are shared as large ones are."""
    monkeypatch.setattr(threads_, "GRAIN", 500)
    monkeypatch.setattr(chunks, "LEAST_ENTRIES", 2000)
    monkeypatch.setattr(chunks, "LEAST_ROWS", 8)
    before = threads_._Given.asked
    yield
    threads_._Given.asked = before


def same(make):
    """What `make` gives, which is the same for any number of threads."""
    found = []
    for count in COUNTS:
        am.threads(count)
        found.append(make())
    for other in found[1:]:
        for a, b in zip(found[0], other, strict=True):
            np.testing.assert_array_equal(a, b)
    return found[0]


def stiffness(shape=(12, 9, 21), seed=1):
    """A symmetric positive definite matrix of a grid of nodes, and its blocks."""
    rng = np.random.default_rng(seed)
    element = rng.standard_normal((24, 24))
    element = element @ element.T + 24 * np.eye(24)
    used = np.ones((int(np.prod([n + 1 for n in shape])), 3), np.uint8)
    used[:7, 1] = 0
    grid = GridBlocks(shape, element, used)
    return grid, grid.stored()


def test_number_of_threads(monkeypatch):
    monkeypatch.setattr(threads_._Given, "asked", None)
    for variables, expected in (
        ({"AMONTONS_THREADS": "3", "OMP_NUM_THREADS": "2"}, 3),
        ({"OMP_NUM_THREADS": "2,1"}, 2),
    ):
        for name in ("AMONTONS_THREADS", "OMP_NUM_THREADS"):
            monkeypatch.delenv(name, raising=False)
        for name, value in variables.items():
            monkeypatch.setenv(name, value)
        threads_._default.cache_clear()
        assert am.threads() == expected
    monkeypatch.setenv("OMP_NUM_THREADS", "many")
    threads_._default.cache_clear()
    assert 1 <= am.threads() <= threads_.DEFAULT_MOST
    monkeypatch.setenv("AMONTONS_THREADS", "many")
    threads_._default.cache_clear()
    with pytest.raises(am.InvalidInput, match="AMONTONS_THREADS: expected .* got 'many'"):
        am.threads()
    threads_._default.cache_clear()
    assert am.threads(4) == am.threads() == threads_.asked() == 4


@pytest.mark.parametrize("count", [0, -1, 2.5, "2", True, 10**6])
def test_no_number_of_threads(count):
    with pytest.raises(am.InvalidInput, match="threads: expected a whole number from 1"):
        am.threads(count)


def test_rows_are_visited_once():
    am.threads(3)
    visits = np.zeros(1000, dtype=int)

    def visit(first, last):
        visits[first:last] += 1

    threads_.over_rows(visit, 1000, 1e9)
    threads_.over_chunks(visit, [(0, 10), (10, 400), (400, 500), (500, 1000)], 1e9)
    threads_.over_blocks(visit, 1000, 1e9)
    assert (visits == 3).all()
    assert len(threads_.split(1000, 1e9)) == 3
    assert len(threads_.split(2, 1e9)) == 2
    assert len(threads_.split(1000, 0)) == 1
    assert [b - a for a, b in threads_.split(0, 0)] == [0]


def test_an_error_of_a_part_arrives_when_all_have_ended():
    am.threads(3)
    ended = []

    def fail(first, last):
        ended.append(first)
        if first > 0:
            raise ValueError(f"part {first}")

    for _ in range(2):  # the first time a kernel is called by one thread
        ended.clear()
        with pytest.raises(ValueError, match="part"):
            threads_.over_rows(fail, 9, 1e9)
        assert sorted(ended) == [0, 1, 3, 4, 6, 7]
    threads_.over_rows(lambda first, last: None, 9, 1e9)


def test_products_and_sweeps():
    for A in stiffness():
        rng = np.random.default_rng(0)
        b, x = (rng.standard_normal((A.nodes, 3)) for _ in range(2))
        held = rng.random(A.nodes) < 0.2

        def run(A=A, b=b, x=x, held=held):
            out = [np.zeros_like(b) for _ in range(4)]
            A.times(x, out[0])
            A.residual(x, b, out[1])
            y = x.copy()
            A.smooth(b, y, held, False)
            A.smooth(b, y, held, True)
            A.first_smooth(b, out[2], out[3])
            return *out, y

        same(run)


def test_sweeps_in_chunks_are_gauss_seidel():
    """Against the definition: even chunks, then odd ones, node after node; and backwards."""
    _, A = stiffness((5, 4, 40))
    assert len(A.chunks) > 3
    whole = A.dense().reshape(A.nodes, 3, A.nodes, 3)
    visits = [*A.chunks[::2], *A.chunks[1::2]]
    order = [i for first, last in visits for i in range(first, last)]
    rng = np.random.default_rng(0)
    b, x = rng.standard_normal((A.nodes, 3)), rng.standard_normal((A.nodes, 3))

    def swept(x, order):
        x = x.copy()
        for i in order:
            rest = b[i] - np.einsum("ajb,jb->a", whole[i], x)
            x[i] += A.inverse[i] @ rest
        return x

    none = np.zeros(A.nodes, dtype=bool)
    am.threads(3)
    y = x.copy()
    A.smooth(b, y, none, False)
    np.testing.assert_allclose(y, swept(x, order), rtol=0, atol=1e-12 * np.abs(y).max())
    y = x.copy()
    A.smooth(b, y, none, True)
    np.testing.assert_allclose(y, swept(x, order[::-1]), rtol=0, atol=1e-12 * np.abs(y).max())
    y, r = np.empty_like(x), np.empty_like(x)
    A.first_smooth(b, y, r)
    expected = swept(np.zeros_like(x), order)
    np.testing.assert_allclose(y, expected, rtol=0, atol=1e-12 * np.abs(y).max())
    np.testing.assert_allclose(
        r, b - np.einsum("iajb,jb->ia", whole, y), rtol=0, atol=1e-11 * np.abs(b).max()
    )


@pytest.mark.parametrize("shape", [(4, 3, 40), (1, 1, 30), (2, 9, 3)])
def test_smoothing_of_a_box_is_chebyshev(shape):
    """Both steps by definition; in one pass, and in parts that change x beside each other."""
    A, stored = stiffness(shape)
    matrix, D = stored.dense(), A.inverses.reshape(3, 3, 3, 3, 3)[A.classes(range(A.nodes))]
    rng = np.random.default_rng(0)
    b, x = (rng.standard_normal((A.nodes, 3)) * A.used for _ in range(2))
    held, none = rng.random(A.nodes) < 0.2, np.zeros(A.nodes, dtype=bool)
    first, keep, second = A._chebyshev

    def smoothed(x, held):
        d = np.zeros_like(x)
        for kept, step in ((0.0, first), (keep, second)):
            rest = np.einsum("kab,kb->ka", D, (b.ravel() - matrix @ x.ravel()).reshape(-1, 3))
            d = (kept * d + step * rest) * (~held)[:, None] * A.used
            x = x + d
        return x

    def run():
        y, z, r = x.copy(), np.full_like(x, 7.0), np.empty_like(x)
        A.smooth(b, y, held, False)
        A.first_smooth(b, z, r)
        return y, z

    found = same(run)
    expected = smoothed(x, held), smoothed(np.zeros_like(x), none)
    for a, e in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, e, rtol=0, atol=1e-12 * np.abs(e).max())


def test_other_numbers_of_nodes():
    """A shuffled matrix gets numbers with chunks; the matrix under them is the same."""
    _, A = stiffness((5, 4, 40))
    rng = np.random.default_rng(0)
    shuffled = A.renumbered(rng.permutation(A.nodes))
    assert len(shuffled.chunks) == 1
    number, found = near_numbers(shuffled.indptr, shuffled.indices)
    again = shuffled.renumbered(number)
    assert again.chunks == found
    assert len(found) > 3
    x, y, z = rng.standard_normal((A.nodes, 3)), np.empty((A.nodes, 3)), np.empty((A.nodes, 3))
    shuffled.times(x, y)
    moved = np.empty_like(x)
    moved[number] = x
    again.times(moved, z)
    np.testing.assert_allclose(z[number], y, rtol=0, atol=1e-12 * np.abs(y).max())


def test_sums():
    rng = np.random.default_rng(0)
    a, b = rng.standard_normal((2, 40_000))
    size = float(np.abs(a) @ np.abs(b))
    assert dot(a, b) == pytest.approx(float(a @ b), abs=1e-14 * size)

    def run():
        x, r = a.copy(), b.copy()
        return dot(a, b), norm(a), advance(x, r, 0.3, b, a), x, r

    *_, size, _, r = same(run)
    assert size == pytest.approx(float(np.linalg.norm(b - 0.3 * a)), rel=1e-13)
    np.testing.assert_allclose(r, b - 0.3 * a, rtol=1e-15, atol=1e-15)
    c = rng.standard_normal(40_000)
    size = float(np.linalg.norm(a - b - c))
    assert same(lambda: (norm_of_rest(a, b, c),)) == pytest.approx([size], rel=1e-13)
    copy_both(a, first := np.empty_like(a), b, second := np.empty_like(b))
    assert (first == a).all() and (second == b).all()
    at_nodes = rng.standard_normal((60_000, 3))
    kind = rng.integers(0, 3, 60_000).astype(np.int8)
    expected = [np.linalg.norm(at_nodes[some]) for some in (kind != LEFT_OUT, kind == BESIDE)]
    assert same(lambda: norms_of(at_nodes, kind)) == pytest.approx(expected, rel=1e-12)


def cube(cells):
    """The pressed and dragged cube."""
    return am.Model(
        [am.Body(am.box((1, 1, 1), cells=cells), am.LinearElastic(young=200, poisson=0.3))],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )


@pytest.mark.parametrize("kind", ["hex", "tet"])
def test_stiffness(kind, monkeypatch):
    """Cells in slabs, in threads, against all of them in turn."""
    mesh = am.box((2, 1, 1), cells=(12, 5, 5), kind=kind)
    law = am.LinearElastic(young=200, poisson=0.3)
    turn = stiffness_of(mesh, law).toarray()
    monkeypatch.setattr(slabs, "LEAST", 100)
    cells = mesh.cells[0].nodes
    sorted_cells, ranges = slabs.in_slabs(mesh.points, cells)
    assert len(ranges) >= 4
    assert sorted(map(tuple, sorted_cells)) == sorted(map(tuple, cells))
    (found,) = same(lambda: (stiffness_of(mesh, law).toarray(),))
    np.testing.assert_allclose(found, turn, rtol=0, atol=1e-14 * np.abs(turn).max())
    rng = np.random.default_rng(0)  # points anywhere: no slabs, and the same stiffness pattern
    assert len(slabs.in_slabs(rng.permutation(mesh.points), cells)[1]) == 1


@pytest.mark.parametrize("kind", ["stored", "operator", "aggregates"])
def test_contact_multigrid(kind, monkeypatch):
    monkeypatch.setattr(assembly, "GRID_FROM", 1 if kind == "operator" else 1e12)
    monkeypatch.setattr(grid, "UNSTORED_FROM", 100)
    monkeypatch.setattr(chunks, "LEAST_ENTRIES", 500)
    problem = cube(8).assemble()
    contacts = ContactLevels.of(problem).contacts
    assert len(contacts.chunks) == len(contacts.near.chunks) == 4
    if kind == "aggregates":
        problem = replace(problem.fresh(), levels=(), guess=None)

    def run():
        found = drive(problem.fresh(), am.ContactMultigrid())
        assert found.converged
        return found.r, found.v, found.convergence.iterations

    same(run)


def test_solves_in_threads_of_the_user():
    """Each with threads of its own, all at once."""
    problem = cube(8).assemble()
    am.threads(1)
    alone = drive(problem, am.ContactMultigrid()).r
    am.threads(3)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: drive(problem, am.ContactMultigrid()).r, range(4)))
    for r in found:
        np.testing.assert_array_equal(r, alone)


def test_shared_gauss_seidel(monkeypatch):
    """All loops in threads give what the compiled ones give; so does the unshared order."""
    monkeypatch.setattr("amontons.solvers.sweeps.chunks.LEAST_ENTRIES", 2000)
    monkeypatch.setattr(chunks, "LEAST_ENTRIES", 2000)
    # a row of contacts, each coupled to three on either side, in shuffled order
    nc, rng = 3000, np.random.default_rng(0)
    order = rng.permutation(nc)
    parts = []
    for shift in range(4):
        blocks = rng.standard_normal((nc - shift, 3, 3)) if shift else 12 * np.eye(3)[None]
        i, j = order[: nc - shift], order[shift:]
        k, m, n = np.meshgrid(np.arange(nc - shift), range(3), range(3), indexing="ij")
        values = np.broadcast_to(blocks, k.shape)[k, m, n].ravel()
        entries = values, ((3 * i[k] + m).ravel(), (3 * j[k] + n).ravel())
        part = sparse.coo_array(entries, shape=(3 * nc, 3 * nc)).tocsr()
        parts.append(part + part.T if shift else part)
    matrix = sparse.csr_array(sum(parts[1:], parts[0]))
    q = rng.standard_normal((nc, 3)) - [1, 0, 0]
    problem = am.FrictionProblem.from_delassus(matrix, q, np.full(nc, 0.4))
    assert len(sweep_data(problem, order=SweepOrder.APPROACH).work) > 3

    def run():
        found = []
        for solver in (
            am.GaussSeidel(order=SweepOrder.APPROACH, batch=5),
            am.GaussSeidel(order=SweepOrder.APPROACH, batch=5, momentum=True),
            am.GaussSeidel(order=SweepOrder.APPROACH, batch=5, anderson_depth=4),
        ):
            solution = drive(problem, solver, max_iterations=60)
            found += [solution.r, solution.convergence.error]
        data = sweep_data(problem, order=SweepOrder.APPROACH)
        memory, watch = Acceleration(data, np.zeros((nc, 3)), 4), watch_for(1e-3)
        return *found, *memory.sweep(50, watch), memory.r, watch

    same(run)


FORK = """
import os, sys
import numpy as np
import amontons as am
from amontons.core import team, threads
from amontons.linear.vectors import dot
threads.GRAIN = 100
am.threads(3)
a = np.cos(np.arange(50_000.0))
dot(a, a), dot(a, a)
assert team._team.helpers
pid = os.fork()
if pid == 0:
    found = dot(a, a)
    os._exit(0 if found == dot(a, a) and team._team.helpers else 1)
for _ in range(3):
    dot(a, a)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system can not fork")
def test_a_forked_process_has_threads_of_its_own():
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", FORK], timeout=60)
    assert done.returncode == 0


def test_the_same_matrix_has_the_same_levels():
    """Smoothed aggregation of random starts would give others each time."""
    problem = cube(8).assemble()

    def digest():
        fresh = replace(problem.fresh(), levels=(), guess=None)
        levels = fresh.hierarchy.levels
        return [hashlib.sha256(x.A.stored().data.tobytes()).digest() for x in levels]

    first = digest()
    assert len(first) > 1
    assert digest() == first
