"""The basis in which contact between bodies looks like contact with an obstacle.

Where every contact couples the displacements of one slave node of its own, through an
orthonormal block and a number, with those of other nodes (closest points or dual mortar),

    u = a R v_s + B v_m + w,    v_s = vhat_s + C v_m  with  C = -R^T B / a
    =>    u = a R vhat_s + w.

a is 1 but where others leave their share to a node, see `mechanics.contact.mortar`.  In this
basis of [HSW] section 2, v = T vhat, the problem reads

    T' M T vhat = T' H r + T' f,    T' H having the slave blocks only.

The energy, the reactions r and the local displacements u stay what they are.

[HSW] S. Hüeber, G. Stadler, B. Wohlmuth, "A primal-dual active set algorithm for
three-dimensional contact problems with Coulomb friction", SIAM J. Sci. Comput. 30 (2008).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .friction import Form, FrictionProblem
from .structure import Structure

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SAME = 1e-10  # vectors of length 1 that differ by less are orthonormal
HELD = -1  # stands for a dof that a support holds


@dataclass(frozen=True, eq=False)
class OneSided:
    """A problem in the basis in which each contact sees one node only; n unknowns, nc contacts.

    M (n, n) and f (n,): T' M T and T' f.  dofs (nc, d): those of the slave node of a contact in
    ascending order, -1 (last) for each one that a support holds.  frames (nc, d, d):

        u = frames @ vhat[dofs] + w,    r acts on vhat[dofs] as frames' r,

    with a column of zeros where dofs is -1; others are orthogonal, of length scale (nc,).
    H (n, nc d): T' H.  levels: the problem's, with T^-1 levels[0].  near_nullspace: T^-1 of the
    problem's.  coupling (n, n): S C, so that T = I + S C and T^-1 = I - S C; None where T is
    the identity, and then all arrays are those of the problem, not copies.
    """

    M: sparse.csc_array
    H: sparse.csc_array
    f: Array
    dofs: Index
    frames: Array
    scale: Array
    levels: tuple[sparse.csr_array, ...] = ()
    near_nullspace: Array | None = None
    coupling: sparse.csr_array | None = None

    @property
    def axes(self) -> Array:
        """Frames with columns of length 1, (nc, d, d)."""
        return self.frames / self.scale[:, None, None]

    @property
    def inverse(self) -> Array:
        """A (nc, d, d) such that r = A @ (force on vhat[dofs]), vhat[dofs] = A' (u - w)."""
        return self.axes / self.scale[:, None, None]

    def to_displacement(self, vhat: Array) -> Array:
        """v = T vhat, (n,) or (n, k)."""
        return vhat if self.coupling is None else vhat + self.coupling @ vhat

    def from_displacement(self, v: Array) -> Array:
        """vhat = T^-1 v, (n,) or (n, k)."""
        return v if self.coupling is None else v - self.coupling @ v

    def to_load(self, force: Array) -> Array:
        """T' force, (n,) or (n, k): nodal forces in the hat basis."""
        return force if self.coupling is None else force + self.coupling.T @ force


def one_sided(problem: FrictionProblem) -> OneSided | None:
    """The problem in the one-sided basis; None where its H has not this structure.

    That is the case in the Delassus form, when a node is the slave of two contacts, with rigid
    bodies, and when a support holds a slave in a direction in which the other side can move.
    T' M T is formed once for all variants of the problem that share M and H.
    """
    if problem.form is not Form.GLOBAL:
        return None
    basis = problem.kept(_basis)
    if basis is None:
        return None
    M, H, dofs, frames, scale, coupling = basis
    assert problem.f is not None
    plain = OneSided(M, H, problem.f, dofs, frames, scale, problem.levels,
                     problem.near_nullspace, coupling)  # fmt: skip
    if coupling is None:
        return plain
    modes, levels = problem.near_nullspace, plain.levels
    if levels:
        finest = sparse.csr_array(levels[0])
        levels = (sparse.csr_array(finest - coupling @ finest), *levels[1:])
    if modes is not None:
        modes = plain.from_displacement(modes)
    f = plain.to_load(problem.f)
    return OneSided(M, H, f, dofs, frames, scale, levels, modes, coupling)


def _basis(problem: FrictionProblem) -> tuple | None:
    """(T' M T, T' H, dofs, frames, scale, S C or None), or None where H has not the structure.

    The slaves are those of the model; where they do not do, or are not known, they are looked
    for in H: of equal meshes either side will do.
    """
    found = None
    if problem.structure is not None:
        found = _basis_of(problem, problem.structure)
    return found if found is not None else _basis_of(problem, None)


def _basis_of(problem: FrictionProblem, structure: Structure | None) -> tuple | None:
    M, d, nc = problem.M, problem.dimension, problem.contacts
    assert M is not None and problem.H is not None
    H = sparse.csr_array(problem.H, copy=True)
    H.eliminate_zeros()
    dofs, frames, scale = slave_dofs(M, H, d, structure)
    own = np.zeros(H.shape[0])
    own[dofs[dofs != HELD]] = 1.0
    others = sparse.csr_array(sparse.diags_array(1 - own) @ H)
    others.eliminate_zeros()
    if not others.nnz:
        return M, problem.H, dofs, frames, scale, None
    tiles = sparse.bsr_array(
        (frames, np.arange(nc), np.arange(nc + 1)), shape=(nc * d, nc * d)
    ).tocsr()  # columns: slots of dofs
    squared = np.repeat(scale**2, d)
    onto_slaves = sparse.csr_array(others @ tiles @ sparse.diags_array(1 / squared))
    missed = others - onto_slaves @ tiles.T
    if missed.nnz and abs(missed).max() > SAME:
        return None
    onto_slaves.eliminate_zeros()
    slots = dofs.ravel()
    back = onto_slaves.T.tocoo()
    rows = slots[back.coords[0]]
    used = rows != HELD
    entries = (-back.data[used], (rows[used], back.coords[1][used]))
    coupling = sparse.coo_array(entries, shape=M.shape).tocsr()
    T = sparse.csc_array(coupling + sparse.eye_array(M.shape[0], format="csr"))
    Hhat = sparse.csc_array(sparse.diags_array(own) @ H)
    Hhat.eliminate_zeros()
    Mhat = sparse.csc_array(T.T @ M @ T)
    Mhat.sort_indices()
    return Mhat, Hhat, dofs, frames, scale, coupling


def slave_dofs(
    M: sparse.csc_array, H: sparse.csr_array, d: int, structure: Structure | None = None
) -> tuple[Index, Array, Array]:
    """(dofs (nc, d), frames (nc, d, d), scale (nc,)) of slaves of contacts, found in H's rows.

    Those of a slave act on its contact alone and are orthogonal, as long as scale says; slots
    without one are -1, with a column of zeros.  Where no structure tells the slave, their
    length is 1; where both sides qualify, the body that does so more often wins.
    """
    nc = H.shape[1] // d
    row, contact, vector, length = _rows_of_one_contact(H, d)
    taken = length == 1
    if structure is not None:
        taken = structure.node[row] == structure.slave[contact]
    row, contact, vector, length = row[taken], contact[taken], vector[taken], length[taken]
    if structure is None and np.bincount(contact, minlength=1).max() > d:
        order = np.argsort(_preference(M, H, d, row, contact), kind="stable")
        row, contact, vector, length = row[order], contact[order], vector[order], length[order]
    dofs = np.full((nc, d), HELD, dtype=np.int64)
    frames, scale = np.zeros((nc, d, d)), np.ones(nc)
    for slot in range(d):
        along = np.einsum("kij,ki->kj", frames[contact], vector)
        free = np.abs(along).max(axis=1, initial=0.0) < SAME * length**2
        free &= (slot == 0) | (np.abs(length - scale[contact]) < SAME * length)
        row, contact, vector, length = row[free], contact[free], vector[free], length[free]
        chosen, first = np.unique(contact, return_index=True)
        dofs[chosen, slot] = row[first]
        frames[chosen, :, slot] = vector[first]
        if slot == 0:
            scale[chosen] = length[first]
    return dofs, frames, scale


def _preference(
    M: sparse.csc_array, H: sparse.csr_array, d: int, row: Index, contact: Index
) -> Index:
    """Minus how many rows the same two bodies have on the body of this row, (k,)."""
    from scipy.sparse.csgraph import connected_components

    bodies, body = connected_components(M, directed=False)
    entries = H.tocoo()
    of, on = entries.coords[1] // d, entries.coords[0]
    low, high = np.full(H.shape[1] // d, bodies), np.full(H.shape[1] // d, -1)
    np.minimum.at(low, of, body[on])
    np.maximum.at(high, of, body[on])
    pair = low[contact] * bodies + high[contact]
    _, key, count = np.unique(
        pair * bodies + body[row], return_inverse=True, return_counts=True
    )
    return -count[key]


def _rows_of_one_contact(
    H: sparse.csr_array, d: int
) -> tuple[Index, Index, Array, Array]:
    """Rows of H that touch one contact only: numbers, contacts, entries (k, d), lengths."""
    counts = np.diff(H.indptr)
    owner = np.repeat(np.arange(H.shape[0]), counts)
    block = H.indices // d
    first = np.zeros(H.shape[0], dtype=np.int64)
    first[owner[::-1]] = block[::-1]
    single = counts > 0
    single[owner[block != first[owner]]] = False
    length = np.sqrt(np.bincount(owner, H.data**2, minlength=H.shape[0]))
    length[np.abs(length - 1) < SAME] = 1.0
    taken = single[owner]
    row = np.flatnonzero(single)
    vector = np.zeros((len(row), d))
    place = np.cumsum(single) - 1
    vector[place[owner[taken]], H.indices[taken] % d] = H.data[taken]
    return row, first[row], vector, length[row]
