"""The table of stages that Auto walks on the Delassus form."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.ready.gallery import random_delassus
from amontons.solvers.auto.portfolio import FIRST, JOINTS, MOST_TURNS, TURNS, Portfolio
from amontons.solvers.contract import Target


def walked(problem, first=JOINTS + FIRST, turns=TURNS):
    """Names of the stages that run when none of them finds anything, turn by turn."""
    seen = []

    def nothing(stage):
        def run(state, row, turn):
            seen.append((turn, stage.name))
            return iter(())

        return replace(stage, run=run)

    first, turns = (tuple(map(nothing, table)) for table in (first, turns))
    start = np.zeros((problem.contacts, 3))
    assert not list(Portfolio(problem, Target(1e-8), start, first, turns).stages())
    return seen


def test_names_are_different():
    names = [stage.name for stage in JOINTS + FIRST + TURNS]
    assert len(set(names)) == len(names)


def test_few_contacts_under_coulombs_law():
    seen = walked(random_delassus(0, 10))
    first = ["accelerated sweeps", "semismooth Newton, dense"]
    again = ["interior point", "smoothing Newton", "proximal point"]
    assert [name for turn, name in seen if name in first] == first
    assert [n for t, n in seen if t == 0][-5:] == [*again, "matching sweeps", "methods alone"]
    assert [n for t, n in seen if t == 1] == [
        *again, "semismooth Newton, small", "matching sweeps",
    ]  # fmt: skip
    assert max(turn for turn, _ in seen) == MOST_TURNS - 1
    assert not {name for _, name in seen} & {stage.name for stage in JOINTS}


def test_laws_without_a_cone_have_the_stages_that_need_none():
    problem = replace(random_delassus(0, 10), law=am.Tresca(np.full(10, 0.3)))
    seen = walked(problem)
    assert "semismooth Newton, no cone" in [name for turn, name in seen if turn == 0]
    assert {name for turn, name in seen if turn == 1} == {
        "semismooth Newton, small", "matching sweeps",
    }  # fmt: skip


@pytest.mark.parametrize("stage", FIRST + TURNS, ids=lambda stage: stage.name)
def test_no_stage_is_needed_by_an_easy_problem(stage):
    problem = random_delassus(3, 12, rank=20)
    first, turns = (tuple(s for s in t if s is not stage) for t in (FIRST, TURNS))
    found = Portfolio(problem, Target(1e-8), np.zeros((12, 3)), first, turns).stages()
    assert any(problem.error(iterate.r) < 1e-8 for iterate in found)
