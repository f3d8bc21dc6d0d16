"""Cattaneo and Mindlin in 3D, on two half spaces whose gap is that of two spheres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import amontons as am
from benchmarks.mortar_models import graded

from .case import Case, Value

Array = NDArray[np.float64]
YOUNG, MU, RADIUS = 1000.0, 0.3, 100.0  # of both, nu = 0; 1 / RADIUS is the sum of curvatures
SIDE, ZONE, REST = 15.0, 1.25, 6  # of a block; where cells are equal; cells beside it


def _block(size: int, up: float) -> am.Mesh:
    """A block beside z = 0 with y > 0, the half of a cube."""
    cells = size + REST
    box = am.box((1, 1, 1), (2 * cells, cells, cells))
    x = np.column_stack([2 * box.points[:, 0] - 1, box.points[:, 1],
                         box.points[:, 2] - (up < 0)])  # fmt: skip
    steps = [graded(np.abs(x[:, c]), ZONE / SIDE, cells, size) for c in range(3)]
    return am.Mesh(SIDE * np.sign(x) * np.column_stack(steps), box.cells, box.surfaces)


def _model(size: int) -> am.Model:
    """Pressed until t = 1, pushed until 2, and drawn back until 3."""
    law, depth = am.LinearElastic(YOUNG, 0.0), 1 / RADIUS
    return am.Model(
        [am.Body(_block(size, 1), law, "upper"), am.Body(_block(size, -1), law, "lower")],
        [am.Fix("upper.top", (lambda x, t: 0.7 * MU * depth * max(0.0, 1 - abs(t - 2)), 0,
                              lambda x, t: -1.1 * depth * min(t, 1.0))),
         am.Fix("lower.bottom", 0),
         am.Fix("upper.front", (None, 0, None)), am.Fix("lower.front", (None, 0, None))],
        [am.Contact("upper.bottom", master="lower.top", mu=MU,
                    clearance=lambda p: (p[:, 0] ** 2 + p[:, 1] ** 2) / (2 * RADIUS))],
    )  # fmt: skip


def _means(points: Array, width: float, half: float) -> Array:
    """Means of root(1 - r^2 / half^2) over the squares that belong to the nodes."""
    at = (np.arange(8) + 0.5) / 8 - 0.5
    inside = width * np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2)
    r = np.linalg.norm(points[:, None, :2] + inside, axis=2)
    return np.sqrt(np.maximum(1 - (r / half) ** 2, 0)).mean(axis=1)


def _errors(fields: am.ContactFields, before: float | None, width: float):
    """Share Q / (mu P), error of the shear over mu p0, and that away from edges of zones.

    before: the share from which the force was drawn back; None while it grows.
    """
    load = 2 * abs(fields.force[:, 2].sum())
    share = -2 * fields.force[:, 0].sum() / (MU * load)
    a = (1.5 * load * RADIUS / YOUNG) ** (1 / 3)
    peak = MU * 1.5 * load / (np.pi * a**2)
    first = a * np.cbrt(1 - (share if before is None else before))
    zones = [(a, 1.0), (first, -1.0)]
    if before is not None:
        zones = [(a, -1.0), (first, -1.0), (a * np.cbrt(1 - (before - share) / 2), 2.0)]
    exact = sum(sign * b / a * _means(fields.points, width, b) for b, sign in zones)
    error = -fields.force[:, 0] / fields.weights / peak - exact
    r = np.linalg.norm(fields.points[:, :2], axis=1)
    away = np.min([np.abs(r - b) for b, _ in zones], axis=0) > width
    near = r < 1.2 * a

    def rms(those: NDArray[np.bool_]) -> float:
        return float(np.sqrt(fields.weights[those] @ error[those] ** 2 / (np.pi * a**2 / 2)))

    return share, rms(near), rms(near & away)


def cattaneo_3d(size: int) -> list[Value]:
    """Pressed, pushed to three quarters of the friction limit, and drawn back."""
    out, before = [], None
    steps = am.evolve(_model(size), am.QuasiStatic(step=1.0), until=3.0, tolerance=1e-9)
    for name, step in zip(("", "after pushing", "after the reversal"), steps, strict=True):
        share, error, away = _errors(step.fields, before, ZONE / size)
        if name:
            before = share
            out += [Value(f"shear {name}, rms", error, 0.0, 1.0),
                    Value(f"shear {name}, rms away from edges", away, 0.0, 1.0,
                          known=5e-3)]  # fmt: skip
    return out


CASES = (
    Case("cattaneo-mindlin-3d", "Cattaneo and Mindlin in 3D, with a reversal",
         "Two spheres are pressed, pushed to 0.75 of the friction limit, and drawn back until "
         "nearly no force is left.",
         'K. L. Johnson, "Contact Mechanics", Cambridge University Press (1985), sections 7.2 '
         "and 7.4; errors over mu p0", cattaneo_3d, (4, 6, 9), (13,), 1.0,
         "Half of two blocks of 14 contact radii, whose gap is r^2 / 2R; nu = 0, for which "
         "shear along x moves the surface along x alone, so that the theory is exact. "
         "At size n cells are 1.16 a / n wide. Expected are means over the area of "
         "a node. Tractions end in roots at the contact's edge and at those of the two zones "
         "that stick: that is where the error is, and beside these circles it is "
         "0.2 percent. Meshes that do not match, 5 to 4 cells, double it: pressing "
         "alone then leaves a shear of 2.5 percent of mu p0 on the coarser one, 1.5 percent on "
         "a mesh 1.4 times finer.", 3e-2),
)  # fmt: skip
