"""Variants of one problem in several threads: the same bits as one after the other."""

import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.model import assembly
from amontons.solvers.driver import drive
from amontons.solvers.newton.joints import Joints


@pytest.fixture(autouse=True)
def quick_turns():
    """Threads take turns after microseconds."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(usual)


def cube(cells=8):
    """The pressed and dragged cube."""
    return am.Model(
        [am.Body(am.box((1, 1, 1), cells=cells), am.LinearElastic(young=200, poisson=0.3))],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )


def bodies():
    """Cubes whose meshes do not match: a one-sided basis with levels of its own."""
    lower = am.Body(am.box((1, 1, 0.5), cells=(6, 6, 4)), am.LinearElastic(80, 0.3), "lower")
    upper = am.Body(
        am.box((0.8, 0.8, 0.5), cells=(4, 4, 4), origin=(0.1, 0.1, 0.5)),
        am.LinearElastic(50, 0.2),
        "upper",
    )
    return am.Model(
        [lower, upper],
        supports=[am.Fix("lower.bottom", (0, 0, 0)), am.Fix("upper.top", (0.02, 0, -0.03))],
        contacts=[am.Contact("upper.bottom", master="lower.top", mu=0.3)],
    )


def contact(problem, solver):
    """What is found, bit by bit."""
    found = drive(problem, solver, tolerance=1e-8)
    assert found.converged, str(found)
    v = () if found.v is None else (found.v,)
    return found.convergence.iterations, found.r, *v


def at_once(problem, works):
    """What works give, each in a thread of its own."""
    with ThreadPoolExecutor(len(works)) as pool:
        gate = Barrier(len(works))  # so that nobody is done before all have a thread
        return list(pool.map(lambda work: (gate.wait(), work(problem))[1], works))


def check(prepared, works, alone=None):
    """Every work alone, then all at once on the same prepared problem, then on a fresh one."""
    alone = alone or [work(prepared) for work in works]
    fresh = prepared.fresh()
    for problem in (prepared, fresh, fresh):
        for expected, found in zip(alone, at_once(problem, works), strict=True):
            for a, b in zip(expected, found, strict=True):
                np.testing.assert_array_equal(a, b)


def loads(problem):
    """Three variants."""
    return [
        lambda p: p,
        lambda p: p.with_load(0.7 * problem.f),
        lambda p: p.with_mu(0.3),
    ]


def linear(problem):
    """A linear solve with the levels that contact multigrid uses."""
    from amontons.linear.geometric import MultigridFactor

    levels = problem.hierarchy
    factor = MultigridFactor(levels, levels.nodes, am.GeometricMultigrid())
    return (factor.solve(problem.f),)


@pytest.mark.parametrize("name", ["stored", "operator", "bodies"])
def test_contact_multigrid_and_linear_solves(name, monkeypatch):
    if name == "operator":
        monkeypatch.setattr(assembly, "GRID_FROM", 1)
    problem = (bodies() if name == "bodies" else cube()).assemble()
    works = [
        lambda p, variant=variant: contact(variant(p), am.ContactMultigrid())
        for variant in loads(problem)
    ]
    check(problem, [*works, linear])


def test_active_set_cycles():
    problem = cube(4).assemble()
    solver = am.ActiveSet(bound="fixed-point", multigrid=am.MultigridCycle())
    works = [
        lambda p, variant=variant: contact(variant(p), solver) for variant in loads(problem)
    ]
    check(problem, works)


@pytest.mark.parametrize("form", ["global", "condensed"])
@pytest.mark.parametrize("make", [lambda: cube(4), lambda: am.SpherePacking(4).problem()])
def test_auto(make, form):
    problem = make()
    problem = problem.assemble() if isinstance(problem, am.Model) else problem
    if form == "condensed":
        problem = problem.condensed()
    load = problem.q if form == "condensed" or problem.f is None else problem.f
    variants = [lambda p: p, lambda p: p.with_load(0.7 * load)]
    works = [lambda p, variant=variant: contact(variant(p), am.Auto()) for variant in variants]
    check(problem, works)


def test_deformable_blocks():
    """A factor goes from one solve to the next in the same thread, and nowhere else."""
    stone = am.LinearElastic(young=2.2e9, poisson=0.2, density=2000)
    wall = am.Wall(3, 2, (0.4, 0.2, 0.2), (4, 2, 2), stone, plate=0.1)
    loads = [am.Traction("plate.top", (0, 0, -1e5)),
             am.Traction("row 2 block 1.left", (2e4, 0, 0))]  # fmt: skip
    step = am.MoreauJean(step=1e-3, theta=1)
    problem = next(am.evolve(wall.model([], loads), step, until=1e-3)).problem.condensed()
    assert Joints.of(problem) is not None
    variants = [lambda p: p, lambda p: p.with_load(0.9 * problem.q)]
    works = [lambda p, variant=variant: contact(variant(p), am.Auto()) for variant in variants]
    alone = [at_once(problem, [work])[0] for work in works]
    check(problem, works, alone)
