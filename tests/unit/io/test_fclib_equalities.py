"""FCLib files with equality constraints: rods, redundant rows, multipliers, broken files."""

import h5py
import numpy as np
import pytest
from scipy import linalg, sparse

from amontons.core.errors import FileFormatError
from amontons.io.fclib import read_fclib, write_fclib
from amontons.mechanics.ready.gallery import box_tower
from amontons.problem.friction import FrictionProblem
from amontons.solvers.driver import drive


def put_matrix(root, name, matrix):
    """A sparse group in compressed columns."""
    stored = sparse.csc_array(matrix)
    group = root.create_group(name)
    for key, value in (("m", stored.shape[0]), ("n", stored.shape[1]), ("nz", -1),
                       ("nzmax", stored.nnz)):  # fmt: skip
        group[key] = np.int32([value])
    group["p"], group["i"] = stored.indptr.astype(np.int32), stored.indices.astype(np.int32)
    group["x"] = stored.data


def global_file(path, problem, G, b):
    write_fclib(problem, path)
    with h5py.File(path, "a") as file:
        put_matrix(file["fclib_global"], "G", G)
        file["fclib_global/vectors/b"] = np.asarray(b, dtype=float)
    return path


def local_file(path, problem, V, R, s):
    write_fclib(problem, path)
    with h5py.File(path, "a") as file:
        put_matrix(file["fclib_local"], "V", V)
        put_matrix(file["fclib_local"], "R", R)
        file["fclib_local/vectors/s"] = np.asarray(s, dtype=float)
    return path


def dense(matrix):
    return matrix.toarray() if sparse.issparse(matrix) else np.asarray(matrix)


def jointed(seed, d=3, rows=4, repeated=0):
    """Random bodies of mixed units with constraints, M, H, f, w, G, b; some said twice."""
    random = np.random.default_rng(seed)
    n, nc = 14, 3
    A = random.normal(size=(n, n))
    units = 10.0 ** random.uniform(-3, 3, n)
    M = (A @ A.T + 0.1 * np.eye(n)) * np.outer(units, units)
    H = random.normal(size=(n, nc * d)) * units[:, None]
    G = random.normal(size=(n, rows)) * units[:, None]
    b = 0.1 * random.normal(size=rows)
    if repeated:
        mixed = random.normal(size=(rows, repeated))
        G, b = np.hstack([G, G @ mixed]), np.concatenate([b, b @ mixed])
    f, w = random.normal(size=n) * units, random.normal(size=(nc, d))
    w[:, 0] -= 3.0  # pressed
    return FrictionProblem.from_global(M, H, f, w, np.full(nc, 0.4)), G, b


def check_balance(problem, G, b, solution, multipliers):
    """The equations of FCLib, each relative to its terms."""
    M, H = dense(problem.M), dense(problem.H)
    v, r, l = solution.v, solution.r.ravel(), multipliers
    terms = (M @ v, H @ r, G @ l, problem.f)
    size = np.sum([abs(x) for x in terms], axis=0)
    assert np.max(abs(terms[0] - terms[1] - terms[2] - terms[3]) / size) < 1e-7
    assert np.max(abs(G.T @ v + b) / (abs(G).T @ abs(v) + abs(b))) < 1e-9
    np.testing.assert_allclose(solution.u.ravel(), H.T @ v + problem.w.ravel(),
                               atol=1e-9 * np.abs(problem.w).max())  # fmt: skip


@pytest.mark.parametrize(("d", "repeated"), [(3, 0), (3, 2), (2, 0), (2, 3)])
def test_global_form_against_the_null_space(d, repeated, tmp_path):
    """v = v0 + Z y with Z an orthonormal null space of G^T: no equality is left."""
    bare, G, b = jointed(d + repeated, d, repeated=repeated)
    problem = read_fclib(global_file(tmp_path / "a.hdf5", bare, G, b))
    found = drive(problem, tolerance=1e-11)
    assert found.converged
    unit = 1 / np.sqrt(dense(bare.M).diagonal())
    Z = unit[:, None] * linalg.null_space((unit[:, None] * G).T, rcond=1e-9)
    v0 = unit * np.linalg.lstsq((unit[:, None] * G).T, -b, rcond=1e-9)[0]
    M, H = dense(bare.M), dense(bare.H)
    reduced = FrictionProblem.from_global(
        Z.T @ M @ Z, Z.T @ H, Z.T @ (bare.f - M @ v0),
        bare.w + (H.T @ v0).reshape(bare.w.shape), bare.mu,
    )  # fmt: skip
    other = drive(reduced, tolerance=1e-11)
    assert other.converged
    size = np.abs(other.r).max()
    assert size > 0
    np.testing.assert_allclose(found.r, other.r, atol=1e-7 * size)
    np.testing.assert_allclose(found.u, other.u, atol=1e-7 * np.abs(bare.w).max())
    assert not np.allclose(found.r, drive(bare).r, atol=1e-3 * size)  # the rows matter
    check_balance(bare, G, b, found, problem.multipliers(found))


@pytest.mark.parametrize("repeated", [0, 2])
@pytest.mark.parametrize("stored", [np.asarray, sparse.csr_array])
def test_local_form_has_the_solution_of_the_global_one(repeated, stored, tmp_path):
    bare, G, b = jointed(7, repeated=repeated)
    whole = read_fclib(global_file(tmp_path / "a.hdf5", bare, G, b))
    M, H = dense(bare.M), dense(bare.H)
    V, R = H.T @ np.linalg.solve(M, G), G.T @ np.linalg.solve(M, G)
    W, q = H.T @ np.linalg.solve(M, H), H.T @ np.linalg.solve(M, bare.f) + bare.w.ravel()
    s = G.T @ np.linalg.solve(M, bare.f) + b
    local = FrictionProblem.from_delassus(stored(0.5 * (W + W.T)), q.reshape(-1, 3), bare.mu)
    path = local_file(tmp_path / "b.hdf5", local, V, 0.5 * (R + R.T), s)
    problem = read_fclib(path)
    one, two = drive(whole, tolerance=1e-11), drive(problem, tolerance=1e-11)
    assert one.converged
    assert two.converged
    size = np.abs(one.r).max()
    np.testing.assert_allclose(two.r, one.r, atol=1e-7 * size)
    l = problem.multipliers(two)
    np.testing.assert_allclose(V.T @ two.r.ravel() + R @ l + s, 0,
                               atol=1e-7 * np.abs(s).max())  # fmt: skip
    u = W @ two.r.ravel() + V @ l + q
    np.testing.assert_allclose(two.u.ravel(), u, atol=1e-7 * np.abs(q).max())


def test_two_masses_on_a_rod(tmp_path):
    """By hand: a mass m falls beside one that stands on a floor, a rod takes both down alike.

    Floor under the second alone: it carries both weights, the rod that of the first.
    """
    M = np.diag([2.0, 2.0, 5.0, 5.0])  # x, y of both
    H = np.zeros((4, 2))
    H[3, 0], H[2, 1] = 1.0, 1.0
    G = np.zeros((4, 1))
    G[1], G[3] = 1.0, -1.0  # y1 - y2 = 0
    f = np.array([0.0, -2.0 * 9.81, 1.0, -5.0 * 9.81])
    bare = FrictionProblem.from_global(M, H, f, np.zeros((1, 2)), [0.5])
    problem = read_fclib(global_file(tmp_path / "rod.hdf5", bare, G, [0.0]))
    found = drive(problem, tolerance=1e-12)
    np.testing.assert_allclose(found.r, [[7 * 9.81, -1.0]], rtol=1e-9)
    np.testing.assert_allclose(problem.multipliers(found), [2 * 9.81], rtol=1e-9)
    np.testing.assert_allclose(found.v, 0, atol=1e-9)
    moved = read_fclib(global_file(tmp_path / "up.hdf5", bare, G, [-3.0]))  # y1 = y2 + 3
    found = drive(moved, tolerance=1e-12)
    np.testing.assert_allclose(found.v[[1, 3]], [3.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(moved.multipliers(found), [2 * (9.81 + 3.0)], rtol=1e-9)
    np.testing.assert_allclose(found.r[0, 0], 7 * 9.81 + 6.0, rtol=1e-9)


def test_constraints_hold_a_loose_body(tmp_path):
    """M alone is singular, with the constraints it is not: a stiffness of one spring."""
    M = np.array([[1.0, -1.0], [-1.0, 1.0]])
    bare = FrictionProblem.from_global(M, [[1.0, 0.0], [0.0, 0.0]], [-2.0, 0.0], [[0.5, 0.0]],
                                       [0.0])  # fmt: skip
    problem = read_fclib(global_file(tmp_path / "a.hdf5", bare, [[0.0], [1.0]], [0.25]))
    found = drive(problem, tolerance=1e-12)
    np.testing.assert_allclose(found.v, [-0.5, -0.25], atol=1e-10)
    np.testing.assert_allclose(found.r[0], [1.75, 0.0], atol=1e-10)
    np.testing.assert_allclose(problem.multipliers(found), [0.25], atol=1e-10)


def test_contact_that_constraints_hold_does_not_react(tmp_path):
    """Rows of H on what is fixed are nothing, not rounding."""
    bare, G, _ = jointed(3)
    G = np.linalg.qr(G)[0] @ np.random.default_rng(0).normal(size=(4, 4))
    H = dense(bare.H).copy()
    H[:, :3] = G @ np.random.default_rng(1).normal(size=(4, 3))
    w = bare.w.copy()
    w[0] = [1.0, 0.0, 0.0]  # open, whatever happens
    bare = FrictionProblem.from_global(bare.M, H, bare.f, w, bare.mu)
    problem = read_fclib(global_file(tmp_path / "a.hdf5", bare, G, np.zeros(4)))
    assert not problem.H[:, :3].nnz
    found = drive(problem)
    assert found.converged
    assert not found.r[0].any()


@pytest.mark.parametrize("form", ["global", "local"])
def test_round_trip_with_solution(form, tmp_path):
    """Numbers and storage of the file again, l beside them; a changed load is written plain."""
    bare, G, b = jointed(5)
    if form == "global":
        path = global_file(tmp_path / "a.hdf5", bare, G, b)
    else:
        V, R = np.ones((9, 2)), np.array([[200.0, 1.0], [1.0, 300.0]])
        path = local_file(tmp_path / "a.hdf5", bare.condensed(), V, R, [1.0, 2.0])
    problem = read_fclib(path)
    found = drive(problem)
    write_fclib(problem, tmp_path / "b.hdf5", solution=found)
    with h5py.File(path) as file, h5py.File(tmp_path / "b.hdf5") as again:
        names = []
        file[f"fclib_{form}"].visititems(
            lambda name, node: names.append(name) if isinstance(node, h5py.Dataset) else None
        )
        assert len(names) > 20
        for name in names:
            key = f"fclib_{form}/{name}"
            np.testing.assert_array_equal(file[key][()], again[key][()])
        np.testing.assert_array_equal(again["solution/l"], problem.multipliers(found))
        assert ("v" in again["solution"]) == (form == "global")
    second = drive(read_fclib(tmp_path / "b.hdf5"))
    np.testing.assert_array_equal(second.r, found.r)
    other = problem.with_load(2 * (problem.f if form == "global" else problem.q))
    write_fclib(other, tmp_path / "c.hdf5", solution=drive(other))
    assert other.multipliers(drive(other)).shape == (0,)
    with h5py.File(tmp_path / "c.hdf5") as file:
        assert not {"G", "V", "R"} & set(file[f"fclib_{form}"])
        assert "l" not in file["solution"]
    np.testing.assert_allclose(drive(read_fclib(tmp_path / "c.hdf5")).r, drive(other).r)


def test_chain_of_boxes(tmp_path):
    """Bodies with small blocks; every third joint said twice: as with the rows said once."""
    bare = box_tower(4)
    bodies = bare.unknowns // 6
    G = np.zeros((bare.unknowns, 3 * (bodies - 1)))
    for k in range(bodies - 1):
        for i in range(3):
            G[6 * k + i, 3 * k + i], G[6 * k + 6 + i, 3 * k + i] = 1.0, -1.0
    once = read_fclib(global_file(tmp_path / "a.hdf5", bare, G, np.zeros(G.shape[1])))
    twice = np.hstack([G, 1e3 * G[:, ::3]])
    again = read_fclib(global_file(tmp_path / "b.hdf5", bare, twice, np.zeros(twice.shape[1])))
    one, two = drive(once), drive(again)
    assert one.converged
    assert two.converged
    moved = one.v.reshape(-1, 6)[:, :3]
    np.testing.assert_allclose(moved, moved[:1].repeat(bodies, axis=0),
                               atol=1e-9 * np.abs(bare.f).max())  # fmt: skip
    np.testing.assert_allclose(two.u, one.u, atol=1e-5 * np.abs(one.u).max() + 1e-9)


BROKEN = {
    "rows of G": (lambda g: put(g, "G", np.ones((5, 2))), "/G: expected m, n"),
    "contradiction": (lambda g: (put(g, "G", np.ones((12, 2))), vector(g, "b", [1.0, 2.0])),
                      "/vectors/b: entry"),
    "no entries": (lambda g: (put(g, "G", np.zeros((12, 2))), vector(g, "b", [0.0, 2.0])),
                   "/vectors/b: entry 1"),
    "no b": (lambda g: g.__delitem__("vectors/b"), "/vectors/b: missing"),
    "short b": (lambda g: vector(g, "b", [1.0]), "/vectors/b: expected 2 values, got 1"),
    "b nan": (lambda g: vector(g, "b", [1.0, np.nan]), "/vectors/b: entry 1: expected a fin"),
    "no G": (lambda g: g.__delitem__("G"), "/vectors/b: expected a group G beside it"),
    "G a dataset": (lambda g: (g.__delitem__("G"), g.__setitem__("G", [1.0])), "/G: expected"),
}  # fmt: skip


def put(root, name, matrix):
    if name in root:
        del root[name]
    put_matrix(root, name, matrix)


def vector(root, name, values):
    del root[f"vectors/{name}"]
    root[f"vectors/{name}"] = values


@pytest.mark.parametrize("name", BROKEN)
def test_broken_constraints_are_named(name, tmp_path):
    change, words = BROKEN[name]
    G = np.zeros((12, 2))
    G[0, 0], G[7, 1] = 1.0, 2.0
    path = global_file(tmp_path / "bad.hdf5", box_tower(2), G, [0.0, 0.0])
    assert read_fclib(path).equalities.count == 2
    with h5py.File(path, "a") as file:
        change(file["fclib_global"])
    with pytest.raises(FileFormatError) as error:
        read_fclib(path)
    assert f"bad.hdf5: /fclib_global{words}" in str(error.value)


@pytest.mark.parametrize(
    ("V", "R", "s", "words"),
    [
        (np.ones((6, 1)), [[0.0]], [0.0], "/V: R is singular"),
        (np.zeros((6, 1)), [[0.0]], [1.0], "/vectors/s: entry 0: the constraints contradict"),
        (np.ones((6, 1)), [[-1.0]], [0.0], "/R: expected a positive semidefinite"),
        (np.ones((6, 2)), [[1.0, 0.5], [0.0, 1.0]], [0.0, 0.0], "/R: expected a symmetric"),
        (np.ones((5, 1)), [[1.0]], [0.0], "/V: expected m, n"),
        (np.ones((6, 1)), [[1.0]], [0.0, 1.0], "/vectors/s: expected 1 values"),
    ],
)
def test_broken_local_constraints_are_named(V, R, s, words, tmp_path):
    bare = FrictionProblem.from_delassus(np.eye(6), np.ones((2, 3)), [0.3, 0.3])
    path = local_file(tmp_path / "bad.hdf5", bare, V, R, s)
    with pytest.raises(FileFormatError) as error:
        read_fclib(path)
    assert f"bad.hdf5: /fclib_local{words}" in str(error.value)


def test_V_without_R(tmp_path):
    bare = FrictionProblem.from_delassus(np.eye(6), np.ones((2, 3)), [0.3, 0.3])
    path = local_file(tmp_path / "bad.hdf5", bare, np.ones((6, 1)), [[1.0]], [0.0])
    with h5py.File(path, "a") as file:
        del file["fclib_local/R"]
    with pytest.raises(FileFormatError, match=r"/fclib_local/R: missing group"):
        read_fclib(path)
