"""Case files: what they mean, and what may be overridden."""

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import FileFormatError, InvalidInput
from amontons.io.case import Settings, make_solver, method_class, read_case
from amontons.io.case.overrides import split_override
from amontons.solvers import METHODS, GaussSeidel, JeanMoreau, SemismoothNewton

CASE = """
title = "press"
[mesh]
box = [1, 1, 1]
cells = [2, 3, 2]
[material.default]
young = 200
poisson = 0.3
[[fix]]
on = "top"
value = ["0", 0.2, "0.06 - 0.15*x"]
[[contact]]
slave = "bottom"
obstacle = { plane = { point = [0, 0, 0], normal = [0, 0, 1] } }
friction = { coulomb = 1.0 }
"""
PLANE = "plane = { point = [0, 0, 0], normal = [0, 0, 1] }"


@pytest.fixture
def write(tmp_path):
    def write_case(old="", new=""):
        path = tmp_path / "case.toml"
        path.write_text(CASE.replace(old, new) if old else CASE)
        return path

    return write_case


def test_same_model_as_in_python(write):
    case = read_case(write())
    block = am.Body(am.box((1, 1, 1), cells=(2, 3, 2)), am.LinearElastic(200, 0.3))
    model = am.Model(
        [block],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )
    ours, theirs = case.model.assemble(), model.assemble()
    np.testing.assert_allclose(ours.f, theirs.f, atol=1e-12)
    np.testing.assert_allclose(ours.w, theirs.w, atol=1e-12)
    assert case.title == ours.name == "press"
    assert case.settings == Settings()


def test_a_mark_of_the_byte_order_is_no_part_of_a_case(write):
    """Editors of Windows put one first."""
    path = write()
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert read_case(path).title == "press"


def test_title_defaults_to_the_name(write):
    path = write('title = "press"', "")
    assert read_case(path).title == path.parent.name
    other = path.rename(path.with_name("press2.toml"))
    assert read_case(other).title == "press2"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (PLANE, "sphere = { center = [0.5, 0.5, -3], radius = 3 }"),
        (PLANE, 'level_set = "z + 0.1*x**2"'),
        (PLANE, "plane = { normal = [0, 0, 2] }"),
        ("coulomb = 1.0", 'coulomb = "0.2 + 0.1*x"'),
        ("coulomb = 1.0", "tresca = 3"),
        ("coulomb = 1.0", 'tresca = "800*x*y*(1-x)*(1-y)"'),
        ("[[contact]]", '[[traction]]\non = "left"\nvalue = ["y", 0, 0]\n[[contact]]'),
        ("[[contact]]", "[[body_force]]\nvalue = [0, 0, -9.81]\n[[contact]]"),
        ('["0", 0.2,', '["free", 0.2,'),
        ("cells = [2, 3, 2]", 'cells = 2\nkind = "tet"'),
        ("young = 200", 'law = "linear-elastic"\ndensity = 7.8\nyoung = 200'),
        ('slave = "bottom"', 'slave = "bottom"\nmethod = "nodal"'),
        ('slave = "bottom"', 'slave = "bottom"\nmethod = "mortar"'),
        ('slave = "bottom"', 'slave = "bottom"\nmethod = "dual-mortar"'),
    ],
)
def test_variants_assemble(write, old, new):
    assert read_case(write(old, new)).model.assemble().contacts > 0


def test_solver_table(write):
    text = '[solver]\nmethod = "gauss-seidel"\ntolerance = 1e-6\nbatch = 5\nmax_sweeps = 40\n'
    settings = read_case(write("[[contact]]", f"{text}[[contact]]")).settings
    assert settings == Settings("gauss-seidel", 1e-6, 40, None, {"batch": 5})
    assert settings.solver() == GaussSeidel(batch=5)


def test_contact_tolerance(write):
    text = "[solver]\ncontact_tolerance = 1e-5\n"
    settings = read_case(write("[[contact]]", f"{text}[[contact]]")).settings
    assert settings.contact_tolerance == 1e-5
    for wrong in ("0", "-1", '"small"'):
        text = f"[solver]\ncontact_tolerance = {wrong}\n"
        with pytest.raises(FileFormatError, match=r"solver\.contact_tolerance"):
            read_case(write("[[contact]]", f"{text}[[contact]]"))


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [("coulomb = 1.0", 'coulomb = "0.2*t"', "contact[0].friction.coulomb"),
     (PLANE, 'level_set = "z - t"', "contact[0].obstacle.level_set")],
)  # fmt: skip
def test_friction_and_obstacles_do_not_depend_on_time(write, old, new, key):
    with pytest.raises(
        FileFormatError, match="only loads and supports depend on the time"
    ) as e:
        read_case(write(old, new))
    assert key in str(e.value)


@pytest.mark.parametrize("friction", ["friction = 0.3", ""])
def test_how_friction_is_written(write, friction):
    with pytest.raises(FileFormatError, match=r"friction: .*\{ coulomb = COEFFICIENT \}"):
        read_case(write("friction = { coulomb = 1.0 }", friction))


def test_built_in_cases_are_read_by_name():
    case = read_case("example:release", ["evolution.step=0.1"])
    assert case.evolution.method.step == 0.1
    assert case.model.bodies[0].mesh.dim == 2
    with pytest.raises(InvalidInput, match="example:relase: no such .* did you mean 'release'"):
        read_case("example:relase")


def test_overrides_name_keys_as_messages_do(write):
    ours = read_case(write(), ["contact[0].friction.coulomb=0.5", "fix[0].value[1]=0.3"])
    theirs = read_case(write(), ["contact.0.friction.coulomb=0.5", "fix.0.value.1=0.3"])
    assert ours.model.contacts[0].mu == theirs.model.contacts[0].mu == 0.5
    np.testing.assert_array_equal(ours.model.assemble().f, theirs.model.assemble().f)


def test_overrides(write):
    overrides = ["mesh.cells=1", "contact.friction.coulomb=0.5", "fix.0.value.1=x",
                 "solver.tolerance=1e-5", "title=other"]  # fmt: skip
    case = read_case(write(), overrides)
    problem = case.model.assemble()
    assert problem.contacts == 4
    assert (problem.mu == 0.5).all()
    assert case.settings.tolerance == 1e-5
    assert case.title == "other"


def test_override_of_an_unknown_key_is_refused(write):
    with pytest.raises(FileFormatError, match="mesh.cels.*cells"):
        read_case(write(), ["mesh.cels=3"])


@pytest.mark.parametrize(
    ("text", "path", "value"),
    [
        ("a=1", ["a"], 1),
        ("a.b = 1.5", ["a", "b"], 1.5),
        ("a=[1, 2]", ["a"], [1, 2]),
        ("a=true", ["a"], True),
        ("a=top", ["a"], "top"),
        ('a="top"', ["a"], "top"),
        ("a=x == 1", ["a"], "x == 1"),
        ("a=1\nb=2", ["a"], "1\nb=2"),
        ("a=", ["a"], ""),
    ],
)
def test_override_syntax(text, path, value):
    assert split_override(text) == (path, value)


@pytest.mark.parametrize("text", ["a", "=1", "a..b=1", ".=1"])
def test_override_refused(text):
    with pytest.raises(InvalidInput, match="key=value"):
        split_override(text)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_has_a_default(method):
    assert isinstance(make_solver(method, {}), method_class(method))


def test_options_are_converted():
    assert make_solver("gauss-seidel", {"batch": "3"}) == GaussSeidel(batch=3)
    newton = make_solver(
        "semismooth-newton", {"rho": 2, "linear": "none", "function": "jean-moreau"}
    )
    assert newton == SemismoothNewton(rho=2.0, linear=None, function=JeanMoreau())


@pytest.mark.parametrize(
    ("method", "options", "words"),
    [
        ("gauss", {}, "gauss-seidel"),
        ("gauss-seidel", {"bach": 1}, "mean 'batch'"),
        ("gauss-seidel", {"batch": 1.5}, "whole number"),
        ("gauss-seidel", {"batch": True}, "whole number"),
        ("gauss-seidel", {"batch": 0}, "solver.batch"),
        ("semismooth-newton", {"rho": "nan"}, "a number"),
        ("semismooth-newton", {"function": "newton"}, "unknown value"),
        ("semismooth-newton", {"function": 3}, "Python"),
    ],
)
def test_options_refused(method, options, words):
    with pytest.raises(InvalidInput, match=words):
        make_solver(method, options)


def test_missing_files(tmp_path):
    with pytest.raises(FileFormatError, match="no such file"):
        read_case(tmp_path / "gone.toml")
    with pytest.raises(FileFormatError, match="folder"):
        read_case(tmp_path)
    (tmp_path / "latin.toml").write_bytes(b'title = "\xa8"')
    with pytest.raises(FileFormatError, match="UTF-8"):
        read_case(tmp_path / "latin.toml")
