"""What no jump does to bodies: turn their cells inside out."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.model.large_deformation import large_deformation
from amontons.mechanics.model.worst_cells import turned_corner
from amontons.solvers.newton import nonlinear
from amontons.solvers.newton.step_lengths import Failed


@pytest.mark.parametrize(
    ("dim", "kind", "order"), [(2, "quad", 1), (2, "tri", 2), (3, "hex", 1), (3, "tet", 2)]
)
def test_corners_that_were_inside_out_before_do_not_count(dim, kind, order):
    mesh = am.Body(am.box((1,) * dim, 2, kind=kind), am.NeoHookean(1, 0.3), order=order).mesh
    u = np.zeros(mesh.points.shape)
    u[(mesh.points == 1).all(axis=1)] = -0.6
    assert "is turned inside out, det F = -" in turned_corner(mesh, u, np.zeros_like(u))
    assert turned_corner(mesh, u, u) == ""
    assert turned_corner(mesh, np.zeros_like(u), u) == ""


def _checked(steps, problem, v, tolerance):
    return nonlinear._not_astray(iter(steps), problem, (problem, v), tolerance, jumped=True)


def test_a_jump_to_cells_inside_out_is_none():
    """Its steps are shown until there; what was inside out at the start may stay so."""
    body = am.Body(am.box((1, 1), 2), am.NeoHookean(1.0, 0.3), name="body")
    wall = am.Contact("body.top", am.Plane((0, -1), (0, 3)), mu=0.0)
    problem = large_deformation(am.Model([body], [am.Fix("body.bottom", 0)], [wall]))
    v = np.zeros(problem.unknowns)
    turned = v.copy()
    turned[-2:] = -0.6  # the corner (1, 1)
    steps = [(v, problem.reactions(v), np.inf), (turned, np.zeros((3, 2)), 1.0)]
    shown = _checked(steps, problem, v, np.inf)
    next(shown)
    with pytest.raises(Failed, match=r"over a jump the corner at \(1, 1\) .* in body 'body'"):
        next(shown)
    assert len(list(_checked(steps, problem, turned, np.inf))) == 2
    assert len(list(_checked(steps, problem, v, 0.0))) == 2  # on the way


def test_the_end_tells_what_was_refused_though_other_attempts_failed_later(monkeypatch):
    ends = iter([nonlinear._Astray("bodies 'a' and 'b' lie in each other at (0, 1)")])

    def reached(*given):
        yield from ()
        raise next(ends, Failed("nothing leads nearer"))

    monkeypatch.setattr(nonlinear.NonlinearNewton, "_reached", reached)
    body = am.Body(am.box((1, 1), 1), am.NeoHookean(1.0, 0.3), name="body")
    wall = am.Contact("body.top", am.Plane((0, -1), (0, 0.9)), mu=0.0)
    model = am.Model([body], [am.Fix("body.bottom", 0)], [wall])
    told = r"nothing leads nearer; a state beyond was refused: bodies 'a' and 'b' lie in each"
    with pytest.raises(am.NotConverged, match=told):
        am.solve(model)
