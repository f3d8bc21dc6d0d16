"""Arbitrary expressions, case files and overrides: AmontonsError or a sound result."""

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from amontons.core.errors import AmontonsError
from amontons.core.expressions import FUNCTIONS, Expression
from amontons.io.case import read_case
from amontons.io.case.overrides import apply_overrides

FUZZ = settings(
    max_examples=300, deadline=None, derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)  # fmt: skip
POINTS = np.array([[0.0, 0.5, 1.0], [0.3, -0.2, 2.0]])
WORDS = st.sampled_from([
    *FUNCTIONS, *"xyzt()+-*/<>,.", "**", "<=", "==", "!=", "pi", "1", "2.5", "9", " and ",
    " or ", "not ", " if ", " else ", "lambda", "[", "]", "'", ":", "__class__", "import", "0x",
    "j", "_", "\n", "#", "\\", "=", "%", "@", "~", "^", "é", "\0",
])  # fmt: skip


def evaluate_or_refuse(text):
    try:
        values = Expression(text)(POINTS)
    except AmontonsError as error:
        assert len(str(error)) < 500  # noqa: PT017
        return
    assert values.shape == (2,)
    assert np.isfinite(values).all()


@FUZZ
@given(st.lists(WORDS, max_size=30).map("".join))
def test_expressions_of_known_words(text):
    evaluate_or_refuse(text)


@FUZZ
@given(st.text(max_size=60))
def test_expressions_of_any_text(text):
    evaluate_or_refuse(text)


@FUZZ
@given(st.sampled_from(["(", "-", "x**", "not ", "abs(", "[", "1+", "x<", "lambda:", "{"]),
       st.integers(1, 3000))  # fmt: skip
def test_deep_nesting(part, count):
    evaluate_or_refuse(part * count + "x")
    evaluate_or_refuse(part * count + "x" + ")" * count)


ARITHMETIC = st.recursive(
    st.one_of(st.sampled_from(["x", "y", "z", "pi"]), st.floats(-5, 5).map(repr)),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from("+-*"), inner).map("({0[0]}{0[1]}{0[2]})".format),
        inner.map("sin({})".format),
        st.tuples(inner, inner).map("max({0[0]},{0[1]})".format),
        st.tuples(inner, inner, inner).map("where({0[0]}<{0[1]},{0[2]},1)".format),
    ),
    max_leaves=12,
)


@FUZZ
@given(ARITHMETIC)
def test_values_agree_with_numpy(text):
    names = {"sin": np.sin, "max": np.maximum, "where": np.where, "pi": np.pi,
             "x": POINTS[:, 0], "y": POINTS[:, 1], "z": POINTS[:, 2]}  # fmt: skip
    expected = eval(text, {"__builtins__": {}}, names)  # the text was made above
    np.testing.assert_array_equal(Expression(text)(POINTS), np.broadcast_to(expected, 2))


CASE = """
[mesh]
box = [1, 1]
cells = 2
[material.default]
young = 100.0
poisson = 0.3
[[fix]]
on = "top"
value = [0.01, "-0.02 + 0.001*x"]
[[contact]]
slave = "bottom"
obstacle = { plane = { point = [0, 0], normal = [0, 1] } }
friction = { coulomb = 0.3 }
"""
SCALARS = st.one_of(
    st.integers(-(2**70), 2**70), st.floats(), st.booleans(), st.text(max_size=8), st.none(),
    st.lists(st.floats(-1, 1), max_size=3), st.just({}), st.just({"a": 1}),
)  # fmt: skip


@settings(FUZZ, max_examples=150)
@given(st.integers(0, len(CASE) - 1), st.integers(0, 12), st.text(max_size=6))
def test_case_files_with_replaced_text(tmp_path, start, length, text):
    path = tmp_path / "case.toml"
    path.write_text(CASE[:start] + text + CASE[start + length :], encoding="utf-8")
    read_or_refuse(path)


@FUZZ
@given(st.binary(max_size=200))
def test_case_files_of_any_bytes(tmp_path, content):
    path = tmp_path / "case.toml"
    path.write_bytes(content)
    read_or_refuse(path)


PATHS = st.sampled_from([
    "title", "mesh", "mesh.box", "mesh.box.0", "mesh.cells", "mesh.kind", "mesh.file",
    "material",
    "material.default", "material.default.young", "material.default.poisson", "fix", "fix.0",
    "fix.on", "fix.value", "fix.value.1", "contact.slave", "contact.obstacle",
    "contact.obstacle.plane.normal", "contact.friction.coulomb", "contact.method", "solver",
    "solver.method", "solver.tolerance", "solver.max_iterations", "solver.sweeps", "traction",
    "body_force", "other", "contact.9", "",
])  # fmt: skip


@settings(FUZZ, max_examples=150)
@given(PATHS, SCALARS)
def test_overrides_with_any_value(tmp_path, path, value):
    file = tmp_path / "case.toml"
    file.write_text(CASE)
    read_or_refuse(file, [f"{path}={value}"])


def read_or_refuse(path, overrides=()):
    try:
        case = read_case(path, overrides)
    except AmontonsError as error:
        assert "case.toml" in str(error) or "--set" in str(error)  # noqa: PT017
        return
    try:
        case.model.assemble()
    except AmontonsError:
        return


def test_overrides_leave_the_data_alone():
    data = {"mesh": {"cells": 2}}
    assert apply_overrides(data, ["mesh.cells=3"], "f") == {"mesh": {"cells": 3}}
    assert data == {"mesh": {"cells": 2}}
