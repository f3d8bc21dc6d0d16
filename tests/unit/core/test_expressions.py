import numpy as np
import pytest

from amontons.core.errors import InvalidInput
from amontons.core.expressions import Expression, nearest

POINTS = np.array([[0.0, 0.5, 1.0], [0.4, 0.2, -1.0]])


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("0.06 - 0.15*x", [0.06, 0.0]),
        ("2", [2.0, 2.0]),
        ("2*pi", [2 * np.pi] * 2),
        ("-x**2", [0.0, -0.16]),
        ("2**-1", [0.5, 0.5]),
        ("where(x < 0.1, y, z)", [0.5, -1.0]),
        ("where(0 < x < 1, 1/x, 0)", [0.0, 2.5]),
        ("min(x, y, z)", [0.0, -1.0]),
        ("max(x, y)", [0.5, 0.4]),
        ("abs(z) + sqrt(y*y)", [1.5, 1.2]),
        ("exp(0*x) + log(1) + sin(0) + cos(0) + tan(0)", [2.0, 2.0]),
        ("(x > 0) - (z > 0)", [-1.0, 1.0]),
        ("-(x > 0)", [0.0, -1.0]),
        ("x == 0 or z == -1", [1.0, 1.0]),
        ("not x and z != 2", [1.0, 0.0]),
        ("x >= 0.4", [0.0, 1.0]),
        ("x <= 0", [1.0, 0.0]),
        (" x ", [0.0, 0.4]),
        ("+y", [0.5, 0.2]),
        ("t", [0.0, 0.0]),
    ],
)
def test_values(text, values):
    np.testing.assert_allclose(Expression(text)(POINTS), values, atol=1e-15)


def test_one_point_gives_a_number():
    value = Expression("x + 2*y")([1.0, 2.0])
    assert np.ndim(value) == 0
    assert value == 5.0


def test_time():
    assert Expression("x*t", time=3.0)([2.0, 0.0]) == 6.0


def test_names():
    assert Expression("x + sin(t)*pi").names == {"x", "t"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("x +", "can not be read"),
        ("2x", "near '2x'"),
        ("x^2", r"\*\*"),
        ("__import__('os')", "unknown name '__import__'"),
        ("os.system('ls')", "unknown name 'os.system'"),
        ("x.__class__", r"'x.__class__' is not allowed"),
        ("(1).real", "not allowed"),
        ("[x]", "not allowed"),
        ("'x'", "not allowed"),
        ("lambda: 1", "not allowed"),
        ("x if y else z", "not allowed"),
        ("x // 2", "not allowed"),
        ("x % 2", "not allowed"),
        ("True", "not allowed"),
        ("1j", "not allowed"),
        ("x is y", "not allowed"),
        ("(x := 1)", "not allowed"),
        ("sinus(x)", "did you mean 'sin'"),
        ("r", "unknown name 'r'"),
        ("sqrt", "is a function"),
        ("sqrt(x, y)", "1 argument"),
        ("sqrt(x=1)", "1 argument"),
        ("min(x)", "two or more"),
        ("where(x, y)", "3 argument"),
        ("min(*x)", "two or more"),
        ("9" * 400, "too large"),
        ("x" * 3000, "characters"),
        ("-" * 500 + "x", "nested"),
        ("(" * 500 + "x" + ")" * 500, "can not be read"),
        ("\0", "can not be read"),
    ],
)
def test_refused(text, words):
    with pytest.raises(InvalidInput, match=words):
        Expression(text)


@pytest.mark.parametrize("text", ["9**9**9", "1/x", "log(z)", "sqrt(z)", "exp(999)", "1e999"])
def test_values_that_are_not_finite(text):
    with pytest.raises(InvalidInput, match=r"(inf|nan) at the point \(.*\)"):
        Expression(text)(POINTS)


def test_missing_coordinate():
    with pytest.raises(InvalidInput, match="'z' does not exist in 2D"):
        Expression("z")(POINTS[:, :2])


def test_not_a_text():
    with pytest.raises(InvalidInput, match="expected a text"):
        Expression(3)


def test_nearest():
    assert nearest("tolerence", ["tolerance", "method"]) == "; did you mean 'tolerance'?"
    assert nearest("q", ["b", "a"]) == "; known: a, b"
