"""Linear systems of bodies in contact, condensed to what contact leaves free, by multigrid.

A row of a contact is an equation between the force lambda on its node and motions.  With the
singular value decomposition of its derivative by lambda, U S V^T, rows and unknowns of the node
are taken along the columns u of U.  Where S is small, the row is a constraint on motions (the
gap of what is closed, the slip of what sticks), else one on forces (what is open, the friction
of what slips).  With constraints c and all other unknowns r, and forces that contacts of the
second kind give to the other side taken back from there,

    [A_rr A_rc] [x_r]   [b_r]        S = A_rr - A_rc A_cc^-1 A_cr,                          (1)
    [A_cr A_cc] [x_c] = [b_c],       S x_r = b_r - A_rc A_cc^-1 b_c.

A_cc couples neighbours on the surface alone and is factorised; S is, but for friction and
turning normals, the stiffness of bodies whose constrained nodes follow the other side:
condensation as of dual mortar methods [WGW].  It is solved by GMRES with right preconditioner,
one V-cycle of `aggregation` on S formed with the diagonal of A_cc.

[WGW] T. Wiesner, M. Gee, A. Popp, W. Wall, "Algebraic multigrid methods for dual mortar finite
element formulations in contact mechanics", Int. J. Numer. Meth. Engng. 114 (2018).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.errors import SingularOperator
from .base import by_columns
from .direct import Direct
from .hierarchy import Hierarchy, Nodes
from .node_blocks import NodeBlocks

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
OF_FORCE = 0.5  # singular value, 1 for an open contact, above which a row is one on forces
LEAST = 0.2  # scale of such a row below which it stays as it is
DOMINANT = 1e-3  # of its row: a diagonal entry of A_cc that may stand for it
LOOSE = 1e-10  # resistance of a motion of whole parts, relative to all springs, that is none
PARTS = 60  # parts up to which their motions are examined
RESTART, MOST = 50, 150  # GMRES: vectors kept, and steps at most


@dataclass(frozen=True, eq=False)
class Structure:
    """What the unknowns (n,) of a matrix are, and the rows of contacts in it.

    dimension d; place (n,): 3 node + component, ascending; part (nodes,): number of the part
    that a node belongs to; modes (n, k): rigid motions of all parts where they are now.
    at (nc, d): unknowns of the contacts' nodes, -1 where supports hold them; by_force
    (nc, d, d): derivative of their rows by the forces on them; returned (n, nc d): forces that
    other unknowns get per force on the contacts, which are in the rows of these already.
    """

    dimension: int
    place: Index
    part: Index
    modes: Array
    at: Index
    by_force: Array
    returned: sparse.csr_array


@dataclass(frozen=True, eq=False)
class Axes:
    """u of every contact, axes (nc, d, d) in columns; constrained (nc, d); scale (nc, d).

    scale: factors of the rows along u, so that those on forces have u . lambda itself.
    """

    axes: Array
    constrained: Mask
    scale: Array

    @classmethod
    def of(cls, by_force: Array, free: Mask) -> Axes:
        """From derivatives (nc, d, d); free (nc, d): components that are unknowns."""
        d = by_force.shape[1]
        inner = np.where(free[:, :, None] & free[:, None, :], by_force, 0.0)
        held = 2.0 + np.abs(inner).sum(axis=(1, 2))  # the first singular values, apart
        inner[:, range(d), range(d)] += np.where(free, 0.0, held[:, None])
        left, size, right = np.linalg.svd(inner)
        along = size * np.einsum("pki,pik->pk", right, left)
        for p in np.flatnonzero(~free.all(axis=1)):  # every held one back to its own place
            order, rest = np.zeros(d, dtype=np.int64), np.count_nonzero(~free[p])
            for k in np.flatnonzero(~free[p]):
                order[k] = np.abs(left[p, k]).argmax()
            order[free[p]] = np.arange(rest, d)
            left[p], size[p], along[p] = left[p][:, order], size[p, order], along[p, order]
            left[p, ~free[p]], left[p][:, ~free[p]] = 0.0, 0.0
        constrained = (size < OF_FORCE) & free
        usual = ~constrained & (np.abs(along) > LEAST)
        return cls(left, constrained, np.where(usual, 1 / np.where(usual, along, 1.0), 1.0))


class Condensed:
    """(1) for a matrix (n, n): to x_r and back."""

    def __init__(self, matrix: sparse.sparray, structure: Structure) -> None:
        self.A = sparse.csr_array(matrix)
        n, self.structure = self.A.shape[0], structure
        at, free = structure.at, structure.at >= 0
        found = Axes.of(structure.by_force, free)
        constrained = np.zeros(n, dtype=bool)
        constrained[at[found.constrained]] = True
        self.rest, self.held = np.flatnonzero(~constrained), np.flatnonzero(constrained)
        self.turn = _turned(n, at, found.axes)
        rows = np.ones(n)
        rows[at[free]] = found.scale[free]
        rows = sparse.csr_array(sparse.diags_array(rows) @ self.turn)
        self._top = rows[self.held]
        left = sparse.csr_array(rows + _taken_back(structure, found) @ rows)
        self._left = left[self.rest]
        back = sparse.csr_array(self.turn.T)
        local = sparse.csr_array(self._top @ self.A @ back)
        self._across = sparse.csr_array(local[:, self.rest])
        self._own = sparse.csc_array(local[:, self.held])
        self._back = back
        self._solve = Direct().factor(self._own).solve if len(self.held) else np.copy

    def product(self, x: Array) -> Array:
        """S x, (r,)."""
        return self._left @ (self.A @ self.whole(x, np.zeros(len(self.held))))

    def whole(self, x: Array, held: Array) -> Array:
        """All unknowns (n,) of x (r,) and A_cc^-1 b_c (c,)."""
        out = np.empty(self.A.shape[0])
        out[self.rest] = x
        out[self.held] = held - self._solve(self._across @ x)
        return self._back @ out

    def reduced(self, b: Array) -> tuple[Array, Array]:
        """(b_r - A_rc A_cc^-1 b_c (r,), A_cc^-1 b_c (c,)) of b (n,)."""
        held = self._solve(self._top @ b)
        moved = np.zeros(len(b))
        moved[self.held] = held
        return self._left @ (b - self.A @ (self._back @ moved)), held

    def matrix(self) -> sparse.csr_array:
        """S with the diagonal of A_cc in place of it, (r, r)."""
        diagonal = self._own.diagonal()
        size = abs(self._own).sum(axis=1)
        firm = np.abs(diagonal) > DOMINANT * size
        inverse = np.where(firm, 1 / np.where(firm, diagonal, 1.0), 0.0)
        eye = sparse.csr_array(sparse.eye_array(self.A.shape[0]))
        onto = eye[:, self.rest] - eye[:, self.held] @ (
            sparse.diags_array(inverse) @ self._across
        )
        return sparse.csr_array(self._left @ (self.A @ sparse.csr_array(self._back @ onto)))

    @cached_property
    def modes(self) -> Array:
        """Rigid motions along the axes of contacts, (r, k)."""
        return (self.turn @ self.structure.modes)[self.rest]

    def hierarchy(self) -> Hierarchy:
        """Levels below S; raises SingularOperator where parts move without resistance."""
        S, structure = self.matrix(), self.structure
        place = structure.place[self.rest]
        own, node = np.unique(place // 3, return_inverse=True)
        part = structure.part[own]
        check_held(S, self.modes, part[node])
        nodes = Nodes(3 * node.astype(np.int64) + place % 3, len(own))
        A = NodeBlocks.from_sparse(S, None if nodes.plain else nodes.place, nodes.count)
        modes = np.zeros((3 * nodes.count, self.modes.shape[1]))
        modes[nodes.place] = self.modes
        return Hierarchy.of_parts(A, nodes, modes, part)


def _turned(n: int, at: Index, axes: Array) -> sparse.csr_array:
    """Unknowns along the axes of contacts, (n, n): U^T at contacts, else the identity."""
    d = at.shape[1]
    others = np.setdiff1d(np.arange(n), at[at >= 0])
    row = np.repeat(at[:, :, None], d, axis=2)
    column = row.swapaxes(1, 2)
    both = (row >= 0) & (column >= 0)
    values = axes.swapaxes(1, 2)[both]
    entries = np.concatenate([np.ones(len(others)), values])
    places = (
        np.concatenate([others, row[both]]), np.concatenate([others, column[both]])
    )  # fmt: skip
    return sparse.coo_array((entries, places), shape=(n, n)).tocsr()


def _taken_back(structure: Structure, found: Axes) -> sparse.csr_array:
    """Rows of forces times what is returned of these forces, (n, n)."""
    at, free = structure.at, structure.at >= 0
    nc, d = at.shape
    axes = np.where((free & ~found.constrained)[:, None, :], found.axes, 0.0)
    along = sparse.bsr_array((axes, np.arange(nc), np.arange(nc + 1)), shape=(nc * d, nc * d))
    flat = np.flatnonzero(free.ravel())
    n = structure.returned.shape[0]
    pick = sparse.csr_array(
        (np.ones(len(flat)), (flat, at.ravel()[flat])), shape=(nc * d, n)
    )
    return sparse.csr_array(structure.returned @ (along.tocsr() @ pick))


def check_held(S: sparse.csr_array, modes: Array, part: Index) -> None:
    """Raise SingularOperator where rigid motions of parts meet no resistance.

    modes (r, k), part (r,): which part an unknown belongs to.
    """
    parts, number = np.unique(part, return_inverse=True)
    if len(parts) > PARTS:
        raise SingularOperator(f"multigrid: {len(parts)} parts, {PARTS} are examined")
    r, k = modes.shape
    columns = (number[:, None] * k + np.arange(k)).ravel()
    pointers = np.arange(r + 1) * k
    own = sparse.csr_array((modes.ravel(), columns, pointers), shape=(r, k * len(parts)))
    dense = own.toarray() * np.sqrt(np.abs(S.diagonal()))[:, None]
    basis = np.zeros((k * len(parts), 0))
    for p in range(len(parts)):  # a few nodes have fewer motions
        mine = slice(p * k, (p + 1) * k)
        gram = dense[:, mine].T @ dense[:, mine]
        size, vectors = np.linalg.eigh(gram)
        good = size > LOOSE * max(size.max(initial=0.0), np.finfo(float).tiny)
        new = np.zeros((k * len(parts), np.count_nonzero(good)))
        new[mine] = vectors[:, good] / np.sqrt(size[good])
        basis = np.column_stack([basis, new])
    moved = own @ basis
    resistance = moved.T @ (S @ moved)
    values = np.linalg.svd(resistance, compute_uv=False)
    if values.min(initial=np.inf) < LOOSE:
        raise SingularOperator("multigrid: a part moves without resistance")


@dataclass(eq=False)
class CondensedFactor:
    """Solves by GMRES on S; levels may be those of an earlier matrix of the same form."""

    condensed: Condensed
    levels: Hierarchy
    exact: bool = False
    iterations: int = 0
    tolerance: float = 1e-10  # relative residual of S

    def solve(self, b: Array) -> Array:
        """The solution x of A x = b, shape of b; SingularOperator where GMRES fails."""
        return by_columns(lambda column: self.solved(column, self.tolerance), b)

    def solved(self, b: Array, tolerance: float) -> Array:
        """The same of b (n,) to a tolerance."""
        from scipy.sparse import linalg as sparse_linalg

        right, held = self.condensed.reduced(b)
        if not np.isfinite(right).all():
            raise SingularOperator("multigrid: a constraint can not be resolved")
        if not right.any():
            return self.condensed.whole(right, held)
        nodes = self.levels.nodes
        out = np.empty((nodes.count, 3))

        def cycled(x: Array) -> Array:
            self.levels.cycle(0, nodes.spread(x), out)
            return nodes.gather(out)

        def counted(_: float) -> None:
            self.iterations += 1

        operator = sparse_linalg.LinearOperator(
            (len(right), len(right)), lambda x: self.condensed.product(cycled(x)), dtype=float
        )
        x, failed = sparse_linalg.gmres(
            operator, right, rtol=tolerance, atol=0.0, restart=RESTART,
            maxiter=MOST // RESTART, callback=counted, callback_type="pr_norm",
        )  # fmt: skip
        if failed or not np.isfinite(x).all():
            raise SingularOperator(f"multigrid: no convergence in {MOST} steps of GMRES")
        return self.condensed.whole(cycled(x), held)
