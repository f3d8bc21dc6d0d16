"""Calls of all kinds of cells, forms and methods on tiny problems, to see what compiles."""

import itertools

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


def main():
    """Solve them all."""
    for problem in problems():
        for method in METHODS:
            attempt(method.__name__, problem, method())
    for model in models():
        attempt("model", model)


if __name__ == "__main__":
    main()
