"""HDF5 files that lead out of themselves, never end, or unpack to more than memory holds."""

import os
import resource
import subprocess
import sys
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.mechanics.ready.gallery import random_delassus

LOCAL = "fclib_local"
SECONDS = 60  # a hang, not a slow machine
MEMORY = 3 * 2**30  # bytes of addresses, of which the packages take one half
pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names")


@pytest.fixture
def path(tmp_path):
    am.write_fclib(random_delassus(1, 3, 2), tmp_path / "p.hdf5", title="honest")
    os.mkfifo(tmp_path / "pipe")
    return tmp_path / "p.hdf5"


@pytest.fixture
def file(path):
    with h5py.File(path, "a") as opened:
        yield opened


def read(*args):
    """Exit code and errors of the command line, in a process of little memory and time."""

    def limited():
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))

    done = subprocess.run(
        [sys.executable, "-m", "amontons", *map(str, args)], capture_output=True, text=True,
        timeout=SECONDS, preexec_fn=limited, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    return done.returncode, done.stderr


def refused(path, message):
    with pytest.raises(am.FileFormatError, match=message) as caught:
        am.read_fclib(path)
    assert len(str(caught.value)) < 2000


def replaced(file, where, **how):
    """A data set in the place of another; by default with its numbers."""
    old = file[where]
    shape, kind = old.shape, old.dtype
    del file[where]
    file.create_dataset(where, **{"shape": shape, "dtype": kind, **how})


def test_links_to_other_files_are_refused(file, path):
    del file[f"{LOCAL}/W"]
    file[f"{LOCAL}/W"] = h5py.ExternalLink("pipe", "/W")
    file.close()
    refused(path, r"/fclib_local/W: expected data in this file, got a link to another file")


def test_links_inside_are_refused_and_so_are_loops(file, path):
    file[f"{LOCAL}/info/there"] = h5py.SoftLink("/fclib_local/info/back")
    file[f"{LOCAL}/info/back"] = h5py.SoftLink("/fclib_local/info/there")
    file.close()
    refused(path, "got a soft link")


def test_groups_that_hold_themselves_end(file, path):
    file[f"{LOCAL}/info/self"] = file[LOCAL]
    file[f"{LOCAL}/W/whole"] = file["/"]
    file.close()
    assert am.read_fclib(path).contacts == 3


@pytest.mark.parametrize("target", ["pipe", "/etc/passwd", "/dev/zero"])
def test_raw_data_elsewhere_is_refused(file, path, target):
    replaced(file, f"{LOCAL}/vectors/q", external=[(target, 0, 48)])
    file.close()
    refused(path, f"/fclib_local/vectors/q: expected data in this file, got raw data.*{target}")


def test_convert_copies_nothing_of_a_foreign_file(file, path, tmp_path):
    secret = tmp_path / "secret"
    secret.write_text("a secret of forty letters, not to be read")
    replaced(file, f"{LOCAL}/info/title", shape=(1,), dtype="S40",
             external=[(str(secret), 0, 40)])  # fmt: skip
    file.close()
    code, said = read("convert", path, tmp_path / "out.hdf5")
    assert code == 2
    assert "got raw data" in said
    assert not (tmp_path / "out.hdf5").exists()


@pytest.mark.parametrize("endless", [False, True])
def test_virtual_data_sets_are_refused(file, path, endless):
    most = (None,) if endless else (6,)
    layout = h5py.VirtualLayout((6,), "f8", maxshape=most)
    source = h5py.VirtualSource("pipe", "q", (6,), maxshape=most)
    layout[0 : h5py.h5s.UNLIMITED if endless else 6] = (
        source[0 : h5py.h5s.UNLIMITED] if endless else source
    )
    del file[f"{LOCAL}/vectors/q"]
    file.create_virtual_dataset(f"{LOCAL}/vectors/q", layout)
    file.close()
    refused(path, "got a virtual data set")


def test_a_few_bytes_do_not_unpack_to_gigabytes(file, path):
    replaced(file, f"{LOCAL}/vectors/mu", shape=(1_500_000_000,), dtype="u1",
             chunks=(65536,))  # fmt: skip
    file.create_dataset("pad", data=np.zeros(2_000_000, "u1"))
    file.close()
    refused(path, r"unpacks to more than \d+ MiB")
    code, said = read("solve", path, "-o", path.parent / "out")
    assert code == 2
    assert "unpacks to more" in said


def test_indices_count_with_the_size_that_they_have_in_memory(file, path):
    for name in "pix":
        replaced(file, f"{LOCAL}/W/{name}", shape=(30_000_000,), dtype="u1", chunks=(65536,))
    file.close()
    refused(path, "unpacks to more")  # 90 MB as bytes, 720 MB as numbers


def test_one_data_set_with_many_names_counts_for_each(file, path):
    file.create_dataset("large", shape=(20_000_000,), dtype="u1", chunks=(65536,))
    for name in "pix":
        del file[f"{LOCAL}/W/{name}"]
        file[f"{LOCAL}/W/{name}"] = file["large"]
    file.close()
    refused(path, "unpacks to more")


def test_a_chunk_that_unpacks_to_more_than_it_holds_is_refused(file, path):
    bomb = zlib.compress(bytes(2**29), 9)
    replaced(file, f"{LOCAL}/vectors/q", shape=(6,), chunks=(6,), compression="gzip")
    file[f"{LOCAL}/vectors/q"].id.write_direct_chunk((0,), bomb)
    file.close()
    refused(path, "a chunk unpacks to more than its entries")


def test_chunks_larger_than_their_data_count_too(file, path):
    replaced(file, f"{LOCAL}/vectors/q", shape=(6,), maxshape=(None,), chunks=(2**28,),
             compression="gzip")  # fmt: skip
    file.close()
    refused(path, "unpacks to more")


def test_honest_large_data_is_read(tmp_path):
    """Numbers of one value, the packing that gains most, in chunks of all sizes."""
    nc = 200_000
    W = sparse.eye_array(2 * nc, format="csr")
    problem = am.FrictionProblem.from_delassus(W, -np.ones((nc, 2)), np.full(nc, 0.5))
    path = tmp_path / "large.hdf5"
    am.write_fclib(problem, path)
    assert path.stat().st_size < 2**20
    assert am.read_fclib(path).contacts == nc


@pytest.mark.parametrize("length", [2**20 + 1, 2**30])
def test_long_texts_are_refused(file, path, length):
    del file[f"{LOCAL}/info/title"]
    kind = h5py.h5t.C_S1.copy()
    kind.set_size(length)
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_chunk((1,))
    one = h5py.h5s.create_simple((1,))
    h5py.h5d.create(file[f"{LOCAL}/info"].id, b"title", kind, one, plan)
    file.close()
    refused(path, "/fclib_local/info/title: expected texts of at most 1048576 bytes")


def test_long_texts_of_variable_length_are_refused(file, path):
    del file[f"{LOCAL}/info/title"]
    file[f"{LOCAL}/info/title"] = "x" * (2**20 + 1)
    file.close()
    refused(path, "expected texts of at most")


def test_many_attributes_are_refused(file, path):
    for k in range(300):
        file[f"{LOCAL}/W"].attrs[f"a{k}"] = np.zeros(2**13 - 100)
    file.close()
    refused(path, "expected attributes of at most")


def test_unknown_filters_are_refused(file, path):
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_chunk((6,))
    plan.set_filter(40000, h5py.h5z.FLAG_OPTIONAL)
    del file[f"{LOCAL}/vectors/q"]
    h5py.h5d.create(file[f"{LOCAL}/vectors"].id, b"q", h5py.h5t.NATIVE_DOUBLE,
                    h5py.h5s.create_simple((6,)), plan)  # fmt: skip
    file.close()
    refused(path, "packed by filter 40000")


def state(tmp_path):
    path = tmp_path / "state.h5"
    arrays = np.zeros(4), np.zeros(4), np.zeros((1, 2)), np.zeros((1, 1))
    am.save_state(path, am.State(0, 0.0, *arrays))
    return path


def test_states_are_checked_alike(path, tmp_path):
    saved = state(tmp_path)
    with h5py.File(saved, "a") as file:
        replaced(file, "amontons_state/displacement", external=[("pipe", 0, 32)])
    with pytest.raises(am.FileFormatError, match="raw data in 'pipe'"):
        am.load_state(saved)
    saved = state(tmp_path)
    with h5py.File(saved, "a") as file:
        replaced(file, "amontons_state/displacement", shape=(10**9,), chunks=(65536,))
    with pytest.raises(am.FileFormatError, match="unpacks to more"):
        am.load_state(saved)


CASE = """[mesh]
file = "{}"
[material.default]
young = 1.0
poisson = 0.3
[[contact]]
slave = "bottom"
obstacle = {{ plane = {{ normal = [0, 1] }} }}
friction = {{ coulomb = 0.3 }}
"""


@pytest.mark.parametrize("target", ["pipe", "device"])
def test_pipes_and_devices_are_refused_wherever_a_file_is_read(path, tmp_path, target):
    for name in ("p.toml", "p.msh", "p.vtu", "p.step", "p.h5"):
        link = tmp_path / name
        link.symlink_to(tmp_path / "pipe" if target == "pipe" else "/dev/zero")
    readers = {am.read_fclib: "p.h5", am.load_state: "p.h5", am.read_case: "p.toml",
               lambda path: am.read_cad(path, 1.0): "p.step"}  # fmt: skip
    for reader, name in [*readers.items(), (am.read_mesh, "p.msh"), (am.read_mesh, "p.vtu")]:
        with pytest.raises(am.FileFormatError, match="not a regular file"):
            reader(tmp_path / name)
    for name in ("p.msh", "p.step"):
        case = tmp_path / "case.toml"
        case.write_text(CASE.format(name))
        with pytest.raises(am.FileFormatError, match=r"mesh\.file.*not a regular file"):
            am.read_case(case)


def test_case_files_have_a_largest_size(tmp_path):
    path = tmp_path / "hole.toml"
    with path.open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(am.FileFormatError, match="case file of at most"):
        am.read_case(path)


def test_holes_of_a_file_are_no_stored_bytes(path):
    with h5py.File(path, "a") as file:
        plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        plan.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
        plan.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
        del file[f"{LOCAL}/vectors/q"]
        h5py.h5d.create(file[f"{LOCAL}/vectors"].id, b"q", h5py.h5t.NATIVE_DOUBLE,
                        h5py.h5s.create_simple((10**9,)), plan)  # fmt: skip
    assert Path(path).stat().st_size > 10**9
    refused(path, "unpacks to more")


def test_meshes_in_hdf5_are_checked_too(path, tmp_path):
    with h5py.File(tmp_path / "m.med", "w") as file:
        file["ENS_MAA"] = h5py.ExternalLink("pipe", "/x")
    with pytest.raises(am.FileFormatError, match="a link to another file"):
        am.read_mesh(tmp_path / "m.med")
