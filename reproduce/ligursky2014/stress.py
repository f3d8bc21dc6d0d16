"""The stress that section 3.2.2 prints for the block, beside the derivative of its energy.

The energy is a |F|^2 + b |cof F|^2 + c det(F)^2 - d ln det F with F in three dimensions; in the
printed derivative the term with the identity lacks its factor F.
"""

from __future__ import annotations

from typing import Any

import numpy as np

LAMBDA, MU, A = 4000.0, 120.0, 30.0  # N/mm^2
B, C, D = MU / 2 - A, LAMBDA / 4 - MU / 2 + A, LAMBDA / 2 + MU
TURN = 0.023
ZERO = 1e-9  # N/mm^2
Row = dict[str, Any]


def printed(F: np.ndarray) -> np.ndarray:
    """As in the paper, N/mm^2."""
    first = 2 * B * np.trace(F.T @ F) * np.eye(3) + 2 * (A * np.eye(3) - B * F @ F.T) @ F
    return first + (2 * C * np.linalg.det(F.T @ F) - D) * np.linalg.inv(F).T


def derivative(F: np.ndarray) -> np.ndarray:
    """Of the energy by F, N/mm^2."""
    square = F.T @ F
    first = 2 * A * F + 2 * B * (np.trace(square) * F - F @ square)
    return first + (2 * C * np.linalg.det(square) - D) * np.linalg.inv(F).T


def rows() -> list[Row]:
    """The largest stress of states that are none: no deformation, and a rotation."""
    c, s = np.cos(TURN), np.sin(TURN)
    turned = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    states = {"F = I": np.eye(3), f"a rotation by {TURN}": turned}
    out = []
    for name, F in states.items():
        found = {"printed": float(np.abs(printed(F)).max()),
                 "derivative of the energy": float(np.abs(derivative(F)).max())}  # fmt: skip
        free = found["derivative of the energy"] < ZERO
        out.append({
            "state": name,
            **{f"stress, {key} (N/mm^2)": round(x, 9) for key, x in found.items()},
            "paper": "free of stress", "agrees": free and found["printed"] < ZERO,
            "fault": "" if found["printed"] < ZERO else "paper",
        })  # fmt: skip
    return out
