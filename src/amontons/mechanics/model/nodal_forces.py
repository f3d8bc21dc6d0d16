"""External nodal forces as functions of the displacements: dead loads and those that follow.

    f(u) = dead + sum_k weight_k l_k(u),                                                    (1)

l_k being the integrals of [LR] eq. (22) for pressures, and for tractions and body forces that
are given per area or volume of the deformed body.  Such forces can be added and scaled, so that
a load between two others is one as well.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import within
from ..elements.moved_loads import Pair, pressure_forces, traction_forces, volume_forces
from .parts import CURRENT, BodyForce, Load, Pressure, Temperature, Traction
from .supports import external_load, locate
from .values import component_at, is_number, vector_at

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
Index = NDArray[np.int64]
STEP = np.finfo(float).eps ** (1 / 3)  # of central differences, relative to the size


@dataclass(frozen=True, eq=False)
class Follower:
    """One load on one kind of facets or cells, with its value at one time.

    nodes (k, a): numbers in the whole model; X (nodes, d): reference positions of all nodes;
    density(points (n, d)): values there, (n, d), or (n,) of a pressure.
    """

    kind: str
    nodes: Index
    X: Array
    forces_on: Callable[[str, Array, Array, Array], Pair]
    density: Callable[[Array], Array]
    is_uniform: bool

    def of(self, u: Array) -> Pair:
        """Forces (k, a, d) at displacements u (nodes, d), and their derivatives by nodes."""
        own, local = np.unique(self.nodes, return_inverse=True)
        local = local.reshape(self.nodes.shape)
        x = (self.X + u)[own]
        density, slopes = self.density(x), self._slopes(x)
        return self.forces_on(self.kind, x[local], density[local], slopes[local])

    def _slopes(self, x: Array) -> Array:
        """Derivatives of the density by position, (n, …, d): central differences."""
        d = x.shape[1]
        if self.is_uniform:
            shape = (len(x), d) if self.forces_on is pressure_forces else (len(x), d, d)
            return np.zeros(shape)
        size = max(float(np.abs(x).max()), float(np.ptp(self.X, axis=0).max()))
        columns = []
        for shift in STEP * size * np.eye(d):
            change = self.density(x + shift) - self.density(x - shift)
            columns.append(change / (2 * STEP * size))
        return np.stack(columns, axis=-1)


@dataclass(frozen=True, eq=False)
class NodalForces:
    """(1): dead (dofs,), and loads that follow the body with their weights."""

    dead: Array
    following: tuple[tuple[float, Follower], ...] = ()
    __array_ufunc__ = None  # so that arrays and numbers leave sums and products to this class

    @classmethod
    def of(cls, given: NodalForces | Array) -> NodalForces:
        """The same, of nodal forces (dofs,) that do not change."""
        return given if isinstance(given, NodalForces) else cls(given)

    def at(self, u: Array) -> Array:
        """Nodal forces (dofs,) at displacements u (nodes, d)."""
        out = self.dead.copy()
        for weight, load in self.following:
            _add(out, load, weight * load.of(u)[0])
        return out

    def slopes(self, u: Array) -> tuple[Array, list[tuple[Index, Array]]]:
        """(forces (dofs,), [(nodes (k, a), derivatives (k, a, a, d, d)), …]) there."""
        out, blocks = self.dead.copy(), []
        for weight, load in self.following:
            forces, slopes = load.of(u)
            _add(out, load, weight * forces)
            blocks.append((load.nodes, weight * slopes))
        return out, blocks

    def __add__(self, other: NodalForces | Array) -> NodalForces:
        other = NodalForces.of(other)
        weights = {load: 0.0 for _, load in (*self.following, *other.following)}
        for weight, load in (*self.following, *other.following):
            weights[load] += weight
        terms = tuple((weight, load) for load, weight in weights.items() if weight)
        return NodalForces(self.dead + other.dead, terms)

    def __mul__(self, factor: float) -> NodalForces:
        terms = tuple((factor * weight, load) for weight, load in self.following)
        return NodalForces(factor * self.dead, terms)

    __radd__, __rmul__ = __add__, __mul__

    def __truediv__(self, factor: float) -> NodalForces:
        return self * (1 / factor)

    def __neg__(self) -> NodalForces:
        return self * -1.0

    def __sub__(self, other: NodalForces | Array) -> NodalForces:
        return self + (-NodalForces.of(other))

    def __rsub__(self, other: Array) -> NodalForces:
        return -self + other


def _add(out: Array, load: Follower, forces: Array) -> None:
    """Sum forces (k, a, d) up in out (dofs,), which changes."""
    d = forces.shape[2]
    dofs = load.nodes[:, :, None] * d + np.arange(d)
    out += np.bincount(dofs.ravel(), forces.ravel(), minlength=len(out))


def follows(load: Load) -> bool:
    """True for a load of the deformed body: a pressure, or one per deformed area or volume."""
    return isinstance(load, Pressure) or load.configuration == CURRENT


def nodal_forces(model: Model, loads: Sequence[Load | None]) -> NodalForces:
    """Of the loads of a model, each with its value at one time; None: left out."""
    moving = [load is not None and follows(load) for load in loads]
    dead = [None if moves else load for load, moves in zip(loads, moving, strict=True)]
    terms = [
        (1.0, follower) for at, load in enumerate(loads) if load is not None and moving[at]
        for follower in _followers(model, load, at)
    ]  # fmt: skip
    return NodalForces(external_load(model.bodies, dead, model.beside), tuple(terms))


def _followers(model: Model, load: Load, at: int) -> list[Follower]:
    """A load, the one of number `at`, on all kinds of facets or cells that it acts on."""
    X = np.concatenate([body.mesh.points for body in model.bodies])
    starts = model.discretisation.offsets[:-1] // model.dimension
    if isinstance(load, BodyForce):
        blocks = [
            (cells.kind, cells.nodes + start)
            for body, start in zip(model.bodies, starts, strict=True)
            for cells in body.mesh.cells if load.region in (None, cells.region)
        ]  # fmt: skip
        what, kernel = "body force", volume_forces
    else:
        assert not isinstance(load, Temperature)  # it does not follow
        k, surface = locate(model.bodies, load.on)
        blocks = [(facets.kind, facets.nodes + starts[k])
                  for facets in model.bodies[k].mesh.surface(surface)]  # fmt: skip
        word = "pressure" if isinstance(load, Pressure) else "traction"
        what = f"{word} on {load.on!r}"
        kernel = traction_forces if isinstance(load, Traction) else pressure_forces

    def density(x: Array) -> Array:
        with within("loads", at, "value"):
            if isinstance(load, Pressure):
                return component_at(load.value, x, what)
            return vector_at(load.value, x, what)  # type: ignore[arg-type]  # no temperature

    uniform = _is_uniform(load.value)
    return [Follower(kind, nodes, X, kernel, density, uniform) for kind, nodes in blocks]


def _is_uniform(value: Any) -> bool:
    """True for numbers alone."""
    if isinstance(value, Sequence):
        return all(is_number(entry) for entry in value)
    return is_number(value) or isinstance(value, np.ndarray)


def sampled(forces: NodalForces | Array, X: Array) -> Array:
    """Nodal forces (k, dofs) on bodies at rest, and on those that have moved and grown.

    To compare loads; X (nodes, d): reference positions.
    """
    if not isinstance(forces, NodalForces):
        return forces
    grown = 0.1 * (X - X.mean(axis=0)) + 0.01 * np.ptp(X, axis=0)
    return np.stack([forces.at(np.zeros_like(X)), forces.at(grown)])
