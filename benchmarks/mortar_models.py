"""Two bodies with known contact pressures, on meshes that do not match: balls and rings.

K. L. Johnson, "Contact Mechanics", Cambridge University Press (1985), sections 3.4, 4.2, 7.2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

import amontons as am

Array = NDArray[np.float64]
YOUNG, POISSON = 1000.0, 0.3
SYMMETRY = 1e-9  # coordinates of planes of symmetry that are rounded


def mapped(mesh: am.Mesh, position: Callable[[Array], Array]) -> am.Mesh:
    """The same mesh with other points."""
    return am.Mesh(position(mesh.points), mesh.cells, mesh.surfaces)


def graded(share: Array, fine: float, cells: int, inner: int) -> Array:
    """[0, 1] -> [0, 1]: `inner` of `cells` equal cells up to `fine`, then geometric growth."""
    first, rest = fine / inner, cells - inner

    def length(growth: float) -> float:
        return first * sum(growth**k for k in range(1, rest + 1)) - (1 - fine)

    growth = brentq(length, 1.0, 20.0)
    outer = fine + first * np.cumsum(growth ** np.arange(1, rest + 1))
    nodes = np.concatenate([np.linspace(0, fine, inner + 1), outer])
    return np.interp(share, np.linspace(0, 1, cells + 1), nodes / nodes[-1])


def stacked(dim: int, below: object, above: object, kinds: tuple[str, str],
            moved: float = 0.0) -> am.Model:  # fmt: skip
    """Two unit blocks on each other whose exact pressure is 1; moved: part of a cell."""
    up = (0,) * (dim - 1)
    meshes = [am.box((1,) * dim, below, kinds[0]),
              am.box((1,) * dim, above, kinds[1], origin=(*up, 1))]  # fmt: skip
    if moved:
        meshes = [_distorted(mesh, moved) for mesh in meshes]
    material = am.LinearElastic(young=100, poisson=0.0)
    lower, upper = (
        am.Body(mesh, material, name=name)
        for mesh, name in zip(meshes, ("lower", "upper"), strict=True)
    )
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (*up, -0.02))]
    contact = am.Contact("upper.bottom", master="lower.top", mu=0.5, method="mortar")
    return am.Model([lower, upper], supports, [contact])


def _distorted(mesh: am.Mesh, amount: float) -> am.Mesh:
    low, high = mesh.bounding_box()
    shift = np.random.default_rng(0).uniform(-1, 1, mesh.points.shape)
    shift *= amount * (high - low) / np.array(mesh.grid)
    shift[(mesh.points == low) | (mesh.points == high)] = 0
    return am.Mesh(mesh.points + shift, mesh.cells, mesh.surfaces)


def dragged(turn: Array | None = None, length: float = 1.0, force: float = 1.0) -> am.Model:
    """A block with a round foot pressed and dragged on another; it sticks, slides and lifts.

    turn (3, 3): of both bodies and all that acts; length, force: the units.
    """
    axes = np.eye(3) if turn is None else turn
    low, high = (
        am.box((1, 1, 1), (4, 4, 1)),
        am.box((1, 1, 1), (3, 3, 1), origin=(0.1, 0.15, 1)),
    )
    foot = (high.points[:, 2] == 1) * 0.05 * ((high.points[:, :2] - 0.6) ** 2).sum(axis=1)
    raised = mapped(high, lambda x: x + np.outer(foot, [0, 0, 1]))
    material = am.LinearElastic(young=100 * force / length**2, poisson=0.3)
    bodies = [
        am.Body(mapped(mesh, lambda x: length * x @ axes.T), material, name=name)
        for mesh, name in ((low, "lower"), (raised, "upper"))
    ]
    move = tuple(length * axes @ [0.01, 0.002, -0.05])
    contact = am.Contact("upper.bottom", master="lower.top", mu=0.3, method="mortar")
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", move)]
    return am.Model(bodies, supports, [contact])


# -------------------------------------------------------------------- ball on block
@dataclass(frozen=True)
class BallOnBlock:
    """A ball of radius 1 on a block of the same material: a quarter, or the half y > 0.

    The ball is held at its equator, which moves by (shift, 0, -push).  inner: cells of the ball
    across the zone of radius `zone`; the block has `ratio` times as many.
    """

    inner: int = 8
    zone: float = 0.12
    ratio: float = 0.8
    push: float = 0.012
    shift: float = 0.0
    mu: float = 0.0
    block: float = 1.5
    rest: int = 6  # cells outside of the zone
    slave: str = "ball"  # or "block", whose normals are those of the tangent plane

    def model(self) -> am.Model:
        """The model."""
        half = self.shift != 0
        ball, block = self._ball(half), self._block(half)
        material = am.LinearElastic(young=YOUNG, poisson=POISSON)
        supports = [am.Fix("ball.top", (self.shift, 0, -self.push)), am.Fix("block.bottom", 0)]
        for body in ("ball", "block"):
            supports.append(am.Fix(f"{body}.front", (None, 0, None)))
            if not half:
                supports.append(am.Fix(f"{body}.left", (0, None, None)))
        sides = ["ball.bottom", "block.top"][:: 1 if self.slave == "ball" else -1]
        contact = am.Contact(sides[0], master=sides[1], mu=self.mu, method="mortar")
        return am.Model(
            [am.Body(ball, material, name="ball"), am.Body(block, material, name="block")],
            supports, [contact], name="ball on block",
        )  # fmt: skip

    def _ball(self, half: bool) -> am.Mesh:
        """The lower half of a ball, a cube whose points move along their rays."""
        inner = self.inner
        cells = inner + self.rest
        box = am.box((1, 1, 1), (cells * (1 + half), cells, cells))

        def position(x: Array) -> Array:
            if half:
                x = x * [2, 1, 1] - [1, 0, 0]
            x, side = np.abs(x), np.where(x < 0, -1, 1)
            steps = [graded(x[:, c], self.zone, cells, inner) for c in range(3)]
            cube = np.column_stack(steps) - [0, 0, 1]
            largest = np.abs(cube).max(axis=1)
            length = np.linalg.norm(cube, axis=1)
            ball = cube * (largest / np.where(length > 0, length, 1.0))[:, None]
            return side * ball

        return mapped(box, position)

    def _block(self, half: bool) -> am.Mesh:
        inner = round(self.ratio * self.inner)
        cells = inner + self.rest
        box = am.box((1, 1, 1), (cells * (1 + half), cells, cells))
        fine = self.zone / self.block

        def position(x: Array) -> Array:
            if half:
                x = x * [2, 1, 1] - [1, 0, 0]
            side = np.where(x < 0, -1, 1)
            out = self.block * np.column_stack(
                [graded(np.abs(x[:, c]), fine, cells, inner) for c in (0, 1)]
                + [-graded(1 - x[:, 2], fine, cells, inner)]
            )
            return out * side - [0, 0, 1]

        return mapped(box, position)


@dataclass(frozen=True)
class Pressed:
    """What a solution of `BallOnBlock` has, and what Hertz expects of its load."""

    contacts: int
    load: float
    peak: float
    peak_hertz: float
    radius: float
    radius_hertz: float
    stick: float  # c / a from the areas of the status
    stick_axis: float  # c / a from the tractions on the axis, 1 - q_0 / (mu p_0)
    stick_mindlin: float
    used: float  # Q / (mu P)


def measured(case: BallOnBlock, solution: am.ModelSolution) -> Pressed:
    """Peak pressure and radii of a solution; the radius by the line p^2 over r^2."""
    parts = 2 if case.shift else 4
    r = np.linalg.norm(solution.points[:, :2], axis=1)
    load = parts * np.abs(solution.force[:, 2].sum())
    modulus = YOUNG / (1 - POISSON**2) / 2
    radius_hertz = (0.75 * load / modulus) ** (1 / 3)
    inside = (solution.pressure > 0) & (r < 0.9 * radius_hertz)
    slope, top = np.polyfit(r[inside] ** 2, solution.pressure[inside] ** 2, 1)
    radius = np.sqrt(-top / slope)
    touching = solution.status > 0
    stuck = solution.status == am.ContactStatus.STICK
    axis = np.argmin(r)
    used = stick_axis = stick = np.nan
    if case.mu > 0:
        drag = parts * np.abs(solution.force[:, 0].sum())
        used = drag / (case.mu * load)
        share = np.abs(solution.shear[axis]).max() / (case.mu * solution.pressure[axis])
        stick_axis = 1 - share
        weights = solution.weights
        stick = np.sqrt(weights[stuck].sum() / weights[touching].sum())
    return Pressed(
        int(touching.sum()), load, solution.pressure.max(),
        1.5 * load / (np.pi * radius_hertz**2), radius, radius_hertz,
        stick, stick_axis, max(1 - used, 0.0) ** (1 / 3), used,
    )  # fmt: skip


# -------------------------------------------------------------------- rings
@dataclass(frozen=True)
class Rings:
    """A quarter of two rings pressed into each other, in 2D (plane strain) or 3D.

    Radii inside, between, outside; they overlap by `overlap` around `between`; facets around:
    slave (inner ring) and master; layers: along the axis in 3D, else 0.
    """

    around: tuple[int, int] = (24, 32)
    layers: int = 0
    overlap: float = 0.005
    radii: tuple[float, float, float] = (0.5, 1.0, 1.6)
    radial: tuple[int, int] = (10, 12)
    mu: float = 0.0

    def model(self) -> am.Model:
        """The model; its slave is the inner ring."""
        a, b, c = self.radii
        half = self.overlap / 2  # on both sides, so that b stays in the middle
        inner = self._ring(a, b + half, self.radial[0], self.around[0], self.layers)
        outer = self._ring(b - half, c, self.radial[1], self.around[1], self.layers + 1)
        material = am.LinearElastic(young=YOUNG, poisson=POISSON)
        axial = () if not self.layers else (None,)
        supports = []
        names = ("bottom", "top") if not self.layers else ("front", "back")
        for body in ("inner", "outer"):
            supports += [am.Fix(f"{body}.{names[0]}", (None, 0, *axial)),
                         am.Fix(f"{body}.{names[1]}", (0, None, *axial))]  # fmt: skip
            if self.layers:
                supports += [
                    am.Fix(f"{body}.{end}", (None, None, 0)) for end in ("bottom", "top")
                ]
        contact = am.Contact("inner.right", master="outer.left", mu=self.mu, method="mortar")
        return am.Model(
            [am.Body(inner, material, name="inner"), am.Body(outer, material, name="outer")],
            supports, [contact], name="rings",
        )  # fmt: skip

    def _ring(
        self, inside: float, outside: float, radial: int, around: int, layers: int
    ) -> am.Mesh:
        cells = (radial, around) if not self.layers else (radial, around, layers)
        size = (1.0, 1.0) if not self.layers else (1.0, 1.0, 0.2)

        def position(x: Array) -> Array:
            r, angle = inside + (outside - inside) * x[:, 0], np.pi / 2 * x[:, 1]
            return np.column_stack([r * np.cos(angle), r * np.sin(angle), x[:, 2:]])

        return mapped(am.box(size, cells), position)

    @property
    def lame(self) -> float:
        """Pressure between the rings, both thick-walled, plane strain."""
        a, b, c = self.radii
        young, poisson = YOUNG / (1 - POISSON**2), POISSON / (1 - POISSON)
        outer = (c**2 + b**2) / (c**2 - b**2) + poisson
        inner = (b**2 + a**2) / (b**2 - a**2) - poisson
        return self.overlap * young / (b * (outer + inner))

    def missed(self, problem: am.FrictionProblem, model: am.Model) -> Array:
        """Overlap that contacts of its problem see in Lamé's own displacements of b, (nc,)."""
        a, b, c = self.radii
        young, poisson = YOUNG / (1 - POISSON**2), POISSON / (1 - POISSON)
        grown = self.lame * b / young
        by = (-grown * ((b**2 + a**2) / (b**2 - a**2) - poisson),
              grown * ((c**2 + b**2) / (c**2 - b**2) + poisson))  # fmt: skip
        points = [body.mesh.points for body in model.bodies]
        moved = np.concatenate([
            u * x / np.linalg.norm(x, axis=1, keepdims=True)
            for u, x in zip(by, points, strict=True)
        ])  # fmt: skip
        free = np.abs(np.concatenate(points)) > SYMMETRY
        v = moved[free]
        return (problem.H.T @ v).reshape(problem.w.shape)[:, 0] + problem.w[:, 0]
