"""Bodies that meet nothing: linear statics, by exact answers and contact that is open."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main

YOUNG, NU, PULL = 200.0, 0.3, 2.0


def bar(dim, supports=None, loads=None, contacts=()):
    """A bar of length 2 on rollers, pulled at its end."""
    mesh = am.box((2, 1, 1)[:dim], cells=(4, 2, 2)[:dim])
    sides = ("left", "bottom", "front")[:dim]
    rollers = [am.Fix(s, [0.0 if i == k else None for i in range(dim)])
               for s, k in zip(sides, (0, dim - 1, 1), strict=False)]  # fmt: skip
    pull = [am.Traction("right", (PULL,) + (0.0,) * (dim - 1))]
    material = am.LinearElastic(YOUNG, NU, density=1.0)
    return am.Model([am.Body(mesh, material)],
                    rollers if supports is None else supports, contacts,
                    pull if loads is None else loads)  # fmt: skip


@pytest.mark.parametrize("dim", [2, 3])
def test_a_pulled_bar(dim):
    found = am.solve(bar(dim))
    stiffness = YOUNG / (1 - NU**2) if dim == 2 else YOUNG  # plane strain
    assert found.converged
    assert found.displacement[0][:, 0].max() == pytest.approx(2 * PULL / stiffness, rel=1e-9)
    assert "no contacts" in str(found) and f"{2 * PULL / stiffness:.6g}" in str(found)
    held = found.fields.reaction[0].sum(axis=0)
    np.testing.assert_allclose(held, [-PULL] + [0] * (dim - 1), atol=1e-10)


def test_as_with_a_contact_that_stays_open():
    alone = am.solve(bar(2))
    far = am.Contact("top", am.Plane(normal=(0, -1), point=(0, 9)), mu=0.3)
    beside = am.solve(bar(2, contacts=[far]))
    np.testing.assert_allclose(
        alone.displacement[0], beside.displacement[0], rtol=0, atol=1e-12
    )


def test_what_is_asked_of_it_has_an_answer():
    model = bar(2)
    assert "exactly one solution, whatever the load" in str(am.uniqueness(model))
    listed = am.all_solutions(model)
    assert listed.complete and len(listed.solutions) == 1 and "no contacts" in listed.reason
    with pytest.raises(am.UnsupportedForm, match="in proportion"):
        am.follow(model, "load", (0.0, 1.0))
    assert am.solve(model).plot() is not None  # a figure of the bodies alone


@pytest.mark.parametrize("method", [am.ActiveSet(), am.SemismoothNewton(), am.GaussSeidel()])
def test_other_methods(method):
    alone = am.solve(bar(3), method)
    np.testing.assert_allclose(
        alone.displacement[0], am.solve(bar(3)).displacement[0], rtol=0, atol=1e-10
    )


def test_in_time():
    step = list(am.evolve(bar(2), am.QuasiStatic(0.5), until=1.0))[-1]
    np.testing.assert_allclose(
        step.displacement[0], am.solve(bar(2)).displacement[0], rtol=0, atol=1e-12
    )
    moved = list(am.evolve(bar(2), am.MoreauJean(0.01), until=0.05))[-1]
    assert 0 < moved.displacement[0][:, 0].max() < step.displacement[0][:, 0].max()


def test_a_body_that_nothing_holds():
    with pytest.raises(am.SingularOperator, match="free to move.*along y"):
        am.solve(bar(2, supports=[am.Fix("left", (0.0, None))]))


def test_finite_strains_want_a_contact():
    mesh = am.box((1, 1), 2)
    model = am.Model([am.Body(mesh, am.NeoHookean(YOUNG, NU))], [am.Fix("left", 0.0)])
    with pytest.raises(am.UnsupportedForm, match="finite strains"):
        am.solve(model)


CASE = """title = "pull"
[[mesh]]
box = [2, 1]
cells = [4, 2]
[material.default]
young = 200
poisson = 0.3
[[fix]]
on = "left"
value = [0, "free"]
[[fix]]
on = "bottom"
value = ["free", 0]
[[traction]]
on = "right"
value = [2, 0]
"""


def test_case_files(tmp_path):
    path = tmp_path / "pull.toml"
    path.write_text(CASE)
    done = CliRunner().invoke(main, ["solve", str(path), "--output", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert "no contacts in 2D" in done.output and "no [[contact]]" in done.output
    assert "largest displacement: 0.0182" in done.output
    told = json.loads((tmp_path / "out" / "solution.json").read_text())
    assert told["outcome"] == "converged" and not told["pairs"]
    for verb in (["info"], ["uniqueness"], ["enumerate"]):
        done = CliRunner().invoke(main, [*verb, str(path)])
        assert done.exit_code == 0, (verb, done.output, done.exception)
