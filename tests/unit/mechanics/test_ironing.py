"""A round die pressed into a slab and dragged over it: both deform a lot, mu = 0.3."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.meshes import Facets
from amontons.solvers.newton import linear_steps, predictors


def die(cells, radius=1.0):
    """A block of 1.2 x 0.75 with a round underside, its lowest point at (1.5, 2)."""
    mesh = am.box((1.2, 0.75), cells)
    x, y = mesh.points[:, 0] - 0.6, mesh.points[:, 1]
    y = y + (radius - np.sqrt(radius**2 - x**2)) * (1 - y / 0.75)
    return replace(mesh, points=np.stack([x + 1.5, y + 2.0], axis=1))


def ironing(slab, cells, *, swap):
    """Pressed in by 0.4 until t = 1, then dragged at 0.1 per unit of time."""
    low = am.Body(am.box((4, 2), slab), am.NeoHookean(1.0, 0.32), name="slab")
    up = am.Body(die(cells), am.NeoHookean(10.0, 0.32), name="die")
    sides = ("die.bottom", "slab.top")[:: -1 if swap else 1]

    def along(x, t):
        return 0.1 * max(t - 1, 0)

    def down(x, t):
        return -0.4 * min(t, 1)

    return am.Model([low, up], [am.Fix("slab.bottom", 0), am.Fix("die.top", (along, down))],
                    [am.Contact(sides[0], master=sides[1], mu=0.3)])  # fmt: skip


def dragged(model, swap):
    """(forces (steps, 2) on the die, Newton steps) of four steps in and eight along."""
    steps = list(am.evolve(model, am.QuasiStatic(0.25), until=1.0))
    steps += list(am.evolve(model, am.QuasiStatic(0.5), until=5.0, start=steps[-1].state))
    forces = [np.einsum("pkc,pk->pc", s.frames, s.state.force).sum(axis=0) for s in steps]
    counts = [s.solution.convergence.iterations for s in steps]
    return np.array(forces) * (-1 if swap else 1), np.array(counts)


def test_who_is_the_master_matters_less_on_finer_meshes():
    """The force while dragging, with either side as the master."""
    apart = []
    for slab, cells in (((16, 8), (8, 5)), ((34, 17), (17, 11))):
        (one, first), (other, second) = (
            dragged(ironing(slab, cells, swap=swap), swap) for swap in (False, True)
        )
        assert max(first.mean(), second.mean()) <= 6
        apart.append(np.abs(one - other)[4:].max(axis=0) / np.abs(one).max(axis=0))
        assert (one[4:, 1] > 0).all()
        assert (one[8:, 0] < -0.25 * one[8:, 1]).all()
    assert apart[1].max() < 0.01
    assert (apart[1] < 0.5 * apart[0]).all()


def coming_down(slab, cells):
    """A die that comes down by 0.1 until t = 1, then goes along by 0.1 per unit of time."""
    low = am.Body(am.box((3, 2), slab), am.NeoHookean(1.0, 0.32), name="slab")
    up = am.Body(die(cells), am.NeoHookean(10.0, 0.32), name="die")
    top = lambda x, t: 0.1 * max(t - 1, 0), lambda x, t: -0.1 * min(t, 1)  # noqa: E731
    return am.Model([low, up], [am.Fix("slab.bottom", 0), am.Fix("die.top", top)],
                    [am.Contact("die.bottom", master="slab.top", mu=0.3)])  # fmt: skip


@pytest.mark.parametrize("cells", [20, 60])
def test_newton_steps_do_not_grow_with_contacts(cells):
    """Two steps down, one along; by the tangent alone up to 8 and 14 Newton steps."""
    model = coming_down((cells, 6), (cells, 4))
    steps = list(am.evolve(model, am.QuasiStatic(0.5), until=1.5))
    counts = [step.solution.convergence.iterations for step in steps]
    assert max(counts) <= 7
    assert min((step.state.force[:, 0] > 0).sum() for step in steps) >= cells / 5


def pressed_beyond_its_rim(cells, *, swap):
    """A die whose sides are in the contact, too; pressed in by its height until t = 1."""
    low = am.Body(am.box((6, 2), (20, 6)), am.NeoHookean(1.0, 0.32), name="slab")
    mesh = am.box((1.2, 1.0), cells)
    x, y = mesh.points[:, 0] - 0.6, mesh.points[:, 1]
    y = y + (1 - np.sqrt(1 - x**2)) * (1 - y)
    outline = [f.nodes for side in ("bottom", "left", "right") for f in mesh.surface(side)]
    surfaces = dict(mesh.surfaces) | {"bottom": (Facets("line", np.concatenate(outline)),)}
    mesh = replace(mesh, points=np.stack([x + 1.5, y + 2.0], axis=1), surfaces=surfaces)
    up = am.Body(mesh, am.NeoHookean(10.0, 0.32), name="die")
    top = lambda x, t: 0.5 * max(t - 1, 0), lambda x, t: -min(t, 1)  # noqa: E731
    slave, master = ("die.bottom", "slab.top")[:: -1 if swap else 1]
    return am.Model([low, up], [am.Fix("slab.bottom", 0), am.Fix("die.top", top)],
                    [am.Contact(slave, master=master, mu=0.3)])  # fmt: skip


@pytest.mark.parametrize("swap", [False, True])
def test_supports_that_move_onto_nodes_at_rest_make_points_of_facets(swap):
    """In the second step, before any solution: no state to warn of."""
    model = pressed_beyond_its_rim((4, 2), swap=swap)
    with np.errstate(divide="raise", invalid="raise"):
        steps = list(am.evolve(model, am.QuasiStatic(0.2), until=0.4))
    assert max(step.solution.convergence.iterations for step in steps) <= 8
    forces = [step.reaction.reshape(-1, 2)[:147].sum(axis=0) for step in steps]
    assert (np.array(forces)[:, 1] > 0).all()


def test_large_bodies_begin_with_cycles_of_multigrid(monkeypatch):
    """Where these do not get there, the tangent does, by more Newton steps."""
    low = am.Body(am.box((3, 1.6, 1), (12, 8, 3)), am.NeoHookean(1.0, 0.32), name="slab")
    mesh = am.box((0.8, 1.0, 0.5), (8, 8, 2), origin=(1.0, 0.3, 1.0))
    points = mesh.points.copy()
    points[:, 2] += (points[:, 0] - 1.4) ** 2 * (1.5 - points[:, 2])
    up = am.Body(replace(mesh, points=points), am.NeoHookean(10.0, 0.32), name="die")
    held = am.Fix("slab.bottom", 0), am.Fix("die.top", (0.02, 0, -0.04))
    model = am.Model([low, up], held, [am.Contact("die.bottom", master="slab.top", mu=0.3)])
    monkeypatch.setitem(linear_steps.LARGE, 3, 1_000)

    def solved():
        return next(iter(am.evolve(model, am.QuasiStatic(1.0), until=1.0)))

    first = solved()
    monkeypatch.setattr(predictors, "CYCLES", 0)
    monkeypatch.setattr(predictors, "ROUGH", 0.0)
    other = solved()
    counts = [step.solution.convergence.iterations for step in (first, other)]
    assert counts[0] <= 5 < counts[1], counts
    size = np.abs(first.state.force).max()
    np.testing.assert_allclose(other.state.force, first.state.force, atol=1e-6 * size)
