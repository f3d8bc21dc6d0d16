"""A run that is cut anywhere goes on with --restart to the same state and table."""

import itertools
import signal

import kills
import numpy as np
import pytest
from faults import OF_FILES, OF_PATHS
from kills import CASE, SLOW, Runs, at_every_call, at_random, by_interrupts, by_signals
from worker import COMPILING, Worker

from amontons.io.checkpoint import load_checkpoint, save_checkpoint

STAGES = (
    ("amontons.app.cli.run:open_source", 1), ("amontons.app.cli.run:identity", 1),
    ("amontons.app.cli.run:at_rest", 1), ("amontons.app.cli.run:evolve", 1),
    ("amontons.mechanics.steps.stepping:drive", 1),
    ("amontons.mechanics.steps.stepping:drive", 5),
    ("amontons.mechanics.steps.moreau_jean:MovingModel.advance", 4),
    ("amontons.app.cli.run_folder:RunFolder.draw", 2),
    ("amontons.app.cli.run_folder:RunFolder.save", 1),
    ("amontons.app.cli.run_folder:RunFolder.save", 3),
    (COMPILING, 1), (COMPILING, 3),
)  # fmt: skip
CHANGING = ("write", "replace", "fsync")


@pytest.fixture(scope="module")
def worker(tmp_path_factory):
    with Worker(tmp_path_factory.mktemp("runs")) as found:
        yield found


@pytest.fixture(scope="module")
def runs(worker):
    return Runs.of(worker, CASE)


def fine(cuts):
    """Every cut was one, and did no harm."""
    cuts = list(cuts)
    assert not [cut for cut in cuts if cut.wrong or not cut.cuts]
    return len(cuts)


def test_what_differs_is_seen(runs):
    runs.worker.run(*runs.arguments, "-o", "out")
    out = runs.folder / "out"
    assert not kills.differences(out, runs.reference)
    found = load_checkpoint(out / "state.h5")
    found.table["defect"][3] = np.nextafter(found.table["defect"][3], 1)
    save_checkpoint(out / "state.h5", found)
    (out / "step-00002.vtu").write_bytes(b"")
    (out / ".state-01234567.h5").write_bytes(b"")
    wrong = kills.differences(out, runs.reference)
    assert wrong == [
        "state: table, defect", "left: .state-01234567.h5", "names of files", "step-00002.vtu"
    ]  # fmt: skip


def test_exit_at_some_renames(runs):
    assert fine(at_every_call(runs, ("replace",), stride=11)) == 6


def test_exit_at_some_calls(runs):
    assert fine(at_every_call(runs, (), stride=80)) >= 6


def test_some_kills(runs):
    assert fine(at_random(runs, 4, seed=5)) == 4


def test_some_signals_while_files_are_written(runs):
    fine(by_signals(runs, signal.SIGINT, 130, (1, 45, 111)))
    fine(by_signals(runs, signal.SIGTERM, 143, (8, 150)))


def test_ctrl_c_at_some_stages(runs):
    fine(by_interrupts(runs, STAGES[::3]))


def test_torn_files_are_taken_away(runs):
    out = runs.folder / "out"
    cut = kills.Cut("torn")
    runs.cut_at(cut, 30, ("replace",), kills.Kind.EXIT_BEFORE)
    torn = [".state-01234567.h5", ".steps-89abcdef.csv", ".step-00004-01234567.vtu", ".lock"]
    for name in torn:
        (out / name).write_bytes((out / "state.h5").read_bytes()[:500])
    others = [".notes-01234567.txt", ".state.h5", ".steps-89abcdef.csv.old"]
    for name in others:
        (out / name).write_text("")
    runs.finish(cut, pictures=False)
    assert sorted(cut.wrong) == [f"left: {name}" for name in sorted(others)]
    for name in others:
        (out / name).unlink()


@pytest.mark.slow_faults
@pytest.mark.parametrize("text", [CASE, SLOW], ids=["dynamic", "quasi-static"])
def test_exit_at_every_rename(worker, text):
    runs = Runs.of(worker, text)
    assert fine(at_every_call(runs, ("replace",))) == 2 * runs.calls("replace")


@pytest.mark.slow_faults
def test_exit_at_every_call(worker):
    runs = Runs.of(worker, CASE, "evolution.until=0.06", every=1)
    assert fine(at_every_call(runs, CHANGING)) == 2 * runs.calls(*CHANGING)
    others = tuple(name for name in (*OF_PATHS, *OF_FILES) if name not in CHANGING)
    fine(at_every_call(runs, others))


@pytest.mark.slow_faults
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_at_every_call(worker, number, code):
    runs = Runs.of(worker, CASE, "evolution.until=0.06", every=1)
    last = max(k for k, name in enumerate(_calls(runs), start=1) if name == "replace")
    first = 1 if number == signal.SIGINT else 2  # every call gets one of both
    fine(by_signals(runs, number, code, range(first, last - 40, 2)))


def _calls(runs):
    runs.calls()
    return runs.worker.calls()


@pytest.mark.slow_faults
def test_ctrl_c_at_every_stage(worker):
    runs = Runs.of(worker, CASE)
    fine(by_interrupts(runs, STAGES))
    loading = by_interrupts(runs, ((COMPILING, call) for call in itertools.count(1)))
    assert fine(itertools.takewhile(lambda cut: cut.cuts, loading)) >= 3


@pytest.mark.slow_faults
def test_ctrl_c_while_compiling(tmp_path):
    """Nothing is compiled before; the next run compiles what is missing."""
    with Worker(tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache")) as worker:
        folder = tmp_path / "case.toml"
        folder.write_text(CASE)
        arguments = ("run", folder, "--quiet", "--every", kills.EVERY, "-o", "out")
        for call in (1, 2, 4, 8):
            ended = worker.interrupted(COMPILING, call, *arguments)
            assert (ended.code, "Traceback" in ended.said) == (130, False), ended.said
        runs = Runs.of(worker, CASE)
        # a picture more where it was stopped
        cut = runs.finish(kills.Cut("compiling"), pictures=False)
        assert not cut.wrong


@pytest.mark.slow_faults
@pytest.mark.parametrize("text", [CASE, SLOW], ids=["dynamic", "quasi-static"])
def test_hundred_kills(worker, text):
    runs = Runs.of(worker, text)
    assert fine(at_random(runs, 100 if text is CASE else 20, seed=1)) >= 20
