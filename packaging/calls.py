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


def without_levels():
    """A body whose mesh comes from a file, so that multigrid has to find its levels."""
    box = replace(am.box((1, 1, 1), cells=(8, 8, 8)), grid=None, levels=())
    return am.Model(
        [am.Body(box, am.LinearElastic(young=200, poisson=0.3))],
        supports=[am.Fix("top", (0.01, 0, -0.02))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=0.5)],
    )


def attempt(what, *arguments):
    """Call; what is refused needs no kernel."""
    try:
        am.solve(*arguments)
    except am.AmontonsError as error:
        print(what, type(error).__name__, str(error)[:100])


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
    attempt("levels", without_levels(), am.ContactMultigrid())
    for model in models():
        attempt("model", model)


if __name__ == "__main__":
    main()
