"""Errors carry an address, and no code decides anything by the words of a message."""

import ast
import pickle
from dataclasses import replace
from pathlib import Path

import pytest

import amontons as am
from amontons.core.errors import InvalidInput, dotted, within
from amontons.problem.solution import StoppedBy

PACKAGE = Path(am.__file__).parent
METHODS = {"startswith", "endswith", "removeprefix", "removesuffix", "find", "index", "count",
           "partition", "rpartition", "replace"}  # fmt: skip


def caught_names(tree):
    """Names that exceptions are bound to."""
    return {node.name for node in ast.walk(tree)
            if isinstance(node, ast.ExceptHandler) and node.name}  # fmt: skip


def is_message(node, caught):
    """True for str(error), error.args[0], error.text, record.detail, and slices of them."""
    if isinstance(node, ast.Subscript):
        return is_message(node.value, caught)
    if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("str", "repr"):
        return bool(node.args) and getattr(node.args[0], "id", None) in caught
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        return node.func.attr in ("lower", "strip", "split") and is_message(
            node.func.value, caught
        )
    if isinstance(node, ast.Attribute):
        owner = getattr(node.value, "id", None)
        return (node.attr in ("args", "text") and owner in caught) or node.attr == "detail"
    return False


def decisions(path):
    """Lines that compare messages, look into them, cut them, or match patterns in them."""
    tree = ast.parse(path.read_text())
    caught = caught_names(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            parts = [node.left, *node.comparators]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            owner = getattr(node.func.value, "id", "")
            parts = [node.func.value] if node.func.attr in METHODS else []
            parts += node.args if owner == "re" else []
        else:
            continue
        if any(is_message(part, caught) for part in parts):
            yield f"{path.relative_to(PACKAGE)}:{node.lineno}"


def test_no_code_decides_by_the_words_of_a_message():
    assert [line for path in sorted(PACKAGE.rglob("*.py")) for line in decisions(path)] == []


@pytest.mark.parametrize("line", [
    "if 'no solution' in str(error): pass", "str(error).startswith('x')",
    "text = str(error).removeprefix('x')", "re.match('x', str(error))",
    "if record.detail == 'by the user': pass", "if 'x' in error.args[0]: pass",
])  # fmt: skip
def test_such_decisions_would_be_found(line, tmp_path, monkeypatch):
    file = tmp_path / "bad.py"
    file.write_text(f"try:\n    pass\nexcept ValueError as error:\n    {line}\n")
    monkeypatch.setitem(globals(), "PACKAGE", tmp_path)
    assert list(decisions(file)) == ["bad.py:4"]


def test_addresses_in_words():
    assert dotted(("contacts", 0, "mu")) == "contacts[0].mu"
    assert dotted(()) == ""


def test_places_come_before_the_address():
    with (
        pytest.raises(InvalidInput, match=r"^mu: expected more$") as caught,
        within("contacts", 2),
        within(),
    ):
        raise InvalidInput("expected more", ("mu",))
    assert caught.value.at == ("contacts", 2, "mu")
    assert caught.value.text == "expected more"
    again = pickle.loads(pickle.dumps(caught.value))
    assert (str(again), again.at, again.text) == ("mu: expected more", caught.value.at,
                                                  "expected more")  # fmt: skip


def block(**more):
    given = {
        "supports": [am.Fix("top", (0, -0.01))],
        "contacts": [am.Contact("bottom", am.Plane((0, 1)), mu=0.3)],
    } | more
    return am.Model([am.Body(am.box((1, 1), 2), am.LinearElastic(1.0, 0.3))], **given)


TOP = am.Fix("top", (0, -0.01))
FLOOR = am.Plane((0, 1))
FLAT = am.LevelSet(lambda x: 0 * x[:, 0])
AT = {
    ("supports", 1, "value"): {"supports": [TOP, am.Fix("left", (0, 1))]},
    ("supports", 0, "on"): {"supports": [am.Fix("tip", 0)]},
    ("loads", 1, "value"): {"loads": [am.BodyForce(0), am.Pressure("left", lambda x: "x")]},
    ("loads", 0, "value"): {"loads": [am.Traction("left", lambda x: [1])]},
    ("loads", 0, "region"): {"loads": [am.BodyForce((0, 1), region="foo")]},
    ("loads", 0, "configuration"): {"loads": [am.BodyForce(0, configuration="current")]},
    ("contacts", 0, "mu"): {"contacts": [am.Contact("bottom", FLOOR, mu=lambda x: -x)]},
    ("contacts", 0, "obstacle"): {"contacts": [am.Contact("bottom", FLAT, mu=1)]},
    ("contacts", 1, "slave"): {"contacts": [am.Contact("bottom", FLOOR, mu=1),
                                            am.Contact("side", FLOOR, mu=1)]},
    ("contacts", 0, "master"): {"contacts": [am.Contact("bottom", master="bottom", mu=1)]},
    ("contacts",): {"supports": [am.Fix("bottom", 0)]},
}  # fmt: skip


@pytest.mark.parametrize("at", AT)
def test_models_name_the_culprit(at):
    with pytest.raises(InvalidInput) as caught:
        block(**AT[at]).assemble()
    assert caught.value.at == at
    assert str(caught.value)


def test_loads_keep_their_number_where_others_depend_on_time():
    late = am.Traction("right", lambda x, t: [t] if t else [0, 0])
    model = block(loads=[am.Traction("left", (0, 0)), late])
    with pytest.raises(InvalidInput) as caught:
        next(am.evolve(model, am.QuasiStatic(0.5), until=1.0))
    assert caught.value.at == ("loads", 1, "value")


def test_who_stopped_does_not_depend_on_words():
    problem = block().assemble().condensed()
    found = am.drive(problem, am.GaussSeidel(), callback=lambda step, iterate: True)
    record = found.convergence
    assert record.stopped_by is StoppedBy.CALLBACK and not record.by_user
    assert replace(record, stopped_by=StoppedBy.USER, detail="in other words").by_user
