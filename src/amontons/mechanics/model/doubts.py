"""What may be wrong with the solution of a model though it has converged: named warnings.

Each check is a function of the model and its fields that returns the warnings it has; a new
one is a function in a file of its own and a name in CHECKS.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ...core.warned import ResultWarning
from .coefficients import like_percent
from .deep_masters import deep_masters
from .fields import ContactFields
from .flat_cells import flat_cells, turned_cells
from .held_facets import held_facets
from .held_friction import held_friction
from .in_each_other import bodies_in_each_other
from .loading import no_load
from .locking import volumetric_locking
from .matching import nodal_on_non_matching
from .overlapping import overlap_at_start
from .rotation import large_rotation
from .sliding import sliding_beyond_curvature, sliding_beyond_pairs
from .unfaced import unfaced_slaves

if TYPE_CHECKING:
    from .model import Model

Check = Callable[["Model", ContactFields], list[ResultWarning]]
CHECKS: tuple[Check, ...] = (
    no_load,
    volumetric_locking,
    large_rotation,
    nodal_on_non_matching,
    overlap_at_start,
    like_percent,
)
AT_FIRST = (overlap_at_start,)  # of how bodies are given: said once
OF_THE_START = (sliding_beyond_pairs, sliding_beyond_curvature)  # its pairs, normals
OF_WHERE_NODES_ARE = (  # found there
    held_facets,
    held_friction,
    deep_masters,
    unfaced_slaves,
    flat_cells,
    turned_cells,
    bodies_in_each_other,
)
OF_MOTIONS = (large_rotation, *OF_THE_START, *OF_WHERE_NODES_ARE)


def model_warnings(
    model: Model, fields: ContactFields, converged: bool = True, *, first: bool = True
) -> tuple[ResultWarning, ...]:
    """All warnings about a solved state of a model, in the order of its checks.

    What has not converged has no motion that could be judged.  first: no step went before.
    """
    left = (() if converged else OF_MOTIONS) + (() if first else AT_FIRST)
    checks = [check for check in model.formulation.doubts if check not in left]
    return tuple(warning for check in checks for warning in check(model, fields))
