"""What a model tells of its unknowns: what else is guessed, and right where that fails."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.linear.bodies import Bodies
from amontons.linear.hierarchy import components
from amontons.problem.one_sided import HELD, one_sided, slave_dofs
from amontons.solvers import ContactMultigrid, SemismoothNewton
from amontons.solvers.driver import drive

SOFT = am.LinearElastic(young=100, poisson=0.3)


def block():
    return am.Model(
        [am.Body(am.box((1, 1, 1), cells=4), SOFT)],
        [am.Fix("top", (0.02, 0, -0.05))],
        [am.Contact("bottom", am.Sphere((0.4, 0.5, -2), 2.0), mu=0.3)],
    )


def quarter():
    """Supports hold single components of nodes, some of them in contact."""
    return am.Model(
        [am.Body(am.box((1, 1, 1), cells=4), SOFT)],
        [am.Fix("left", (0, None, None)), am.Fix("front", (None, 0, None)),
         am.Fix("top", (None, None, -0.05))],
        [am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.2)],
    )  # fmt: skip


def two(cells=(3, 2), method="nodal", dim=3):
    size, up = (1,) * dim, (0,) * (dim - 1) + (1,)
    bodies = [am.Body(am.box(size, cells[0]), SOFT, name="lower"),
              am.Body(am.box(size, cells[1], origin=up), SOFT, name="upper")]  # fmt: skip
    drop = (0.005, -0.05) if dim == 2 else (0, 0.005, -0.05)
    return am.Model(
        bodies,
        [am.Fix("lower.bottom", 0), am.Fix("upper.top", drop)],
        [am.Contact("upper.bottom", master="lower.top", mu=0.2, method=method)],
    )


MODELS = {
    "block": block,
    "quarter": quarter,
    "nodal": two,
    "mortar": lambda: two(method="mortar"),
    "plane": lambda: two(dim=2),
    "several obstacles": lambda: replace(
        block(),
        contacts=[am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.3),
                  am.Contact("left", am.Plane((1, 0, 0), (-0.01, 0, 0)), mu=0.3)],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MODELS)
def test_it_is_what_is_guessed(name):
    problem = MODELS[name]().assemble()
    known, d = problem.structure, problem.dimension
    modes = problem.near_nullspace
    np.testing.assert_array_equal(known.component, components(modes, problem.unknowns, d))
    guessed, told = Bodies.of(problem.M), Bodies.of(problem.M, known.body)
    for a, b in zip(guessed.members, told.members, strict=True):
        np.testing.assert_array_equal(a, b)
    H = sparse.csr_array(problem.H)
    H.eliminate_zeros()
    guess, tell = slave_dofs(problem.M, H, d), slave_dofs(problem.M, H, d, known)
    for a, b in zip(guess, tell, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("name", ["block", "nodal", "mortar"])
def test_the_same_bits_with_and_without_it(name):
    problem = MODELS[name]().assemble()
    for solver in (ContactMultigrid(), SemismoothNewton()):
        told = drive(problem.fresh(), solver, tolerance=1e-9)
        guessed = drive(replace(problem.fresh(), structure=None), solver, tolerance=1e-9)
        np.testing.assert_array_equal(told.r, guessed.r)


def test_equal_meshes_meet_on_the_side_of_the_slave():
    """Rows of both sides have length 1: from H alone it is the body with the lower numbers."""
    model = two((4, 4))
    problem = model.assemble()
    upper = model.discretisation.offsets[1]
    told, guessed = (
        one_sided(p).dofs for p in (problem, replace(problem.fresh(), structure=None))
    )
    free = model.discretisation.free
    assert (free[told[told != HELD]] >= upper).all()
    assert (free[guessed[guessed != HELD]] < upper).all()
    expected = drive(problem, SemismoothNewton(), tolerance=1e-11)
    found = drive(problem, ContactMultigrid(), tolerance=1e-9)
    np.testing.assert_allclose(found.r, expected.r, atol=1e-6 * np.abs(expected.r).max())


def test_directions_without_rigid_modes():
    """Supports have left some nodes one or two unknowns: n does not tell where nodes begin."""
    problem = replace(quarter().assemble().fresh(), near_nullspace=None, levels=())
    guess = components(None, problem.unknowns, 3)
    assert guess is None or (guess != problem.structure.component).any()
    expected = drive(quarter().assemble(), SemismoothNewton(), tolerance=1e-11)
    found = drive(problem, ContactMultigrid(), tolerance=1e-9)
    assert found.converged
    np.testing.assert_allclose(found.r, expected.r, atol=1e-6 * np.abs(expected.r).max())


def test_a_slave_that_can_not_be_one_is_left_to_the_guess():
    """Held against its master, which can slide past it: the master is taken for the slave."""
    held = two((2, 2))
    held = replace(held, supports=[*held.supports, am.Fix("upper.left", (0, None, None))])
    problem = held.assemble()
    basis = one_sided(problem)
    assert basis is not None
    upper = held.discretisation.offsets[1]
    assert (held.discretisation.free[basis.dofs[basis.dofs != HELD]] < upper).all()


def test_its_size_is_checked():
    problem = block().assemble()
    known = problem.structure
    with pytest.raises(am.InvalidInput, match="structure.slave"):
        am.FrictionProblem.from_global(
            problem.M, problem.H, problem.f, problem.w, problem.mu, structure=known.at([0, 1])
        )
