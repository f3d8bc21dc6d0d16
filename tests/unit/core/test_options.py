"""Every field of every solver and of its parts takes what it says and nothing else."""

import dataclasses
import typing
from enum import Enum

import numpy as np
import pytest

import amontons as am
from amontons import linear, solvers
from amontons.core.errors import InvalidInput
from amontons.core.options import alternatives, hints_of, is_enum, members_of, words
from amontons.io.case.settings import make_solver
from amontons.solvers import METHODS
from amontons.solvers.contract import Iterate, Target


def option_classes():
    """Solvers, and all that may be a part of one."""
    listed = [getattr(home, key) for home in (solvers, linear) for key in home.__all__]
    listed = [x for x in listed if isinstance(x, type) and dataclasses.is_dataclass(x)]
    kinds = {*METHODS.values(), am.NonlinearNewton, *listed}
    chosen = [kind for kind in kinds if not issubclass(kind, Iterate | Target)]
    return sorted(chosen, key=lambda kind: kind.__name__)


KINDS = option_classes()
FIELDS = [(kind, name) for kind in KINDS for name in hints_of(kind)]
ENUMS = [
    (kind, name, hint)
    for kind, name in FIELDS
    for hint in alternatives(hints_of(kind)[name])
    if is_enum(hint)
]
TOGETHER = {  # what another field has to be for a word to make sense
    ("SemismoothNewton", "rho_strategy"): {"function": am.JeanMoreau()},
}


class Other(Enum):
    """An enum that no field has."""

    FIRST = "first"


def wrong_values(kind, name):
    """Values that a field can not take, by its annotation."""
    hints = alternatives(hints_of(kind)[name])
    yield from ("no such word", Other.FIRST, [1], {"a": 1}, object())
    if type(None) not in hints:
        yield None
    if bool not in hints:
        yield True
    else:
        yield from (1, 0, "true", "no", "")
    if int not in hints and float not in hints:
        yield from (1, 1.5)
    else:
        yield from ("1", "3", np.nan, np.inf, 1j, np.ones(2))
    if int in hints:
        yield from (1.0, 1.5, np.float64(2))
    for hint in hints:
        if getattr(hint, "_is_protocol", False):
            yield from (type(p) for p in parts_of(hint))  # a class instead of one of it


def parts_of(protocol):
    """Instances that follow a protocol."""
    fitting = [k for k in KINDS if all(hasattr(k, key) for key in members_of(protocol))]
    return [kind() for kind in fitting]


def test_solvers_and_parts_are_seen():
    assert set(METHODS.values()) <= set(KINDS)
    assert {am.MultigridCycle, am.Armijo, am.Direct, am.GeometricMultigrid} <= set(KINDS)
    assert len(ENUMS) >= 13


@pytest.mark.parametrize(("kind", "name"), FIELDS)
def test_wrong_values_are_refused(kind, name):
    for value in wrong_values(kind, name):
        if isinstance(value, list) and typing.get_origin(hints_of(kind)[name]) is tuple:
            continue
        with pytest.raises(InvalidInput, match=rf"^{name}: expected .*got .*{kind.__name__}"):
            kind(**{name: value})


@pytest.mark.parametrize(("kind", "name", "enum"), ENUMS)
def test_words_choose_what_they_say(kind, name, enum):
    for word, member in words(enum).items():
        if getattr(member, "installed", True) is False:
            continue
        others = TOGETHER.get((kind.__name__, name), {})
        for spelt in (word, word.upper(), word.replace("-", "_"), member):
            found = getattr(kind(**{name: spelt}, **others), name)
            assert found is member


@pytest.mark.parametrize(("kind", "name", "enum"), ENUMS)
def test_a_wrong_word_names_all_that_there_are(kind, name, enum):
    with pytest.raises(InvalidInput) as caught:
        kind(**{name: "sideways"})
    text = str(caught.value)
    assert text.startswith(f"{name}: expected ")
    assert kind.__name__ in text and "'sideways'" in text
    assert all(word in text for word in words(enum))


@pytest.mark.parametrize(("kind", "name", "enum"), ENUMS)
def test_case_files_take_the_same_words(kind, name, enum):
    method = next((m for m, k in METHODS.items() if k is kind), None)
    if method is None:
        return
    with pytest.raises(InvalidInput, match=rf"^solver\.{name}: expected .* got 'sideways'"):
        make_solver(method, {name: "sideways"})
    word, member = next(iter(words(enum).items()))
    assert getattr(make_solver(method, {name: word}), name) is member


@pytest.mark.parametrize(("kind", "name"), FIELDS)
def test_numbers_of_numpy_become_pythons(kind, name):
    hints = alternatives(hints_of(kind)[name])
    usual = getattr(kind(), name)
    if isinstance(usual, bool) or not isinstance(usual, int | float) or is_enum(type(usual)):
        return
    given = (np.int64 if isinstance(usual, int) else np.float64)(usual)
    assert type(getattr(kind(**{name: given}), name)) is type(usual)
    if float in hints and usual >= 1 and usual == int(usual):
        assert type(getattr(kind(**{name: int(usual)}), name)) is float


def test_a_word_is_the_algorithm_it_names():
    """The fixed point ran under the name of Newton's method."""
    assert am.ActiveSet(bound="newton") == am.ActiveSet(bound=am.FrictionBound.NEWTON)
    assert am.ActiveSet(modification="first") == am.ActiveSet()
    assert am.MultigridCycle(shape="v").shape is am.CycleShape.V
    with pytest.raises(InvalidInput, match="bound: expected fixed-point with multigrid"):
        am.ActiveSet(bound="newton", multigrid=am.MultigridCycle())
    block = am.Body(am.box((1, 1), 3), am.LinearElastic(1.0, 0.3))
    model = am.Model(
        [block],
        supports=[am.Fix("top", (0.2, -0.1))],
        contacts=[am.Contact("bottom", am.Plane((0, 1)), mu=0.5)],
    )
    counts = [
        am.drive(model.assemble(), am.ActiveSet(bound=bound)).convergence.iterations
        for bound in ("newton", am.FrictionBound.NEWTON, "fixed-point")
    ]
    assert counts[0] == counts[1] < counts[2]


def test_messages_name_the_class_in_python_and_the_key_elsewhere():
    words = r"^bound: .*got 'wrong' \(field of ActiveSet\)$"
    with pytest.raises(InvalidInput, match=words) as caught:
        am.ActiveSet(bound="wrong")
    assert caught.value.at == ("bound",)
    with pytest.raises(InvalidInput, match=r"^solver\.bound: .*got 'wrong'$") as caught:
        make_solver("active-set", {"bound": "wrong"})
    assert caught.value.at == ("solver", "bound")
