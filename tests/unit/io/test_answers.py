"""Results of CalculiX: what is read, written, and refused."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import FileFormatError
from amontons.io.answers.frd import read_frd

SHARED = Path(os.environ.get("AMONTONS_SHARED", "../shared")) / "data" / "audit"
needs_anchors = pytest.mark.skipif(not SHARED.is_dir(), reason="no reference files")
VERDICTS = {"crown_good": ("right", None), "block_good": ("right", None),
            "crown_soft_penalty": ("wrong", "penetration"),
            "fit_nonmatching": ("wrong", "geometry")}  # fmt: skip


@needs_anchors
@pytest.mark.parametrize("name", VERDICTS)
def test_anchors_get_their_verdict(name):
    found = am.audit(SHARED / f"{name}.inp", SHARED / f"{name}.frd")
    verdict, question = VERDICTS[name]
    assert found.verdict == verdict, str(found)
    wrong = [k for k, f in found.findings.items() if f.verdict.value == "wrong"]
    assert wrong == ([question] if question else [])


@needs_anchors
def test_broken_results_are_refused_with_their_place(tmp_path):
    text = (SHARED / "block_good.frd").read_text()
    deck = SHARED / "block_good.inp"
    place = text.index("DISP")
    lines = {
        "NaN": text[:place] + text[place:].replace(" 0.00000E+00", "         NaN", 1),
        "no displacements": text.replace("DISP", "FORC"),
        "another deck": (SHARED / "crown_good.frd").read_text(),
        "ends within a table": text[: len(text) // 2],
        "holds no nodes": "    1C\n",
        "expected results of CalculiX": "hello\n",
    }
    for words, broken in lines.items():
        path = tmp_path / "broken.frd"
        path.write_text(broken)
        with pytest.raises(FileFormatError, match=words):
            am.audit(deck, path)


def test_what_we_write_we_read(tmp_path):
    block = am.Body(am.box((1, 1, 1), cells=2), am.LinearElastic(100.0, 0.3))
    contact = am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=0.3)
    solution = am.solve(am.Model([block], [am.Fix("top", (0.01, 0, -0.02))], [contact]))
    path = tmp_path / "a.frd"
    solution.write(path)
    found = read_frd(path)
    assert found.points == pytest.approx(block.mesh.points)
    moved = found.named("DISP")[0].values
    assert moved == pytest.approx(solution.displacement[0], rel=1e-5, abs=1e-12)
    assert {b.name for b in found.blocks} == {"DISP", "STRESS", "CONTACT"}
    assert np.array_equal(found.elements[1][:4], [1, 2, 5, 4]) or len(found.elements) == 8
