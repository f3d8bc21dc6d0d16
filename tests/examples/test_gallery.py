"""The gallery: every page has a title and words; examples, laws and papers are all there."""

import ast
import re
from pathlib import Path

import pytest

import amontons as am
from amontons.problem import law

GALLERY = Path(__file__).parents[2] / "docs" / "gallery"
PAGES = sorted(GALLERY.glob("*/plot_*.py"))
DATA = Path(am.__file__).parent / "examples_data"


def test_there_are_pages_and_nothing_else_is_run():
    assert len(PAGES) >= 30
    assert sorted(GALLERY.glob("**/*.py")) == PAGES
    for folder in {page.parent for page in PAGES}:
        assert (folder / "README.txt").exists()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_page_has_a_title_and_words(page):
    text = page.read_text()
    title, line, *words = ast.get_docstring(ast.parse(text)).splitlines()
    assert set(line) == {"="}
    assert len(line) >= len(title)
    assert len(" ".join(words)) > 120
    assert len(re.findall(r"^# %%$", text, re.MULTILINE)) >= 2 or "axis" in text
    assert "print(" in text or "plot" in text


@pytest.mark.parametrize("name", sorted(path.stem for path in DATA.glob("*.toml")))
def test_each_example_has_a_page(name):
    assert (GALLERY / "start" / f"plot_{name}.py").exists()


def test_each_law_has_a_page():
    words = "\n".join(page.read_text() for page in (GALLERY / "laws").glob("*.py")).lower()
    names = [name for name in dir(law) if isinstance(getattr(law, name), type)]
    for name in {"CappedCoulomb", "Cohesive", "Compliant", "Coulomb", "Orthotropic", "Tresca"}:
        assert name in names
        assert re.sub("coulomb$", "", name.lower()) in words, name


@pytest.mark.parametrize(
    "verb",
    ["uniqueness", "all_solutions", "multistart", "basins", "follow", "diagram", "first_order",
     "existence", "critical_friction", "p_matrix_friction", "full_contact_friction"],
)  # fmt: skip
def test_each_question_is_asked(verb):
    assert any(f"am.{verb}(" in page.read_text() for page in PAGES)


@pytest.mark.parametrize("paper", ["acary", "hueeber", "ligursky", "rey"])
def test_each_paper_has_pages(paper):
    assert len(list((GALLERY / "papers").glob(f"plot_{paper}_*.py"))) >= 3
