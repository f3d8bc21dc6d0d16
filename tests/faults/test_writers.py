"""Every writer on a disk that fails or is full: words, no file too many, none half written."""

import csv
import errno
import os
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from faults import Faults, Kind
from kills import CASE, SLOW
from whole import check_whole, left_over

import amontons as am
from amontons.app.cli import main
from amontons.io import results as output
from amontons.io.checkpoint import Checkpoint, save_checkpoint
from amontons.mechanics.ready.gallery import box_tower, one_contact_2d
from amontons.mechanics.steps import at_rest
from amontons.solvers.driver import drive

ERRORS = (errno.ENOSPC, errno.EIO, errno.EACCES, errno.EDQUOT, errno.EROFS)
OLD = b"old"


class Failed(Exception):
    """What a command says that ended with exit code 2."""


def command(*arguments):
    """A writer: a command of the command line in a folder."""

    def write(folder):
        filled = [str(a).replace("DIR", str(folder)) for a in arguments]
        done = CliRunner().invoke(main, filled)
        if done.exit_code == 2:
            raise Failed(done.output)
        if done.exception is not None and not isinstance(done.exception, SystemExit):
            raise done.exception
        assert done.exit_code in (0, 1), done.output

    return write


@pytest.fixture(scope="session")
def model():
    body = am.Body(am.box((1, 1), 3), am.LinearElastic(100.0, 0.3))
    plane = am.Plane(normal=(0, 1))
    contact = am.Contact("bottom", plane, mu=0.3)
    return am.Model([body], supports=[am.Fix("top", (0.01, -0.01))], contacts=[contact])


@pytest.fixture(scope="session")
def writers(model, tmp_path_factory):
    """Name: a function that writes into a folder."""
    solution, tower = am.solve(model), drive(box_tower(2))
    source = tmp_path_factory.mktemp("source")
    am.write_fclib(box_tower(2), source / "tower.hdf5")
    (source / "case.toml").write_text(SLOW.replace("until = 0.24", "until = 0.08"))
    (source / "moving.toml").write_text(CASE.replace("until = 0.24", "until = 0.08"))
    state, table = at_rest(model), np.zeros(500, dtype=[("index", int), ("x", float)])
    checkpoint = Checkpoint(state, {"a": 1.0}, table, np.arange(9))
    case, moving, problem = source / "case.toml", source / "moving.toml", source / "tower.hdf5"
    quiet = ("-o", "DIR/out", "--quiet")
    return {
        "fclib": lambda at: am.write_fclib(box_tower(30), at / "a.hdf5"),
        "state": lambda at: am.save_state(at / "a.h5", state),
        "checkpoint": lambda at: save_checkpoint(at / "a.h5", checkpoint),
        "h5": lambda at: solution.write(at / "a.h5"),
        "h5 of fclib": lambda at: output.write(
            output.Output(tower, from_fclib=True), at / "a.h5"
        ),
        "json": lambda at: solution.write(at / "a.json"),
        "vtu": lambda at: solution.write(at / "a.vtu"),
        "png": lambda at: solution.plot(at / "a.png"),
        "svg": lambda at: solution.plot(at / "a.svg"),
        "pdf": lambda at: solution.plot(at / "a.pdf"),
        "results": lambda at: output.save(solution.output, at / "new" / "out"),
        "convert": command("convert", problem, "DIR/c.hdf5"),
        "solve": command("solve", problem, *quiet, "--json", "DIR/copy.json"),
        "run": command("run", case, *quiet, "--every", 2, "--export-fclib", "DIR/steps"),
        "moving": command("run", moving, *quiet, "--every", 2),
        "film": command("run", case, *quiet, "--every", 4, "--pictures"),
        "follow": command("follow", "example:one-contact", *quiet, "--json", "DIR/f.json"),
        "enumerate": command("enumerate", "example:one-contact", "--json", "DIR/e.json",
                             "--picture", "DIR/e.png"),
        "uniqueness": command("uniqueness", "example:one-contact", "--json", "DIR/u.json"),
        "info": command("info", problem, "--json", "DIR/i.json"),
        "bench": command("bench", problem, "--methods", "gauss-seidel", "--tolerances", "1e-3",
                         "--json", "DIR/b.json", "--profile", "DIR/b.png"),
    }  # fmt: skip


QUICK = ("fclib", "state", "checkpoint", "h5", "h5 of fclib", "json", "vtu")
DRAWN = ("png", "svg", "pdf", "results", "convert", "solve", "run", "moving", "film", "follow",
         "enumerate", "uniqueness", "info", "bench")  # fmt: skip


def files(folder):
    return sorted(path for path in folder.rglob("*") if path.is_file())


def tried(write, folder, *, at=0, number=errno.ENOSPC, room=np.inf, old=()):
    """Write once on a disk that fails; returns whether it did, and what was done.

    Whatever happens, files are whole or as they were, and nothing else stays.
    """
    folder.mkdir()
    for name in old:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(OLD)
    faults = Faults(folder, Kind.ERROR, at, number, room=room)
    said = ""
    with faults.injected():
        try:
            write(folder)
        except (am.NotWritten, Failed) as reason:
            said = str(reason)
    if said:
        assert os.strerror(number) in said
        assert str(folder) in said
        assert "Traceback" not in said
    lost = faults.calls[at - 1 : at] in (["unlink"], ["rmdir"])
    assert lost or not left_over(folder), left_over(folder)
    for path in files(folder):
        if path.read_bytes() != OLD and not path.name.startswith("."):
            check_whole(path)
    if said and not old and not at:
        for place in folder.rglob("*"):
            assert not place.is_dir() or list(place.iterdir()), f"{place} is empty"
    return bool(said), faults


def names(folder):
    return [path.relative_to(folder) for path in files(folder)]


@pytest.mark.parametrize("name", QUICK)
@pytest.mark.parametrize("number", ERRORS[:2], ids=errno.errorcode.get)
def test_every_call_fails_once(writers, name, number, tmp_path):
    failed, good = tried(writers[name], tmp_path / "good")
    calls = good.calls
    assert not failed
    assert calls.count("fsync") >= 2
    for at in range(1, len(calls) + 1):
        for old in ((), names(tmp_path / "good")):
            tried(writers[name], tmp_path / f"{at}-{len(old)}", at=at, number=number, old=old)


@pytest.mark.parametrize("name", QUICK)
def test_full_disks(writers, name, tmp_path):
    size = tried(writers[name], tmp_path / "good")[1].written
    for room in (*np.linspace(0, size - 1, 7).astype(int), size):
        for old in ((), names(tmp_path / "good")):
            place = tmp_path / f"{room}-{len(old)}"
            failed, _ = tried(writers[name], place, room=int(room), old=old)
            assert failed == (room < size)
            if failed and old:
                assert {path.read_bytes() for path in files(place)} == {OLD}


@pytest.mark.parametrize("name", ["png", "results", "convert", "run", "film", "bench"])
def test_a_full_disk_at_some_point(writers, name, tmp_path):
    size = tried(writers[name], tmp_path / "good")[1].written
    failed, _ = tried(writers[name], tmp_path / "half", room=size // 2)
    assert failed


@pytest.mark.slow_faults
@pytest.mark.parametrize("name", DRAWN)
def test_every_call_of_a_command_fails_once(writers, name, tmp_path):
    calls = tried(writers[name], tmp_path / "good")[1].calls
    for at in range(1, len(calls) + 1):
        number = ERRORS[at % len(ERRORS)]
        old = names(tmp_path / "good") if at % 2 else ()
        tried(writers[name], tmp_path / f"{at}", at=at, number=number, old=old)


@pytest.mark.slow_faults
@pytest.mark.parametrize("name", DRAWN)
def test_full_disks_of_commands(writers, name, tmp_path):
    size = tried(writers[name], tmp_path / "good")[1].written
    rooms = (*np.linspace(0, size, 25).astype(int), *(4096 * k for k in (1, 2, 3, 5, 8, 13)))
    for k, room in enumerate(rooms):
        tried(writers[name], tmp_path / f"{k}", room=int(room))


def test_what_is_renamed_is_on_the_disk(writers, tmp_path):
    """Between the last byte of a file and its name stands its fsync, then the folder's."""
    for name in ("checkpoint", "vtu", "json"):
        faults = Faults(tmp_path)
        with faults.injected():
            writers[name](tmp_path)
        calls = [call for call in faults.calls if call in ("write", "fsync", "replace")]
        assert calls[-4:] == ["write", "fsync", "replace", "fsync"], name


def test_a_run_on_a_full_disk_says_what_is_safe(writers, tmp_path):
    write = writers["moving"]
    calls = tried(write, tmp_path / "good")[1].calls
    renames = [k for k, call in enumerate(calls, start=1) if call == "replace"]
    with Faults(tmp_path, at=renames[8]).injected(), pytest.raises(Failed) as reason:
        write(tmp_path)
    for words in ("No space left", "step-00004.vtu", "state after step 2", "--restart"):
        assert words in str(reason.value)
    state = am.load_state(tmp_path / "out" / "state.h5")
    assert state.index == 2
    with (tmp_path / "out" / "steps.csv").open(newline="") as file:
        assert len(list(csv.reader(file))) == 3


def test_the_bytes_are_those_of_hdf5(tmp_path):
    """Made in memory or by HDF5 itself: the same file."""
    import h5py

    from amontons.io.fclib import put_fclib

    am.write_fclib(one_contact_2d(), tmp_path / "a.hdf5")
    with h5py.File(tmp_path / "b.hdf5", "w") as file:
        put_fclib(file, one_contact_2d())
    assert (tmp_path / "a.hdf5").read_bytes() == Path(tmp_path / "b.hdf5").read_bytes()
