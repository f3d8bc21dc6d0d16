"""Reports as files: what is in them, what can not get out, and that numbers are the same."""

import base64
import json
import re
import zlib
from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.analysis.paths.events import Event
from amontons.core.errors import NotWritten
from amontons.io.case import read_case
from amontons.io.plots.style import COLOURS
from amontons.io.report import page_of, report
from amontons.io.report.packing import Packer
from amontons.io.report.page import STATIC
from amontons.io.report.skin import Skin
from amontons.io.report.states import Stage
from amontons.io.units import Units
from amontons.mechanics.elements import von_mises
from amontons.mechanics.elements.nodal_stress import stress_of
from amontons.mechanics.meshes import second_order

HOSTILE = "</script><script>alert(1)</script> <!-- & \" ' {{css}} \ud800 \x00 \u2028 µ Ü 接触"


def block(name="", cells=(2, 2, 2)):
    body = am.Body(am.box((1, 1, 1), cells=cells), am.LinearElastic(young=200, poisson=0.3))
    return am.Model(
        [body], supports=[am.Fix("top", (0.01, 0, -0.02))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=0.5)], name=name,
    )  # fmt: skip


def two_blocks(method="mortar", cells=((3, 3, 2), (4, 4, 2))):
    """A block pressed on another: uniform pressure 1, no shear."""
    material = am.LinearElastic(young=200, poisson=0.0)
    lower = am.box((1, 1, 0.5), cells=cells[0], origin=(0, 0, -0.5))
    upper = am.box((1, 1, 0.5), cells=cells[1])
    return am.Model(
        [am.Body(lower, material, "lower"), am.Body(upper, material, "upper")],
        supports=[am.Fix("lower.bottom", 0), am.Fix("upper.top", (0, 0, -0.005))],
        contacts=[am.Contact("upper.bottom", master="lower.top", mu=0.5, method=method)],
    )


@pytest.fixture(scope="module")
def solution():
    return am.solve(block("a block"))


def data_of(html):
    """The JSON of a page, and a function from a reference in it to numbers."""
    found = json.loads(re.search(r'id="data">(.*?)</script>', html, re.S)[1])
    raw = zlib.decompress(base64.b64decode(re.search(r'id="arrays">(.*?)</script>', html)[1]))
    kinds = {"f4": "<f4", "i2": "<i2", "u2": "<u2", "u4": "<u4"}

    def array(place):
        values = np.frombuffer(raw, kinds[place["type"]], place["n"], place["at"])
        return values * place.get("step", 1)

    return found, array


def test_the_page_holds_the_numbers_of_the_solution(solution, tmp_path):
    path = solution.report(tmp_path / "r.html", units="mm,N")
    data, array = data_of(path.read_text())
    state = data["view"]["states"][0]
    node = array(data["view"]["node"])
    moved = array(state["moved"]).reshape(-1, 3)
    assert np.allclose(moved, solution.displacement[0][node], rtol=1e-6, atol=1e-12)
    at = {int(n): k for k, n in enumerate(node[array(data["view"]["contacts"])])}
    mine = [at[n] for n in solution.fields.node]
    pressure = array(state["values"]["pressure"])[mine]
    assert np.allclose(pressure, solution.pressure, rtol=1e-6)
    assert np.array_equal(array(state["status"])[mine], solution.status)
    assert data["units"] == {"length": "mm", "force": "N", "time": "", "stress": "MPa"}
    stress = stress_of(solution.model.bodies[0].mesh, solution.model.bodies[0].material,
                       solution.displacement[0])[1]  # fmt: skip
    assert np.allclose(array(state["stress"]), von_mises(stress)[node], rtol=1e-5)
    force = array(state["force"]).reshape(-1, 3).sum(axis=0)
    assert np.allclose(force, solution.resultant, rtol=1e-5)


def test_inner_nodes_stay_at_home(solution):
    skin = Skin(solution.model)
    assert len(skin.points) == 26  # of 27
    corners = skin.points[skin.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.isclose(np.linalg.norm(normal, axis=1).sum() / 2, 6.0)
    assert np.isclose(np.einsum("ic,ic->", normal, corners[:, 0]) / 6, 1.0)  # outwards
    assert len(skin.sharp) == 24  # twelve edges in two parts


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("kind", ["tri", "quad", "tet", "hex"])
def test_the_skin_covers_all_kinds_of_cells(kind, order):
    dim = 2 if kind in ("tri", "quad") else 3
    body = am.Body(am.box((1,) * dim, cells=(2,) * dim, kind=kind),
                   am.LinearElastic(young=1, poisson=0.3), order=order)  # fmt: skip
    contact = am.Contact("bottom", am.Plane(normal=np.eye(dim)[-1]), mu=0.1, method="nitsche")
    skin = Skin(am.Model([body], supports=[am.Fix("top", 0)], contacts=[contact]))
    corners = skin.points[skin.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.isclose(np.linalg.norm(normal, axis=1).sum() / 2, 6.0 if dim == 3 else 1.0)


@pytest.mark.parametrize("kind", ["quad", "hex"])
def test_the_skin_covers_serendipity_cells(kind):
    dim = 2 if kind == "quad" else 3
    mesh = second_order(am.box((1,) * dim, cells=(2,) * dim, kind=kind), serendipity=True)
    body = am.Body(mesh, am.LinearElastic(young=1, poisson=0.3))
    contact = am.Contact("bottom", am.Plane(normal=np.eye(dim)[-1]), mu=0.1, method="nitsche")
    skin = Skin(am.Model([body], supports=[am.Fix("top", 0)], contacts=[contact]))
    corners = skin.points[skin.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.isclose(np.linalg.norm(normal, axis=1).sum() / 2, 6.0 if dim == 3 else 1.0)
    volume = np.einsum("ic,ic->", normal, corners[:, 0]) / 6
    assert dim == 2 or np.isclose(volume, 1.0)  # outwards


@pytest.mark.parametrize("method", ["mortar", "nodal"])
def test_both_sides_of_a_uniform_pressure_show_it(method):
    cells = ((3, 3, 2), (4, 4, 2)) if method == "mortar" else ((3, 3, 2), (3, 3, 2))
    model = two_blocks(method, cells)
    found = am.solve(model)
    stage = Stage(Skin(model))
    state = stage.state(found.fields, found.solution)
    side = stage.skin.body[stage.contacts]
    assert set(side) == {0, 1}
    assert (state.status >= 0).all()
    assert np.allclose(state.values["pressure"][side == 0], 1.0, rtol=1e-6)
    assert np.allclose(state.values["pressure"][side == 1], 1.0, rtol=1e-6)
    assert np.allclose(state.force[stage.skin.body == 0], 0)  # arrows are on the slave
    assert np.isclose(state.force[:, 2].sum(), found.resultant[2], rtol=1e-9)


def test_a_hostile_title_stays_text(solution, tmp_path):
    html = page_of(solution, title=HOSTILE, units={"length": "<b>", "force": "&"}).html
    assert html.count("<script") == html.count("</script>") == 4
    assert "alert(1)</script>" not in html
    assert "{{css}}" in html
    data, _ = data_of(html)
    assert data["title"].startswith("</script><script>")
    assert data["title"].endswith("接触")
    assert "\x00" not in html
    html.encode("utf-8")


def test_the_same_result_gives_the_same_bytes(solution):
    assert page_of(solution).html == page_of(solution).html


def test_nothing_is_loaded_from_anywhere(solution):
    html = page_of(solution).html
    assert "default-src 'none'" in html
    assert not re.findall(r'(?:src|href)="', html)


def test_what_has_not_converged_is_stamped():
    found = am.solve(block(), am.GaussSeidel(), max_iterations=1, check=False)
    page = page_of(found)
    assert page.stamp.startswith("NOT CONVERGED")
    assert 'class="stamp" role="alert">NOT CONVERGED (max iterations' in page.html
    assert "Allow more iterations" in page.html


def test_other_names_than_pages_are_refused(solution, tmp_path):
    with pytest.raises(am.InvalidInput, match=r"ends in \.html or \.htm, got '\.png'"):
        solution.report(tmp_path / "r.png")
    with pytest.raises(NotWritten, match="does not exist"):
        solution.report(tmp_path / "none" / "r.html")
    with pytest.raises(TypeError, match="has no report"):
        report(3, tmp_path / "r.html")
    with pytest.raises(TypeError, match="has no report"):
        solution.convergence.report(tmp_path / "r.html")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("units", [3, "a,b,c,d", {"mass": "kg"}, ["mm", 3]])
def test_units_that_are_none_are_refused(solution, tmp_path, units):
    with pytest.raises(am.InvalidInput, match="units: expected up to three names"):
        solution.report(tmp_path / "r.html", units=units)


def test_units_of_a_case(tmp_path):
    case = read_case("example:cube", ['units.length="m"', "units.force=kN"])
    assert case.units == Units("m", "kN")
    assert case.units.stress == "kPa"
    assert Units("in", "lbf").stress == "lbf/in²"
    with pytest.raises(am.FileFormatError, match=r"units\.lenght: unknown key; did you mean"):
        read_case("example:cube", ["units.lenght=m"])


def test_no_verdict_is_given_of_large_strains():
    """That of the tangent problem, "one solution, whatever the load", is none of the model."""
    body = am.Body(am.box((1, 1), cells=2), am.NeoHookean(1.0, 0.3))
    model = am.Model([body], [am.Fix("top", (0, -0.1))],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0.1)])  # fmt: skip
    found = am.solve(model)
    title, text = page_of(found).verdict
    assert title == "Not examined"
    assert "am.multistart(model)" in text
    assert am.uniqueness(found.solution.problem).verdict is am.Verdict.UNIQUE_EVERY_LOAD
    branch = am.follow(model, max_points=2)
    assert "am.multistart(model)" in page_of(branch).verdict[1]
    crossed = replace(branch, events=(Event(am.EventKind.BRANCH, 0.0, branch[0].state),))
    assert page_of(crossed).verdict[0] == "No: other curves leave this one at a branch point"


def test_verdicts_in_words(solution):
    known = ("Not settled", "Yes: one solution, whatever the load")
    assert page_of(solution).verdict[0] in known
    found = am.solve(am.FrictionProblem.from_delassus([[1, 0.8], [0.8, 1]], [[0.2, 1.0]], 0.1))
    assert page_of(found).verdict[0] == "Yes: one solution, whatever the load"
    several = am.all_solutions(found.problem.with_mu(2.0))
    page = page_of(several, problem=found.problem.with_mu(2.0), title="one contact")
    assert page.verdict[0] == "3 solutions; there is no other"
    assert len(page.charts) == 3
    assert len(page_of(several).tables[0].rows) == 3  # without a problem, the table


def test_a_branch_of_a_model_shows_bodies_and_others_do_not():
    model = read_case("example:brake").model
    branch = am.follow(model, "load", (0.2, 1.0))
    page = page_of(branch, model=model)
    assert len(page.states) == len(page.charts[0]["states"]) >= 2
    assert page.states[-1].parameter == pytest.approx(1.0)
    for state in page.states:  # supports stand where the load at that point has them
        top = page.stage.skin.points[:, 1].max()
        held = np.isclose(page.stage.skin.points[:, 1], top)
        given = am.solve(model.with_load(state.parameter)).displacement[0]
        at = page.stage.skin.node[held]
        assert np.allclose(state.moved[held, :2], given[at], atol=1e-12)
    assert page_of(branch).stage is None


def test_packed_numbers_come_back():
    packer = Packer(small=True)
    values = np.linspace(-3e-7, 5e-7, 1001)
    places = [packer.floats(values), packer.indices([0, 70000]), packer.signs([-1, 2]),
              packer.floats(values, small=False),
              packer.floats([1e300, np.nan, np.inf], small=False)]
    raw = zlib.decompress(base64.b64decode(packer.text))
    small = np.frombuffer(raw, "<i2", 1001, places[0]["at"]) * places[0]["step"]
    assert np.abs(small - values).max() <= 5e-7 / 32767
    assert np.frombuffer(raw, "<u4", 2, places[1]["at"]).tolist() == [0, 70000]
    assert np.frombuffer(raw, "<i2", 2, places[2]["at"]).tolist() == [-1, 2]
    stored = np.frombuffer(raw, "<f4", 3, places[4]["at"]).astype(float)
    big = stored * places[4]["step"]
    assert big.tolist() == [pytest.approx(1e300, rel=1e-6), 0, 0]


def test_colours_are_those_of_the_figures():
    style = (STATIC / "report.css").read_text()
    for status, colour in COLOURS.items():
        assert f"--{status.name.lower()}: {colour.lower()};" in style


def test_the_library_says_what_it_is():
    wanted = json.loads((STATIC / "three" / "package.json").read_text())
    version = wanted["dependencies"]["three"]
    library = (STATIC / "three.min.js").read_text()
    assert library.startswith(f"/* three.js {version}, MIT licence")
    assert f'"{version.split(".")[1]}"' in library  # its REVISION
    assert "<!--" not in library and "</script" not in library
    assert "MIT License" in (STATIC / "three.LICENSE.txt").read_text()


def test_sizes_grow_with_the_surface_only():
    few, many = (len(page_of(am.solve(block(cells=(n, n, n)))).html) for n in (4, 12))
    facets = 12 * (12**2 - 4**2)
    assert (many - few) / facets < 60  # bytes a triangle; 32 cells have 12 288 of them


def test_a_zone_is_seen_from_the_other_side():
    steel = am.LinearElastic(2e5, 0.3)
    angles = np.linspace(0, 2 * np.pi, 17)
    roller = am.Body(am.ring([0.5, 1.0], angles, [0, 1]), steel, "roller")
    base = am.Body(am.box((1, 4, 1), cells=(1, 4, 1), origin=(1.01, -2, 0)), steel, "base")
    bore = am.Body(am.ring([1.01, 2.0], angles, [0, 1]), steel, "bore")
    held = [am.Fix("roller.inner", (0, 0, 0))]

    def outward(other, master):
        contact = am.Contact("roller.outer", master=master, mu=0.2)
        other_held = am.Fix(f"{other.name}.top", (0, 0, 0))
        model = am.Model([roller, other], [*held, other_held], [contact])
        return Skin(model).zones[0].outward

    np.testing.assert_allclose(outward(base, "base.left"), [1, 0, 0], atol=1e-12)
    around = outward(bore, "bore.inner")
    assert np.linalg.norm(around) == pytest.approx(1) and abs(around[2]) < 1e-12
