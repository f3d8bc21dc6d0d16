"""Reference cells of second order: nodes at the corners and at the middles.

Nodes in VTK order: corners, middles of edges, of quadrilateral faces, of the hexahedron.  On
the reference cell every node sits at the mean of its parents, the corners that it lies between.
The serendipity cells quad8, hex20 and wedge15 have nodes at corners and edges only; all others
have all polynomials of degree 2 in every direction, or in all.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from .gauss import roots_jacobi
from .linear_cells import LINEAR, ReferenceCell, Rule

Array = NDArray[np.float64]
Parents = tuple[tuple[int, ...], ...]

_TRI = ((0, 1), (1, 2), (2, 0))
_QUAD = ((0, 1), (1, 2), (2, 3), (3, 0))
_TET = (*_TRI, (0, 3), (1, 3), (2, 3))
_HEX = (*_QUAD, (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7),
        (0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7),
        tuple(range(8)))  # fmt: skip
_WEDGE = (*_TRI, (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5))
PARENTS = {"line3": ((0, 1),), "tri6": _TRI, "quad9": (*_QUAD, (0, 1, 2, 3)), "tet10": _TET,
           "hex27": _HEX, "quad8": _QUAD, "hex20": _HEX[:12], "wedge15": _WEDGE}  # fmt: skip
SECOND = {"line": "line3", "tri": "tri6", "quad": "quad9", "tet": "tet10", "hex": "hex27"}
SERENDIPITY = SECOND | {"quad": "quad8", "hex": "hex20", "wedge": "wedge15"}
FIRST = {second: first for table in (SECOND, SERENDIPITY) for first, second in table.items()}


def _powers(kind: str, dim: int) -> Array:
    """Exponents of the monomials of a cell, (nodes, dim)."""
    every = list(product(range(3), repeat=dim))
    if kind in ("tri6", "tet10"):
        every = [p for p in every if sum(p) <= 2]
    elif kind in ("quad8", "hex20"):
        every = [p for p in every if p.count(2) <= 1]
    elif kind == "wedge15":  # of degree 2 in all where linear along the axis, else 1
        every = [p for p in every if p[0] + p[1] <= (2 if p[2] < 2 else 1)]
    return np.array(every)


def _lagrange(nodes: Array, powers: Array) -> tuple[Callable, Callable]:
    """Shape functions of these monomials that are 1 at one node each."""
    dim = nodes.shape[1]
    lower = np.maximum(powers - 1, 0)

    def monomials(x: Array) -> Array:
        return (x[..., None, :] ** powers).prod(axis=-1)

    def slopes(x: Array) -> Array:
        columns = []
        for k in range(dim):
            parts = x[..., None, :] ** powers
            parts[..., k] = powers[:, k] * x[..., None, k] ** lower[:, k]
            columns.append(parts.prod(axis=-1))
        return np.stack(columns, axis=-1)

    weights = np.linalg.inv(monomials(nodes)).T
    return lambda x: monomials(x) @ weights.T, lambda x: weights @ slopes(x)


def gauss(dim: int, simplex: bool, count: int = 3) -> tuple[Array, Array]:
    """`count` points per direction, exact to degree 2 count - 1; simplices: a collapsed cube.

    Points (count^dim, dim) and weights of the unit cube or simplex.
    """
    points, weights = [], []
    rules = [roots_jacobi(count, dim - 1 - k if simplex else 0) for k in range(dim)]
    for nodes in product(range(count), repeat=dim):
        at = np.array([(1 + rules[k][0][j]) / 2 for k, j in enumerate(nodes)])
        scale = [2.0 ** -(dim - k if simplex else 1) for k in range(dim)]
        weights.append(np.prod([rules[k][1][j] * scale[k] for k, j in enumerate(nodes)]))
        if simplex:
            at *= np.cumprod([1.0, *(1 - at[:-1])])
        points.append(at)
    return np.array(points), np.array(weights)


def _in_tet() -> Rule:
    """14 points, exact to degree 5: N. J. Walkington, CMU report 00-CNA-023 (2000)."""
    corner = [(0.31088591926330060980, 0.11268792571801585080),
              (0.092735250310891226402, 0.073493043116361949544)]  # fmt: skip
    edge, weight = 0.045503704125649649492, 0.042546020777081466438
    barycentric = [np.full((4, 4), a) + (1 - 4 * a) * np.eye(4) for a, _ in corner]
    barycentric.append(np.array([
        [edge if k in pair else 0.5 - edge for k in range(4)]
        for pair in combinations(range(4), 2)
    ]))  # fmt: skip
    weights = np.repeat([w for _, w in corner] + [weight], [4, 4, 6])
    return np.vstack(barycentric)[:, 1:], weights / weights.sum() / 6


def _in_wedge(points: tuple[Rule, Rule]) -> Rule:
    """Points in a triangle times points on a line."""
    (triangle, area), (line, length) = points
    at = [[*p, *z] for p in triangle for z in line]
    return np.array(at), np.outer(area, length).ravel()


def _rules(kind: str, first: ReferenceCell) -> tuple[Rule, Rule, Rule]:
    """Points for shape functions, for products of gradients, and fewer of the latter."""
    if kind == "wedge15":
        few = _in_wedge((LINEAR["tri"].gauss, gauss(1, False)))
        full = _in_wedge((gauss(2, True), gauss(1, False)))
        return full, full, few
    simplex = first.kind in ("tri", "tet")
    rule = _in_tet() if kind == "tet10" else gauss(first.dim, simplex)
    return rule, first.gauss if simplex else rule, first.gauss


def _cell(kind: str) -> ReferenceCell:
    first, parents = LINEAR[FIRST[kind]], PARENTS[kind]
    middles = [first.corners[list(p)].mean(axis=0) for p in parents]
    nodes = np.vstack([first.corners, middles])
    shape, gradient = _lagrange(nodes, _powers(kind, first.dim))
    whole = any(len(p) > 2 for p in parents)
    facets = tuple(
        _facet(facet, parents, len(first.corners), whole) for facet in first.facets
    )
    rule, stiffness, reduced = _rules(kind, first)
    return ReferenceCell(kind, first.dim, nodes, facets, shape, gradient, rule, stiffness,
                         parents, reduced)  # fmt: skip


def _facet(
    corners: tuple[int, ...], parents: Parents, first: int, whole: bool
) -> tuple[int, ...]:
    """Nodes of one side, in the order of its own kind; whole: sides have a node inside."""
    kind = {1: None, 2: "line3", 3: "tri6", 4: "quad9" if whole else "quad8"}[len(corners)]
    place = {frozenset(p): first + k for k, p in enumerate(parents)}
    wanted = PARENTS[kind] if kind else ()
    return (*corners, *(place[frozenset(corners[j] for j in p)] for p in wanted))


QUADRATIC = {kind: _cell(kind) for kind in PARENTS}
