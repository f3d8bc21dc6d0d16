"""Calls of all kinds of cells, forms and methods on tiny problems, to see what compiles."""

import itertools
from dataclasses import replace

import amontons as am

METHODS = (
    am.GaussSeidel, am.SemismoothNewton, am.AcceleratedGradient, am.InteriorPoint, am.ActiveSet,
    am.ProximalPoint, am.SmoothingNewton, am.Uzawa, am.Jacobi, am.Hybrid, am.ContactMultigrid,
)  # fmt: skip
BOXES = (
    ((1, 1), (2, 2), ("quad", "tri")),
    ((1, 1, 1), (2, 2, 2), ("hex", "tet")),
)


def models():
    """An elastic box on a plane of every dimension, kind of cell, order and law."""
    for sides, cells, kinds in BOXES:
        dim = len(sides)
        laws = am.LinearElastic(young=200, poisson=0.3), am.NeoHookean(young=200, poisson=0.3)
        for kind, order, law in itertools.product(kinds, (1, 2), laws):
            body = am.Body(am.box(sides, cells=cells, kind=kind), law, order=order)
            floor = am.Plane(normal=(0,) * (dim - 1) + (1,))
            yield am.Model(
                [body],
                supports=[am.Fix("top", (0.01,) * (dim - 1) + (-0.02,))],
                contacts=[am.Contact("bottom", floor, mu=0.5)],
            )


def on_levels():
    """Bodies for multigrid: in 2D, with padding, and in 3D, without levels as from a file."""
    for dim, known in ((2, True), (3, False)):
        box = am.box((1,) * dim, cells=(8,) * dim)
        up = (0,) * (dim - 1) + (1,)
        yield am.Model(
            [am.Body(box if known else replace(box, grid=None, levels=()),
                     am.LinearElastic(young=200, poisson=0.3))],
            supports=[am.Fix("top", (0.01,) * (dim - 1) + (-0.02,))],
            contacts=[am.Contact("bottom", am.Plane(normal=up), mu=0.5)],
        )  # fmt: skip


def attempt(what, *arguments):
    """Call; what is refused needs no kernel."""
    try:
        am.solve(*arguments)
    except am.AmontonsError as error:
        print(what, type(error).__name__, str(error)[:100])


def sliding():
    """Two bodies that slide far over each other, in 2D and 3D."""
    for dim, kind in ((2, "quad"), (3, "hex"), (3, "tet")):
        wide, narrow = (2,) * (dim - 1) + (1,), (1,) * dim
        lower = am.Body(am.box(wide, 2, origin=(-0.4,) * (dim - 1) + (-1,), kind=kind),
                        am.NeoHookean(1, 0.3), name="lower")  # fmt: skip
        upper = am.Body(am.box(narrow, 2, kind=kind), am.NeoHookean(10, 0.3), name="upper")
        push = am.Fix("upper.top", (0.02,) * (dim - 1) + (-0.02,))
        pair = am.Contact("upper.bottom", master="lower.top", mu=0.3)
        yield am.Model([lower, upper], [am.Fix("lower.bottom", 0), push], [pair])


def fall(until, **friction):
    """Stones and a ball on the ground."""
    stones = [
        am.RigidBody(am.cuboid((0.05, 0.2, 0.5)), density=2000, position=(0.2 * k, 0, 0.25))
        for k in range(2)
    ]
    ball = am.RigidBody(am.Ball(0.08), density=8000, position=(-0.15, 0, 0.45),
                        velocity=(2, 0, 0))  # fmt: skip
    bodies = [ball] if "rolling" in friction else [*stones, ball]
    system = am.RigidBodies(bodies, [am.Plane((0, 0, 1))], mu=0.5, **friction)
    for _ in am.evolve_rigid(system, step=2e-3, until=until):
        pass


def problems():
    """Two contacts in 2D and in 3D."""
    import numpy as np

    for dim in (2, 3):
        W = np.eye(2 * dim) + 0.1
        q = np.array([[-1, 0.5, 0.2][:dim], [-0.5, 0.1, 0.1][:dim]])
        yield am.FrictionProblem.from_delassus(W=W, q=q, mu=[0.3, 0.3])
        yield am.FrictionProblem.from_delassus(W=-W, q=q, mu=[0.3, 0.3])  # what failures ask


def main():
    """Solve them all."""
    for problem in problems():
        for method in METHODS:
            attempt(method.__name__, problem, method())
        attempt("adaptive", problem, am.GaussSeidel(batch=am.Batch.ADAPTIVE))
    for model in on_levels():
        attempt("levels", model, am.ContactMultigrid())
    for model in (*models(), *sliding()):
        attempt("model", model)
    fall(0.2)
    fall(0.4, rolling=0.005, torsion=0.002)


if __name__ == "__main__":
    main()
