"""Typical mistakes are answered as docs/mistakes.md says: by the nearest right word."""

import re
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from mistakes import made, mistakes, page_entries

ALL = list(mistakes())
HELP = re.compile(
    "[Dd]id you mean|known: |write |expected|such as|needs|is not one of|mesh it with|ends in"
    "|does not exist|have a point|hold it with|Invalid value|in 3D"
)


def test_there_are_many_and_each_is_on_the_page_once():
    written = [entry[1] for entry in ALL]
    assert len(written) >= 100
    assert len(set(written)) == len(written)
    assert list(page_entries()) == written


@pytest.mark.parametrize(("group", "written", "answer"), ALL, ids=[a[1][:60] for a in ALL])
def test_answer(group, written, answer, tmp_path, monkeypatch):
    monkeypatch.chdir(made(tmp_path))
    said = answer()
    assert said == page_entries()[written]
    assert HELP.search(said), said
