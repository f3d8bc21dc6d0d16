"""Contacts that supports drive: tangents that can not react, and whether they move.

Where a support prescribes a tangential component of a contact node, a reaction moves nothing
there: its row of W is zero.  If that component rests, the reaction in it may as well be zero.
If it moves, at a given u_d, the contact can not stick; closed, it slides with

    r_T = -mu r_N u_T / |u_T|,   |u_T| >= |u_d| > 0,

so that r_d is a part of the friction that takes its share from the other tangent.  In functions
of r_T - rho u_T the contact is seen to slide if rho |u_T| is a few times the bound.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..problem.friction import Form, FrictionProblem
from .augmentation import own_blocks

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
NO_STIFFNESS = 1e-13  # relative compliance below which a direction can not react
RESTS = 1e-13  # motion relative to the largest one that is rounding
OUTSIDE = 4.0  # rho |u_T| of a driven contact, in friction bounds


def able_directions(problem: FrictionProblem) -> Mask:
    """Directions, (nc, d), in which a reaction moves its own contact; none without a normal."""
    own = np.diagonal(own_blocks(problem), axis1=1, axis2=2)
    able = own > NO_STIFFNESS * own.max(axis=1, keepdims=True, initial=0.0)
    return able & able[:, :1]


def driven_directions(problem: FrictionProblem) -> Mask:
    """Tangents, (nc, d), that can not react and move at a given speed."""
    given = problem.q if problem.form is Form.DELASSUS else problem.w
    assert given is not None
    able = able_directions(problem)
    return ~able & able[:, :1] & moves(given)


def moves(given: Array) -> Mask:
    """Tangents, (nc, d), with a motion of their own in w or q (nc, d) that is no rounding."""
    out = np.abs(given) > RESTS * np.abs(given).max(initial=0.0)
    out[:, 0] = False
    return out


def sliding_rho(rho: Array, driven: Mask, bound: Array, u: Array) -> Array:
    """rho (nc,) of the tangents, raised where a driven contact would be taken for stuck.

    driven (nc,): contacts with a driven tangent; bound (nc,): of their friction; u (nc, d).
    """
    speed = np.linalg.norm(u[:, 1:], axis=1)
    bound = np.where(np.isfinite(bound), bound, 0.0)  # tied contacts do not slide
    least = OUTSIDE * bound / np.where(speed > 0, speed, 1.0)
    return np.where(driven & (speed > 0), np.maximum(rho, least), rho)
