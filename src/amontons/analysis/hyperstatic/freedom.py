"""Whether reactions of a motion have a choice: a rank, and the contacts that it leaves open.

The reactions that keep a motion are a face (`face`): c with A c = A c0, inside of the cones.
Where c0 lies inside, the null vectors of A lead to other reactions with the same motion: as
many free numbers as A lacks in rank, at the contacts where null vectors do not vanish, by
random ones.  That is a small part of what `ranges` says, for a small part of its price.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import Deadline
from ...core.errors import InvalidInput, TimeUp
from ...core.faces import Told
from ...problem.friction import Form, FrictionProblem
from ...problem.solution import FrictionSolution
from .face import Face, face_of

Mask = NDArray[np.bool_]
SAMPLES = 3  # random null vectors
MOVES = 1e-7  # of the largest entry of one, below which a reaction is determined
FACTOR = 1 / 3  # operations of a factor of W per cube of its rows


@dataclass(frozen=True, eq=False, repr=False)
class Freedom(Told):
    """What a motion leaves open of its reactions.

    dimension: free numbers among them, 0 where they are unique, None where that is not known,
    see reason.  open (nc,): contacts whose reaction is not determined.  sure: False where the
    rank, or the status of a contact, is in doubt; then the dimension is what was found.
    """

    dimension: int | None
    open: Mask
    sure: bool = True
    reason: str = ""

    @property
    def unique(self) -> bool | None:
        """Whether the reactions of this motion are the only ones; None where in doubt."""
        if self.dimension:
            return False
        return True if self.dimension == 0 and self.sure else None

    def __str__(self) -> str:
        if self.dimension is None:
            return f"Whether its reactions are unique is not known: {self.reason}."
        doubt = "" if self.sure else "as far as the accuracy of the solution tells, "
        if not self.dimension:
            return f"{doubt}with this motion all reactions are unique.".capitalize()
        count, of = int(self.open.sum()), len(self.open)
        contacts = f"{count} of {of} contacts" if of > 1 else "the contact"
        numbers = "1 free number" if self.dimension == 1 else f"{self.dimension} free numbers"
        return (f"{doubt}with this motion the reactions of {contacts} are not unique, in "
                f"{numbers}.").capitalize()  # fmt: skip

    @property
    def record(self) -> dict[str, Any]:
        """Plain data, as JSON files have it."""
        return {"unique": self.unique, "dimension": self.dimension, "sure": self.sure,
                "contacts": np.flatnonzero(self.open).tolist(), "reason": str(self)}


def freedom_of(
    problem: FrictionProblem, solution: FrictionSolution, deadline: Deadline
) -> Freedom:
    """What the motion of a converged solution leaves open, Coulomb's law; in time or not."""
    nothing = np.zeros(problem.contacts, dtype=bool)
    try:
        if problem.form is not Form.GLOBAL:
            deadline.pay(FACTOR * float(problem.contacts * problem.dimension) ** 3)
        face = face_of(problem, solution, deadline)
        rank = face.rank(deadline)
        dimension = face.unknowns - rank.value
        sure = rank.least == rank.value and not face.edge
        if not dimension:
            return Freedom(0, nothing, sure)
        return Freedom(dimension, _open(face, problem.contacts, deadline), sure)
    except (TimeUp, InvalidInput) as error:
        return Freedom(None, nothing, False, str(error))


def _open(face: Face, contacts: int, deadline: Deadline) -> Mask:
    """Contacts at which a null vector of A does not vanish."""
    one = sparse.csr_array(sparse.eye_array(face.unknowns))
    solve = face.solver(one, deadline)
    if solve is None:
        raise TimeUp("the balance can not be factorised")
    g = np.random.default_rng(0).standard_normal((face.unknowns, SAMPLES))
    moves = np.abs(face.balanced(one, solve, g)).max(axis=1)
    free = moves > MOVES * max(float(moves.max(initial=0.0)), 1e-300)
    owner = np.concatenate([face.stick.repeat(face.d), face.slip])
    out = np.zeros(contacts, dtype=bool)
    out[owner[free]] = True
    return out
