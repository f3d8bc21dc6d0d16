"""Files of a solution: contents by the contract, figures that exist, nothing half-written."""

import json
from dataclasses import replace

import h5py
import meshio
import numpy as np
import pytest

import amontons as am
from amontons.io import results as output
from amontons.io.fclib import read_fclib, write_fclib
from amontons.io.plots import convergence_figure, profile_figure, status_figure
from amontons.io.plots.style import round_below
from amontons.mechanics.ready.gallery import GALLERY, box_tower, one_contact_2d
from amontons.solvers.driver import drive

KEYS = {
    "outcome", "advice", "method", "error", "fclib_error", "tolerance", "iterations",
    "linear_iterations", "seconds", "dimension", "unknowns", "contacts", "resultant", "measure",
    "max_penetration", "max_cone_violation", "versions", "schema", "warnings",
}  # fmt: skip


def solved(dimension, **contact):
    body = am.Body(am.box((1,) * dimension, cells=3), am.LinearElastic(200, 0.3))
    plane = am.Plane(normal=(0,) * (dimension - 1) + (1,))
    contact = contact or {"mu": 0.4}
    push = (0.02, -0.02) if dimension == 2 else (0.02, 0.0, -0.02)
    return am.solve(
        am.Model([body], supports=[am.Fix("top", push)],
                 contacts=[am.Contact("bottom", plane, **contact)], name="block")
    )  # fmt: skip


@pytest.fixture(scope="module", params=[2, 3])
def solution(request):
    return solved(request.param)


def test_json(solution, tmp_path):
    solution.write(tmp_path / "a.json")
    data = json.loads((tmp_path / "a.json").read_text())
    assert data.keys() >= KEYS
    assert data["schema"] == "amontons/solution/1"
    assert data["outcome"] == "converged"
    assert data["method"] == "auto"
    assert data["seconds"].keys() == {"assemble", "setup", "solve", "total", "compiling"}
    assert data["contacts"]["total"] == sum(
        data["contacts"][k] for k in ("open", "slip", "stick")
    )
    assert len(data["resultant"]) == data["dimension"]
    assert data["versions"]["amontons"] == am.__version__


def test_active_sets_step_by_step(tmp_path):
    """In solution.json and in the summary; other methods have none."""
    body = am.Body(am.box((1, 1, 1), cells=4), am.LinearElastic(200, 0.3))
    model = am.Model(
        [body], supports=[am.Fix("top", lambda x: (0, 0.1, 0.03 - 0.1 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.6)],
    )  # fmt: skip
    found = am.solve(model, am.ActiveSet(bound="fixed-point", change=1e-9))
    found.write(tmp_path / "a.json")
    sets = json.loads((tmp_path / "a.json").read_text())["active_sets"]
    steps = sets["steps"]
    assert [step["iteration"] for step in steps] == list(range(1, len(steps) + 1))
    assert all(step["open"] + step["stick"] + step["slip"] == 25 for step in steps)
    assert steps[-1]["change"] < 1e-9 <= steps[-2]["change"]
    last = {key: steps[-1][key] for key in ("open", "stick", "slip")}
    assert last == found.counts
    assert sets["settled"] == len(steps) - steps[-1]["kept"]
    text = output.describe(found.output)
    first = "{open}/{stick}/{slip}".format(**steps[0])
    final = "{open}/{stick}/{slip}".format(**steps[-1])
    assert f"open/stick/slip, where they change: 1: {first}, 2: " in text
    assert f"{sets['settled']}: {final} (of {len(steps)} iterations)" in text
    other = output.summary(am.solve(model).output)
    assert other["active_sets"] is None
    assert "active sets" not in output.describe(am.solve(model).output)


def test_json_has_no_nan():
    found = drive(one_contact_2d(), max_iterations=1)
    broken = replace(found, convergence=replace(found.convergence, error=np.inf))
    data = output.summary(output.Output(broken))
    assert data["error"] is None
    assert data["resultant"] is None
    assert "NaN" not in output.to_json(data)


def test_h5(solution, tmp_path):
    solution.write(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5") as file:
        np.testing.assert_array_equal(file["r"], solution.r)
        np.testing.assert_array_equal(file["u"], solution.u)
        np.testing.assert_array_equal(file["v"], solution.v)
        np.testing.assert_array_equal(file["status"], solution.status)
        np.testing.assert_array_equal(file["points"], solution.points)
        np.testing.assert_array_equal(file["frames"], solution.frames)
        np.testing.assert_array_equal(file["displacement/body"], solution.displacement[0])


def test_h5_of_an_fclib_problem_is_an_fclib_file(tmp_path):
    write_fclib(box_tower(2), tmp_path / "a.hdf5")
    found = drive(read_fclib(tmp_path / "a.hdf5"))
    output.write(output.Output(found, from_fclib=True), tmp_path / "b.h5")
    assert read_fclib(tmp_path / "b.h5").contacts == 8
    with h5py.File(tmp_path / "b.h5") as file:
        np.testing.assert_array_equal(file["solution/r"], found.r.ravel())
        np.testing.assert_array_equal(file["r"], found.r)


def test_vtu(solution, tmp_path):
    solution.write(tmp_path / "a.vtu")
    mesh = meshio.read(tmp_path / "a.vtu")
    d = solution.problem.dimension
    np.testing.assert_allclose(mesh.point_data["displacement"][:, :d], solution.displacement[0])
    node = solution.fields.node
    fields = mesh.point_data
    np.testing.assert_allclose(fields["CPRESS"][node], solution.pressure)
    np.testing.assert_allclose(fields["COPEN"][node], solution.gap)
    np.testing.assert_array_equal(fields["CSTATUS"][node], solution.status)
    np.testing.assert_allclose(fields["CSHEAR"][node], np.linalg.norm(solution.shear, axis=1))
    np.testing.assert_allclose(fields["CSLIP"][node], np.linalg.norm(solution.slip, axis=1))
    assert (np.delete(fields["CSTATUS"], node) == -1).all()
    for values in fields.values():
        assert np.isfinite(values).all()
    assert all((stress >= 0).all() for stress in mesh.cell_data["von_mises"])


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_plot(solution, suffix, tmp_path):
    path = tmp_path / f"a{suffix}"
    solution.plot(path)
    assert path.stat().st_size > 1000
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", GALLERY)
def test_figures_without_geometry(name, tmp_path):
    found = drive(GALLERY[name]())
    status_figure(found, title=name).savefig(tmp_path / "a.png")
    convergence_figure(found.convergence, name).savefig(tmp_path / "b.png")


@pytest.mark.parametrize("contact", [{"mu": 0.0}, {"tresca": 1.0}, {"tresca": 0.0}])
@pytest.mark.parametrize("dimension", [2, 3])
def test_figures_of_other_laws(contact, dimension, tmp_path):
    solved(dimension, **contact).plot(tmp_path / "a.png")


def test_figure_of_a_failure(tmp_path):
    found = drive(one_contact_2d())
    broken = replace(found.convergence, error=np.inf, history=())
    convergence_figure(broken).savefig(tmp_path / "a.png")


def test_profile_figure(tmp_path):
    profiles = {
        1e-3: am.performance_profile([[1.0, 2.0]]),
        1e-6: am.performance_profile([[np.inf] * 2]),
    }
    profile_figure(profiles, ["a", "b"]).savefig(tmp_path / "a.png")


def test_unknown_suffix(solution, tmp_path):
    with pytest.raises(am.InvalidInput, match=r"\.vtu"):
        solution.write(tmp_path / "a.xyz")
    with pytest.raises(am.InvalidInput, match=r"\.png"):
        solution.plot(tmp_path / "a.xyz")
    with pytest.raises(am.InvalidInput, match="no mesh"):
        output.write(output.Output(drive(one_contact_2d())), tmp_path / "a.vtu")
    assert not list(tmp_path.iterdir())


def test_nothing_half_written(solution, tmp_path, monkeypatch):
    output.save(solution.output, tmp_path)
    old = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert len(old) == 6

    def fail(*arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("amontons.io.results.plot_convergence", fail)
    with pytest.raises(am.InvalidInput, match="No space left"):
        output.save(solution.output, tmp_path)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == old


@pytest.mark.parametrize("name", ["summary", "plot_status", "write_h5"])
def test_a_failure_leaves_no_folder(solution, tmp_path, monkeypatch, name):
    def fail(*arguments):
        raise am.SingularOperator("no")

    monkeypatch.setattr(f"amontons.io.results.{name}", fail)
    with pytest.raises(am.SingularOperator):
        output.save(solution.output, tmp_path / "new" / "deep")
    assert not list(tmp_path.iterdir())


def test_folder_that_can_not_be_made(solution, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(am.InvalidInput, match="can not be made"):
        output.save(solution.output, tmp_path / "file" / "x")
    with pytest.raises(am.InvalidInput, match="can not be made"):
        output.save(solution.output, tmp_path / "new" / ("a" * 300))
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_fclib_error_may_be_unknown(monkeypatch):
    monkeypatch.setattr(type(drive(one_contact_2d())), "fclib_error", None)
    assert output.summary(output.Output(drive(one_contact_2d())))["fclib_error"] is None


def corner(dimension):
    """A body pressed into a corner: contacts of two pairs at the nodes of its edge."""
    body = am.Body(am.box((1,) * dimension, cells=3), am.LinearElastic(200, 0.3))
    floor = am.Plane(normal=(0,) * (dimension - 1) + (1,))
    wall = am.Plane(normal=(1,) + (0,) * (dimension - 1))
    push = (0.0, -0.02) if dimension == 2 else (0.0, 0.0, -0.02)
    return am.solve(
        am.Model([body], supports=[am.Fix("top", push)],
                 contacts=[am.Contact("bottom", floor, mu=0.3),
                           am.Contact("left", wall, mu=0.3)])
    )  # fmt: skip


@pytest.mark.parametrize("dimension", [2, 3])
def test_vtu_of_several_contacts_at_a_node(dimension, tmp_path):
    found = corner(dimension)
    found.write(tmp_path / "a.vtu")
    values = meshio.read(tmp_path / "a.vtu").point_data
    total = values["CFORCE"].sum(axis=0)[:dimension]
    size = abs(found.resultant).max()  # its component T2 is zero but for rounding
    np.testing.assert_allclose(total, found.resultant, atol=1e-12 * size)
    node = found.fields.node
    twice = np.flatnonzero(np.bincount(node) == 2)
    assert len(twice) == (1 if dimension == 2 else 4)
    for k in twice:
        here = node == k
        shear = np.einsum("ik,ikc->c", found.shear[here], found.frames[here, 1:])
        assert np.isclose(values["CPRESS"][k], found.pressure[here].sum())
        assert np.isclose(values["CSHEAR"][k], np.linalg.norm(shear))
        assert values["COPEN"][k] == found.gap[here].min()
        assert values["CSTATUS"][k] == found.status[here].max()


@pytest.mark.parametrize("dimension", [2, 3])
def test_figure_of_several_pairs(dimension):
    found = corner(dimension)
    figure = status_figure(found.solution, found.fields, "corner", found.model)
    if dimension == 2:
        left = figure.axes[0]
        starts = [line.get_xdata() for line in left.lines[:4]]
        assert all((np.diff(x) > 0).all() for x in starts)
        assert {text.get_text() for text in left.texts} == {"bottom", "left"}
    else:
        assert sum(axes.get_title() == "Contact status on left" for axes in figure.axes) == 1


def test_words_of_a_model_without_a_name(tmp_path):
    found = corner(2)
    assert str(found).startswith("model: 7 contacts in 2D")
    assert output.summary(found.output)["title"] == "model"
    assert repr(found) == "<ModelSolution of model: 0 open, 3 slip, 4 stick; converged>"


def test_round_numbers_are_not_above_what_they_stand_for():
    just_below = np.nextafter(1000.0, 0.0)  # its logarithm is 3, rounded
    assert round_below(just_below) == pytest.approx(1000.0)
    for value in (1e-9, 0.3, 1.0, 1.9, 2.0, 4.99, 5.0, 77.0, 3e11):
        rounded = round_below(value)
        assert 1 - 1e-12 <= value / rounded < 2.5
        assert f"{rounded:.6e}"[:8] in ("1.000000", "2.000000", "5.000000")
