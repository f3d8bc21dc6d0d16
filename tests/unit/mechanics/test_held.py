"""What supports hold: decided by their form, judged at every time, the same for all methods."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.core.expressions import Expression
from amontons.mechanics.model.timing import AtTime, is_timed, lasting
from amontons.mechanics.steps import MoreauJean, QuasiStatic, at_rest, evolve
from amontons.mechanics.steps.system import Motion
from amontons.mechanics.steps.timed import growth_in_words

STEEL = am.LinearElastic(200.0, 0.3, density=1.0)
METHODS = ("nodal", "mortar")
FLOOR = am.Plane((0, 0, 1))


def moved(mesh, by):
    return am.Mesh(mesh.points + np.array(by), mesh.cells, mesh.surfaces)


def pair(supports, method, mu=0.2, cells=(2, 3)):
    """A slave s on a master m whose meshes do not match; `supports` beside their far ends."""
    s = am.Body(am.box((1, 1, 1), cells[0]), STEEL, name="s")
    m = am.Body(moved(am.box((1, 1, 1), cells[1]), (0, 0, -1)), STEEL, name="m")
    held = [am.Fix("s.top", (0, 0, lambda x, t: -0.01 * t)), am.Fix("m.bottom", 0.0)]
    contact = am.Contact("s.bottom", master="m.top", mu=mu, method=method)
    return am.Model([s, m], held + supports, [contact])


def forces(model, until=1.0, step=1.0):
    return [s.resultant() for s in evolve(model, QuasiStatic(step), until=until)]


# ------------------------------------------------------------------ what is held for good
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("way", [lambda x, t: 0.01 * t, Expression("0.01*t"), 0.01])
def test_sides_held_alike_at_time_zero_and_then_moved_slide(method, way):
    """Held to 0 on both sides at t = 0, one of them is moved: friction is mu N."""
    model = pair([am.Fix("s.bottom", (None, way, None)), am.Fix("m.top", (None, 0, None))],
                 method)  # fmt: skip
    (force,) = forces(model)
    assert force[1] == pytest.approx(-0.2 * force[2], rel=2e-3)  # but for slip across


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("way", [lambda x, t: 0.01 * t, 0.01, 0.0])
def test_sides_moved_together_do_not_slide(method, way):
    model = pair([am.Fix(on, (None, way, None)) for on in ("s.bottom", "m.top")], method)
    (force,) = forces(model)
    assert abs(force[1]) < 1e-9 * force[2]


@pytest.mark.parametrize("method", METHODS)
def test_moved_together_then_apart(method):
    """The same value at several times says nothing either."""
    late = pair([am.Fix("s.bottom", (None, lambda x, t: 0.01 * max(t - 1, 0), None)),
                 am.Fix("m.top", (None, lambda x, t: 0.0, None))], method)  # fmt: skip
    first, second = forces(late, until=2)
    assert abs(first[1]) < 1e-9 * first[2]
    assert second[1] == pytest.approx(-0.2 * second[2], rel=5e-3)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("later", [0.01, 0.012, 0.006])
def test_held_after_sliding_the_shear_stays(method, later):
    """Nothing moves along y any more: it is as it was, or as much as less pressure allows."""
    model = pair([am.Fix("s.bottom", (None, lambda x, t: 0.01 * min(t, 1), None)),
                  am.Fix("m.top", (None, 0, None))], method)  # fmt: skip
    press = am.Fix("s.top", (0, 0, lambda x, t: -np.interp(t, [0, 1, 2], [0, 0.01, later])))
    model = replace(model, supports=[press, *model.supports[1:]])
    first, second = evolve(model, QuasiStatic(1.0), until=2)
    assert second.solution.converged
    bound = 0.2 * second.state.force[:, 0] * (1 + 1e-6)
    shear = np.linalg.norm(second.state.force[:, 1:], axis=1)
    assert (shear <= bound).all()
    before, now = first.resultant(), second.resultant()
    expected = before[1] if later >= 0.01 else -0.2 * now[2]
    assert now[1] == pytest.approx(expected, rel=2e-2)  # but for slip across
    assert second.problem.error(second.solution.r, second.solution.v) <= 1e-8


def press_fit(end, method, mu=0.15):
    """A quarter of a shaft in a hub, pressed together, the shaft pulled at z = 0."""

    def ring(inner, outer, cells):
        box = am.box((1, 1, 1), cells)
        r, angle = inner + (outer - inner) * box.points[:, 0], box.points[:, 1] * np.pi / 2
        names = {"inner": "left", "outer": "right", "y0": "front", "x0": "back",
                 "z0": "bottom", "z1": "top"}  # fmt: skip
        points = np.stack([r * np.cos(angle), r * np.sin(angle), 30 * box.points[:, 2]], axis=1)
        return am.Mesh(points, box.cells, {k: box.surfaces[v] for k, v in names.items()})

    steel = am.LinearElastic(210e3, 0.3)
    bodies = [am.Body(ring(10, 20.02, (2, 8, 6)), steel, name="shaft"),
              am.Body(ring(20, 40, (3, 6, 5)), steel, name="hub")]  # fmt: skip
    planes = (("y0", (None, 0, None)), ("x0", (0, None, None)))
    supports = [am.Fix(f"{name}.{on}", v) for name in ("shaft", "hub") for on, v in planes]
    supports += [am.Fix("shaft.z0", (None, None, lambda x, t: -0.02 * max(0, t - 1))),
                 am.Fix(f"hub.{end}", (None, None, 0.0))]  # fmt: skip
    contact = am.Contact("shaft.outer", master="hub.inner", mu=mu, method=method)
    return am.Model(bodies, supports, [contact])


@pytest.mark.parametrize("end", ["z0", "z1"])
def test_a_shaft_is_pulled_out_with_all_of_its_friction(end):
    """Also where the hub is held at the end at which the shaft is pulled."""
    steps = list(evolve(press_fit(end, "mortar"), QuasiStatic(1.0), until=3))
    fields = steps[-1].fields
    normal = (fields.pressure * fields.weights).sum()
    assert steps[-1].resultant()[2] == pytest.approx(0.15 * normal, rel=1e-6)
    held = (fields.points[:, 2] == 0) if end == "z0" else np.zeros(len(fields.gap), dtype=bool)
    assert held.sum() == (9 if end == "z0" else 0)
    assert (np.linalg.norm(fields.shear, axis=1)[held] > 0.1 * fields.pressure[held]).all()


def test_a_component_held_off_a_plane_of_symmetry_keeps_its_shear():
    """Uniform shear in a 3D patch whose side faces are held: no plane but sheared ones.

    Reactions of sticking contacts at held edges are not unique, displacements are.
    """
    shear = 1e-4
    slope = 2 * 1.3 * shear / 200  # shear over the shear modulus

    def along(x):
        return (0, slope * x[2], None)

    supports = [am.Fix(f"{body}.{side}", along) for body in ("s", "m")
                for side in ("left", "right", "front", "back")]  # fmt: skip
    supports += [am.Fix("s.top", lambda x: (0, slope * x[2], -1e-3)),
                 am.Fix("m.bottom", lambda x: (0, slope * x[2], 0))]  # fmt: skip
    loads = [am.Traction(f"{body}.{side}", (0, 0, way * shear)) for body in ("s", "m")
             for side, way in (("front", -1), ("back", 1))]  # fmt: skip
    model = replace(pair([], "mortar", mu=0.5), supports=supports, loads=loads)
    fields = am.solve(model, tolerance=1e-11).fields
    for body, part in zip(model.bodies, fields.displacement, strict=True):
        exact = slope * body.mesh.points[:, 2]
        np.testing.assert_allclose(part[:, 1], exact, atol=1e-9 * slope)


# ------------------------------------------------------------------ held nodes pushed in
def edge(x, t):
    return (None, None, -0.1 * t) if x[0] < 1e-9 else (None, None, None)


def pushed(method, value=edge, **parts):
    body = am.Body(am.box((1, 1, 1), 3), STEEL)
    return am.Model([body], [am.Fix("top", (0, 0, -0.01)), am.Fix("bottom", value)],
                    [am.Contact("bottom", FLOOR, mu=0.2, method=method)], **parts)  # fmt: skip


REFUSED = r"contact on 'bottom': at t = 0.5 supports hold the node at \[0.0.*fix on 'bottom'.*"


@pytest.mark.parametrize("method", [*METHODS, "nitsche"])
def test_supports_that_push_a_held_node_in_are_refused_when_they_do(method):
    steps = evolve(pushed(method, lambda x, t: edge(x, max(t - 0.25, 0))), QuasiStatic(0.25),
                   until=1)  # fmt: skip
    assert next(steps).time == 0.25
    with pytest.raises(am.InvalidInput, match=REFUSED + "push it 0.025 into"):
        next(steps)
    out = list(evolve(pushed(method, lambda x, t: edge(x, -t)), QuasiStatic(0.5), until=1))
    assert len(out) == 2


def test_dynamics_refuse_it_too():
    method = MoreauJean(step=0.25, theta=1.0)
    steps = evolve(pushed("nodal", lambda x, t: edge(x, max(t - 0.25, 0))), method, until=1)
    next(steps)
    with pytest.raises(am.InvalidInput, match=REFUSED):
        next(steps)


@pytest.mark.parametrize("method", [*METHODS, "nitsche"])
def test_two_bodies_held_on_both_sides(method):
    """Pushed into each other they are refused, drawn apart they are not."""

    def model(speed):
        ways = [am.Fix("s.bottom", lambda x, t: edge(x, speed * t)),
                am.Fix("m.top", lambda x, t: edge(x, 0.0))]  # fmt: skip
        return pair(ways, method)

    with pytest.raises(am.InvalidInput, match=r"at t = 1 supports hold.*'s.bottom'.*push it 0"):
        forces(model(1.0))
    assert len(forces(model(-0.1))) == 1


def test_a_held_node_on_a_free_master_may_push():
    """The master gives way: that is contact."""
    model = pair([am.Fix("s.bottom", lambda x, t: edge(x, 0.1 * t))], "nodal")
    assert forces(model)[0][2] > 0


def test_held_nodes_are_judged_at_the_load_factor_that_is_applied():
    model = pushed("nodal", lambda x: (None, None, 0.2) if x[0] < 1e-9 else (None,) * 3)
    assert am.solve(model).converged
    with pytest.raises(am.InvalidInput, match="'bottom': supports hold the node.*push it 0.2"):
        am.solve(model.with_load(-1.0))
    below = pushed("nodal", lambda x: (None, None, -0.2) if x[0] < 1e-9 else (None,) * 3)
    with pytest.raises(am.InvalidInput, match=r"push it 0.2"):
        am.solve(below)
    assert am.solve(below.with_load(-1.0)).converged
    steps = evolve(below, QuasiStatic(0.5), until=1)
    with pytest.raises(am.InvalidInput, match=r"at t = 0.5 supports.*push it 0.1"):
        next(steps)


def test_at_finite_strains_the_moved_place_counts():
    """Held at the side of a ball and moved along it, a node meets the ball farther up."""
    body = am.Body(am.box((1, 1), 2, origin=(0, 0.1)), am.NeoHookean(100, 0.3))
    contact = am.Contact("bottom", am.Sphere((0.5, -1), 1.15), mu=0.1)

    def model(way):
        corner = am.Fix("bottom", lambda x: (way, 0) if x[0] < 1e-9 else (None, None))
        return am.Model([body], [am.Fix("top", (way, 0)), corner], [contact])

    assert am.solve(model(-0.1)).converged
    with pytest.raises(am.InvalidInput, match=r"push it 0.05 into"):
        am.solve(model(0.5))


def test_nodes_that_take_no_part_are_not_judged():
    model = pushed("nodal")
    contact = replace(model.contacts[0], where=lambda points: points[:, 0] > 0.1)
    assert len(forces(replace(model, contacts=[contact]))) == 1


# ------------------------------------------------------------------ structure and time
@pytest.mark.parametrize(("late", "words"), [
    (False, "component 0 at .* is held at t = 0 and free at t = 1"),
    (True, "component 0 at .* is free at t = 0 and held at t = 1"),
])  # fmt: skip
@pytest.mark.parametrize("method", [QuasiStatic(0.5), MoreauJean(0.5)])
def test_supports_that_come_or_go_are_refused(late, words, method):
    body = am.Body(am.box((1, 1), 2), STEEL)

    def top(x, t):
        return (0 if (t > 0.7) == late else None, -0.1 * t)

    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.2)
    model = am.Model([body], [am.Fix("top", top)], [contact])
    steps = evolve(model, method, until=1)
    next(steps)
    with pytest.raises(am.InvalidInput, match=f"fix on 'top': {words}"):
        next(steps)


def test_functions_of_time_are_taken_at_zero_without_one():
    body = am.Body(am.box((1, 1), 2), STEEL)
    model = am.Model([body], [am.Fix("top", (0, lambda x, t: -0.1 - t))],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0.2)])  # fmt: skip
    still = replace(model, supports=[am.Fix("top", (0, -0.1))])
    np.testing.assert_allclose(am.solve(model).resultant, am.solve(still).resultant, atol=1e-9)
    again = Motion(Motion(model).body)  # the assembled form still knows its time
    np.testing.assert_allclose(again.prescribed(1.0).min(), -1.1)


def test_what_lasts_is_read_from_the_form():
    assert lasting((0, None, lambda x, t: 0.0)) == [0, None, None]
    assert lasting(2.0) == 2.0
    assert lasting(lambda x, t: (0, 0))(np.zeros(2)) == [None, None]
    assert is_timed(AtTime(lambda x, t: t, 0.0))
    assert not is_timed(lambda x: x)


@pytest.mark.parametrize("start", [None, at_rest])
def test_the_first_quasi_static_step_is_the_static_solution(start):
    """Friction counts the way of held contact nodes from the undeformed state, to any share."""
    body = am.Body(am.box((1, 1), 2), STEEL)
    supports = [am.Fix("top", (0, -0.1)), am.Fix("bottom", (0.05, None))]
    model = am.Model([body], supports, [am.Contact("bottom", am.Plane((0, 1)), mu=0.2)])
    begin = None if start is None else start(model)
    half, whole = evolve(model, QuasiStatic(0.5), until=1, start=begin)
    static = am.solve(model).resultant
    assert static[0] == pytest.approx(-0.2 * static[1])
    np.testing.assert_allclose(half.resultant(), static / 2, rtol=1e-6)
    np.testing.assert_allclose(whole.resultant(), static, rtol=1e-6)
    more = am.Fix("right", (None, lambda x, t: -0.1 * x[1]))
    timed = replace(model, supports=[*supports, more])
    (one,) = evolve(timed, QuasiStatic(1.0), until=1)
    np.testing.assert_allclose(one.resultant(), am.solve(timed).resultant, rtol=1e-6)


def test_a_wave_is_no_straight_line():
    """Zero at both ends and in the middle: the load between them counts."""
    body = am.Body(am.box((1, 1), 2), STEEL)
    wave = am.Fix("top", (0, lambda x, t: -0.1 * np.sin(2 * np.pi * t)))
    contact = [am.Contact("bottom", am.Plane((0, 1)), mu=0.2)]
    with pytest.raises(am.InvalidInput, match="no straight line in time"):
        Motion(am.Model([body], [wave], contact)).straight((0.0, 1.0), "so")
    line = am.Fix("top", (0, lambda x, t: -0.1 * t))
    assert Motion(am.Model([body], [line], contact)).straight((0.0, 1.0), "so")


@pytest.mark.parametrize(("supports", "loads", "words"), [
    ([am.Fix("top", (0, -1))], [], "nothing depends on the time t"),
    ([am.Fix("top", (0, Expression("-t")))], [], ""),
    ([am.Fix("top", (0, Expression("-t")))], [am.Traction("left", (1, 0))],
     "full from the first step on: traction on 'left'"),
    ([am.Fix("top", (0.1, None))], [am.BodyForce((0, lambda x, t: t)), am.BodyForce((0, 0))],
     "full from the first step on: fix on 'top'"),
])  # fmt: skip
def test_words_for_how_loads_grow(supports, loads, words):
    body = am.Body(am.box((1, 1), 2), STEEL)
    model = am.Model([body], supports, [am.Contact("bottom", am.Plane((0, 1)), mu=0.2)], loads)
    found = growth_in_words(model)
    assert words in found
    assert bool(found) == bool(words)
