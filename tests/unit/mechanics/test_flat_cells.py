"""Cells that are pressed flat as nothing in their law resists it, and corners inside out."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.model.flat_cells import flat_in_words

SVK = am.SaintVenantKirchhoff(1.0, 0.3)
SOFT = am.MooneyRivlin(0.2, 0, 1)
RUBBERS = (am.NeoHookean(1.0, 0.3), am.CiarletGeymonat(1.0, 0.3),
           am.MooneyRivlin(0.2, 0.1, 5.0), am.ReducedPolynomial((0.2, 0.01, 0.001), 5.0),
           am.Ogden((0.4,), (0.5,), 5.0))  # fmt: skip


def told(solution):
    """Messages about flat cells."""
    return [w.message for w in solution.warnings if w.name == "flat-cells"]


def stretched(law, kind, stretch, dim=3, order=1):
    """One cube (square) pulled in all directions but the last, in which it is free."""
    k = stretch - 1
    body = am.Body(am.box((1,) * dim, 1, kind=kind), law, name="body", order=order)
    ways = {"left": (0, 0), "right": (0, k), "front": (1, 0), "back": (1, k),
            "bottom": (dim - 1, 0)}  # fmt: skip
    supports = [
        am.Fix(f"body.{side}", tuple(value if c == axis else None for c in range(dim)))
        for side, (axis, value) in ways.items()
        if dim == 3 or side not in ("front", "back")
    ]
    return am.solve(am.Model([body], supports, []))


@pytest.mark.parametrize(
    ("dim", "kind", "order", "stretch"),
    [(3, "hex", 1, 1.5), (3, "tet", 1, 1.5), (3, "hex", 2, 1.5), (2, "quad", 1, 1.9),
     (2, "tri", 2, 1.9)],
)  # fmt: skip
def test_saint_venant_kirchhoff_that_is_pulled_flat_is_told(dim, kind, order, stretch):
    """S_33 = 0 asks for E_33 = -poisson / (1 - poisson) (E_11 + E_22), here below -1/2."""
    (message,) = told(stretched(SVK, kind, stretch, dim, order))
    assert "of body 'body' is pressed to " in message
    assert "which SaintVenantKirchhoff does not resist" in message
    assert "take NeoHookean" in message


@pytest.mark.parametrize("law", RUBBERS)
def test_rubber_that_is_pulled_or_pressed_is_no_doubt(law):
    """Stretches of .21 and less in the free direction: these laws resist."""
    assert not told(stretched(law, "hex", 2.2))
    mesh = am.box((1, 1, 1), 1)
    pressed = mesh.points * ((3.0, 3.0, 0.1) - np.ones(3))
    assert flat_in_words(mesh, law, "body", pressed) == ""


def test_a_moderate_strain_is_no_doubt_and_the_flattest_cell_is_named():
    """Stretches of .42 (told) and .66 (not) across: the largest compression is at .577."""
    (message,) = told(stretched(SVK, "hex", 1.4))
    assert "cell 0 at (0.5, 0.5, 0.5)" in message
    assert "pressed to 0.42 of its thickness, det F = 0.82" in message
    assert not told(stretched(SVK, "hex", 1.29))


def test_volume_that_vanishes_all_around_is_told():
    """U = bulk / 2 (J - 1)^2 lets a cube shrink to nothing, ln J does not."""
    mesh = am.box((1, 1, 1), 1)
    assert "0.2 of its" in flat_in_words(mesh, SOFT, "a", -0.8 * mesh.points)
    assert not flat_in_words(mesh, am.NeoHookean(1.0, 0.3), "a", -0.8 * mesh.points)
    assert not flat_in_words(mesh, SOFT, "a", -0.4 * mesh.points)


def test_plane_stress_tells_where_no_thickness_is_left():
    """Beyond equal stretches of 1.475 the thickness has no square: the end names the cells."""
    law = am.SaintVenantKirchhoff(1.0, 0.3, plane="stress")
    body = am.Body(am.box((1, 1), 2), law, name="sheet")
    supports = [am.Fix("sheet.left", (0, None)), am.Fix("sheet.right", (0.5, None)),
                am.Fix("sheet.bottom", (None, 0)), am.Fix("sheet.top", (None, 0.5))]
    with pytest.raises(am.NotConverged, match="SaintVenantKirchhoff does not resist"):
        am.solve(am.Model([body], supports, []))


def test_small_strains_with_finite_kinematics_that_press_a_cell_flat_are_told():
    """Linear elasticity has no thickness that it keeps."""
    block = am.Body(am.box((1, 1), 2), am.LinearElastic(1.0, 0.3), name="block")
    plane = am.Contact("block.left", am.Plane((1, 0), (-5, 0)), mu=0, kinematics="finite")
    for down, count in ((0.3, 0), (0.6, 1)):
        supports = [am.Fix("block.bottom", 0), am.Fix("block.top", (0, -down))]
        solution = am.solve(am.Model([block], supports, [plane]))
        assert len(told(solution)) == count


def test_a_corner_inside_out_is_told_though_the_solve_converged():
    """Sides that bulge over a bonded plate fold round its end."""
    body = am.Body(am.box((1, 1), 4), am.MooneyRivlin(0.2, 0.1, 50.0), name="pad")
    for down, count in ((0.1, 0), (0.5, 1)):
        solution = am.solve(am.Model(
            [body], [am.Fix("pad.bottom", 0), am.Fix("pad.top", (0, -down))], []))  # fmt: skip
        found = [w.message for w in solution.warnings if w.name == "cells-inside-out"]
        assert len(found) == count
        assert all("the corner at (" in message and "'pad'" in message for message in found)
