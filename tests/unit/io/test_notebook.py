"""What notebooks show: escaped words, tables of pandas and xarray, a view, progress."""

import logging
import sys
from html.parser import HTMLParser

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import InvalidInput, MissingDependency
from amontons.io.notebook import tables
from amontons.mechanics.ready.gallery import one_contact_2d, random_delassus
from amontons.mechanics.ready.hild import hild_triangle

HOSTILE = "<script>alert('x')</script> & co"


class Words(HTMLParser):
    """Text and tags of a page; raises for a tag that is closed before its inner ones."""

    def __init__(self, page):
        super().__init__()
        self.open, self.tags, self.words = [], set(), ""
        self.feed(page)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, text):
        self.words += f" {text}"


def block(name="block", **options):
    body = am.Body(am.box((2, 1), cells=(8, 4)), am.LinearElastic(young=1000, poisson=0.3))
    return am.Model(
        [body], supports=[am.Fix("top", (0.01, -0.02))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.3)], name=name, **options,
    )  # fmt: skip


@pytest.fixture(scope="module")
def solved():
    return am.solve(block())


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda: one_contact_2d(), "1 in 2D"),
        (block, "with Plane"),
        (lambda: am.solve(block()), "9 contacts in 2D"),
        (lambda: am.solve(block()).solution, "9 contacts in 2D"),
        (lambda: am.solve(block()).convergence, "converged"),
        (lambda: am.all_solutions(one_contact_2d()), "3 solutions"),
        (lambda: am.uniqueness(one_contact_2d()), "not unique"),
        (lambda: am.critical_friction(one_contact_2d()), "1.25"),
        (lambda: am.existence(one_contact_2d()), "whatever the load"),
        (lambda: am.follow(hild_triangle(2), "friction", (0.1, 4)), "branch over friction"),
        (lambda: am.diagram(hild_triangle(1), "friction", (1, 4), at=(4,)), "branch"),
        (lambda: am.basins(one_contact_2d(), ["gauss-seidel"], starts={"zero": 1}), "zero"),
    ],
)
def test_every_result_shows_itself(make, expected):
    if expected == "zero":
        expected = "gauss-seidel"
    page = make()._repr_html_()
    assert expected in Words(page).words
    assert len(page) < 8000


def test_words_of_users_are_only_words():
    model = block(name=HOSTILE)
    for shown in (model, model.assemble(), am.solve(model)):
        page = Words(shown._repr_html_())
        assert "script" not in page.tags
        assert HOSTILE in page.words


def test_what_has_not_converged_says_so_in_red():
    problem = random_delassus(1, 10)
    solution = am.solve(problem, am.Jacobi(), max_iterations=1, check=False)
    page = solution._repr_html_()
    assert "NOT CONVERGED" in page and "#b00020" in page
    assert "NOT CONVERGED" not in am.solve(block())._repr_html_()


def test_long_lists_are_cut_and_counted():
    found = am.all_solutions(hild_triangle(8, mu=8.0))
    assert len(found) > 12
    assert f"{len(found) - 12} more" in Words(found._repr_html_()).words


def test_dataframe_has_a_row_for_each_contact(solved):
    pandas = pytest.importorskip("pandas")
    frame = solved.to_dataframe()
    assert isinstance(frame, pandas.DataFrame)
    assert len(frame) == 9
    np.testing.assert_array_equal(frame.pressure, solved.pressure)
    np.testing.assert_allclose(frame[["force_x", "force_y"]].sum(), solved.resultant)
    assert (frame.status == "slip").sum() == solved.counts["slip"]


def test_dataframes_of_other_results():
    pytest.importorskip("pandas")
    found = am.all_solutions(one_contact_2d())
    assert sorted(found.to_dataframe().orientation) == [-1, 1, 1]
    branch = am.follow(hild_triangle(2), "friction", (0.1, 4))
    frame = branch.to_dataframe()
    np.testing.assert_array_equal(frame.parameter, branch.parameter)
    history = am.solve(one_contact_2d()).convergence
    assert len(history.to_dataframe()) == len(history.history)


def test_xarray_has_names_for_all_axes(solved):
    pytest.importorskip("xarray")
    data = solved.to_xarray()
    np.testing.assert_allclose(data.force.sum("contact"), solved.resultant)
    np.testing.assert_array_equal(data.r.sel(component="N"), solved.r[:, 0])
    np.testing.assert_array_equal(data.displacement_body, solved.displacement[0])
    assert data.attrs["outcome"] == "converged"
    branch = am.follow(hild_triangle(2), "friction", (0.1, 4))
    assert branch.to_xarray().y.shape == branch.states.shape


def test_what_is_no_table_is_refused():
    pytest.importorskip("xarray")
    with pytest.raises(InvalidInput, match="expected a solution or a branch"):
        am.all_solutions(one_contact_2d()).to_xarray()
    with pytest.raises(InvalidInput, match="expected a solved model"):
        am.solve(one_contact_2d()).view()


@pytest.mark.parametrize(
    ("package", "ask"),
    [("pandas", "to_dataframe"), ("xarray", "to_xarray"), ("pyvista", "view")],
)
def test_a_missing_package_is_named_with_what_installs_it(package, ask, solved, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    words = rf"{ask} needs {package}: .*amontons\[notebook"
    with pytest.raises(MissingDependency, match=words):
        getattr(solved, ask)()


def test_view_draws_the_deformed_bodies(solved):
    pytest.importorskip("pyvista")
    plotter = solved.view(show=False, off_screen=True, scalars="CPRESS", magnify=2.0)
    left, right, low, *_ = plotter.bounds
    assert right > 2.0 and low < 1e-9 and left < 0.05
    plotter.close()
    with pytest.raises(InvalidInput, match="scalars: expected one of .*CPRESS"):
        solved.view(show=False, off_screen=True, scalars="pressures")


def test_the_logger_tells_of_solves_where_somebody_listens(caplog):
    with caplog.at_level(logging.INFO, "amontons"):
        am.solve(block(name="told"))
    assert "told: 9 contacts" in caplog.text and "converged" in caplog.text
    caplog.clear()
    with caplog.at_level(logging.WARNING, "amontons"):
        am.solve(block(name="silent"))
    assert not caplog.records


def test_a_notebook_runs(tmp_path):
    """Cells as a user writes them, in a kernel: HTML comes back, and the progress is gone."""
    client = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    import nbformat

    book = nbformat.v4.new_notebook(cells=[
        nbformat.v4.new_code_cell("import amontons as am"),
        nbformat.v4.new_code_cell(
            "from amontons.mechanics.ready.gallery import one_contact_2d\n"
            "am.all_solutions(one_contact_2d())"
        ),
        nbformat.v4.new_code_cell("am.solve(one_contact_2d())"),
    ])  # fmt: skip
    client.NotebookClient(book, timeout=300, kernel_name="python3").execute()
    for cell, words in zip(book.cells[1:], ("3 solutions", "1 contacts in 2D"), strict=True):
        *shown, result = cell.outputs
        assert words in result.data["text/html"]
        assert [line.data["text/html"] for line in shown] == [""]


def test_tables_name_the_package_that_they_need():
    assert tables.needed("math", "this").pi > 3
