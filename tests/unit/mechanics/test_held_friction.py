"""Supports that hold sliding contacts of two bodies along the surface: what lacks is told."""

import re

import pytest

import amontons as am

MU, LAW = 0.3, am.LinearElastic(1000.0, 0.3)


def dragged(kinematics, side, against):
    """(friction over mu N, warnings) of a block pressed by a load and moved by a side."""
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
    return -along / (MU * across), [
        w.message for w in solution.warnings if w.name == "held-without-friction"
    ]


@pytest.mark.parametrize("against", ["plane", "body"])
def test_friction_that_a_support_takes_is_told(against):
    """Small kinematics bears mu N; finite kinematics of bodies lacks what it says."""
    whole, none = dragged("small", "left", against)
    assert whole == pytest.approx(1, rel=1e-6)
    assert not none
    if against == "plane":
        whole, none = dragged("finite", "left", against)
        assert whole == pytest.approx(1, rel=1e-6)
        assert not none
        return
    part, (told,) = dragged("finite", "left", against)
    assert part < 0.92
    (percent,) = re.findall("about (.*) % of what friction bears is missing", told)
    assert float(percent) == pytest.approx(100 * (1 - part), rel=0.1)
    assert "supports hold 1 of its contacts along the surface" in told
    assert "at [0, 0]" in told
    assert "take the other surface as the slave" in told
    part, none = dragged("finite", "top", against)
    assert part == pytest.approx(1, rel=3e-3)  # surfaces tilt by the strain
    assert not none


def test_a_plane_of_symmetry_lacks_no_friction():
    """Both sides are held along the surface there, and do not move on each other."""
    law = am.NeoHookean(1.0, 0.3)
    bodies = [am.Body(am.box((2, 1), (5, 2), origin=(0, -1)), law, name="low"),
              am.Body(am.box((1, 1), (4, 3)), am.NeoHookean(0.3, 0.3), name="up")]  # fmt: skip
    held = [am.Fix("low.bottom", 0), am.Fix("low.left", (0, None)),
            am.Fix("up.left", (0, None)), am.Fix("up.top", (None, -0.2))]  # fmt: skip
    pair = am.Contact("up.bottom", master="low.top", mu=MU)
    solution = am.solve(am.Model(bodies, held, [pair]))
    assert solution.converged
    assert solution.counts["slip"] > 0
    assert "held-without-friction" not in [w.name for w in solution.warnings]
