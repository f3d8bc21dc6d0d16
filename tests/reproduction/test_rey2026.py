"""`python -m reproduce.rey2026`: printed cells of every algorithm, solutions and thresholds."""

import json
import re
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))  # the reproductions are not installed

from reproduce.rey2026 import (  # noqa: E402
    alart_curnier,
    extra,
    extruded,
    primal_dual,
    report,
    solutions,
    uzawa,
    verdict,
)
from reproduce.rey2026.__main__ import ALGORITHMS, PAPER, PARTS, main  # noqa: E402
from reproduce.rey2026.triangle import Triangle, triangle_of  # noqa: E402


def some(table, rows):
    """A table with some of its rows."""
    keep = {name: [table[name][k] for k in rows] for name in ("values", "cells")}
    return {**table, **keep}


def agreement(module, table):
    ours = [[asdict(cell) for cell in row] for row in module.cells(table)]
    return report.agreement(ours, table)


def test_every_cell_of_the_paper_is_there():
    sizes = [np.size(table["cells"]) for table in PAPER.values() if "cells" in table]
    assert sum(sizes) == 852
    for name, table in PAPER.items():
        assert name in PARTS
        assert name == "mu_crit" or table["algorithm"] in ALGORITHMS


def test_the_command_prints_all_cells_of_alart_curnier(tmp_path):
    done = CliRunner().invoke(main, ["alart", "alart_35", "--results", str(tmp_path)])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "results.md").read_text()
    assert page.count("72 of 72 cells agree.") == 2
    assert "| all | 144 | 144 |" in page
    record = json.loads((tmp_path / "results.json").read_text())
    record["alart"][0][0]["kind"] = "slip"
    assert report.agreement(record["alart"], PAPER["alart"]) == (71, 72)
    assert "**slip** (free)" in "\n".join(
        report.map_table("alart", record["alart"], PAPER["alart"])
    )


@pytest.mark.parametrize("eta", [1e-3, 1.0, 1e3])
def test_on_one_element_the_law_at_points_is_that_of_the_node(eta):
    triangle = Triangle(1, 3.5)
    for start in PAPER["alart_35"]["columns"][:6]:
        row = np.array([start[::-1]])
        one = alart_curnier.run(triangle, eta, row)
        two = alart_curnier.run_at_points(triangle, eta, row)
        assert one.kind == two.kind


def test_bad_parts_are_refused(tmp_path):
    done = CliRunner().invoke(main, ["table9", "--results", str(tmp_path)])
    assert done.exit_code == 2
    assert "table9" in done.output


@pytest.mark.parametrize(
    ("module", "name", "rows", "least"),
    [(uzawa, "uzawa_u", (0, 4), 18), (uzawa, "uzawa_u_35", (1, 6), 17),
     (uzawa, "uzawa_lam_35", (2, 5), 14), (primal_dual, "pd_u_35", (1, 7), 18),
     (primal_dual, "pd_r_35", (0, 6), 16), (primal_dual, "pd_r", (0,), 8)],
)  # fmt: skip
def test_rows_of_the_other_algorithms(module, name, rows, least):
    same, every = agreement(module, some(PAPER[name], rows))
    assert least <= same <= every == len(rows) * len(PAPER[name]["columns"])


def test_random_starts_are_counted(tmp_path):
    done = CliRunner().invoke(
        main, ["alart_multidof", "--draws", "2", "--results", str(tmp_path)]
    )
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "results.json").read_text())["alart_multidof"]
    assert found["draws"] == 2
    assert np.sum(list(found["counts"].values()), axis=0).tolist() == [2] * 6


def test_no_run_out_of_balance_is_a_solution():
    """Draw 80 at eta = 100 ends at r = 0 with a body on its way: slip it is not, at mu = 3."""
    triangle = triangle_of(50, 3.0)
    random = np.random.default_rng(2026)
    for _ in range(81):
        r = random.uniform([0, -0.5], 0.5, (50, 2))
        v = random.uniform(-0.5, 0.5, triangle.problem.unknowns)
    method = uzawa.method(triangle, 100.0)
    start = am.Iterate(r, v)
    cell = triangle.study([method], [start], within=1e-4, max_iterations=20_000)[0][0]
    assert cell.kind in ("free", "fail")


def test_the_page_opens_with_counts_of_verdicts():
    page = (ROOT / "reproduce" / "rey2026" / "results" / "results.md").read_text()
    first = page.splitlines()[2]
    assert re.fullmatch(
        r"\*\*agrees \d+ / differs by the paper's fault \d+ / differs by ours \d+\*\*", first
    )
    record = json.loads(
        (ROOT / "reproduce" / "rey2026" / "results" / "results.json").read_text()
    )
    cells = verdict.of_cells(record, PAPER, report.agrees)
    assert len(cells) == 852
    assert f"- 852 cells: {verdict.in_words(cells)}" in page


def test_the_example_of_section_5_2():
    found = extra.example()
    assert found["free"] == pytest.approx(-3 / np.hypot(3, 6.6), abs=1e-5)
    assert found["held"] == pytest.approx(6.6 / np.hypot(3, 6.6))
    assert found["mu"] == pytest.approx(2.2)


def test_three_solutions_above_mu_3_and_the_printed_thresholds(tmp_path):
    found = solutions.enumeration((3,))["3"]
    assert found["complete"]
    assert found["runs"] == [[0.0, 2.9, 1], [3.0, 3.0, 2], [3.1, 5.0, 3]]
    for n_c, one in solutions.critical((1, 3, 5)).items():
        k = PAPER["mu_crit"]["n_c"].index(int(n_c))
        assert np.ceil(100 * one["mu_P"] - 1e-6) / 100 == pytest.approx(
            PAPER["mu_crit"]["mu_P"][k]
        )
        assert round(one["mu_c"], 2) == PAPER["mu_crit"]["mu_c"][k]
        assert one["lower"] <= one["upper"] <= one["mu_c"] + 1e-9
    drawn = solutions.slip_figure(tmp_path / "figure.png", n_c=7)
    assert sorted(one["counts"]["slip"] for one in drawn["solutions"]) == [0, 0, 7]
    assert (tmp_path / "figure.png").stat().st_size > 10_000


def test_the_criteria_of_the_extruded_triangle():
    (first,) = extruded.criteria((1,))
    one = first["1"]
    for name in ("mu_P", "critical", "mu_c sharp", "mu_P given"):
        assert one[name][0] < 2.2 and one[name][1] == pytest.approx(2.2)  # as in 2D
    assert one["energy"] < one["mu_P"][0]
    assert one["mu_c"][1] < one["mu_c sharp"][1]
    for contacts in (1, 2, 3):
        assert extruded.extruded(contacts).assemble().contacts == contacts
    page = (ROOT / "reproduce" / "rey2026" / "results" / "results.md").read_text()
    assert "\n".join(report.criteria(json.loads(
        (ROOT / "reproduce" / "rey2026" / "results" / "results.json").read_text()
    )["criteria3d"])) in page  # fmt: skip


def test_mass_and_lengths_integrate_shape_functions():
    triangle = Triangle(7, 3.0)
    order = np.argsort(triangle.places)
    x = np.append(triangle.places[order], 1.0)
    s, weights = np.polynomial.legendre.leggauss(400)
    s, weights = (s + 1) / 2, weights / 2
    shapes = np.array([np.interp(s, x, row) for row in np.eye(8)[:7]])
    assert shapes @ weights == pytest.approx(triangle.lengths[order], abs=1e-4)
    mass = (shapes * weights) @ shapes.T
    assert mass == pytest.approx(triangle.mass[np.ix_(order, order)], abs=1e-4)
