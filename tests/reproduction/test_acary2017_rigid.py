"""The wall of rigid blocks beside the elastic one: what is measured, and the page of it."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))  # the reproductions are not installed

from reproduce.acary2017 import rigid  # noqa: E402


def test_order_of_convergence_is_that_of_the_errors():
    assert rigid.order([1.0, 1e-3, 1e-6, 1e-12]) == pytest.approx(2)
    assert rigid.order([1e-3, 1e-4, 1e-5, 1e-17]) == pytest.approx(1)
    assert np.isnan(rigid.order([1.0, 0.5, 0.7]))
    assert np.isnan(rigid.order([1e-3, 1e-20]))


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    out = tmp_path_factory.mktemp("rigid")
    rigid.measure(out, {}, rigid.QUICK, lambda text: None)
    return out, json.loads((out / "rigid.json").read_text())


def test_rigid_blocks_are_hyperstatic_and_newton_alone_fails_on_them(record):
    """Pressed ones it may meet by chance: on singular matrices rounding leads its steps."""
    rows = record[1]["rows"]
    assert list(rows) == [f"{kind.name}, {word}" for kind in rigid.QUICK
                          for word in rigid.WORDS.values()]  # fmt: skip
    for name, row in rows.items():
        methods = {who: run["outcome"] for who, run in row["methods"].items()}
        if name.startswith("elastic"):
            assert row["rank"] == row["rows"] == 3 * row["contacts"]
            assert set(methods.values()) == {"converged"}
        else:
            assert row["rank"] == 75 < row["unknowns"] == 84  # 9 of them are driven
            assert "sheared" not in name or methods["NSN-AC"] != "converged"
            assert methods["NSGS-AC"] == methods["Auto"] == "converged"
        assert row["existence"] == "assured"


def test_newton_ends_quadratically_on_elastic_blocks(record):
    found = record[1]["errors"]["elastic, coarse"]["NSN-AC"]
    assert rigid.order(found) > 1.7
    assert found[-1] < 1e-12


def test_the_section_has_both_tables_and_the_figure(record):
    out, stored = record
    text = rigid.section(stored, out)
    assert "| rigid, coarse, sheared | 100 | 84 | 300 | 75 | 225 | assured, margin" in text
    assert "NSN-AC 2, NSN-AC-HYBRID 2, NSGS-AC 2, Auto 2" in text  # of elastic blocks
    assert "(order 2" in text
    assert (out / rigid.FIGURE).read_bytes().startswith(b"\x89PNG")


def test_walls_that_are_not_asked_for_stay(record):
    out, stored = record
    rigid.measure(out, {"cpu": "other"}, (), lambda text: None)
    assert json.loads((out / "rigid.json").read_text())["rows"] == stored["rows"]
