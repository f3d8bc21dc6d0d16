"""A body that meets itself, small strains that slide far, and the laws of sliding pairs."""


import numpy as np
import pytest
from folded_meshes import ARM, hairpin
from tangent_checker import checked_tangents

import amontons as am
from amontons.mechanics.model.large_deformation import large_deformation, large_step

NEO, LINEAR = am.NeoHookean(1.0, 0.3), am.LinearElastic(1.0, 0.3)


# ------------------------------------------------------------------------ folded beam
def test_sides_of_a_folded_beam_are_found():
    """Across a gap that is wider than the beam is thick; then as with sides given by hand."""

    def down(x, t):
        return -0.4 * min(t, 1)

    beam = am.Body(hairpin(), NEO, name="beam")
    supports = [am.Fix("left", 0), am.Fix("press", (0, down))]
    found = am.find_contacts([beam], itself=True, gap=0.35, mu=0.3)
    assert len(found) == 1
    by_hand = am.Model([beam], supports, [am.Contact("high", master="low", mu=0.3)])
    forces = []
    for model in (am.Model(found.bodies, supports, found.contacts), by_hand):
        *_, step = am.evolve(model, am.QuasiStatic(0.25), until=1.0)
        forces.append(np.abs(np.ravel(step.resultant())))
    assert forces[0][1] > 0.01
    np.testing.assert_allclose(forces[0], forces[1], rtol=0.02, atol=1e-4)


def test_a_folded_beam_meets_itself_and_slides():
    """Its arms are pressed together, one is pulled along the other; forces balance."""

    def along(x, t):
        return 0.5 * max(t - 1, 0)

    def down(x, t):
        return -0.45 * min(t, 1)

    mesh = hairpin()
    model = am.Model([am.Body(mesh, NEO, name="beam")],
                     [am.Fix("left", 0), am.Fix("press", (along, down))],
                     [am.Contact("high", master="low", mu=0.3)])  # fmt: skip
    closed, counts = [], []
    for step in am.evolve(model, am.QuasiStatic(0.1), until=1.6):
        counts.append(step.solution.convergence.iterations)
        parts = large_deformation(step.model).parts
        u = step.state.displacement.reshape(parts.X.shape)
        spread = parts.meet(u).columns(step.frames) @ step.state.force.ravel()
        size = np.abs(spread).sum()
        assert np.abs(spread.reshape(-1, 2).sum(axis=0)).max() <= 1e-12 * size
        closed.append(int((step.state.force[:, 0] > 0).sum()))
        moved = parts.X + u  # the arms do not pass through each other
        high, low = (moved[mesh.surface_nodes(name)] for name in ("high", "low"))
        flat = low[low[:, 0] < ARM]
        under = np.interp(high[:, 0], *flat[np.argsort(flat[:, 0])].T)
        assert (high[:, 1] - under > -0.02)[high[:, 0] < 1.5].all()
    assert closed[0] == 0
    assert closed[9] >= 2
    assert closed[-1] >= 1
    assert np.mean(counts) <= 6


@pytest.mark.parametrize(("law", "sides"), [(NEO, ("top", "low")), (LINEAR, ("top", "top"))])
def test_a_surface_is_its_own_master_as_a_whole_or_not_at_all(law, sides):
    """And with small strains not at all, where pairs do not change."""
    body = am.Body(hairpin(), law, name="beam")
    pair = am.Contact(sides[0], master=sides[1], mu=0.1)
    with pytest.raises(am.InvalidInput, match="name the two sides as separate surfaces"):
        am.solve(am.Model([body], [am.Fix("left", 0)], [pair]))


# --------------------------------------------------------------------- small strains
def blocks(law, top, order=1, **options):
    lower = am.Body(am.box((3, 1), (8, 3), origin=(-0.5, -1)), law, name="lower", order=order)
    upper = am.Body(am.box((1, 1), 3), law, name="upper", order=order)
    pair = am.Contact("upper.bottom", master="lower.top", kinematics="finite", **options)
    return am.Model([lower, upper], [am.Fix("lower.bottom", 0), am.Fix("upper.top", top)],
                    [pair])  # fmt: skip


def test_small_strains_slide_far():
    """A block pressed by 1e-4 and dragged by its width: the force stays mu N.

    Pairs are found again on the way: contact found once would end where the block began.
    """

    def along(x, t):
        return 1.0 * max(t - 1, 0)

    def down(x, t):
        return -1e-4 * min(t, 1)

    model = blocks(LINEAR, (along, down), mu=0.3)
    steps = list(am.evolve(model, am.QuasiStatic(0.1), until=2.0))
    forces = [np.einsum("pkc,pk->pc", s.frames, s.state.force).sum(axis=0) for s in steps]
    first, last = forces[len(forces) // 2 + 1], forces[-1]
    for force in (first, last):
        assert abs(force[0] / force[1] + 0.3) < 1e-3
    assert abs(last[1] / first[1] - 1) < 0.1  # as far from one end as from the other before
    assert np.mean([s.solution.convergence.iterations for s in steps]) <= 6


# -------------------------------------------------------------------------------- laws
def test_shear_stays_below_a_cap():
    cap = 0.002
    model = blocks(NEO, (0.05, -0.05), mu=0.3, cap=cap)
    solution = am.solve(model)
    assert (solution.pressure > 2 * cap / 0.3).all()
    fields = solution.fields
    at = model.bodies[1].mesh.points[fields.node] + solution.displacement[1][fields.node]
    order = np.argsort(at[:, 0])
    edge = np.linalg.norm(np.diff(at[order], axis=0), axis=1)
    area = 0.5 * (np.append(edge, 0.0) + np.append(0.0, edge))  # of now
    shear = np.abs(solution.shear[:, 0] * fields.weights)[order]
    np.testing.assert_allclose(shear, cap * area, rtol=1e-4)


def test_the_tangent_with_a_cap_is_exact():
    model = blocks(NEO, 0, mu=0.3, cap=0.002)
    rng = np.random.default_rng(3)
    dofs = large_deformation(model).parts.X.size
    problem = large_step(model, np.zeros(dofs), np.zeros(dofs),
                         0.02 * rng.standard_normal(dofs))  # fmt: skip
    draws = (rng.standard_normal((2, problem.unknowns)) * [[0.03], [1.0]] for _ in range(10))
    assert checked_tangents(problem, draws) > 5


def test_a_held_node_may_pass_beside_the_master():
    """Ends of both blocks are held, one lower in the end than the side that it has left."""

    def along(x, t):
        return 3.2 * min(t, 1)

    def down(x, t):
        return 0.02 - 0.3 * max(t - 1, 0)

    lower = am.Body(am.box((2, 1), (5, 3), origin=(0, -1)), NEO, name="lower")
    upper = am.Body(am.box((1, 1), 3), NEO, name="upper")
    model = am.Model([lower, upper],
                     [am.Fix("lower.left", 0), am.Fix("upper.left", (along, down))],
                     [am.Contact("upper.bottom", master="lower.top", mu=0.1)])  # fmt: skip
    steps = list(am.evolve(model, am.QuasiStatic(0.25), until=2.0))
    assert all((step.state.force == 0).all() for step in steps)
