"""Matrices that CalculiX stores, as bodies here."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.core.errors import FileFormatError, InvalidInput
from amontons.io.decks.written import write_deck
from amontons.mechanics.elements import stiffness
from amontons.mechanics.elements.mass import mass
from amontons.mechanics.meshes import second_order

STEEL = am.LinearElastic(210e3, 0.3, density=7.8e-9)


def block(kind: str | None = None) -> am.Mesh:
    return am.box((2, 1, 1), cells=(3, 2, 2), kind=kind)


def pressed(body: am.Body) -> am.Model:
    return am.Model([body], [am.Fix("top", (2e-3, 0.0, -1e-2))],
                    [am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.3)])  # fmt: skip


def store(folder, K, M=None, labels=None, seed=0):
    """Files as CalculiX writes them, rows in any order; their path."""
    n = K.shape[0] // 3
    labels = np.arange(1, n + 1) if labels is None else labels
    order = np.random.default_rng(seed).permutation(3 * n)
    rows = (f"{labels[k // 3]}.{k % 3 + 1}\n" for k in order)
    (folder / "m.dof").write_text("".join(rows))
    for name, matrix in (("m.sti", K), ("m.mas", M)):
        if matrix is not None:
            write(folder / name, sparse.triu(sparse.csr_array(matrix)[order][:, order]))
    return folder / "m.sti"


def write(path, matrix):
    whole = sparse.coo_array(matrix)
    rows = zip(whole.row + 1, whole.col + 1, whole.data, strict=True)
    path.write_text("".join(f"{i} {j} {v:20.13e}\n" for i, j, v in rows))


def test_a_body_of_stored_matrices_is_ours(tmp_path):
    mesh = block()
    K, M = stiffness(mesh, STEEL), mass(mesh, STEEL)
    labels = 7 + 3 * np.random.default_rng(1).permutation(len(mesh.points))
    body = am.read_matrices(store(tmp_path, K, M, labels)).body(mesh, labels)
    given = body.material
    np.testing.assert_allclose(given.K.toarray(), K.toarray(), atol=1e-9 * abs(K).max())
    np.testing.assert_allclose(given.mass.toarray(), M.toarray(), atol=1e-9 * abs(M).max())
    ours, theirs = am.solve(pressed(am.Body(mesh, STEEL))), am.solve(pressed(body))
    np.testing.assert_allclose(theirs.displacement[0], ours.displacement[0], atol=1e-9)


def test_the_mass_may_be_missing_and_the_matrix_whole(tmp_path):
    K = stiffness(block(), STEEL)
    path = store(tmp_path, K)
    found = am.read_matrices(tmp_path / "m.dof")
    assert found.mass is None
    (tmp_path / "m.mas").write_text("1 1 0.0\n")
    assert am.read_matrices(path).mass is None  # a deck without *DENSITY
    write(path, found.K)
    again = am.read_matrices(path).K
    np.testing.assert_allclose(again.toarray(), found.K.toarray(), atol=1e-9 * abs(K).max())


@pytest.mark.parametrize(
    ("name", "line", "text", "says"),
    [
        ("m.dof", 1, "12", "m.dof: line 2: expected node.direction"),
        ("m.dof", 0, "3.4", "line 1: expected node.direction with a direction from 1 to 3"),
        ("m.sti", 4, "1 2", "m.sti: line 5: expected row, column and a finite value"),
        ("m.sti", 4, "1 2 nan", "line 5: expected row, column and a finite value"),
        ("m.sti", 4, "1 2000 3.0", "line 5: expected rows and columns from 1 to 108"),
        ("m.sti", None, "", "expected rows and columns"),
    ],
)
def test_files_that_are_broken_are_told_with_their_line(name, line, text, says, tmp_path):
    path = store(tmp_path, stiffness(block(), STEEL))
    lines = [] if line is None else (tmp_path / name).read_text().splitlines()
    if line is not None:
        lines[line] = text
    (tmp_path / name).write_text("\n".join(lines))
    with pytest.raises(FileFormatError, match=says):
        am.read_matrices(path)


def test_files_of_another_mesh_are_told(tmp_path):
    mesh = block()
    path = store(tmp_path, stiffness(mesh, STEEL))
    stored = am.read_matrices(path)
    other = am.box((2, 1, 1), cells=(3, 2, 1))
    with pytest.raises(InvalidInput, match=r"108 rows for 72 .* node 25"):
        stored.body(other)
    with pytest.raises(InvalidInput, match="no row for 3 of 108 components, such as node 99"):
        stored.body(mesh, np.where(np.arange(36) == 5, 99, np.arange(1, 37)))
    with pytest.raises(InvalidInput, match="labels: expected 36 numbers"):
        stored.body(mesh, np.arange(3))
    (tmp_path / "m.dof").unlink()
    with pytest.raises(FileFormatError, match="MATRIXSTORAGE"):
        am.read_matrices(path)


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
@pytest.mark.parametrize("kind", ["hex", "tet"])
@pytest.mark.parametrize("order", [1, 2])
def test_matrices_of_calculix_are_those_of_our_elements(kind, order, tmp_path):
    mesh = block(kind)
    if order == 2:
        mesh = second_order(mesh, serendipity=True)
    light = am.LinearElastic(210e3, 0.3)
    write_deck(pressed(am.Body(mesh, light)), tmp_path / "m.inp")
    text = (tmp_path / "m.inp").read_text()
    text = re.sub(r"(\*ELASTIC\n.*\n)", r"\1*DENSITY\n7.8e-9\n", text)  # of the plane too
    step = "*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n1\n*END STEP\n"
    (tmp_path / "m.inp").write_text(text[: text.index("*STEP")] + step)
    run = subprocess.run(["ccx", "m"], cwd=tmp_path, capture_output=True, timeout=100)
    assert (tmp_path / "m.sti").is_file(), run.stdout[-1000:]
    body = am.read_matrices(tmp_path / "m.inp").body()
    K = stiffness(mesh, STEEL)
    size = len(mesh.points)  # the plane is a block of its own in a deck
    found = body.material.K[: 3 * size][:, : 3 * size]
    np.testing.assert_allclose(found.toarray(), K.toarray(), atol=1e-9 * abs(K).max())
