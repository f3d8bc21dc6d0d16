"""Several solutions at large strains, without proof: a block with three, a buckled strip."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.model.worst_cells import turned_corner

TURN = 0.023


def block(down):
    """The rectangular block of ligursky2014 on a coarse mesh, turned and pressed down."""
    c, s = -2 * np.sin(TURN / 2) ** 2, np.sin(TURN)
    law = am.CiarletGeymonat.from_lame(4000.0, 120.0, 30.0)
    body = am.Body(am.box((40, 80), cells=(4, 8)), law, integration="full")
    top = am.Fix("top", lambda x: (x[0] * c, x[0] * s - down))
    return am.Model([body], [top], [am.Contact("bottom", am.Plane((0, 1)), mu=1.8)])


def strip(down):
    """An upright strip that another body presses down by more than it can bear straight."""
    column = am.Body(am.box((0.1, 1.0), cells=(2, 20), origin=(-0.05, 0)),
                     am.NeoHookean(1.0, 0.3), name="strip")  # fmt: skip
    press = am.Body(am.box((1.0, 0.3), cells=(8, 2), origin=(-0.5, 1.0)),
                    am.NeoHookean(5.0, 0.3), name="press")  # fmt: skip
    supports = [am.Fix("strip.bottom", 0), am.Fix("press.top", (0, -down))]
    contact = am.Contact("strip.top", master="press.bottom", mu=0.5)
    return am.Model([column, press], supports, [contact])


def test_all_three_solutions_of_a_block_between_its_folds():
    """Its path has them at 0.5209, between the folds 0.5125 and 0.5293."""
    found = am.multistart(block(0.5209))
    patterns = {solution.pattern for solution in found.solutions}
    assert patterns == {"--fff", "f--f-", "f---s"}
    assert not found.complete
    assert "no proof" in str(found)
    for solution in found.solutions:
        assert solution.convergence.error < 1e-9
    outside = am.multistart(block(0.4), starts=8)
    assert len(outside) == 1


def test_a_strip_between_two_bodies_buckles_to_either_side():
    model = strip(0.08)
    found = am.multistart(model, starts=24)
    middle = int(np.argmin(np.abs(model.bodies[0].mesh.points - [0, 0.5]).sum(axis=1)))
    aside = sorted(
        float(model.discrete_problem().displacement(solution.v)[middle, 0])
        for solution in found.solutions
    )
    assert aside[0] < -0.1 < 0.1 < aside[-1]
    assert aside[0] == pytest.approx(-aside[-1], abs=1e-6)
    assert all(solution.converged for solution in found.solutions)


def test_no_solution_has_cells_that_are_inside_out():
    """Another equilibrium has a corner that is, which no point of integration feels."""
    body = am.Body(am.box((0.8, 1), cells=2, origin=(-0.4, 0)), am.NeoHookean(1.0, 0.3),
                   integration="full")  # fmt: skip
    model = am.Model([body], [am.Fix("top", (0, -0.6))],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0.3)])  # fmt: skip
    found = am.multistart(model, starts=12)
    discrete = model.discrete_problem()
    assert len(found) == 3  # upright, and bent to either side
    for solution in found.solutions:
        assert turned_corner(body.mesh, discrete.displacement(solution.v)) == ""


def test_starts_and_time_are_limits():
    with pytest.raises(am.InvalidInput, match="starts: expected a whole number >= 1"):
        am.multistart(block(0.4), starts=0)
    found = am.multistart(block(0.4), starts=3)
    assert found.starts == 3
    with pytest.raises(am.NotConverged, match="multistart: no solution to begin with"):
        am.multistart(block(0.4), time_limit=1e-9)


def test_a_triangle_of_one_free_node():
    """Fewer unknowns than there are modes to begin from."""
    mesh = am.Mesh(
        np.array([[-1, 0], [1.0, 0], [0.2, -1]]), (am.Cells("tri", [[0, 2, 1]]),),
        {"held": (am.Facets("line", [[0, 1]]),),
         "side": (am.Facets("line", [[1, 2], [2, 0]]),)},
    )  # fmt: skip
    contact = am.Contact("side", am.Plane((0, 1), (0, -1)), mu=0.5,
                         where=lambda x: x[:, 1] < -0.9)  # fmt: skip
    model = am.Model([am.Body(mesh, am.NeoHookean(1.0, 0.3))], [am.Fix("held", (0.1, -0.2))],
                     [contact])  # fmt: skip
    found = am.multistart(model, starts=8)
    assert len(found) == 1
    assert not found.complete
