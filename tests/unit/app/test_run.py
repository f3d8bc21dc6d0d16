"""`amontons run`: what it writes, restart, export, refusals; the [wall] table."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest
from block_case import block_case, command

import amontons as am
from amontons.app.cli.locking import locked
from amontons.core.clock import Deadline
from amontons.io.case import read_case

WALL = Path(__file__).resolve().parents[3] / "examples" / "wall" / "wall.toml"
SMALL = ["--set", "wall.cells=[2,1,1]", "--set", "evolution.step=1e-3"]
BLOCK = block_case(
    '["0.01*t", "-0.02*min(1, 2*t)"]', "{ coulomb = 0.4 }", length=2, cells=[4, 2],
    poisson=0.2, step=0.25,
)  # fmt: skip


def run(*arguments):
    return command("run", *arguments)


def table(folder):
    with (folder / "steps.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_the_wall_of_a_case_is_that_of_the_script():
    model = read_case(WALL).model
    assert len(model.bodies) == 14
    stone, steel = model.bodies[1].material, am.Rigid(7800)
    wall = am.Wall(3, 3, (0.4, 0.2, 0.2), (8, 4, 4), stone, plate=0.05, base=0.05,
                   plate_material=steel, bond=am.Bond.ALTERNATING)  # fmt: skip
    assert [c.slave for c in model.contacts] == [c.slave for c in wall.contacts]
    assert model.bodies[-1].material == model.bodies[0].material == steel
    assert stone.density == 2000
    rigid = read_case(WALL, ["wall.rigid=true"]).model
    assert rigid.bodies[5].material == am.Rigid(2000)


def test_a_run_restarts_where_it_stopped(tmp_path):
    whole, half = tmp_path / "whole", tmp_path / "half"
    done = run(WALL, *SMALL, "--set", "evolution.until=0.03", "-o", whole, "--export-fclib",
               tmp_path / "problems", "--quiet")  # fmt: skip
    assert done.exit_code == 0, done.output
    assert done.output == ""
    rows = table(whole)
    assert [int(row["index"]) for row in rows] == list(range(1, 31))
    assert sorted(p.name for p in whole.iterdir()) == [
        "solution.json", "state.h5", "step-00010.vtu", "step-00020.vtu", "step-00030.vtu",
        "steps.csv", "steps.pvd",
    ]  # fmt: skip
    problems = sorted((tmp_path / "problems").iterdir())
    assert [p.name for p in problems] == [f"wall-{k:05d}.hdf5" for k in range(1, 31)]
    assert am.read_fclib(problems[-1]).contacts > 20
    for end in ("0.015", "0.03"):
        again = ["--restart"] if end == "0.03" else []
        done = run(WALL, *SMALL, "--set", f"evolution.until={end}", "-o", half, *again)
        assert done.exit_code == 0, done.output
        assert "results in" in done.output
    ours, theirs = am.load_state(half / "state.h5"), am.load_state(whole / "state.h5")
    np.testing.assert_array_equal(ours.displacement, theirs.displacement)
    assert [row["elastic"] for row in table(half)] == [row["elastic"] for row in rows]


def test_export_takes_the_steps_that_are_asked_for(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(BLOCK)
    out, problems = tmp_path / "out", tmp_path / "problems"
    asked = ("-o", out, "--export-fclib", problems, "--export-steps")
    assert run(case, *asked, "1,3-9:2", "--quiet").exit_code == 0
    made = [int(row["index"]) for row in table(out)]
    wanted = [k for k in (1, 3, 5, 7, 9) if k in made]
    assert [p.name for p in sorted(problems.iterdir())] == [
        f"case-{k:05d}.hdf5" for k in wanted
    ]


@pytest.mark.parametrize("text", ["", "0", "3-1", "1-5:0", "a", "1,,2", "1-", "-3", "1:2"])
def test_steps_to_export_are_checked(tmp_path, text):
    case = tmp_path / "case.toml"
    case.write_text(BLOCK)
    done = run(case, "-o", tmp_path / "out", "--export-fclib", tmp_path / "x",
               "--export-steps", text)  # fmt: skip
    assert done.exit_code == 2
    assert "--export-steps: expected" in done.output
    assert not (tmp_path / "out").exists()
    alone = run(case, "--export-steps", "1")
    assert alone.exit_code == 2
    assert "needs --export-fclib" in alone.output


def test_quasi_static_cases_run(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(BLOCK)
    done = run(case, "-o", tmp_path / "out", "--every", 2)
    assert done.exit_code == 0, done.output
    rows = table(tmp_path / "out")
    assert len(rows) == 4
    for row in rows:
        assert float(row["contact"]) <= 1e-9 * float(row["elastic"])  # of the tolerance
        assert abs(float(row["defect"])) < 1e-9
    pvd = (tmp_path / "out" / "steps.pvd").read_text()
    assert "step-00002.vtu" in pvd
    assert "step-00004.vtu" in pvd


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[evolution]", "[evolutions]", ["evolutions", "evolution"]),
        ("step = 0.25", "", ["evolution.step", "missing"]),
        ("step = 0.25", "step = -1", ["evolution", "step", "-1"]),
        ("until = 1", "until = 0", ["evolution.until", "0"]),
        ("until = 1", "until = 1\ntheta = 1", ["evolution.theta", "unknown key"]),
        ('"quasi-static"', '"static"', ["evolution.kind", "quasi-static"]),
        ('kind = "quasi-static"', "", ["density"]),
        ("young = 100", "young = 100\ndensity = -1", ["density", "-1"]),
    ],
)
def test_broken_cases_are_refused(old, new, words, tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(BLOCK.replace(old, new))
    done = run(case, "-o", tmp_path / "out")
    assert done.exit_code == 2, done.output
    for word in words:
        assert word in done.output
    assert not (tmp_path / "out" / "steps.csv").exists()


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("wall.rows=0", ["wall.rows", "0"]),
        ("wall.cells=[3,1,1]", ["even number"]),
        ("wall.bond=english", ["wall.bond", "running"]),
        ("wall.size=[1]", ["wall.size"]),
        ("wall.brick=1", ["wall.brick", "unknown key"]),
        ("mesh.cells=2", ["mesh", "not with"]),
        ("fix[1].on=lid", ["lid"]),
        ("wall.rigid=1", ["wall.rigid", "true or false"]),
        ("wall.base=-1", ["base", "-1"]),
        ("material.plate.young=1", ["material.plate", "young"]),
        ("evolution.lumped=1", ["lumped", "true or false"]),
        ("material.glass.young=1", ["glass", "unknown key"]),
    ],
)
def test_broken_walls_are_refused(setting, words, tmp_path):
    done = run(WALL, "--set", setting, "-o", tmp_path / "out")
    assert done.exit_code == 2, done.output
    for word in words:
        assert word in done.output
    assert not (tmp_path / "out").exists()


def test_an_error_in_a_later_step_names_its_key(tmp_path):
    (tmp_path / "case.toml").write_text(
        BLOCK.replace("-0.02*min(1, 2*t)", "-0.02 + 0*log(0.6 - t)")
    )
    result = run(tmp_path / "case.toml", "-o", tmp_path / "out")
    assert result.exit_code == 2, result.output
    assert "case.toml: fix[0].value: " in result.stderr
    assert (tmp_path / "out" / "state.h5").exists()  # of the step before


def test_run_needs_an_evolution_and_a_state(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(BLOCK.split("[evolution]")[0])
    done = run(case, "-o", tmp_path / "out")
    assert done.exit_code == 2
    assert "evolution: missing" in done.output
    case.write_text(BLOCK)
    done = run(case, "-o", tmp_path / "out", "--restart")
    assert done.exit_code == 2
    assert "state.h5: no such file" in done.output
    done = run(tmp_path / "problem.hdf5")
    assert done.exit_code == 2


def test_a_run_that_fails_keeps_its_state(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(BLOCK)
    done = run(case, "-o", tmp_path / "out", "--tolerance", "1e-30")
    assert done.exit_code == 1
    assert "step 1" in done.output


@pytest.fixture
def half(tmp_path):
    """A case, and the folder of its run up to the middle."""
    case = tmp_path / "case.toml"
    case.write_text(BLOCK)
    done = run(case, "-o", tmp_path / "out", "--set", "evolution.until=0.5", "--quiet")
    assert done.exit_code == 0, done.output
    return case, tmp_path / "out"


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("material.default.young=200", "material.default.young was 100.0, is 200.0"),
        ("contact.friction.coulomb=0.5", "contact[0].friction.coulomb was 0.4, is 0.5"),
        ("mesh.cells=[4,3]", "mesh.cells[1] was 2.0, is 3.0; the mesh has changed"),
        ("evolution.step=0.125", "evolution.step was 0.25, is 0.125"),
        ("evolution.crossing=true", 'evolution.crossing.kind was not there, is "PathCrossing"'),
        ("evolution.kind=dynamic", "evolution.kind"),
    ],
)
def test_another_case_does_not_go_on(half, setting, words):
    case, out = half
    before = {path: path.read_bytes() for path in out.iterdir()}
    case.write_text(BLOCK.replace("young = 100", "young = 100\ndensity = 1"))
    if "kind" not in setting:
        case.write_text(BLOCK)
    done = run(case, "-o", out, "--restart", "--set", setting)
    assert done.exit_code == 2, done.output
    assert "state.h5: is of another case" in done.output
    assert words in done.output
    assert {path: path.read_bytes() for path in out.iterdir()} == before


def test_a_mesh_file_that_has_changed_is_another_case(tmp_path):
    case, mesh = tmp_path / "case.toml", am.box((2, 1), (4, 2))
    text = BLOCK.replace("box = [2, 1]", 'file = "a.vtu"').replace("cells = [4, 2]", "")
    case.write_text(text)
    cells = [("quad", mesh.cells[0].nodes)]
    points = np.column_stack([mesh.points, np.zeros(len(mesh.points))])
    meshio = pytest.importorskip("meshio")
    sides = {name: facets[0].nodes for name, facets in mesh.surfaces.items()}
    tags = {name: k for k, name in enumerate(sides, start=1)}
    lines = np.concatenate(list(sides.values()))
    marks = np.repeat(list(tags.values()), [len(part) for part in sides.values()])

    def write(name, shift):
        meshio.Mesh(
            points + shift, [*cells, ("line", lines)],
            cell_data={"gmsh:physical": [np.full(len(cells[0][1]), 9), marks],
                       "gmsh:geometrical": [np.full(len(cells[0][1]), 9), marks]},
            field_data={**{n: np.array([k, 1]) for n, k in tags.items()},
                        "default": np.array([9, 2])},
        ).write(tmp_path / name, file_format="gmsh22", binary=False)  # fmt: skip

    case.write_text(text.replace("a.vtu", "a.msh"))
    write("a.msh", 0.0)
    until = ("--set", "evolution.until=0.5")
    assert run(case, "-o", tmp_path / "out", *until, "--quiet").exit_code == 0
    (tmp_path / "a.msh").rename(tmp_path / "b.msh")
    case.write_text(text.replace("a.vtu", "b.msh"))
    done = run(case, "-o", tmp_path / "out", "--restart", "--quiet")
    assert done.exit_code == 0, done.output  # only its name is another
    write("b.msh", np.array([0.01, 0, 0]))
    done = run(case, "-o", tmp_path / "out", "--restart")
    assert done.exit_code == 2
    assert "the mesh has changed" in done.output


def test_another_solver_goes_on_with_a_word(half):
    case, out = half
    done = run(case, "-o", out, "--restart", "--tolerance", "1e-6", "--quiet")
    assert done.exit_code == 0, done.output
    assert done.output == "--restart: solver.tolerance was 1e-08, is 1e-06, from step 3 on\n"
    assert len(table(out)) == 4
    done = run(case, "-o", out, "--restart", "--tolerance", "1e-6", "--quiet")
    assert done.output == ""


def test_a_state_without_its_table_does_not_go_on(half):
    case, out = half
    am.save_state(out / "state.h5", am.load_state(out / "state.h5"))
    done = run(case, "-o", out, "--restart")
    assert done.exit_code == 2
    assert "state alone" in done.output
    assert "load_state" in done.output
    assert len(table(out)) == 2


def test_a_checkpoint_that_has_changed_does_not_go_on(half):
    h5py = pytest.importorskip("h5py")
    case, out = half
    with h5py.File(out / "state.h5", "a") as file:
        file["amontons_state/force"][0, 0] += 1e-9
    done = run(case, "-o", out, "--restart")
    assert done.exit_code == 2
    assert "digest differs" in done.output


def test_table_and_pictures_come_from_the_checkpoint(half):
    """Also where older files of other runs lie around."""
    case, out = half
    rows = (out / "steps.csv").read_text()
    (out / "steps.csv").write_text("index,time\n1,0\n")
    (out / "steps.pvd").unlink()
    (out / "step-00001.vtu").write_text("of another run")
    done = run(case, "-o", out, "--restart", "--set", "evolution.until=0.5", "--quiet")
    assert done.exit_code == 0, done.output
    assert (out / "steps.csv").read_text() == rows
    pvd = (out / "steps.pvd").read_text()
    assert pvd.count("step-") == 1
    assert "step-00002.vtu" in pvd


def test_one_run_at_a_time_in_a_folder(half):
    case, out = half
    before = {path: path.read_bytes() for path in out.iterdir()}
    with locked(out):
        for more in ([], ["--restart"], ["-o", out.parent / "other", "--export-fclib", out]):
            done = run(case, "-o", out, *more)
            assert done.exit_code == 2
            assert f"{out}: in use by another `amontons run`, process" in done.output
    assert {path: path.read_bytes() for path in out.iterdir()} == before
    assert not (out.parent / "other").exists()
    (out / ".lock").write_text("123")  # of a process that was killed
    assert run(case, "-o", out, "--export-fclib", out, "--restart").exit_code == 0
    assert not (out / ".lock").exists()


def test_time_and_iterations_are_limited(half):
    case, out = half
    for limit in ("solver.time_limit=1e-9", "solver.max_iterations=1"):
        done = run(case, "-o", out, "--restart", "--set", "solver.method=uzawa",
                   "--set", limit)  # fmt: skip
        assert done.exit_code == 1, done.output
        assert "Not converged: step 3: " in done.output
        assert limit[7:].split("_")[0] in done.output
    done = run(case, "-o", out, "--restart", "--time-limit", 1e-9)
    assert done.exit_code == 1
    stopped = r"Stopped by --time-limit 1e-09 at t = 0\.(5|75) of 1; go on with --restart\."
    assert re.search(stopped, done.output)
    assert run(case, "-o", out, "--restart", "--time-limit", 1e9).exit_code == 0
    assert len(table(out)) == 4
    done = run(case, "-o", out, "--time-limit", -1)
    assert done.exit_code == 2
    assert "--time-limit: expected seconds > 0, got -1" in done.output


def test_steps_have_limits_in_python(half):
    case, _ = half
    read = read_case(case)
    step = read.evolution.method
    for limits in ({"time_limit": 1e-9}, {"max_iterations": 1},
                   {"deadline": Deadline.after(1e-9)}):  # fmt: skip
        steps = am.evolve(read.model, step, until=1, solver=am.Uzawa(), **limits)
        with pytest.raises(am.NotConverged, match="step 1: (time limit|max iterations)"):
            next(steps)
    for limits in ({"time_limit": 0}, {"max_iterations": 0}):
        with pytest.raises(am.InvalidInput, match=next(iter(limits))):
            am.evolve(read.model, step, until=1, **limits)
