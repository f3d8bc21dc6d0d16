"""The figure of the errors says which method made which part, and what it saw itself."""

from dataclasses import replace

import numpy as np
import pytest
from legible import faults

import amontons as am
from amontons.io.plots import convergence_figure
from amontons.mechanics.ready.gallery import random_delassus


@pytest.fixture(scope="module")
def pressed():
    """A cube that contact multigrid solves."""
    body = am.Body(am.box((1, 1, 1), cells=12), am.LinearElastic(200.0, 0.3))
    plane = am.Plane((0, 0, 1))
    return am.solve(
        am.Model([body], [am.Fix("top", (0.02, 0, -0.02))],
                 [am.Contact("bottom", plane, mu=0.4)])
    )  # fmt: skip


def named(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_multigrid_tells_what_it_sees_in_every_cycle(pressed):
    record = pressed.convergence
    last = record.history[-1]
    assert last.stage == "contact multigrid"
    assert sum(len(step.own) for step in record.history) == record.iterations
    own = np.array([error for step in record.history for error in step.own])
    assert own[0] > 1e3 * own[-1]
    figure = convergence_figure(record, "cube")
    assert named(figure) == ["contact multigrid", "judged", "by the method's own measure",
                             "tolerance"]  # fmt: skip
    lines = [line.get_xydata() for line in figure.axes[0].lines]
    shown = next(xy for xy in lines if len(xy) > len(record.history) + 1)
    shown = shown[np.isfinite(shown).all(axis=1)]
    assert shown[:, 0].tolist() == list(range(1, record.iterations + 1))
    assert shown[:, 1] == pytest.approx(own)
    assert faults(figure) == []


def test_the_bands_of_a_hybrid_are_its_methods():
    problem = random_delassus(3, 30, 3)
    solver = am.Hybrid(first=am.GaussSeidel(batch=2), iterates_of_first=3)
    record = am.solve(problem, solver).convergence
    stages = [step.stage for step in record.history[1:]]
    assert stages[:3] == ["GaussSeidel"] * 3
    assert set(stages[3:]) == {"SemismoothNewton"}
    figure = convergence_figure(record)
    assert named(figure)[:2] == ["gauss-seidel", "semismooth-newton"]
    left = figure.axes[0]
    back = left.transData.inverted()
    bands = [patch.get_extents().transformed(back) for patch in left.patches]
    x = [step.iteration for step in record.history]
    assert [(b.x0, b.x1) for b in bands] == [
        pytest.approx((x[0], x[3])), pytest.approx((x[3], x[-1]))
    ]  # fmt: skip
    assert faults(figure) == []


def test_one_method_has_no_bands():
    record = am.solve(random_delassus(1, 8), am.GaussSeidel()).convergence
    figure = convergence_figure(record)
    assert not figure.axes[0].patches
    assert named(figure) == ["judged", "tolerance"]


def test_many_stages_stay_legible():
    record = am.solve(random_delassus(1, 8), am.GaussSeidel(batch=1)).convergence
    first = record.history[0]
    history = [
        first._replace(iteration=k, error=10.0**-k, seconds=float(k), stage=f"long name of {k}")
        for k in range(12)
    ]
    assert faults(convergence_figure(replace(record, history=tuple(history)), "many")) == []
