"""Bolts, references, couplings, equations and springs of case files."""

import pytest

import amontons as am

BAR = """
[mesh]
box = [2, 2, 4]
cells = [2, 2, 4]
[material.default]
young = 1000.0
poisson = 0.3
[[fix]]
on = "bottom"
value = [0, 0, 0]
[[contact]]
slave = "left"
obstacle = { plane = { normal = [1, 0, 0], point = [-5, 0, 0] } }
friction = { coulomb = 0.2 }
"""
BOLT = """
[[fix]]
on = "top"
value = [0, "free", 0]
[[pretension]]
name = "bolt"
point = [0, 0, 2]
normal = [0, 0, 1]
force = 10.0
"""


def model_of(folder, text):
    path = folder / "case.toml"
    path.write_text(text)
    return am.read_case(path).model


def test_a_bolt_by_force_and_by_length(tmp_path):
    """The numbers of CalculiX for the same bricks."""
    found = am.solve(model_of(tmp_path, BAR + BOLT))
    assert found.references["bolt"].displacement == pytest.approx(9.616650e-3, rel=1e-6)
    length = am.solve(model_of(tmp_path, BAR + BOLT.replace("force = 10.0", "length = 0.01")))
    assert length.references["bolt"].force == pytest.approx(10.39863, rel=1e-6)


def test_a_bolt_that_is_locked(tmp_path):
    text = BOLT.replace("force = 10.0", 'force = "10*min(t, 1)"\nlocked = 1.0')
    text = text.replace('"free", 0]', '"free", "0.01*max(0, t - 1)"]')
    steps = list(am.evolve(model_of(tmp_path, BAR + text), am.QuasiStatic(step=1.0), until=2.0))
    assert steps[1].references["bolt"].force == pytest.approx(20.39863, rel=1e-6)


def test_references_couplings_equations_and_springs(tmp_path):
    text = BAR + """
[[reference]]
name = "lead"
point = [1, 1, 4]
force = [0, 0, -10]
rotation = [0, 0, 0]
[[coupling]]
on = "top"
reference = "lead"
[[equation]]
terms = [["lead", 0, 1.0], ["lead", 1, -1.0]]
[[spring]]
terms = [["lead", 2, 1.0]]
stiffness = 1e9
"""
    found = am.solve(model_of(tmp_path, text))
    assert found.references["lead"].displacement[2] == pytest.approx(-10 / 1e9, rel=1e-4)


@pytest.mark.parametrize(("change", "words"), [
    (('force = 10.0', ""), r"pretension\[0\]: expected either force"),
    (("point = [0, 0, 2]", "point = [0, 0, 2.3]"), r"pretension\[0\].point: .*cuts cells"),
    (("point = [0, 0, 2]", ""), "expected either sides"),
    (('name = "bolt"', 'name = "top"'), "pretension.*has this name"),
    (("force = 10.0", "force = 10.0\nfriction = 1"), "unknown key"),
])  # fmt: skip
def test_wrong_tables_are_told(tmp_path, change, words):
    with pytest.raises(am.FileFormatError, match=words):
        model_of(tmp_path, BAR + BOLT.replace(*change))
