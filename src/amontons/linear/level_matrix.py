"""What multigrid asks of the matrix of one level: a new kind of matrix is this, in one file.

Rows of 3x3 blocks, one per node; vectors are arrays (nodes, 3), which a matrix on another
device copies where it needs them.  There are `NodeBlocks`, stored, and `GridBlocks`, an
operator on a box; a cycle also takes `PatchedBlocks`, with some rows of one solve's own.
`Hierarchy.made_of` puts matrices of a new kind in, `FrictionProblem.with_hierarchy` has a
problem solved on them.  Coarse levels are copied where contacts change them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .node_blocks import NodeBlocks
    from .transfer import Transfer

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class LevelMatrix(Protocol):
    """The symmetric matrix A of a level.

    is_stored: False where products take no more time than to read the vectors.  is_positive:
    whether all unknowns have a stiffness of their own, which contact multigrid needs.
    """

    is_stored: ClassVar[bool]

    @property
    def nodes(self) -> int:
        """Number of block rows."""
        ...

    @property
    def is_positive(self) -> bool:
        """True where the diagonal is finite and above zero."""
        ...

    def times(self, x: Array, out: Array) -> None:
        """out = A x."""
        ...

    def residual(self, x: Array, b: Array, out: Array) -> None:
        """out = b - A x."""
        ...

    def smooth(self, b: Array, x: Array, held: NDArray[np.bool_], backward: bool) -> None:
        """x becomes better for A x = b; nodes that are held, (nodes,), stay as they are.

        backward: in reverse order, the transposed iteration, so that a cycle is symmetric.
        """
        ...

    def first_smooth(self, b: Array, x: Array, r: Array) -> None:
        """x = what the same makes of zero, and r = b - A x."""
        ...

    def rows(self, node: Index) -> NodeBlocks:
        """The block rows of some nodes, (k,), as the k rows of a stored matrix.

        Its `inverse`, (k, 3, 3), is that of the diagonal blocks.
        """
        ...

    def coarse(self, P: Transfer) -> LevelMatrix:
        """P^T A P, or as good a matrix of the next level, with ones at padding."""
        ...

    def stored(self) -> NodeBlocks:
        """The whole matrix; asked of levels that contacts change and of the coarsest one."""
        ...
