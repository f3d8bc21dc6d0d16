"""Results of CalculiX: what is read, written, and refused."""

from __future__ import annotations

import os
import shutil
import subprocess
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


def test_displacements_along_local_axes_are_not_taken_for_global_ones(tmp_path):
    """CalculiX prints nodes of a *TRANSFORM so, with an L behind them, unless GLOBAL=YES."""
    path = tmp_path / "turned.dat"
    path.write_text(" displacements (vx,vy,vz) for set ALL and time  0.1000000E+01\n\n"
                    "         1  5.000000E-02  1.000000E-02  0.000000E+00 L\n")  # fmt: skip
    with pytest.raises(FileFormatError, match="line 3: node 1 is printed along.*GLOBAL=YES"):
        am.audit(SHARED / "block_good.inp", path)


def test_a_folder_without_a_solution_is_told_from_a_file(tmp_path):
    with pytest.raises(FileFormatError, match="a folder with solution.h5 in it"):
        am.audit(am.read_case("example:hild").model, tmp_path)


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


@pytest.mark.skipif(not (shutil.which("cgx") and shutil.which("xvfb-run")),
                    reason="cgx, or a display for it, is not installed")  # fmt: skip
def test_cgx_reads_our_results(tmp_path):
    body = am.Body(am.box((1, 1, 1), cells=(3, 2, 2)), am.LinearElastic(1000.0, 0.3))
    model = am.Model([body], [am.Fix("top", (0.0, 0.0, -0.01))],
                     [am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.3)])  # fmt: skip
    am.solve(model).write(tmp_path / "own.frd")
    (tmp_path / "see.fbd").write_text("read own.frd new\nds 1 e 3\nplot fv all\nquit\n")
    run = subprocess.run(["xvfb-run", "-a", "cgx", "-b", "see.fbd"], cwd=tmp_path,
                         capture_output=True, text=True, timeout=60, check=True)  # fmt: skip
    assert "Elements: 12 Nodes:36 Datasets:3" in run.stdout
    for name in ("own.frd opened", "DISP     D3", "min:-1.000000e-02 at node:"):
        assert name in run.stdout
