"""What the contact multigrid prepares of a problem: nodes, levels, contacts on every level."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...linear.blocks import spatial
from ...linear.chunks import better_numbers
from ...linear.halves import Halves
from ...linear.hierarchy import Hierarchy, Level, Nodes, append_level
from ...linear.node_blocks import NodeBlocks, slots_of_rows
from ...linear.transfer import Transfer
from ...problem.friction import FrictionProblem
from ...problem.law.law import BOUND
from ...problem.one_sided import OneSided, one_sided
from ..contract import Breakdown, Iterate
from .nodes import ContactNodes
from .truncation import Truncation

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Integers = NDArray[np.integer]
TINY = float(np.finfo(float).tiny)
ROUNDING = 1e-13  # of the weights of a prolongation


@dataclass(eq=False)
class ContactLevels:
    """Of M and H alone: shared by all variants of a problem.

    contacts: those of the finest level without a law; coarse: per coarser level the contacts
    that sit on one of its nodes, (k,), and these contacts there.
    """

    basis: OneSided
    nodes: Nodes
    hierarchy: Hierarchy
    contacts: ContactNodes
    coarse: list[tuple[Index, ContactNodes]]
    truncation: Truncation

    @classmethod
    def of(cls, problem: FrictionProblem) -> ContactLevels:
        """Prepared once for all variants; raises Breakdown where the structure is missing."""
        return problem.kept(_prepare)

    # ------------------------------------------------------------------ the finest level
    def finest(self, problem: FrictionProblem) -> tuple[ContactNodes, Array, float, float]:
        """Contacts under the problem's law, load (nodes, 3), sizes of load and of u."""
        assert problem.w is not None and problem.f is not None
        contacts = self.contacts.under(problem.law, spatial(problem.w), problem.rho)
        f = self.nodes.spread(self.basis.to_load(problem.f))
        load, length = problem.scales
        return contacts, f, max(load, TINY), max(length, TINY)

    def start(self, problem: FrictionProblem, start: Iterate) -> Array:
        """First v at the nodes: of the start, else what continues prescribed displacements."""
        v = start.v if start.v is not None else problem.guess
        if v is None:
            return np.zeros((self.nodes.count, 3))
        return self.nodes.spread(self.basis.from_displacement(np.asarray(v)))

    def displacement(self, x: Array) -> Array:
        """v, (n,), of nodal values."""
        return self.basis.to_displacement(self.nodes.gather(x))

    # ------------------------------------------------------------------ coarser levels
    def coarse_problems(
        self, problem: FrictionProblem, x: Array, f: Array
    ) -> list[tuple[ContactNodes, Array]]:
        """Contacts and load of the coarser levels for a correction of x, that of the guess.

        f: the load at the nodes, (nodes, 3), whose padding becomes zero.
        Galerkin loads; gaps at the contacts that sit on coarse nodes; Tresca's bounds summed.
        """
        if not self.coarse:
            return []
        assert problem.w is not None and problem.f is not None
        levels = self.hierarchy.levels
        if problem.guess is not None:
            load = problem.f - problem.times_M(problem.guess)
            f = self.nodes.spread(self.basis.to_load(load))
        w = spatial(problem.w) + np.einsum("kai,ka->ki", self.contacts.H, x[self.contacts.node])
        bound = np.zeros(levels[0].A.nodes)
        bound[self.contacts.node] = problem.law.parameters[:, BOUND]
        bound[~np.isfinite(bound)] = 0.0
        out = []
        for k, (kept, contacts) in enumerate(self.coarse):
            P = levels[k].P
            assert P is not None
            restricted = np.empty((P.coarse, 3))
            P.restrict(f, restricted)
            bound = P.restrict_few(bound)
            law = problem.law.at(kept).with_bounds(bound[contacts.node])
            out.append((contacts.under(law, w[kept], contacts.rho), restricted))
            f = restricted
        return out

    def coarse_scales(self, k: int, f: Array, problem: FrictionProblem) -> tuple[float, float]:
        """Sizes of load and u on level k."""
        load, length = problem.scales
        share = len(self.coarse[k - 1][0]) / len(self.contacts.node)
        size = float(np.linalg.norm(f))
        return max(size if size > 0 else load, TINY), max(length * np.sqrt(share), TINY)


def _prepare(problem: FrictionProblem) -> ContactLevels:
    basis = one_sided(problem)
    if basis is None:
        raise Breakdown(
            "contact multigrid: a contact has no slave node of its own, or an orthotropic law"
        )
    hierarchy = problem.hierarchy
    if hierarchy is None:
        raise Breakdown("contact multigrid: the unknowns do not come in nodes")
    if basis.coupling is not None:
        hierarchy = _in_basis(hierarchy, basis)
    A = hierarchy.levels[0].A
    contacts = ContactNodes.of(basis, hierarchy.nodes, A)
    if contacts is None:
        raise Breakdown("contact multigrid: the contacts do not sit on nodes of their own")
    if not A.is_positive:
        raise Breakdown("contact multigrid: M has a diagonal block that is not positive")
    coarse = _coarse_contacts(hierarchy, contacts)
    touched = [contacts.node, *(c.node for _, c in coarse)]
    truncation = Truncation(hierarchy, touched)
    if basis.coupling is not None and contacts.bulk is not None and len(hierarchy.levels) > 1:
        assert isinstance(A, NodeBlocks)  # nobody else has these
        halves = Halves.of(A, contacts.bulk)
        if halves is not None:
            hierarchy.levels[0] = hierarchy.levels[0].of(halves)
            contacts.bulk = None
    return ContactLevels(basis, hierarchy.nodes, hierarchy, contacts, coarse, truncation)


def _in_basis(hierarchy: Hierarchy, basis: OneSided) -> Hierarchy:
    """Levels in one-sided bases: T' M T, and T^-1 P T_c with such a basis T_c of each level.

    A contact whose slave node is one of the coarse level too sees there the coarse values of
    the master side at its place, so that it has one node of its own on every level.
    """
    nodes = hierarchy.nodes
    A = nodes.blocks(basis.M)
    number = better_numbers(A.indptr, A.indices)
    if number is not None:
        nodes, A = nodes.renumbered(number), A.renumbered(number)
    contact = nodes.place[basis.dofs[:, 0]] // 3
    last, changed = _numbers_with_last(A, contact, contact[:0])
    nodes, A, contact = nodes.renumbered(last), A.renumbered(last), last[contact]
    number = last if number is None else last[number]
    levels = [Level(A)]
    size = 3 * nodes.count
    C = basis.coupling.tocoo()
    entries = (C.data, (nodes.place[C.coords[0]], nodes.place[C.coords[1]]))
    coupling = sparse.coo_array(entries, shape=(size, size)).tocsr()
    coarse: Index | None = None
    for k in range(len(hierarchy.levels) - 1):
        P = hierarchy.levels[k].P
        assert P is not None
        P = P.renumbered(number if k == 0 else None, None)
        if coupling.nnz:
            P, coupling = _between_bases(P, coupling, geometric=k + 1 < hierarchy.geometric)
        coarse = append_level(levels, P, coarse)
        P, A = levels[k].P, levels[k + 1].A
        assert P is not None and isinstance(A, NodeBlocks)
        found = _on_coarse(P, contact) if k + 1 < hierarchy.geometric else None
        contact = contact[:0] if found is None else found[1]
        above = P.indices[slots_of_rows(P.indptr, changed)[0]]
        last, changed = _numbers_with_last(A, contact, above)
        levels[k].P, levels[k + 1] = P.renumbered(None, last), Level(A.renumbered(last))
        coarse, contact = last if coarse is None else last[coarse], last[contact]
    out = Hierarchy(levels, hierarchy.geometric, nodes)
    return out if hierarchy.kind is None else out.made_of(hierarchy.kind)


def _numbers_with_last(A: NodeBlocks, contact: Index, above: Integers) -> tuple[Index, Index]:
    """(New numbers of nodes, (n,), nodes that the contacts change, numbered so).

    These come last, above: those of a finer level; behind them what contacts touch, and the
    contacts: others are swept and evaluated in one stream of memory then.
    """
    rank = np.zeros(A.nodes, dtype=np.int8)
    rank[above] = 1
    rank[A.indices[A.slots(contact)[0]]] = 2
    rank[contact] = 3
    number = np.empty(A.nodes, dtype=np.int64)
    number[np.argsort(rank, kind="stable")] = np.arange(A.nodes)
    return number, np.arange(np.count_nonzero(rank == 0), A.nodes)


def _between_bases(
    P: Transfer, coupling: sparse.csr_array, geometric: bool
) -> tuple[Transfer, sparse.csr_array]:
    """((I - S C) P (I + S_c C_c), S_c C_c) for S C, (3 fine, 3 fine), of the finer level.

    S_c C_c, (3 coarse, 3 coarse), are the rows of S C P at the nodes of both levels.
    """
    matrix = P.masked()
    below = sparse.csr_array(coupling @ matrix)
    coarse = sparse.csr_array((matrix.shape[1],) * 2)
    if geometric:
        node = np.unique(coupling.tocoo().coords[0] // 3)
        parent = _parent(P, node)
        node, parent = node[parent >= 0], parent[parent >= 0]
        slot = np.arange(3)
        pick = sparse.coo_array(
            (
                np.ones(3 * len(node)),
                ((3 * parent[:, None] + slot).ravel(), (3 * node[:, None] + slot).ravel()),
            ),
            shape=(matrix.shape[1], matrix.shape[0]),
        ).tocsr()
        found = sparse.csr_array(pick @ below)
        if not (found @ found).nnz:  # else a master node is a slave itself on the coarse level
            coarse = found
    out = matrix - below
    if coarse.nnz:
        out = out + out @ coarse
    out = sparse.csr_array(out)
    out.data[np.abs(out.data) < ROUNDING] = 0.0
    out.eliminate_zeros()
    tiles = sparse.bsr_array(out.tobsr((3, 3)))
    return Transfer.of(tiles, P.idle, P.coarse_idle), coarse


def _coarse_contacts(
    hierarchy: Hierarchy, contacts: ContactNodes
) -> list[tuple[Index, ContactNodes]]:
    """On the given levels, as long as there are contacts: (contacts, contacts there)."""
    out: list[tuple[Index, ContactNodes]] = []
    kept = np.arange(len(contacts.node))
    for k in range(1, hierarchy.geometric):
        P, A = hierarchy.levels[k - 1].P, hierarchy.levels[k].A
        assert P is not None
        on_coarse = _on_coarse(P, contacts.node)
        if on_coarse is None:
            break
        found, node = on_coarse
        kept = kept[found]
        contacts = contacts.at(found, node, A)
        out.append((kept, contacts))
    return out


def _on_coarse(P: Transfer, node: Index) -> tuple[NDArray[np.bool_], Index] | None:
    """Which of the nodes of contacts are nodes of the coarse level, and where these are there.

    None where there are none, or no nodes of their own.
    """
    if len(P.blocks):
        return None
    parent = _parent(P, node)
    found = parent >= 0
    if not found.any() or len(np.unique(parent[found])) < found.sum():
        return None
    return found, parent[found]


def _parent(P: Transfer, node: NDArray[np.integer]) -> Index:
    """The coarse node that a fine node is, -1 where it is none."""
    first = P.indptr[node]
    single = np.diff(P.indptr)[node] == 1
    at = np.where(single, first, 0)
    same = single & (np.abs(P.weights[at] - 1) < 1e-12)
    return np.where(same, P.indices[at], -1).astype(np.int64)
