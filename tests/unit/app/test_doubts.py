"""Warnings about models: each where it is due, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am

STEEL = am.LinearElastic(young=200.0, poisson=0.3)


def names(solution):
    return [warning.name for warning in solution.warnings]


def block(value=0.0, loads=(), *, gap=0.0, **options):
    """A block above a floor, held at its top."""
    return am.Model(
        [am.Body(am.box((2, 1), cells=(4, 2)), STEEL)],
        [am.Fix("top", value)],
        [am.Contact("bottom", am.Plane((0, 1), point=(0, -gap)), mu=0.3)],
        loads,
        **options,
    )


def test_warnings_of_python_are_for_those_who_ask():
    solution = am.solve(block())  # silent: any warning fails a test
    with pytest.warns(am.DoubtWarning, match=r"\[no-load\]") as told:
        am.warn_of(solution)
    assert [one.filename for one in told] == [__file__]
    am.warn_of(am.solve(block((0, -0.01))))
    with pytest.raises(am.DoubtWarning):
        am.warn_of(solution)  # pytest turns them into errors here


@pytest.mark.parametrize(
    "model",
    [
        block(),
        block(gap=0.1),
        block(lambda x: (0.0, 0.0)),
        block((0, None), [am.Traction("left", (0, 0)), am.BodyForce(np.zeros(2))]),
        block((0, -0.1), load_factor=0.0),
    ],
)
def test_a_model_without_load_says_so(model):
    solution = am.solve(model)
    assert names(solution) == ["no-load"]
    assert "no-load" in str(solution)


@pytest.mark.parametrize(
    "model",
    [
        block((0, -0.1)),
        block((0, 0.1)),  # lifted: open by its load
        block(gap=-0.01),  # an overlap is a load
        block(0, [am.Traction("left", (0, -1))]),
        block(0, [am.BodyForce((0, -1))]),
    ],
)
def test_a_load_is_no_doubt(model):
    assert names(am.solve(model)) == []


def test_steps_before_the_load_begins_are_no_doubt():
    model = block((0, lambda x, t: -max(t - 0.6, 0.0)))
    assert [names(step) for step in am.evolve(model, am.QuasiStatic(0.5), until=1)] == [[], []]
    quiet = list(am.evolve(block(), am.QuasiStatic(0.5), until=1))
    assert [names(step) for step in quiet] == [["no-load"], ["no-load"]]


# ------------------------------------------------------------------ volumetric locking
def rubber(law, cells, kind=None, order=1, press=0.02, integration="auto"):
    """A block between a bonded and a rubbing side."""
    size, down = ((2, 1), (0, -1)) if len(cells) == 2 else ((2, 2, 1), (0, 0, -1))
    move = tuple(press * x for x in down)
    mesh = am.box(size, cells=cells, kind=kind)
    mesh = replace(mesh, cells=tuple(replace(b, integration=integration) for b in mesh.cells))
    return am.Model(
        [am.Body(mesh, law, order=order)],
        [am.Fix("top", move)],
        [am.Contact("bottom", am.Plane([-x for x in down]), mu=0.5)],
    )


def estimated(solution):
    """The factor of the warning."""
    (warning,) = solution.warnings
    assert warning.name == "volumetric-locking"
    assert "order=2" in warning.message
    return float(warning.message.split("about ")[1].split(" times")[0])


@pytest.mark.parametrize(
    ("cells", "kind", "poisson"),
    [((8, 4), "quad", 0.499), ((8, 4), "quad", 0.4999), ((16, 8), "tri", 0.499),
     ((4, 4, 2), "hex", 0.49), ((4, 4, 2), "tet", 0.499)],
)  # fmt: skip
def test_locking_is_told_with_its_size(cells, kind, poisson):
    law = am.LinearElastic(1.0, poisson)
    solution = am.solve(rubber(law, cells, kind, integration="full"))
    fine = am.solve(rubber(law, (16, 8) if len(cells) == 2 else (6, 6, 3), order=2))
    assert fine.warnings == ()
    factor = solution.resultant[-1] / fine.resultant[-1]
    assert estimated(solution) == pytest.approx(factor, rel=0.15)


@pytest.mark.parametrize(("method", "told"), [("mortar", False), ("nodal", True)])
def test_second_order_helps_two_bodies_too(method, told):
    """Averages know facets of second order, nodal contact does not."""
    law = am.LinearElastic(1.0, 0.4999)
    bodies = [am.Body(am.box((2, 1), (4, 2), origin=(0, at), kind="tri"), law, name=name)
              for name, at in (("low", 0), ("up", 1))]  # fmt: skip
    contact = am.Contact("up.bottom", master="low.top", mu=0.1, method=method)
    supports = [am.Fix("low.bottom", 0), am.Fix("up.top", (0, -0.01))]
    solution = am.solve(am.Model(bodies, supports, [contact]))
    messages = [w.message for w in solution.warnings if w.name == "volumetric-locking"]
    assert len(messages) == 2
    assert all("order=2" in message for message in messages)
    assert all(('of method "mortar"' in message) == told for message in messages)


@pytest.mark.parametrize("law", [am.NeoHookean, am.CiarletGeymonat])
def test_locking_at_finite_strains(law):
    coarse = am.solve(rubber(law(1.0, 0.499), (8, 4), press=0.1, integration="full"))
    fine = am.solve(rubber(law(1.0, 0.499), (8, 4), order=2, press=0.1))
    assert fine.warnings == ()
    factor = coarse.resultant[-1] / fine.resultant[-1]
    assert estimated(coarse) == pytest.approx(factor, rel=0.3)


@pytest.mark.parametrize(
    ("law", "cells"),
    [
        (am.LinearElastic(1.0, 0.4999, plane="stress"), (8, 4)),
        (am.LinearElastic(1.0, 0.3), (2, 1)),
        (am.LinearElastic(1.0, 0.4999), (8, 4)),  # hybrid cells
        (am.NeoHookean(1.0, 0.4999), (8, 4)),
    ],
)
def test_what_does_not_lock(law, cells):
    assert am.solve(rubber(law, cells)).warnings == ()


def test_the_region_that_locks_is_named():
    """One region of one body of two."""
    mesh = am.box((2, 1), cells=(4, 2))
    half = am.Cells("quad", mesh.cells[0].nodes[:4], "seal", "full")
    rest = am.Cells("quad", mesh.cells[0].nodes[4:], "frame")
    mesh = am.Mesh(mesh.points, (half, rest), mesh.surfaces)
    laws = {"seal": am.LinearElastic(1.0, 0.4999), "frame": am.LinearElastic(1.0, 0.3)}
    model = am.Model(
        [am.Body(mesh, laws, name="ring")],
        [am.Fix("top", (0, -0.1))],
        [am.Contact("bottom", am.Plane((0, 1)), mu=0.5)],
    )
    (warning,) = am.solve(model).warnings
    assert "region 'seal' of body 'ring'" in warning.message


def rubbing(mu, **law):
    body = am.Body(am.box((1, 1), 2), am.LinearElastic(100, 0.3))
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=mu, name="shoe", **law)
    return am.Model([body], [am.Fix("top", (0.01, -0.02))], [contact])


@pytest.mark.parametrize(("mu", "meant"), [(30.0, "0.3 if it is meant in percent, 0.577"),
                                           (150.0, "1.5 if it is meant in percent, or tie")])
def test_friction_in_percent_or_degrees_is_doubted(mu, meant):
    found = am.solve(rubbing(mu))
    (warning,) = found.warnings
    assert warning.name == "friction-like-percent"
    assert "'shoe'" in warning.message
    assert meant in warning.message
    assert warning.contacts == (0, 1, 2)


@pytest.mark.parametrize("contact", [
    {"mu": 1.5}, {"mu": 4.0}, {"mu": 10.0}, {"mu": 1e6}, {"mu": 200.0},
    {"mu": lambda x: 4 + x[:, 0]},
])  # fmt: skip
def test_friction_of_surfaces_and_of_those_that_never_slip_is_not(contact):
    assert am.solve(rubbing(**contact)).warnings == ()


def test_only_the_pair_with_odd_friction_is_named():
    body = am.Body(am.box((1, 1), 2), am.LinearElastic(100, 0.3))
    pairs = [am.Contact("bottom", am.Plane((0, 1)), mu=20, cap=1.0),
             am.Contact("right", am.Plane((-1, 0), (1, 0)), tresca=30.0)]  # fmt: skip
    model = am.Model([body], [am.Fix("top", (-0.01, -0.02))], pairs)
    (warning,) = am.solve(model).warnings
    assert "'bottom'" in warning.message
    assert len(warning.contacts) == 3
