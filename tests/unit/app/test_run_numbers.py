"""Numbers of pairs and supports in the files of a run, also across restarts."""

import csv
import json
import shutil

import h5py
import meshio
import numpy as np
import pytest
from block_case import block_case, command

import amontons as am
from amontons.app.cli import run_folder
from amontons.io.case import read_case
from amontons.io.checkpoint import load_checkpoint

CASE = 'title = "A shoe, there and back"' + block_case(
    '["0.05*sin(3*t)", "-0.02*min(1, 4*t)"]', "{ coulomb = 0.3 }", length=2, cells=[4, 2],
    poisson=0.2, step=0.125, until=2,
).replace("[[contact]]", '[[contact]]\nname = "shoe"')  # fmt: skip


def run(*arguments):
    done = command("run", *arguments, "--quiet")
    assert done.exit_code == 0, done.output
    return done


def table(folder):
    with (folder / "steps.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture
def case(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    return path


def test_the_table_has_pairs_and_supports(case, tmp_path):
    run(case, "-o", tmp_path / "out")
    rows, read = table(tmp_path / "out"), read_case(case)
    steps = list(am.evolve(read.model, read.evolution.method, until=2))
    assert len(rows) == len(steps) == 16
    for row, step in zip(rows, steps, strict=True):
        pair, top = step.pairs["shoe"], step.supports["top"]
        found = [float(row[f"shoe.{name}"]) for name in (
            "force_x", "force_y", "moment_z", "area", "largest_pressure", "slip_net",
            "slip_accumulated", "friction_work", "share_sticking")]  # fmt: skip
        assert found == [
            *pair.force, *pair.moment, pair.area, pair.largest_pressure, pair.slip.net,
            pair.slip.accumulated, pair.friction_work, pair.share_sticking,
        ]  # fmt: skip
        assert [float(row[f"fix top.force_{axis}"]) for axis in "xy"] == top.force.tolist()
        assert float(row["fix top.force_x"]) == pytest.approx(-found[0], abs=1e-12)
    worked = sum(float(row["contact"]) for row in rows)
    assert float(rows[-1]["shoe.friction_work"]) == pytest.approx(-worked, rel=1e-6)
    data = json.loads((tmp_path / "out" / "solution.json").read_text())
    assert data["schema"] == "amontons/run/1"
    assert data["title"] == "A shoe, there and back"
    assert (data["steps"], data["time"], data["outcome"]) == (16, 2.0, "converged")
    assert data["pairs"] == [steps[-1].pairs["shoe"].record]
    assert data["supports"] == [steps[-1].supports["top"].record]
    assert data["works"]["contact"] == pytest.approx(worked)


def test_slip_is_carried_on(case, tmp_path):
    whole, half = tmp_path / "whole", tmp_path / "half"
    run(case, "-o", whole, "--xdmf", "--every", 4)
    run(case, "-o", half, "--xdmf", "--every", 4, "--set", "evolution.until=1")
    run(case, "-o", half, "--xdmf", "--every", 4, "--restart")
    names = sorted(path.name for path in whole.iterdir())
    assert "steps.xdmf" in names
    assert sorted(path.name for path in half.iterdir()) == names
    for name in set(names) - {"state.h5", "steps.csv"}:
        assert (half / name).read_bytes() == (whole / name).read_bytes(), name
    record = (whole / "solution.json").read_bytes()
    (half / "solution.json").unlink()
    run(case, "-o", half, "--restart")  # nothing is left to do, and it is written again
    assert (half / "solution.json").read_bytes() == record
    for one, other in zip(table(whole), table(half), strict=True):
        assert one | {"seconds": ""} == other | {"seconds": ""}
    with meshio.xdmf.TimeSeriesReader(half / "steps.xdmf") as series:
        series.read_points_cells()
        assert [series.read_data(k)[0] for k in range(series.num_steps)] == [0.5, 1.0, 1.5, 2.0]


def older(path):
    """Make a checkpoint what versions without slip and numbers of pairs wrote."""
    found = load_checkpoint(path)
    names = list(run_folder.COLUMNS)
    with h5py.File(path, "a") as file:
        for name in ("slid", "path", "friction_work"):
            del file[f"amontons_state/{name}"]
        del file["amontons_run/record"]
        old = np.zeros(len(found.table), dtype=[(n, found.table.dtype[n]) for n in names])
        for name in names:
            old[name] = found.table[name]
        del file["amontons_run/table"]
        file["amontons_run/table"] = old
        from hashlib import sha256

        state = found.state
        whole = sha256(file["amontons_run/case"][()].tobytes())
        for part in (np.array([state.index]), np.array([state.time]), state.displacement,
                     state.velocity, state.force, state.slip, old, found.pictures):  # fmt: skip
            whole.update(f"{part.dtype.descr} {part.shape}".encode())
            whole.update(np.ascontiguousarray(part).tobytes())
        file["amontons_run/digest"][()] = np.frombuffer(whole.digest(), dtype=np.uint8)


def test_a_checkpoint_of_an_older_version_goes_on(case, tmp_path):
    new, old = tmp_path / "new", tmp_path / "old"
    run(case, "-o", new, "--set", "evolution.until=1")
    shutil.copytree(new, old)
    older(old / "state.h5")
    assert not load_checkpoint(old / "state.h5").counts_slip
    assert not am.load_state(old / "state.h5").path.any()
    done = run(case, "-o", old, "--restart")
    assert "of an older version, slip and friction work are counted anew, from step 9" in (
        done.stderr
    )
    run(case, "-o", new, "--restart")
    before, after = table(new), table(old)
    assert [row["shoe.force_x"] for row in after[:8]] == [""] * 8
    assert [row["shoe.force_x"] for row in after[8:]] == [r["shoe.force_x"] for r in before[8:]]
    missed = float(before[7]["shoe.friction_work"])
    found = [float(row["shoe.friction_work"]) for row in (before[-1], after[-1])]
    assert found[0] - found[1] == pytest.approx(missed)


def test_many_pairs_have_no_columns(case, tmp_path, monkeypatch):
    monkeypatch.setattr(run_folder, "MOST_NUMBERS", 8)
    run(case, "-o", tmp_path / "out")
    assert tuple(table(tmp_path / "out")[0]) == run_folder.COLUMNS
    data = json.loads((tmp_path / "out" / "solution.json").read_text())
    assert [pair["name"] for pair in data["pairs"]] == ["shoe"]


def test_names_in_a_case_file(case, tmp_path):
    text = CASE.replace("[evolution]", '[[contact]]\nname = "shoe"\nslave = "left"\n'
                        "obstacle = { plane = { normal = [1, 0] } }\n"
                        "friction = { coulomb = 0 }\n[evolution]")  # fmt: skip
    case.write_text(text)
    done = command("run", case, "-o", tmp_path / "out")
    assert done.exit_code == 2
    assert "contact[1].name: expected names that differ, got 'shoe'" in done.stderr
    assert not (tmp_path / "out").exists()
    case.write_text(CASE.replace('name = "shoe"', "name = 3"))
    done = command("run", case, "-o", tmp_path / "out")
    assert "contact[0].name: expected a text, got 3" in done.stderr
