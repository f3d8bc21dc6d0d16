"""Reference cells of first order: nodes in VTK order, facets, shape functions, Gauss points.

Reference coordinates are [0, 1] for lines, quadrilaterals and hexahedra, the unit simplex for
triangles and tetrahedra, their product for wedges; pyramids have the base [0, 1]^2 and the apex
above its first node.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from .gauss import roots_jacobi

Array = NDArray[np.float64]
Facets = tuple[tuple[int, ...], ...]
Rule = tuple[Array, Array]


@dataclass(frozen=True, eq=False)
class ReferenceCell:
    """One kind of cell.

    corners (nodes, dim); facets: local nodes of every side, right-hand rule outwards;
    shape(x) and gradient(x) at reference points (…, dim): (…, nodes) and (…, nodes, dim);
    gauss: points (k, dim) and weights (k,), exact for the integrals of shape functions;
    stiffness: the same for products of two gradients, exact where the Jacobian is constant.
    parents: of every node that is no corner, the corners that it is the middle of.
    reduced: fewer points for products of gradients, with which a regular mesh still has no
    motion without energy but the rigid ones; None where there are no fewer.
    """

    kind: str
    dim: int
    corners: Array
    facets: Facets
    shape: Callable[[Array], Array]
    gradient: Callable[[Array], Array]
    gauss: Rule
    stiffness: Rule
    parents: tuple[tuple[int, ...], ...] = ()
    reduced: Rule | None = None

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return len(self.corners)

    @property
    def corner_count(self) -> int:
        """Number of nodes at corners; they come first."""
        return self.nodes - len(self.parents)

    @property
    def order(self) -> int:
        """1, or 2 with nodes in the middles."""
        return 2 if self.parents else 1

    @property
    def centre(self) -> Array:
        """Mean of the corners, (dim,)."""
        return self.corners.mean(axis=0)

    def jacobians(self, coordinates: Array, point: Array) -> Array:
        """Slopes of x (k, nodes, space) at one reference point or one each, (k, space, dim)."""
        return np.einsum("kas,ad->ksd" if point.ndim == 1 else "kas,kad->ksd",
                         coordinates, self.gradient(point))  # fmt: skip

    def gradients(self, coordinates: Array, point: Array) -> Array:
        """Gradients in space of the shape functions at one reference point, (k, nodes, dim)."""
        return self.gradient(point) @ np.linalg.inv(self.jacobians(coordinates, point))


def _simplex(dim: int) -> tuple[Array, Callable, Callable]:
    corners = np.vstack([np.zeros(dim), np.eye(dim)])
    slopes = np.vstack([-np.ones(dim), np.eye(dim)])

    def shape(x: Array) -> Array:
        return np.concatenate([1 - x.sum(axis=-1, keepdims=True), x], axis=-1)

    def gradient(x: Array) -> Array:
        return np.broadcast_to(slopes, (*x.shape[:-1], *slopes.shape))

    return corners, shape, gradient


def _tensor(corners: Array) -> tuple[Array, Callable, Callable]:
    """Multilinear shape functions with the given order of corners of the unit cube."""

    def factors(x: Array) -> Array:
        return np.where(corners > 0, x[..., None, :], 1 - x[..., None, :])

    def gradient(x: Array) -> Array:
        value, sign = factors(x), np.where(corners > 0, 1.0, -1.0)
        columns = [
            sign[:, k] * np.delete(value, k, axis=-1).prod(axis=-1)
            for k in range(corners.shape[1])
        ]
        return np.stack(columns, axis=-1)

    return corners, lambda x: factors(x).prod(axis=-1), gradient


def _wedge() -> tuple[Array, Callable, Callable]:
    tri, shape, gradient = _simplex(2)
    corners = np.vstack([np.c_[tri, np.zeros(3)], np.c_[tri, np.ones(3)]])

    def both(x: Array) -> Array:
        s, z = shape(x[..., :2]), x[..., 2:]
        return np.concatenate([s * (1 - z), s * z], axis=-1)

    def slopes(x: Array) -> Array:
        s, g, z = shape(x[..., :2])[..., None], gradient(x[..., :2]), x[..., 2:, None]
        low = np.concatenate([g * (1 - z), -s], axis=-1)
        return np.concatenate([low, np.concatenate([g * z, s], axis=-1)], axis=-2)

    return corners, both, slopes


def _pyramid() -> tuple[Array, Callable, Callable]:
    """Rational shape functions; the gradient has no limit at the apex, do not ask there."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1.0]])

    def shape(x: Array) -> Array:
        a, b, c = np.moveaxis(x, -1, 0)
        s = 1 - c
        values = [(s - a) * (s - b), a * (s - b), a * b, (s - a) * b, c * s]
        return np.stack(values, axis=-1) / s[..., None]

    def gradient(x: Array) -> Array:
        a, b, c = np.moveaxis(x, -1, 0)
        s = 1 - c
        q, none = a * b / s**2, np.zeros_like(s)  # q: d(ab / (1 - c)) / dc
        rows = [
            [-(s - b) / s, -(s - a) / s, q - 1], [(s - b) / s, -a / s, -q], [b / s, a / s, q],
            [-b / s, (s - a) / s, -q], [none, none, none + 1],
        ]  # fmt: skip
        return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)

    return corners, shape, gradient


_TWO = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3)
_LINE = (_TWO[:, None], np.full(2, 0.5))
_QUAD = (np.array([[x, y] for x in _TWO for y in _TWO]), np.full(4, 0.25))
_HEX = (np.array([[x, y, z] for x in _TWO for y in _TWO for z in _TWO]), np.full(8, 0.125))
_TRI = (np.array([[1, 1], [4, 1], [1, 4]]) / 6, np.full(3, 1 / 6))
_A, _B = (5 - np.sqrt(5)) / 20, (5 + 3 * np.sqrt(5)) / 20
_TET = (np.vstack([np.full(3, _A), _A + (_B - _A) * np.eye(3)]), np.full(4, 1 / 24))
_WEDGE = (np.array([[*p, z] for p in _TRI[0] for z in _TWO]), np.full(6, 1 / 12))
_ON_AXIS = (np.array([[1 / 3, 1 / 3, z] for z in _TWO]), np.full(2, 1 / 4))
_PYRAMID = (np.array([[0.375, 0.375, 0.25]]), np.full(1, 1 / 3))
_ONE_IN_TRI = (np.full((1, 2), 1 / 3), np.array([1 / 2]))
_ONE_IN_TET = (np.full((1, 3), 1 / 4), np.array([1 / 6]))
_SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
_CUBE = np.vstack([np.c_[_SQUARE, np.zeros(4)], np.c_[_SQUARE, np.ones(4)]])

_HEX_FACETS = (
    (0, 3, 2, 1),
    (4, 5, 6, 7),
    (0, 1, 5, 4),
    (1, 2, 6, 5),
    (2, 3, 7, 6),
    (3, 0, 4, 7),
)
_WEDGE_FACETS = ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
_PYRAMID_FACETS = ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4))

_TRI_FACETS = ((0, 1), (1, 2), (2, 0))
_QUAD_FACETS = ((0, 1), (1, 2), (2, 3), (3, 0))
_TET_FACETS = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))


def _in_pyramid() -> Rule:
    """Two points per direction: one could not hold all modes."""
    height, weights = roots_jacobi(2, 2)  # the square of the distance from the apex
    points = [((1 - h) * x, (1 - h) * y, h)
              for h, x, y in product((1 + height) / 2, _TWO, _TWO)]  # fmt: skip
    return np.array(points), np.repeat(weights / 8, 4) / 4


def _cell(
    kind: str,
    facets: Facets,
    parts: tuple[Array, Callable, Callable],
    gauss: Rule,
    stiffness: Rule | None = None,
    reduced: Rule | None = None,
) -> ReferenceCell:
    """stiffness: by default the points of `gauss`."""
    corners, *functions = parts
    rules = (gauss, stiffness or gauss)
    return ReferenceCell(kind, corners.shape[1], corners, facets, *functions, *rules,
                         reduced=reduced)  # fmt: skip


LINEAR = {
    cell.kind: cell
    for cell in (
        _cell("line", ((0,), (1,)), _tensor(np.array([[0], [1]])), _LINE),
        _cell("tri", _TRI_FACETS, _simplex(2), _TRI, _ONE_IN_TRI, _ONE_IN_TRI),
        _cell("quad", _QUAD_FACETS, _tensor(_SQUARE), _QUAD),
        _cell("tet", _TET_FACETS, _simplex(3), _TET, _ONE_IN_TET),
        _cell("hex", _HEX_FACETS, _tensor(_CUBE), _HEX),
        _cell("wedge", _WEDGE_FACETS, _wedge(), _WEDGE, reduced=_ON_AXIS),
        _cell("pyramid", _PYRAMID_FACETS, _pyramid(), _PYRAMID, _in_pyramid()),
    )
}
