"""The one choice of how contact is formulated, and that nobody makes it again."""

import re
from pathlib import Path

import pytest

import amontons as am
from amontons.mechanics.model.formulation import Moved, Reactions, Stresses

LINEAR, RUBBER = am.LinearElastic(100, 0.3), am.NeoHookean(100, 0.3)
ASKS = re.compile(r"\.is_large\b|\.contacts\[0\]|\bcontact\.nitsche\b")
MAY_ASK = {f"mechanics/model/{name}.py" for name in ("model", "formulation", "placing")}


def block(law=LINEAR, **contact):
    contacts = [am.Contact("bottom", am.Plane((0, 1)), mu=0.3, **contact)]
    return am.Model([am.Body(am.box((1, 1), 2), law)], [am.Fix("top", (0, -0.01))], contacts)


@pytest.mark.parametrize(("model", "kind", "problem"), [
    (block(), Reactions, "FrictionProblem"),
    (block(method="mortar"), Reactions, "FrictionProblem"),
    (block(method="nitsche"), Stresses, "NitscheProblem"),
    (block(kinematics="finite"), Moved, "LargeDeformation"),
    (block(RUBBER), Moved, "LargeDeformation"),
])  # fmt: skip
def test_bodies_and_contacts_choose(model, kind, problem):
    assert type(model.formulation) is kind
    assert model.kind.__name__ == problem
    assert type(model.discrete_problem()) is model.kind
    assert model.discrete_problem().kind is model.kind
    assert model.is_large == (kind is Moved)
    assert type(model.with_load(2.0).formulation) is kind


def test_what_is_solved_is_made_once():
    for model in (block(), block(method="nitsche"), block(RUBBER)):
        assert model.discrete_problem() is model.discrete_problem()


def test_nobody_else_asks_which_it_is():
    package = Path(am.__file__).parent
    for path in package.rglob("*.py"):
        if path.relative_to(package).as_posix() not in MAY_ASK:
            assert not ASKS.search(path.read_text()), path
