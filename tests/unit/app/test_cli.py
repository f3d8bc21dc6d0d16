"""Commands that work: files, streams, exit codes, start-up time."""

import json
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.app.cli.sources import open_source
from amontons.io.fclib import read_fclib, write_fclib
from amontons.io.plots import solutions_figure
from amontons.mechanics.ready.gallery import box_tower, random_delassus
from amontons.solvers import Iterate


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_fclib(box_tower(2), "tower.hdf5")
    write_fclib(random_delassus(1, 8), "random.hdf5")
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(main, [str(a) for a in arguments])


def test_the_list_of_commands_has_whole_sentences():
    commands = run("--help").stdout.partition("Commands:")[2].partition("Examples:")[0]
    lines = [line for line in commands.splitlines() if line.strip()]
    assert len(lines) == len(main.commands)
    assert all(line.endswith(".") and not line.endswith("..") for line in lines)


def test_solve_writes_everything(folder):
    result = run("solve", "tower.hdf5")
    assert result.exit_code == 0
    assert "8 contacts in 3D" in result.stdout
    assert "converged" in result.stdout
    names = {path.name for path in (folder / "tower-results").iterdir()}
    assert names == {"solution.json", "solution.h5", "status.png", "convergence.png"}


def test_solve_case_writes_vtu_too(folder):
    result = run("solve", "example:slab", "--set", "mesh.cells=[6,3]", "-o", "out/deep")
    assert result.exit_code == 0
    assert (folder / "out" / "deep" / "solution.vtu").is_file()
    assert "resultant" in result.stdout


def test_json_on_stdout_is_all_there_is(folder):
    result = run("solve", "tower.hdf5", "--json", "-")
    data = json.loads(result.stdout)
    assert data["schema"] == "amontons/solution/1"
    assert data["method"] == "auto"
    assert (folder / "tower-results" / "solution.json").is_file()


def test_json_copy(folder):
    run("solve", "tower.hdf5", "--json", "copy.json", "--quiet")
    assert (folder / "copy.json").read_text() == (
        folder / "tower-results" / "solution.json"
    ).read_text()


def test_words_are_those_of_the_command_line(folder):
    assert "converged with auto" in run("solve", "tower.hdf5").stdout
    result = run("solve", "tower.hdf5", "--method", "gauss-seidel")
    assert "converged with gauss-seidel" in result.stdout


def test_the_set_example_of_the_help_works(folder):
    assert "solver.tolerance=1e-6" in run("solve", "--help").stdout
    flags = ["--set", "mesh.cells=4", "--set", "solver.tolerance=1e-6", "--json", "-"]
    assert json.loads(run("solve", "example:slab", *flags).stdout)["tolerance"] == 1e-6


def test_quiet(folder):
    result = run("solve", "tower.hdf5", "--quiet")
    assert (result.exit_code, result.output) == (0, "")


def test_not_converged_is_exit_code_1_with_results(folder):
    result = run("solve", "random.hdf5", "--method", "gauss-seidel", "--max-iterations", 1,
                 "--tolerance", "1e-13")  # fmt: skip
    assert result.exit_code == 1
    assert "max iterations" in result.stderr
    assert "Allow more iterations" in result.stderr
    data = json.loads((folder / "random-results" / "solution.json").read_text())
    assert data["outcome"] == "max_iterations"


def test_contacts_are_judged_one_by_one(folder):
    weak = am.FrictionProblem.from_delassus(np.eye(6), [[-1, 0, 0], [1e9, 0, 0]], [0.3, 0.3])
    write_fclib(weak, "weak.hdf5")
    data = json.loads(run("solve", "weak.hdf5", "--json", "-").stdout)
    assert (data["outcome"], data["contact_tolerance"]) == ("converged", 1e-4)
    assert data["contact_error"] <= 1e-4
    flags = ["--contact-tolerance", 10, "--json", "-"]
    data = json.loads(run("solve", "weak.hdf5", *flags).stdout)
    assert (data["weakest"], data["outcome"]) == (0, "converged")
    assert data["contact_error"] > 0.5
    flags = ["--set", "solver.contact_tolerance=0.5", "--json", "-"]
    assert json.loads(run("solve", "weak.hdf5", *flags).stdout)["contact_tolerance"] == 0.5
    for flags in (["--contact-tolerance", 0], ["--set", "solver.contact_tolerance=-1"]):
        assert run("solve", "weak.hdf5", *flags).exit_code == 2


def test_interrupted_is_exit_code_130_with_results(folder, monkeypatch):
    def iterates(self, problem, start, target):
        from amontons.solvers import Iterate

        yield Iterate(np.ones_like(start.r))
        raise KeyboardInterrupt

    monkeypatch.setattr(am.GaussSeidel, "iterates", iterates)
    result = run("solve", "random.hdf5", "--method", "gauss-seidel")
    assert result.exit_code == 130
    data = json.loads((folder / "random-results" / "solution.json").read_text())
    assert data["outcome"] == "stopped"


def test_interrupted_before_the_solve_writes_nothing(folder, monkeypatch):
    def interrupt(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("amontons.io.fclib.read_fclib", interrupt)
    before = set(folder.iterdir())
    assert run("solve", "random.hdf5").exit_code == 130
    assert set(folder.iterdir()) == before


@pytest.mark.parametrize("method", ["gauss-seidel", "semismooth-newton", "auto"])
def test_methods_reach_global_files_too(folder, method):
    result = run("solve", "tower.hdf5", "--method", method, "--json", "-")
    assert json.loads(result.stdout)["method"] == method


def test_solver_fields(folder):
    flags = ["--set", "solver.batch=5", "--set", "solver.max_sweeps=10"]
    result = run("solve", "random.hdf5", "--method", "gauss-seidel", *flags,
                 "--tolerance", "1e-14", "--json", "-")  # fmt: skip
    assert json.loads(result.stdout)["iterations"] <= 10


def test_convert(folder):
    assert run("convert", "tower.hdf5", "local.hdf5", "--form", "local").exit_code == 0
    local = read_fclib("local.hdf5")
    assert local.form is am.Form.DELASSUS
    np.testing.assert_allclose(local.q, box_tower(2).condensed().q)
    run("solve", "tower.hdf5")
    assert run("convert", "tower-results", "again.hdf5").exit_code == 0
    assert read_fclib("again.hdf5").form is am.Form.GLOBAL
    assert run("convert", "example:slab", "slab.hdf5", "--set", "mesh.cells=4").exit_code == 0
    assert read_fclib("slab.hdf5").dimension == 2


def test_bench(folder):
    result = run("bench", "tower.hdf5", "random.hdf5", "--methods", "auto,gauss-seidel",
                 "--tolerances", "1e-2,1e-4", "--profile", "p.png", "--json",
                 "b.json")  # fmt: skip
    assert result.exit_code == 0
    assert "tower" in result.stdout
    rows = json.loads((folder / "b.json").read_text())["results"]
    assert len(rows) == 8
    assert all(row["outcome"] == "converged" and row["seconds"] > 0 for row in rows)
    assert (folder / "p.png").stat().st_size > 1000


def test_bench_counts_failures(folder):
    wedged = am.FrictionProblem.from_delassus(
        np.diag([0.0, 1.0, 1.0]), np.array([-1.0, 0.0, 0.0]), 0.5
    )
    write_fclib(wedged, "wedged.hdf5")  # nothing can open the contacts
    result = run("bench", "wedged.hdf5", "--methods", "auto,gauss-seidel", "--tolerances",
                 "1e-6", "--time-limit", "1e-9", "--profile", "p.png", "--json",
                 "-")  # fmt: skip
    rows = json.loads(result.stdout)["results"]
    assert all(row["seconds"] is None and row["outcome"] == "time_limit" for row in rows)


def test_examples_are_listed():
    result = run("examples")
    assert "cube " in result.stdout
    assert all(len(line) < 100 for line in result.stdout.splitlines())


@pytest.mark.parametrize(
    "command", [[], ["solve"], ["info"], ["convert"], ["bench"], ["enumerate"], ["examples"]]
)
def test_help(command):
    result = run(*command, "--help")
    assert result.exit_code == 0
    assert "Usage" in result.stdout


def test_version():
    assert am.__version__ in run("--version").stdout


def test_start_up_loads_no_heavy_package():
    code = "import sys; from amontons.app.cli import main; assert 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_enumerate_lists_all_solutions():
    result = run("enumerate", "example:hild", "--json", "-")
    assert result.exit_code == 0
    data = json.loads(result.stdout)
    assert data["complete"] is True
    assert sorted(s["pattern"].count("f") for s in data["solutions"]) == [0, 0, 8]
    assert all(s["error"] < 1e-8 for s in data["solutions"])
    table = run("enumerate", "example:hild", "--mu", "2", "--set", "mesh.refine=1").stdout
    assert "ff " in table
    assert "1 solution; there is no other" in table


def test_enumerate_in_three_dimensions(tmp_path):
    path = tmp_path / "two.hdf5"
    write_fclib(random_delassus(0, 2, 3), path)
    result = run("enumerate", str(path), "--json", "-")
    assert result.exit_code == 0
    (solution,) = json.loads(result.stdout)["solutions"]
    assert set(solution["pattern"]) <= set("fsl")


@pytest.mark.parametrize("name", ["brake", "one-contact"])
def test_enumerate_draws_solutions_side_by_side(name, tmp_path):
    picture = tmp_path / "solutions.png"
    assert run("enumerate", f"example:{name}", "--picture", str(picture)).exit_code == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    refused = run("enumerate", f"example:{name}", "--picture", str(tmp_path / "a.doc"))
    assert refused.exit_code == 2
    assert ".doc" in refused.stderr


def test_pictures_of_several_solutions_and_of_none():
    brake = open_source("example:brake")
    problem = brake.discrete()
    found = [am.solve(problem, start=Iterate(s.r.copy()))
             for s in am.all_solutions(problem).solutions]  # fmt: skip
    long = "word " * 60
    figure = solutions_figure(found, model=brake.model, title=long)
    assert len({axes.get_xlim() + axes.get_ylim() for axes in figure.axes}) == 1  # one scale
    figure.canvas.draw()
    title = figure._suptitle.get_window_extent()
    assert 0 <= title.x0
    assert title.x1 <= figure.bbox.width
    for model in (brake.model, None):
        empty = solutions_figure([], model=model)
        texts = [text.get_text() for axes in empty.axes for text in axes.texts]
        assert texts == ["no solution was found"]


def test_enumerate_that_is_stopped_early_lists_what_newton_finds(tmp_path):
    found = run("enumerate", "example:slab", "--time-limit", 0.01, "--json", "-")
    assert found.exit_code == 1
    record = json.loads(found.stdout)
    assert not record["complete"]
    solved = am.solve(open_source("example:slab").model)
    patterns = [s["pattern"] for s in record["solutions"]]
    assert solved.pattern in patterns


@pytest.mark.parametrize(("name", "words"), [
    ("tresca", "expected Coulomb friction"), ("wall", "contact alone holds a body")
])  # fmt: skip
def test_enumerate_names_what_it_has_no_use_for(name, words):
    smaller = "wall.cells=[2,1,1]" if name == "wall" else "mesh.cells=2"
    result = run("enumerate", f"example:{name}", "--set", smaller)
    assert result.exit_code == 2
    assert words in result.stderr


@pytest.mark.parametrize("command", ["solve", "enumerate", "uniqueness"])
def test_values_in_time_are_named_where_they_count_at_zero(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    limit = [] if command == "solve" else ["--time-limit", 0.5]
    assert "this is t = 0" in run(command, "example:vee", *limit).stdout
    assert "this is t = 0" not in run(command, "example:brake", *limit).stdout


FREE = """
[mesh]
box = [2, 1]
cells = [4, 2]
[material.default]
young = 200
poisson = 0.3
[[traction]]
on = "top"
value = [0.1, -1.0]
[[contact]]
slave = "bottom"
obstacle = { plane = { normal = [0, 1] } }
friction = { coulomb = 0.2 }
"""


def test_a_small_body_that_contact_alone_holds(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(FREE)
    result = run("solve", case, "-o", tmp_path / "out")
    assert result.exit_code == 0
    assert "Contact alone holds a body" in result.stdout
    pushed = run("solve", case, "-o", tmp_path / "out", "--set", "traction.value=[1.0, -1.0]")
    assert pushed.exit_code == 1
    assert "there is no solution" in pushed.stderr
    assert "Hold what gives way by a support" in pushed.stderr
    assert "'auto'" not in pushed.stderr  # it was
    told = run("info", case)
    assert told.exit_code == 0
    assert "none, contact alone holds a body" in told.stdout
    assert "elastic bodies" in told.stdout
    refused = run("enumerate", case)
    assert refused.exit_code == 2
    assert "contact alone holds a body" in refused.stderr
    assert "contact alone holds a body" in run("uniqueness", case).stdout.lower()


def test_a_brake_arm_jams_only_with_much_friction():
    counts = [
        len(am.all_solutions(open_source("example:brake").model.with_mu(mu)).solutions)
        for mu in (0.3, 0.42, 0.5, 0.8)
    ]
    assert counts == [1, 1, 3, 3]  # a rigid arm jams from 0.364 on


def test_enumerate_says_what_it_can_not_do():
    tower = run("enumerate", "example:tower", "--time-limit", "0.01")
    assert tower.exit_code == 1
    assert "there may be others" in tower.stdout
    assert "--mu" in run("enumerate", "example:hild", "--mu", "-1").stderr


def test_basins_says_who_finds_what(folder):
    arguments = ("basins", "random.hdf5", "--methods", "gauss-seidel", "--starts", "cone:3")
    short = ("--time-limit", "20", "--quiet")
    result = run(*arguments, *short, "--json", "b.json", "--picture", "b.png")
    assert result.exit_code == 0, result.output
    data = json.loads((folder / "b.json").read_text())
    assert data["schema"] == "amontons/basins/1"
    assert sum(data["counts"]["gauss-seidel"].values()) == 3
    assert (folder / "b.png").stat().st_size > 5000
    for words, extra in (
        ("such as uzawa.rho=1,10,100", ("--parameter", "rho")),
        ("no such field", ("--parameter", "uzawa.rho=1")),
        ("expected kinds among", ("--starts", "cones")),
        ("unknown method", ("--methods", "newton")),
        ("tolerance", ("--tolerance", "7")),
    ):
        refused = run(*arguments, *short, *extra)
        assert refused.exit_code == 2, extra
        assert words in refused.stderr


def test_solve_starts_from_a_file(folder):
    assert run("solve", "tower.hdf5", "--quiet", "-o", "first").exit_code == 0
    for start in ("first", "first/solution.h5"):
        data = json.loads(run("solve", "tower.hdf5", "--start", start, "--json", "-").stdout)
        assert data["iterations"] == 0
    text = json.dumps({"r": np.zeros((8, 3)).tolist(), "v": None})
    (folder / "start.json").write_text(text)
    assert run("solve", "tower.hdf5", "--start", "start.json").exit_code == 0
    broken = {
        "list.json": ("[1]", "found no r"),
        "rows.json": ('{"r": [[1, 2], [3]]}', "r: expected an array of numbers"),
        "few.json": ('{"r": [[1, 2, 3]]}', "expected r of shape (8, 3), got (1, 3)"),
        "nan.json": ('{"r": [[NaN, 2, 3]]}', "not finite"),
        "text.json": ('{"r": "abc"}', "r: expected"),
        "half.json": ('{"r": [[', "expected JSON"),
        "flat.json": ('{"r": [1, 2]}', "a row per contact"),
        "no.h5": ("no HDF5", "expected a solution (HDF5)"),
    }
    for name, (content, words) in broken.items():
        (folder / name).write_text(content)
        refused = run("solve", "tower.hdf5", "--start", name, "-o", "none")
        assert refused.exit_code == 2, name
        assert f"--start {name}: " in refused.stderr
        assert words in refused.stderr, refused.stderr
    for name, words in (("first/solution.json", "solution.h5"), ("gone.json", "no such file"),
                        ("tower.hdf5", "found no r")):  # fmt: skip
        refused = run("solve", "tower.hdf5", "--start", name)
        assert refused.exit_code == 2
        assert words in refused.stderr, refused.stderr
