"""Nitsche's tables of rey2026: a part of the cells, and errors that fall like 1 / kappa."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))

from reproduce.rey2026 import nitsche  # noqa: E402
from reproduce.rey2026.__main__ import PAPER  # noqa: E402
from reproduce.rey2026.triangle import Triangle  # noqa: E402


def rows(table, *numbers):
    """The table with some of its rows."""
    return table | {key: [table[key][k] for k in numbers] for key in ("values", "cells")}


def test_cells_at_friction_three():
    table = rows(PAPER["nitsche"], 0, 2, 5, 10)
    found = nitsche.cells(table)
    assert [[cell.kind for cell in row] for row in found] == table["cells"]


def test_slip_is_as_far_from_the_exact_one_as_printed():
    """The printed error is the square of the energy norm, 0.36 / kappa^2."""
    table = rows(PAPER["nitsche_35"], 3, 4, 5, 6, 7)
    last = [row[-1] for row in nitsche.cells(table | {"columns": table["columns"][-1:]})]
    printed = [row[-1]["slip_error"] for row in table["cells"]]
    assert [cell.kind for cell in last] == ["slip"] * 5
    assert [cell.error**2 for cell in last] == pytest.approx(printed, rel=0.1)
    rate = np.polyfit(np.log(table["values"]), np.log([cell.error for cell in last]), 1)[0]
    assert rate == pytest.approx(-1, abs=0.01)


@pytest.mark.parametrize("kappa", [2.0, 100.0])
def test_free_and_stick_stay_at_any_kappa(kappa):
    triangle = Triangle(3, 3.5)
    model = nitsche.by_nitsche(triangle, kappa)
    for name in ("free", "stick"):
        cell = nitsche.run(triangle, model, triangle.exact[name])
        assert (cell.kind, cell.iterations) == (name, 0)
