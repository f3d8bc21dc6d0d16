"""A press fit of two tubes in 3D, a quarter: matching and other meshes, of both orders."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import amontons as am
from amontons.mechanics.meshes import second_order

YOUNG, MU, LENGTH = 210e3, 0.1, 19.0
INSIDE, BETWEEN, OUTSIDE, OVERLAP = 10.0, 20.0, 30.0, 0.0025  # radii, mm
NAMES = {"left": "inner", "right": "outer", "front": "y0", "back": "x0", "bottom": "low",
         "top": "high"}  # fmt: skip
SEED = 3


@dataclass(frozen=True)
class Fit:
    """Tubes of diameters 20/40.005 and 40/60 mm, 19 mm long, pressed into each other.

    shaft, hub: cells along the radius, a quarter of the circumference and the axis; order: of
    both meshes; arcs: whether nodes between the corners lie on the circles; uneven: part of a
    cell by which nodes are moved along the surfaces; slave: the side with the contacts.
    """

    shaft: tuple[int, int, int]
    hub: tuple[int, int, int]
    kind: str = "hex"
    order: int = 1
    arcs: bool = True
    poisson: float = 0.0
    uneven: float = 0.0
    slave: str = "shaft"
    method: str = "mortar"

    def tubes(self) -> tuple[am.Mesh, am.Mesh]:
        """The meshes of shaft and hub."""
        return (self._tube(INSIDE, BETWEEN + OVERLAP, self.shaft),
                self._tube(BETWEEN, OUTSIDE, self.hub))  # fmt: skip

    def _tube(self, a: float, b: float, cells: tuple[int, int, int]) -> am.Mesh:
        box = am.box((1, 1, 1), cells, self.kind)
        box = am.Mesh(box.points, box.cells, {new: box.surfaces[old]
                                              for old, new in NAMES.items()})  # fmt: skip
        box = am.Mesh(_shifted(box.points, cells, self.uneven), box.cells, box.surfaces)
        if self.order == 2 and self.arcs:
            box = second_order(box)

        def position(x: np.ndarray) -> np.ndarray:
            r, angle = a + (b - a) * x[:, 0], np.pi / 2 * x[:, 1]
            return np.column_stack([r * np.cos(angle), r * np.sin(angle), LENGTH * x[:, 2]])

        tube = am.Mesh(position(box.points), box.cells, box.surfaces)
        return tube if self.arcs or self.order == 1 else second_order(tube)

    def model(self, push: float) -> am.Model:
        """The fit, frictionless without a push; else the shaft is pushed along the axis."""
        law = am.LinearElastic(YOUNG, self.poisson)
        names = ("shaft", "hub")
        bodies = [am.Body(mesh, law, n) for mesh, n in zip(self.tubes(), names, strict=True)]
        held = [am.Fix(f"{n}.y0", (None, 0, None)) for n in names]
        held += [am.Fix(f"{n}.x0", (0, None, None)) for n in names]
        held += [am.Fix("hub.low", (None, None, 0)), am.Fix("shaft.high", (None, None, -push))]
        sides = ["shaft.outer", "hub.inner"][:: 1 if self.slave == "shaft" else -1]
        contact = am.Contact(
            sides[0], master=sides[1], mu=MU if push else 0.0, method=self.method
        )
        return am.Model(bodies, held, [contact])


def _shifted(x: np.ndarray, cells: tuple[int, int, int], amount: float) -> np.ndarray:
    """Points of the unit cube moved along its second and third axis, but not off its faces."""
    by = amount * np.random.default_rng(SEED).uniform(-1, 1, x.shape) / np.array(cells)
    by[:, 0] = 0.0
    by[np.isclose(x, 0) | np.isclose(x, 1)] = 0.0
    return x + by


def measured(fit: Fit, *, pushed: bool = True) -> tuple[float, float]:
    """Mean pressure without friction, force over area; and the force that pushes it out."""
    pressed = am.solve(fit.model(0.0))
    area = 2 * np.pi * BETWEEN * LENGTH / 4
    pressure = float(pressed.pressure @ pressed.weights / area)
    if not pushed:
        return pressure, float("nan")
    force = am.solve(fit.model(0.05)).resultant[2]
    return pressure, 4 * abs(float(force))
