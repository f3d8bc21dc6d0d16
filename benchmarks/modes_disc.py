"""The disc and two pads of `modes.py`, on a coarse and a finer mesh."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

import amontons as am

Array = np.ndarray
STEEL = am.LinearElastic(200e9, 0.3, density=7850)  # N, m, kg, s
SPEEDS = (10.0, 100.0)  # rad/s
MESHES = (1, 2)  # cells along radius and circumference, in parts of the coarse ones


def model_of(fine: int) -> am.Model:
    """6 x 36 x 2 cells of the disc and 2 x 6 x 2 of a pad, times fine each way along it."""
    radii = np.linspace(0.04, 0.15, 6 * fine + 1)
    angles = np.linspace(0, 2 * np.pi, 36 * fine + 1)
    inner, outer = 3 * fine, 5 * fine + 1
    first, last = 6 * fine, 12 * fine + 1
    disc = am.ring(radii, angles, np.linspace(-0.01, 0.01, 3))
    upper = am.ring(radii[inner:outer], angles[first:last], np.linspace(0.01, 0.025, 3))
    lower = am.ring(radii[inner:outer], angles[first:last], np.linspace(-0.025, -0.01, 3))
    return am.Model(
        [am.Body(disc, STEEL, "disc"), am.Body(upper, STEEL, "upper"),
         am.Body(lower, STEEL, "lower")],
        [am.Fix("disc.inner", 0), am.Fix("upper.top", (0, 0, -2e-6)),
         am.Fix("lower.bottom", (0, 0, 2e-6))],
        [am.Contact("upper.bottom", master="disc.top", mu=0.3),
         am.Contact("lower.top", master="disc.bottom", mu=0.3)],
    )  # fmt: skip


def left(modes: am.Modes) -> float:
    """What (s^2 M + s C + K) v = F r, r by least squares, leaves of its largest term."""
    state, worst = modes.state, 0.0
    F = (state.F_0 + state.F_1).toarray()
    for s, v in zip(modes.s, modes.shapes.T, strict=True):
        terms = [s * s * (state.M @ v), state.K @ v]
        terms += [] if state.C is None else [s * (state.C @ v)]
        total = np.sum(terms, axis=0)
        r = np.linalg.lstsq(F.astype(complex), total, rcond=None)[0]
        size = max(float(np.abs(x).max()) for x in terms)
        worst = max(worst, float(np.abs(total - F @ r).max()) / size)
    return worst


def turning(speed: float) -> Callable[[Array], tuple[Any, Any, float]]:
    """Velocity of the pads against a disc that turns."""
    return lambda x: (speed * x[1], -speed * x[0], 0.0)


def disc_rows() -> list[str]:
    """Which modes grow, slow and fast."""
    rows = []
    for fine in MESHES:
        model = model_of(fine)
        for speed in SPEEDS:
            began = time.process_time()
            modes = am.modes(model, 8, near=6474, velocity=turning(speed))
            spent = time.process_time() - began
            grow = modes.growing
            hertz = ", ".join(f"{modes.frequency[k]:.1f}" for k in grow)
            damping = ", ".join(f"{modes.damping[k]:.1e}" for k in grow)
            rows.append(f"| {modes.shapes.shape[0]} | {speed:g} | {len(grow)} | {hertz} | "
                        f"{damping} | {left(modes):.0e} | {spent:.1f} |")  # fmt: skip
    return rows
