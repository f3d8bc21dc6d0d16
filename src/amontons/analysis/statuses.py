"""What a contact may do in a piece or region of the law: one alphabet for all searches.

Single statuses come first, so that tables by status have as few rows as a search needs; then
those that hold several of them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

States = NDArray[np.integer]

FREE, PLUS, MINUS, STICK = range(4)  # r = 0; slip in 2D, r_T = mu r_N, -mu r_N; u = 0
TANGENT = 4  # no status: u_T = 0 and r_N = 0, which only the P-matrix criterion has
LOAD = 4  # no contact: the load as an unknown of the pattern search, which has no TANGENT
FRICTIONLESS = 5  # u_N = 0 without friction, u_T of any sign
SLIP = 6  # in any direction: 2D plus or minus, 3D on a disc
CLOSED = 7  # stick or slip
ANY = 8  # free or closed
LETTERS = "f+-st+lc."
BOTH_WAYS = "x"  # of SLIP in 2D certificates


def word(states: States) -> str:
    """A pattern as text, one letter per contact."""
    return "".join(LETTERS[int(state)] for state in states)


def states_of(pattern: str) -> NDArray[np.int8]:
    """The states (nc,) of a word; + is PLUS."""
    return np.array([LETTERS.index(letter) for letter in pattern], dtype=np.int8)
