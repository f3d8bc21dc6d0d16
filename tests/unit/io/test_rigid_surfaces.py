"""Rigid elements of decks, R3D3 and R3D4: tools that a node moves or presses."""

import numpy as np
import pytest

import amontons as am
from tests.unit.io.test_decks import case_of, solved

N = 3  # cells along a side of the block
AT = "999, 1, 2, 0.\n999, 4, 6, 0."
DOWN = f"*BOUNDARY\n{AT}\n999, 3, 3, -.01"
CORNERS = [(-0.5, -0.5), (0.7, -0.5), (1.5, -0.5), (-0.5, 1.5), (0.7, 1.5), (1.5, 1.5)]


def block(kind="R3D4", side="SPOS", step=DOWN, way=1, body="ELSET=TOOL", high=1.0):
    """A cube of 1 under a rigid plate of two elements; way: normals down with 1, up with -1."""
    grid = [(i, j, k) for k in range(N + 1) for j in range(N + 1) for i in range(N + 1)]
    number = {at: n for n, at in enumerate(grid, 1)}
    nodes = [f"{n}, {i / N}, {j / N}, {k / N}" for (i, j, k), n in number.items()]
    ring = ((0, 0), (1, 0), (1, 1), (0, 1))
    cells = [
        f"{c}, " + ", ".join(
            str(number[i + a, j + b, k + h]) for h in (0, 1) for a, b in ring)
        for c, (i, j, k) in enumerate(
            ((i, j, k) for k in range(N) for j in range(N) for i in range(N)), 1)
    ]  # fmt: skip
    nodes += [f"{901 + m}, {x}, {y}, {high}" for m, (x, y) in enumerate(CORNERS)]
    plates = [(901, 904, 905, 902), (902, 905, 906, 903)]  # their normals look down
    if kind == "R3D3":
        plates = [t for a, b, c, d in plates for t in ((a, b, c), (a, c, d))]
    rows = [f"{800 + m}, " + ", ".join(map(str, p[::way])) for m, p in enumerate(plates)]
    upper = "\n".join(f"{c}, S2" for c in range(1 + N * N * (N - 1), 1 + N**3))
    low = ", ".join(str(n) for (_, _, k), n in number.items() if k == 0)
    return "\n".join([
        "*NODE", *nodes, "999, 0.5, 0.5, 2.", "*ELEMENT, TYPE=C3D8, ELSET=E", *cells,
        f"*ELEMENT, TYPE={kind}, ELSET=TOOL", *rows, f"*NSET, NSET=LOW\n{low}",
        f"*SURFACE, NAME=TOP\n{upper}", f"*SURFACE, NAME=PLATE\nTOOL, {side}",
        "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET=E, MATERIAL=M",
        f"*RIGID BODY, {body}, REF NODE=999", "*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.2,",
        "*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE\nTOP, PLATE",
        f"*BOUNDARY\nLOW, 1, 3\n*STEP\n*STATIC\n{step}\n*END STEP\n",
    ])  # fmt: skip


def of_block(found):
    """Displacements of the nodes of the cube, in an order of their places."""
    x, u = found.model.bodies[0].mesh.points, found.displacement[0]
    inside = (x.min(axis=1) > -1e-9) & (x.max(axis=1) < 1 + 1e-9)
    inside &= np.isclose((x * N).round(), x * N, atol=1e-6).all(axis=1)
    rows = np.flatnonzero(inside)
    return u[rows[np.lexsort(x[rows].round(6).T)]]


@pytest.mark.parametrize(("kind", "side", "way"), [
    ("R3D4", "SPOS", 1), ("R3D4", "SNEG", -1), ("R3D3", "SPOS", 1), ("R3D3", "SNEG", -1),
])  # fmt: skip
def test_a_plate_that_is_moved_is_a_plane(tmp_path, kind, side, way):
    moved = solved(tmp_path, block(kind, side, way=way))
    mesh = am.box((1.0, 1.0, 1.0), cells=N)
    by_hand = am.solve(
        am.Model([am.Body(mesh, am.LinearElastic(1000.0, 0.3))], [am.Fix("bottom", 0)],
                 [am.Contact("top", am.Plane((0, 0, -1), (0, 0, 0.99)), mu=0.2,
                             method="mortar")]), tolerance=1e-10,
    )  # fmt: skip
    wanted = of_block(by_hand)
    np.testing.assert_allclose(of_block(moved), wanted, atol=1e-6 * np.abs(wanted).max())
    reaction = float(moved.references["node 999"].force[2])
    assert reaction == pytest.approx(float(by_hand.resultant[2]), rel=1e-6)
    assert reaction < -5.0
    press = f"*BOUNDARY\n{AT}\n*CLOAD\n999, 3, {reaction!r}"
    pressed = solved(tmp_path, block(kind, side, press, way))
    assert pressed.references["node 999"].displacement[2] == pytest.approx(-0.01, rel=1e-7)


def test_a_plate_is_a_stiff_body(tmp_path):
    """The same plate as a deformable one of 1e6 times the stiffness."""
    rigid = solved(tmp_path, block())
    upper = am.box((2.0, 2.0, 0.5), cells=(2, 2, 1), origin=(-0.5, -0.5, 1.0))
    stiff = am.solve(
        am.Model(
            [am.Body(am.box((1.0, 1.0, 1.0), cells=N), am.LinearElastic(1e3, 0.3), "low"),
             am.Body(upper, am.LinearElastic(1e9, 0.3), "plate")],
            [am.Fix("low.bottom", 0), am.Fix("plate.top", (0, 0, -0.01))],
            [am.Contact("low.top", master="plate.bottom", mu=0.2)],
        ), tolerance=1e-10,
    )  # fmt: skip
    wanted = of_block(stiff)
    np.testing.assert_allclose(of_block(rigid), wanted, atol=1e-4 * np.abs(wanted).max())


@pytest.mark.parametrize(("text", "words"), [
    (lambda: block(body="NSET=LOW"), r"are in no \*RIGID BODY, ELSET="),
    (lambda: block().replace("TOOL, SPOS", "TOOL, SPOS\nTOOL, SNEG"), "both sides"),
    (lambda: block().replace("800, 901, 904, 905, 902", "800, 902, 905, 904, 901"),
     "point in opposite directions"),
])  # fmt: skip
def test_what_is_wrong_is_said_with_its_line(tmp_path, text, words):
    with pytest.raises(am.FileFormatError, match=rf"deck.inp:\d+: .*{words}"):
        case_of(tmp_path, text())


def test_supports_are_named_after_their_set_and_line(tmp_path):
    text = block().replace("LOW, 1, 3\n", "LOW, 1, 3\n901, 1, 1\n1, 1, 1, 0.\n", 1)
    path = tmp_path / "deck.inp"
    names = [s.on for s in case_of(tmp_path, block()).model.supports]
    line = path.read_text().splitlines().index("*BOUNDARY") + 1
    assert "support LOW" in names
    again = text.replace("901, 1, 1\n", "2, 1, 1, 1e-3\n")
    split = [s.on for s in case_of(tmp_path, again).model.supports]
    assert {name for name in split if "line" in name} == {
        f"support of line {line}", f"support of line {line} part 2"}  # fmt: skip
    assert "support LOW" in solved(tmp_path, block()).supports
