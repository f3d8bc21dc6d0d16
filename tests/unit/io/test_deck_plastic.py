"""*PLASTIC of decks: a beam that is bent and bent back, against CalculiX 2.20."""

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import FileFormatError
from amontons.io.decks.written import write_deck
from amontons.mechanics.meshes import second_order

# total force on END after every increment, `*NODE PRINT, TOTALS=ONLY`, seven digits
FORCE = {
    "C3D20": (-6.427519, -8.297244, -8.839073, -9.307311, -1.166434, 5.743961, 8.319818,
              9.208093),
    "C3D10": (-6.932493, -8.979578, -9.730629, -10.31167, -1.982887, 5.934859, 8.634916,
              9.837266),
    "C3D8": (-9.611775, -12.90718, -14.69124, -16.12479, -4.328695, 5.912237, 10.25479,
             12.71014),
}  # fmt: skip
PLASTIC = "*PLASTIC\n100., 0.\n140., 0.02\n160., 0.1"


def deck(kind, plastic=PLASTIC):
    """A cantilever of 4 x 1 x 1, its end pushed down by 0.1 and up to 0.02."""
    mesh = am.box((4, 1, 1), (4, 1, 1 if kind == "C3D10" else 2),
                  "tet" if kind == "C3D10" else "hex")  # fmt: skip
    mesh = mesh if kind == "C3D8" else second_order(mesh, serendipity=True)
    x = mesh.points
    lines = ["*NODE", *(f"{k + 1}, {', '.join(map(str, p))}" for k, p in enumerate(x.tolist()))]
    lines.append(f"*ELEMENT, TYPE={kind}, ELSET=A")
    for k, row in enumerate(mesh.cells[0].nodes):
        words = [str(k + 1), *(str(n + 1) for n in row)]
        lines += [", ".join(words[:11]) + "," * (len(words) > 11), ", ".join(words[11:])]
    for name, at in (("FIX", x[:, 0] == 0), ("END", x[:, 0] == 4)):
        lines += [f"*NSET, NSET={name}", *(str(n + 1) for n in np.flatnonzero(at))]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", "70000., 0.3", plastic,
              "*SOLID SECTION, ELSET=A, MATERIAL=M", "*BOUNDARY", "FIX, 1, 3"]  # fmt: skip
    for push in (-0.1, 0.02):
        lines += ["*STEP, INC=200", "*STATIC, DIRECT", "0.25, 1.", "*BOUNDARY",
                  f"END, 3, 3, {push}", "*END STEP"]  # fmt: skip
    return "\n".join(line for line in lines if line) + "\n"


@pytest.mark.parametrize("kind", FORCE)
def test_a_beam_bent_to_and_fro(tmp_path, kind):
    path = tmp_path / "beam.inp"
    path.write_text(deck(kind))
    case = am.read_case(path)
    steps = am.evolve(case.model, case.evolution.method, until=2.0)
    end = case.model.bodies[0].mesh.points[:, 0] == 4
    found = [step.fields.reaction[0][end, 2].sum() for step in steps]
    np.testing.assert_allclose(found, FORCE[kind], rtol=5e-7)


@pytest.mark.parametrize(("plastic", "message"), [
    ("*PLASTIC, HARDENING=KINEMATIC\n100., 0.", "HARDENING=KINEMATIC: is not read"),
    ("*PLASTIC\n100.", r"beam.inp:\d+: \*PLASTIC: expected a stress and a strain, got 1"),
    ("*PLASTIC\n100., 0., 20.\n90., 0., 300.", "several temperatures are not read"),
    ("*PLASTIC\n100., 0.\n90., 0.1", "row 2: expected stresses that do not fall"),
    ("*PLASTIC", "expected a line of data"),
    ("*EXPANSION, TYPE=ORTHO\n1e-5, 1e-5, 2e-5\n" + PLASTIC, "expected isotropic"),
])  # fmt: skip
def test_what_is_not_read_is_named(tmp_path, plastic, message):
    path = tmp_path / "beam.inp"
    path.write_text(deck("C3D8", plastic))
    with pytest.raises(FileFormatError, match=message):
        am.read_case(path)


def test_a_law_that_yields_is_written_and_read_again(tmp_path):
    law = am.ElastoPlastic(70e3, 0.3, yield_stress=[(100, 0), (140, 0.02)], hardening=50.0)
    model = am.Model([am.Body(am.box((1, 1, 1), 1), law)], [am.Fix("top", (0, 0, -0.01))],
                     [am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.1)])  # fmt: skip
    write_deck(model, tmp_path / "block.inp")
    found = am.read_case(tmp_path / "block.inp").model.bodies[0].material
    (read,) = {each for each in found.values() if isinstance(each, am.ElastoPlastic)}
    assert read.yield_stress == ((100, 0), (140, 0.02), (140 + 50 * 9.98, 10.0))
    p = np.linspace(0, 1, 11)
    np.testing.assert_allclose(read.yields_at(p), law.yields_at(p), rtol=1e-12)
