"""Newton steps of bodies in contact by multigrid: beside direct factors, and its limits."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.core.errors import SingularOperator
from amontons.linear.condensed import Axes, Condensed, CondensedFactor
from amontons.linear.hierarchy import Hierarchy, Nodes
from amontons.linear.node_blocks import NodeBlocks
from amontons.mechanics.contact.current import STICK
from amontons.mechanics.model.large_deformation import large_deformation
from amontons.solvers.newton import linear_steps
from amontons.solvers.newton.linear_steps import LinearSteps, forcing

NEO = am.NeoHookean(1.0, 0.3)
RUBBER = am.NeoHookean(1.0, 0.499)


def pressed(dim=3, law=NEO, *, pair=True, sides=(), order=1, fine=1):
    """A block pressed by 0.05 onto a slab of other cells, or onto a plane, and moved along."""
    cells = (2 * fine,) * dim
    upper = am.box((1,) * dim, cells)
    shift = np.zeros(dim)
    shift[:] = 0.15
    shift[-1] = 0.0
    upper = replace(upper, points=upper.points + shift)
    bodies = [am.Body(upper, law, name="upper", order=order)]
    down = (0.02, *[0.0] * (dim - 2), -0.05)
    held = [am.Fix("upper.top", down)]
    if not pair:
        normal = np.eye(dim)[-1]
        contacts = [am.Contact("upper.bottom", am.Plane(tuple(normal)), mu=0.3)]
    else:
        origin = (*[0.0] * (dim - 1), -0.5)
        size, cells = (*[1.4] * (dim - 1), 0.5), (*[3 * fine] * (dim - 1), 2)
        below = am.box(size, cells, origin=origin)
        bodies.append(am.Body(below, law, name="lower", order=order))
        held.append(am.Fix("lower.bottom", 0))
        contacts = [am.Contact("upper.bottom", master="lower.top", mu=0.3)]
    held += [am.Fix(side, (None, 0, None)) for side in sides]
    return am.Model(bodies, held, contacts)


def tangent(model, statuses=None):
    """A problem and its linearisation at the solution, or of other pieces there."""
    problem = large_deformation(model)
    v = am.solve(model).v
    if statuses is None:
        return problem, v, problem.linearisation(v)
    return problem, v, problem.linearisation(v, np.full(problem.contacts, statuses, np.int8))


CASES = {
    "3D": {},
    "3D second order": {"order": 2},
    "2D": {"dim": 2, "fine": 3},
    "nearly incompressible": {"law": RUBBER},
    "plane": {"pair": False},
    "plane 2D": {"dim": 2, "pair": False},
    "symmetry": {"sides": ("upper.front",)},
}


@pytest.mark.parametrize("statuses", [None, STICK])
@pytest.mark.parametrize("case", CASES)
def test_solutions_are_those_of_a_direct_factor(case, statuses):
    """Whatever statuses contacts have, and whatever supports hold of them."""
    _, _, here = tangent(pressed(**CASES[case]), statuses)
    b = np.cos(np.arange(here.matrix.shape[0]))
    condensed = Condensed(here.matrix, here.structure)
    assert len(condensed.held) > 0
    factor = CondensedFactor(condensed, condensed.hierarchy(), tolerance=1e-11)
    x, right = factor.solve(b), am.linear.Direct().factor(here.matrix).solve(b)
    assert np.abs(x - right).max() <= 1e-7 * np.abs(right).max()
    assert 0 < factor.iterations < 80


def test_levels_grow_with_the_mesh_and_steps_of_gmres_hardly():
    """As many steps, to a few, on a mesh with seven times the nodes."""
    counts = []
    for fine in (2, 4):
        _, _, here = tangent(pressed(fine=fine))
        condensed = Condensed(here.matrix, here.structure)
        factor = CondensedFactor(condensed, condensed.hierarchy(), tolerance=1e-8)
        factor.solve(np.cos(np.arange(here.matrix.shape[0])))
        counts.append(factor.iterations)
    assert counts[1] <= 1.5 * counts[0] + 4


def test_evolutions_are_the_same(monkeypatch):
    """Load steps by multigrid end where those by direct factors do."""
    ends = []
    for large in (10**9, 1):
        monkeypatch.setitem(linear_steps.LARGE, 3, large)
        solution = am.solve(pressed(fine=2))
        assert solution.converged
        ends.append((solution.r, solution.v, len(solution.convergence.history)))
    (r, v, steps), (again, moved, count) = ends
    assert np.abs(r - again).max() <= 1e-7 * np.abs(r).max()
    assert np.abs(v - moved).max() <= 1e-7 * np.abs(v).max()
    assert count <= steps + 2  # cycles predict to 1e-4


def test_a_body_that_only_contact_holds(monkeypatch):
    """Nothing holds it before it touches: the same answer as by direct factors."""
    upper = am.box((1, 1, 1), (2, 2, 2))
    lower = am.box((2, 2, 1), (3, 3, 2), origin=(-0.5, -0.5, -1))
    ends = []
    for large in (10**9, 1):
        monkeypatch.setitem(linear_steps.LARGE, 3, large)
        model = am.Model(
            [am.Body(upper, NEO, name="upper"), am.Body(lower, NEO, name="lower")],
            [am.Fix("lower.bottom", 0)],
            [am.Contact("upper.bottom", master="lower.top", mu=0.5)],
            [am.Traction("upper.top", (0.005, 0.0, -0.05))],
        )
        solution = am.solve(model)
        assert solution.converged
        ends.append(solution.r)
    assert np.abs(ends[0] - ends[1]).max() <= 1e-6 * np.abs(ends[0]).max()


def test_what_moves_without_resistance_is_found():
    """Levels are refused where open contacts leave a body loose; a direct factor, too."""
    problem, v, _ = tangent(pressed())
    free = replace_supports(pressed())
    loose = large_deformation(free).linearisation(np.zeros(large_deformation(free).unknowns))
    condensed = Condensed(loose.matrix, loose.structure)
    with pytest.raises(SingularOperator, match="without resistance"):
        condensed.hierarchy()
    assert problem.unknowns == len(v)


def replace_supports(model):
    """The model without what holds its upper body."""
    apart = [replace(model.bodies[0], mesh=replace(
        model.bodies[0].mesh, points=model.bodies[0].mesh.points + [0, 0, 0.1]))]  # fmt: skip
    return am.Model([*apart, *model.bodies[1:]], model.supports[1:], model.contacts,
                    [am.Traction("upper.top", (0, 0, -0.01))])  # fmt: skip


def test_a_direct_factor_takes_over(monkeypatch):
    """Where GMRES fails, and to the end of the solve."""
    monkeypatch.setitem(linear_steps.LARGE, 3, 1)
    _, _, here = tangent(pressed())

    def fails(*_):
        raise SingularOperator("no convergence")

    monkeypatch.setattr(CondensedFactor, "solved", fails)
    steps = LinearSteps(None)
    F = np.cos(np.arange(here.matrix.shape[0]))
    x, factor = steps.solved(here, F, 1e-4)
    assert factor.exact
    assert np.abs(here.matrix @ x + F).max() <= 1e-9
    monkeypatch.undo()
    assert steps.solved(here, F, 1e-4)[1].exact


def test_levels_are_kept_while_constraints_stay(monkeypatch):
    """The second solve takes the levels of the first; other constraints need new ones."""
    monkeypatch.setitem(linear_steps.LARGE, 3, 1)
    problem, v, here = tangent(pressed())
    F = np.cos(np.arange(here.matrix.shape[0]))
    steps = LinearSteps(None)
    first = steps.solved(here, F, 1e-4)[1]
    again = steps.solved(problem.linearisation(1.0001 * v), F, 1e-4)[1]
    other = problem.linearisation(v, np.full(problem.contacts, STICK, np.int8))
    assert again.levels is first.levels
    assert steps.solved(other, F, 1e-4)[1].levels is not first.levels


def test_forcing_follows_the_square_of_the_last_ratio():
    """[EW] choice 2 within its bounds."""
    assert forcing([1.0]) == 1e-4
    assert forcing([1.0, 1e-3]) == pytest.approx(1e-7)
    assert forcing([1.0, 0.9]) == 1e-4
    assert forcing([1.0, 1e-9]) == 1e-10


def test_axes_of_slip_stick_and_open():
    """Constraints along the normal of slip, everywhere in stick, nowhere where open."""
    mu, n, t = 0.3, np.array([0.6, 0, 0.8]), np.array([0, 1.0, 0])
    slip = np.eye(3) - np.outer(n, n) - mu * np.outer(t, n)
    found = Axes.of(np.stack([slip, np.zeros((3, 3)), np.eye(3)]), np.ones((3, 3), bool))
    assert found.constrained.sum(axis=1).tolist() == [1, 3, 0]
    assert abs(found.axes[0, :, found.constrained[0]].ravel() @ n) == pytest.approx(1)


def test_axes_leave_held_components_in_their_place():
    """Unknowns and axes keep their numbers where a support holds a component."""
    held = np.array([[True, False, True]])
    n = np.array([0.8, 0, 0.6])
    found = Axes.of((np.eye(3) - np.outer(n, n))[None], held)
    assert found.constrained.sum() == 1
    assert not found.constrained[0, 1]
    assert np.abs(found.axes[0, 1]).max() == 0
    assert np.abs(found.axes[0, :, 1]).max() == 0


def test_aggregates_keep_to_parts():
    """Two chains of nodes tied by springs: a coarse unknown belongs to one of them."""
    n = 200
    chain = sparse.diags_array([-1.0, 2.1, -1.0], offsets=[-1, 0, 1], shape=(n, n))
    both = sparse.block_diag([chain, chain]) + 0.1 * sparse.eye_array(2 * n)
    tie = sparse.eye_array(2 * n, k=n) * 0.05
    matrix = sparse.kron(both - tie - tie.T, sparse.eye_array(3), format="csr")
    A = NodeBlocks.from_sparse(matrix, None, 2 * n)
    modes = np.tile(np.eye(3), (2 * n, 1))
    levels = Hierarchy.of_parts(A, Nodes(np.arange(6 * n), 2 * n), modes, np.repeat([0, 1], n))
    assert len(levels.levels) > 1
    x = levels.solve(0, np.ones((2 * n, 3)), 1e-10, 60)
    assert x[1] < 40
    assert np.abs(matrix @ x[0].ravel() - 1).max() < 1e-8
