"""Supports that hold sliding contacts along the surface take their friction."""

import numpy as np
import pytest

import amontons as am
from amontons.analysis.paths.continuation import Continuation
from amontons.analysis.paths.load_path import load_path
from amontons.mechanics.model.large_deformation import large_deformation
from amontons.mechanics.model.rubbed_between import without_rubbed

MU, LAW = 0.3, am.LinearElastic(1000.0, 0.3)


def dragged(kinematics, side, against):
    """Friction over mu N of a block pressed by a load and moved by a side."""
    slab = am.Body(am.box((3, 1), (9, 2), origin=(-1, -1)), LAW, name="low")
    block = am.Body(am.box((1, 1), (4, 3)), LAW, name="up")
    low = [am.Fix("low.bottom", 0)]
    held = [am.Fix(f"up.{side}", (0.05, None))]
    load = am.Traction("up.top", (0, -0.5))
    if against == "plane":
        contact = am.Contact("up.bottom", am.Plane((0, 1)), mu=MU, kinematics=kinematics)
        model = am.Model([block], held, [contact], [load])
    else:
        contact = am.Contact("up.bottom", master="low.top", mu=MU, kinematics=kinematics)
        model = am.Model([slab, block], low + held, [contact], [load])
    solution = am.solve(model)
    across, along = solution.resultant[::-1]
    return -along / (MU * across)


@pytest.mark.parametrize("against", ["plane", "body"])
@pytest.mark.parametrize("side", ["left", "top"])
def test_the_side_that_drags_bears_all_friction(side, against):
    """The lowest node of the left side is held along the surface, that of the top is not."""
    assert dragged("small", side, against) == pytest.approx(1, rel=1e-6)
    surfaces_tilt = 3e-3 if (side, against) == ("top", "body") else 1e-3
    assert dragged("finite", side, against) == pytest.approx(1, rel=surfaces_tilt)


def test_there_is_no_friction_across_a_plane_of_symmetry():
    """Both sides are held along the surface there, and go together."""
    law = am.NeoHookean(1.0, 0.3)
    bodies = [am.Body(am.box((2, 1), (5, 2), origin=(0, -1)), law, name="low"),
              am.Body(am.box((1, 1), (4, 3)), am.NeoHookean(0.3, 0.3), name="up")]  # fmt: skip
    held = [am.Fix("low.bottom", 0), am.Fix("low.left", (0, None)),
            am.Fix("up.left", (0, None)), am.Fix("up.top", (None, -0.2))]  # fmt: skip
    pair = am.Contact("up.bottom", master="low.top", mu=MU)
    solution = am.solve(am.Model(bodies, held, [pair]))
    assert solution.converged
    assert solution.counts["slip"] > 0
    corner = np.argmin(solution.points[:, 0])
    assert solution.shear[corner] == pytest.approx(0, abs=1e-12)


def test_friction_that_is_missing_in_a_plane_where_both_are_held_is_told():
    """The slab is held at x = 0 far from the block, and moves on it there."""
    slab = am.Body(am.box((2, 2, 0.5), (4, 4, 1), origin=(-0.5, -0.5, -0.5)), LAW, name="low")
    block = am.Body(am.box((1, 0.5, 0.5), (2, 1, 1)), LAW, name="up")
    held = [am.Fix("low.bottom", (None, None, 0)), am.Fix("low.front", (0.1, 0, None)),
            am.Fix("low.back", (0, 0, None)), am.Fix("up.left", (0, 0, None))]  # fmt: skip
    pair = am.Contact("up.bottom", master="low.top", mu=MU, kinematics="finite")
    load = am.Traction("up.top", (0, 0, -0.5))
    solution = am.solve(am.Model([slab, block], held, [pair], [load]))
    (warning,) = solution.warnings
    assert warning.name == "held-without-friction"
    assert "of its contacts along the surface" in str(warning)
    assert np.linalg.norm(solution.resultant[:2]) < 0.8 * MU * solution.resultant[2]


def dragged_underside(motion):
    """A small block whose underside supports move on a slab."""
    law, slab = am.NeoHookean(10, 0.3), am.box((2, 1), (2, 1), origin=(-0.3, -1))
    bodies = [am.Body(slab, law, name="low"), am.Body(am.box((1, 1), 1), law, name="up")]
    held = [am.Fix("low.bottom", 0), am.Fix("up.bottom", motion)]
    pair = am.Contact("up.bottom", master="low.top", mu=MU, kinematics="finite")
    return am.Model(bodies, held, [pair], [am.Traction("up.top", (0, -0.3))])


def test_paths_leave_out_what_solutions_have():
    """As `PathCrossing`, whose steps are told of it, do."""
    model = dragged_underside((0.05, None))
    solution = am.solve(model)
    assert not solution.warnings
    np.testing.assert_allclose(solution.resultant, [-MU * 0.3, 0.3], rtol=1e-3)
    path, without = load_path(model, (0, 1)), without_rubbed(large_deformation(model))
    assert np.array_equal(path.residual(solution.v, 1.0) * path.unit,
                          without.residual(solution.v) / path.unit * path.unit)  # fmt: skip
    assert without_rubbed(without) is without
    timed = dragged_underside(lambda x, t: (0.05 * t, None))
    crossing = am.PathCrossing(Continuation(step=0.2, max_step=1.0))
    (step,) = am.evolve(timed, am.QuasiStatic(1.0, crossing=crossing), until=1.0)
    assert step.passage.arrived
    assert np.abs(without.residual(step.solution.v)).max() < 1e-9
    assert abs(step.resultant()[0]) < 1e-9
    (warning,) = step.warnings
    assert warning.name == "held-without-friction"
    assert "paths leave out" in str(warning)
    (step,) = am.evolve(timed, am.QuasiStatic(1.0), until=1.0)
    np.testing.assert_allclose(step.resultant(), solution.resultant, rtol=1e-6)
    assert not step.warnings


def test_a_branch_tells_what_it_leaves_out():
    """Curves of a model have the warnings of its states."""
    branch = am.follow(dragged_underside((0.05, None)), at=0.5, max_points=2)
    (warning,) = branch.warnings
    assert warning.name == "held-without-friction"
    assert "paths leave out" in str(branch)
    assert "100 % of what friction bears is missing" in str(warning)
    assert branch.record()["warnings"] == [warning.record]
