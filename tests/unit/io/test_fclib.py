"""Reading and writing FCLib files: storages, round trips, texts, solutions."""

import h5py
import numpy as np
import pytest
from scipy import sparse

from amontons.core.errors import FileFormatError, InvalidInput, UnsupportedForm
from amontons.io.fclib import read_fclib, write_fclib
from amontons.mechanics.ready.gallery import (
    box_tower,
    one_contact_2d,
    random_delassus,
    sphere_packing,
)
from amontons.problem.friction import Form, FrictionProblem
from amontons.problem.law import Tresca
from amontons.solvers.driver import drive

PROBLEMS = {
    "tower": box_tower(3),
    "one contact": one_contact_2d(),
    "random 2D": random_delassus(3, 5, 2),
    "random 3D": random_delassus(4, 4, 3, rank=7),
    "spheres": sphere_packing(2, layers=2),
    "no contact": FrictionProblem.from_delassus(np.zeros((0, 0)), np.zeros((0, 3)), []),
}


def dense(matrix):
    return matrix.toarray() if sparse.issparse(matrix) else np.asarray(matrix)


def assert_same(a, b):
    """Bit-equal numbers."""
    assert a.form is b.form
    np.testing.assert_array_equal(a.mu, b.mu)
    for name in ("f", "w", "q"):
        x, y = getattr(a, name), getattr(b, name)
        assert (x is None) == (y is None)
        if x is not None:
            np.testing.assert_array_equal(x, y)
            np.testing.assert_array_equal(np.signbit(x), np.signbit(y))
    for name in ("M", "H", "W"):
        x, y = getattr(a, name), getattr(b, name)
        assert (x is None) == (y is None)
        if x is not None:
            np.testing.assert_array_equal(dense(x), dense(y))


def datasets(path):
    """All datasets below the problem's group."""
    found = {}

    def keep(name, node):
        if isinstance(node, h5py.Dataset) and name.startswith("fclib"):
            found[name] = (node.dtype if node.dtype.kind != "S" else "S", node[()])

    with h5py.File(path) as file:
        file.visititems(keep)
    return found


@pytest.mark.parametrize("name", PROBLEMS)
def test_round_trip(name, tmp_path):
    path = tmp_path / "a.hdf5"
    write_fclib(PROBLEMS[name], path)
    again = read_fclib(path)
    assert_same(PROBLEMS[name], again)
    assert again.name == "a"
    write_fclib(again, tmp_path / "b.hdf5")
    first, second = datasets(path), datasets(tmp_path / "b.hdf5")
    assert first.keys() == second.keys()
    for key, (kind, values) in first.items():
        assert second[key][0] == kind
        np.testing.assert_array_equal(second[key][1], values)


def test_shared_files_round_trip(shared, tmp_path):
    files = sorted((shared / "data" / "fclib").glob("*.hdf5"))
    assert files
    for path in files:
        write_fclib(read_fclib(path), tmp_path / "copy.hdf5")
        first, second = datasets(path), datasets(tmp_path / "copy.hdf5")
        assert first.keys() <= second.keys(), path
        for key, (kind, values) in first.items():
            assert second[key][0] == kind, (path, key)
            assert np.array_equal(second[key][1], values), (path, key)


def write_with_storage(path, storage):
    """The file of a 2x2 system whose W is stored in one of the three ways, with a duplicate."""
    entries = {  # nz, p, i, x; W = [[2, 1], [0, 3]], 2 = 1.5 + 0.5
        "triplet": (4, [0, 1, 0, 1], [0, 0, 0, 1], [1.5, 1.0, 0.5, 3.0]),
        "spare capacity": (4, [0, 1, 0, 1, 9], [0, 0, 0, 1, -7], [1.5, 1.0, 0.5, 3.0, np.nan]),
        "columns": (-1, [0, 2, 4], [0, 0, 1, 0], [1.5, 0.5, 3.0, 1.0]),
        "rows": (-2, [0, 3, 4], [1, 0, 0, 1], [1.0, 0.5, 1.5, 3.0]),
    }
    nz, p, i, x = entries[storage]
    with h5py.File(path, "w") as file:
        root = file.create_group("fclib_local")
        root["spacedim"] = np.int32([2])
        root["vectors/q"], root["vectors/mu"] = [-1.0, 0.5], [0.3]
        for key, value in (("m", 2), ("n", 2), ("nz", nz), ("nzmax", 5)):
            root[f"W/{key}"] = np.int32([value])
        root["W/p"], root["W/i"], root["W/x"] = np.int32(p), np.int32(i), np.array(x)


@pytest.mark.parametrize("storage", ["triplet", "spare capacity", "columns", "rows"])
def test_all_storages_mean_the_same(storage, tmp_path):
    path = tmp_path / "w.hdf5"
    write_with_storage(path, storage)
    problem = read_fclib(path)
    np.testing.assert_array_equal(dense(problem.W), [[2.0, 1.0], [0.0, 3.0]])
    write_fclib(problem, tmp_path / "again.hdf5")
    for key, (_, values) in datasets(path).items():
        np.testing.assert_array_equal(datasets(tmp_path / "again.hdf5")[key][1], values)


def test_changed_problem_is_written_afresh(tmp_path):
    write_fclib(box_tower(2), tmp_path / "a.hdf5")
    problem = read_fclib(tmp_path / "a.hdf5")
    write_fclib(problem.with_mu(0.9), tmp_path / "b.hdf5")
    assert_same(read_fclib(tmp_path / "b.hdf5"), problem.with_mu(0.9))
    write_fclib(problem.condensed(), tmp_path / "c.hdf5")
    assert_same(read_fclib(tmp_path / "c.hdf5"), problem.condensed())


def test_texts_that_are_not_utf8_survive(tmp_path):
    write_fclib(box_tower(1), tmp_path / "a.hdf5", title="tower")
    with h5py.File(tmp_path / "a.hdf5", "a") as file:
        del file["fclib_global/info/description"]
        file["fclib_global/info/description"] = np.bytes_(b"\xa8 bytes")
    write_fclib(read_fclib(tmp_path / "a.hdf5"), tmp_path / "b.hdf5")
    with h5py.File(tmp_path / "b.hdf5") as file:
        assert file["fclib_global/info/description"][()] == b"\xa8 bytes"
        assert file["fclib_global/info/title"][()] == b"tower"
    write_fclib(read_fclib(tmp_path / "a.hdf5"), tmp_path / "c.hdf5", title="new")
    with h5py.File(tmp_path / "c.hdf5") as file:
        assert file["fclib_global/info/title"][()] == b"new"


def test_layout_is_that_of_fclib(tmp_path):
    write_fclib(box_tower(1), tmp_path / "a.hdf5")
    with h5py.File(tmp_path / "a.hdf5") as file:
        root = file["fclib_global"]
        assert root["spacedim"].dtype == np.int32
        assert root["spacedim"].shape == (1,)
        for name in ("m", "n", "nz", "nzmax"):
            assert root[f"H/{name}"].dtype == np.int32
        assert root["H/nz"][0] == -1
        assert root["H/p"].shape == (13,)
        assert root["vectors/w"].shape == (12,)
        assert root["info/title"].dtype.kind == "S"
    write_fclib(box_tower(1).condensed(), tmp_path / "b.hdf5")
    with h5py.File(tmp_path / "b.hdf5") as file:
        assert file["fclib_local/W/nz"][0] == -2


def test_solution_group(tmp_path):
    problem = box_tower(2)
    solution = drive(problem)
    write_fclib(problem, tmp_path / "a.hdf5", solution=solution)
    with h5py.File(tmp_path / "a.hdf5") as file:
        np.testing.assert_array_equal(file["solution/r"], solution.r.ravel())
        np.testing.assert_array_equal(file["solution/u"], solution.u.ravel())
        np.testing.assert_array_equal(file["solution/v"], solution.v)
    assert_same(read_fclib(tmp_path / "a.hdf5"), problem)


def test_solution_of_another_problem(tmp_path):
    with pytest.raises(InvalidInput, match="solution"):
        write_fclib(box_tower(2), tmp_path / "a.hdf5", solution=drive(box_tower(1)))
    assert not list(tmp_path.iterdir())


def test_tresca_has_no_place_in_fclib(tmp_path):
    problem = FrictionProblem.from_delassus(np.eye(3), [[-1.0, 0, 0]], Tresca(np.ones(1)))
    with pytest.raises(UnsupportedForm, match="Tresca"):
        write_fclib(problem, tmp_path / "a.hdf5")
    assert not list(tmp_path.iterdir())


def test_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.hdf5"
    write_fclib(box_tower(1), path)
    old = path.read_bytes()

    def fail(*arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("amontons.io.fclib.writing._put_texts", fail)
    with pytest.raises(InvalidInput, match="No space left"):
        write_fclib(box_tower(2), path)
    assert path.read_bytes() == old
    assert list(tmp_path.iterdir()) == [path]


def test_empty_bilateral_groups_pass(tmp_path):
    path = tmp_path / "a.hdf5"
    write_fclib(box_tower(1), path)
    with h5py.File(path, "a") as file:
        file.copy("fclib_global/H", "fclib_global/G")
        file["fclib_global/G/n"][:] = 0
        file["fclib_global/vectors/b"] = np.zeros(0)
    assert read_fclib(path).form is Form.GLOBAL


@pytest.mark.parametrize(
    "content", [b"", b"hello", b"\x89HDF\r\n\x1a\n", b"\x89HDF\r\n\x1a\n" * 50]
)
def test_not_hdf5(content, tmp_path):
    path = tmp_path / "a.hdf5"
    path.write_bytes(content)
    with pytest.raises(FileFormatError, match=r"a\.hdf5"):
        read_fclib(path)


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(FileFormatError, match="no such file"):
        read_fclib(tmp_path / "gone")
    with pytest.raises(FileFormatError, match="folder"):
        read_fclib(tmp_path)
    with pytest.raises(InvalidInput, match="folder"):
        write_fclib(box_tower(1), tmp_path)
    with pytest.raises(InvalidInput, match="can not be written"):
        write_fclib(box_tower(1), tmp_path / "no" / "a.hdf5")


def text_types(path):
    with h5py.File(path) as file:
        nodes = {name: file[f"fclib_global/info/{name}"] for name in ("title", "description")}
        return {
            name: (node.dtype, node.shape, node.id.get_type().get_strpad(), node[()])
            for name, node in nodes.items()
        }


@pytest.mark.parametrize("padding", [h5py.h5t.STR_NULLTERM, h5py.h5t.STR_NULLPAD,
                                     h5py.h5t.STR_SPACEPAD])  # fmt: skip
def test_texts_keep_type_and_bytes(padding, tmp_path):
    write_fclib(box_tower(1), tmp_path / "a.hdf5")
    with h5py.File(tmp_path / "a.hdf5", "a") as file:
        info = file["fclib_global/info"]
        del info["title"], info["description"]
        kind = h5py.h5t.TypeID.copy(h5py.h5t.C_S1)
        kind.set_size(22)
        kind.set_strpad(padding)
        space = h5py.h5s.create(h5py.h5s.SCALAR)
        node = h5py.h5d.create(info.id, b"title", kind, space)
        node.write(h5py.h5s.ALL, h5py.h5s.ALL, np.array(b"a title of 22 letters!"), mtype=kind)
        info["description"] = np.array([b"in one row"])
    problem = read_fclib(tmp_path / "a.hdf5")
    write_fclib(problem, tmp_path / "b.hdf5")
    assert text_types(tmp_path / "a.hdf5") == text_types(tmp_path / "b.hdf5")
    write_fclib(problem, tmp_path / "c.hdf5", title="other", description="in one row")
    assert text_types(tmp_path / "c.hdf5")["title"][3] == b"other"
    assert text_types(tmp_path / "c.hdf5")["description"][1] == (1,)


def test_simple_attributes_of_info_and_matrices_survive(tmp_path):
    write_fclib(box_tower(1), tmp_path / "a.hdf5")
    simple = {"count": np.int32(3), "scale": 0.5, "unit": "m", "row": np.arange(3.0),
              "letters": np.bytes_(b"abc")}  # fmt: skip
    with h5py.File(tmp_path / "a.hdf5", "a") as file:
        for where in ("info", "M"):
            file[f"fclib_global/{where}"].attrs.update(simple)
            file[f"fclib_global/{where}"].attrs["link"] = file.ref
    write_fclib(read_fclib(tmp_path / "a.hdf5"), tmp_path / "b.hdf5")
    with h5py.File(tmp_path / "b.hdf5") as file:
        for where in ("info", "M"):
            found = dict(file[f"fclib_global/{where}"].attrs)
            assert found.keys() == simple.keys()
            for key, value in simple.items():
                np.testing.assert_array_equal(found[key], value)
