"""Linear constraints eliminated: u = T z, all of them at once, and what supports add to it.

The displacements u (dofs,) of the nodes and of what is beside them stay what contact, pictures
and files are made of.  z are the independent ones among them, rotations of references scaled
to lengths, and the rigid motions of bodies that follow no reference, a (dofs, 6) basis each
with rotations scaled to the size of the body.  Rotations are small, as everywhere.

What supports prescribe of an independent one is known at once.  What they prescribe of others,
of nodes that follow a reference for one, binds several z, see `Bound`; the driven unknowns
among these remain in the discrete problem: a row of their own with a value, which no contact
force changes.  So a rigid body has 6 unknowns whatever holds it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph
from scipy.sparse import linalg as sparse_linalg

from ...core.errors import InvalidInput, SingularOperator
from ...linear.rigid_modes import rigid_modes
from ..elements.rigid import Rigid
from .beside import TURN, Beside
from .bound import Bound
from .chains import dependence
from .constraint_rows import Rows, coupled_nodes, is_rigid
from .constraints import Constraint, Coupling

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
CANCELLED = 1e-12  # of the sum of sizes: a sum that is rounding
LOST = 1e-9  # force on what nothing resists, relative to the largest, that is none


@dataclass(frozen=True, eq=False)
class Independent:
    """u = map @ z: map (dofs, nz), own (nz,) the dof that a z is, -1 for a rigid motion.

    scale (nz,): u = scale * z of these; loose (bodies, 6): the numbers of the motions of each
    body in `rigid` that follows no reference; dependent (m,): dofs that constraints eliminate;
    tied: all dofs that rows of constraints name, and those of these bodies.
    """

    map: sparse.csc_array
    own: Index
    scale: Array
    rigid: tuple[int, ...]
    loose: Index
    dependent: Index
    tied: Index

    @classmethod
    def of(
        cls, beside: Beside, constraints: Sequence[Constraint], is_fixed: Mask
    ) -> Independent:
        """Eliminate all constraints; raises InvalidInput that names the wrong one."""
        rows = Rows.of(constraints, beside)
        A = dependence(rows, constraints, beside, is_fixed)
        rigid = _without_reference(beside, constraints)
        hidden = np.zeros(beside.total, dtype=bool)
        for k in rigid:
            hidden[beside.offsets[k] : beside.offsets[k + 1]] = True
        kept = ~hidden
        kept[rows.dependent] = False
        own = np.flatnonzero(kept)
        scale = np.where(_turns(beside)[own], 1 / _size(beside), 1.0)
        blocks = [sparse.coo_array(
            (scale, (own, np.arange(len(own)))), shape=(beside.total, len(own))
        )]  # fmt: skip
        for k in rigid:
            modes = rigid_modes(beside.bodies[k].mesh.points)
            dofs = beside.offsets[k] + np.arange(len(modes))
            size = modes.shape[1]
            i, j = np.repeat(dofs, size), np.tile(np.arange(size), len(dofs))
            blocks.append(sparse.coo_array(
                (modes.ravel(), (i, j)), shape=(beside.total, modes.shape[1])
            ))  # fmt: skip
        kind = 3 if beside.dim == 2 else 6
        loose = len(own) + np.arange(len(rigid) * kind).reshape(len(rigid), kind)
        of_kept = sparse.csr_array(sparse.hstack(blocks, format="csr"))
        whole = of_kept
        if len(rows.dependent):
            put = sparse.coo_array(
                (np.ones(len(rows.dependent)),
                 (rows.dependent, np.arange(len(rows.dependent)))),
                shape=(beside.total, len(rows.dependent)),
            )  # fmt: skip
            whole = of_kept + put.tocsr() @ (A @ of_kept)
        tied = np.union1d(np.unique(rows.matrix.indices), np.flatnonzero(hidden))
        motions = np.full(loose.size, -1)
        return cls(sparse.csc_array(whole), np.concatenate([own, motions]),
                   np.concatenate([scale, np.ones(loose.size)]), rigid, loose, rows.dependent,
                   tied.astype(np.int64))  # fmt: skip


def _without_reference(beside: Beside, constraints: Sequence[Constraint]) -> tuple[int, ...]:
    """Rigid bodies whose motion is no displacement of a reference."""
    led = {
        int(np.searchsorted(beside.offsets, coupled_nodes(part, beside)[0][0, 0], side="right"))
        - 1
        for part in constraints if isinstance(part, Coupling) and is_rigid(part, beside)
    }  # fmt: skip
    found = tuple(
        k for k, body in enumerate(beside.bodies)
        if isinstance(body.material, Rigid) and k not in led
    )  # fmt: skip
    if found and beside.bodies[0].mesh.axisymmetric:
        name = beside.bodies[found[0]].name
        raise InvalidInput(
            f"a rigid body around an axis follows a reference: expected Coupling({name!r}, "
            "...) and the Reference among the constraints", ("bodies", found[0]),
            f"body {name!r}",
        )  # fmt: skip
    return found


def _turns(beside: Beside) -> Mask:
    """Which dofs are rotations, (dofs,)."""
    out = np.zeros(beside.total, dtype=bool)
    for entry in beside.entries.values():
        if entry.kind == TURN:
            out[entry.dofs] = True
    return out


def _size(beside: Beside) -> float:
    """A length of the model, by which rotations are scaled."""
    points = np.concatenate([body.mesh.points for body in beside.bodies])
    return float(np.ptp(points, axis=0).max()) / 2 or 1.0


@dataclass(frozen=True, eq=False)
class Elimination:
    """The unknowns y (n,) of a model with constraints, u = prescribed + spread @ y.

    spread (dofs, n), without what is driven; driven (n,): unknowns that supports prescribe;
    singles: z that are unknowns by themselves; given: z that a support prescribes by itself;
    bound: the groups of the others; idle: z that move nothing, and stay 0.
    """

    beside: Beside
    independent: Independent
    singles: Index
    given: Index
    bound: tuple[Bound, ...]
    idle: Index
    spread: sparse.csc_array
    driven: Mask
    constraints: Sequence[Constraint] = field(default=(), repr=False)

    @classmethod
    def of(
        cls, beside: Beside, constraints: Sequence[Constraint], is_fixed: Mask,
        sprung: Index,
    ) -> Elimination | None:  # fmt: skip
        """None where all bodies deform and nothing constrains them.

        sprung: dofs with springs.
        """
        rigid = any(isinstance(body.material, Rigid) for body in beside.bodies)
        if not (rigid or constraints or beside.count):
            return None
        found = Independent.of(beside, constraints, is_fixed)
        bound = _groups(beside, found, is_fixed)
        taken = np.zeros(found.map.shape[1], dtype=bool)
        for group in bound:
            taken[group.columns] = True
        own, known = found.own, np.zeros(len(found.own), dtype=bool)
        known[own >= 0] = is_fixed[own[own >= 0]]
        idle = _moves_nothing(found, beside, sprung) & ~taken & ~known
        singles = np.flatnonzero(~taken & ~known & ~idle)
        blocks = [found.map[:, singles]]
        driven = [np.zeros(len(singles), dtype=bool)]
        for group in bound:
            free = sparse.diags_array((~group.driven).astype(float))
            blocks.append(found.map[:, group.columns] @ (sparse.csc_array(group.basis) @ free))
            driven.append(group.driven)
        spread = sparse.csc_array(sparse.hstack(blocks, format="csc"))
        spread.eliminate_zeros()
        given = np.flatnonzero(known & ~taken)
        return cls(beside, found, singles, given, bound, np.flatnonzero(idle), spread,
                   np.concatenate(driven), constraints)  # fmt: skip

    @property
    def only_rigid(self) -> bool:
        """True where there are rigid bodies, and nothing else to eliminate."""
        return not (len(self.constraints) or self.beside.count)

    @property
    def dofs(self) -> Index:
        """All dofs on which constraints act."""
        return self.independent.tied

    def matrix(self, whole: sparse.csr_array) -> sparse.csc_array:
        """S^T A S for A (dofs, dofs), with the mean of its diagonal at what is driven."""
        inner = sparse.csc_array(self.spread.T @ whole @ self.spread)
        inner = _without_rounding(inner, self.spread, whole)
        size = np.abs(inner.diagonal())
        mean = float(size[size > 0].mean()) if (size > 0).any() else 1.0
        return sparse.csc_array(inner + sparse.diags_array(np.where(self.driven, mean, 0.0)))

    def gathered(self, force: Array) -> Array:
        """S^T force, (n, ...); raises SingularOperator for one on what nothing resists."""
        if self.idle.size and force.any():
            lost = np.abs(self.independent.map[:, self.idle].T @ force)
            lost = lost.reshape(len(self.idle), -1).max(axis=1)
            if lost.max() > LOST * np.abs(force).max():
                dof = int(self.independent.own[self.idle[int(lost.argmax())]])
                raise SingularOperator(
                    f"a force acts on {self.beside.where(dof)}, which moves no node: nothing "
                    "resists it", ("constraints",), "",
                )  # fmt: skip
        return self.spread.T @ force

    def driven_values(self, prescribed: Array) -> Array:
        """Unknowns (n,) that values (dofs,) on prescribed dofs demand, zero elsewhere."""
        return np.concatenate(
            [np.zeros(len(self.singles)), *(group.motion(prescribed) for group in self.bound)]
        )

    def completed(self, prescribed: Array) -> Array:
        """Values (dofs,) on prescribed dofs, continued over all that they move."""
        found = self.independent
        z = np.zeros(len(found.own))
        z[self.given] = prescribed[found.own[self.given]] / found.scale[self.given]
        for group in self.bound:
            z[group.columns] = group.basis @ group.motion(prescribed)
        return found.map @ z

    def nearest(self, values: Array, prescribed: Array) -> Array:
        """Values (dofs,) with the nearest motions that constraints and `prescribed` allow."""
        known = self.completed(prescribed)
        nodes = self.spread.tocsr()[: self.beside.first]
        normal = sparse.csc_array(nodes.T @ nodes)
        normal = normal + sparse.diags_array(np.where(normal.diagonal() > 0, 0.0, 1.0))
        left = nodes.T @ (values - known)[: self.beside.first]
        y: Any = sparse_linalg.spsolve(sparse.csc_array(normal), left)
        return known + self.spread @ np.atleast_1d(y)

    def held_by(self, rest: Array) -> Array:
        """Forces of supports (dofs,) in `rest` (dofs,), those of supports and constraints."""
        force, out = self.independent.map.T @ rest, np.zeros_like(rest)
        own = self.independent.own[self.given]
        out[own] = force[self.given] / self.independent.scale[self.given]
        for group in self.bound:
            out[group.at] = group.held_by(force[group.columns])
        return out


def _moves_nothing(found: Independent, beside: Beside, sprung: Index) -> Mask:
    """z (nz,) that move no node and no spring."""
    acts = np.zeros(beside.total, dtype=bool)
    acts[: beside.first] = True
    acts[sprung] = True
    return np.asarray(abs(found.map).T @ acts.astype(float)).ravel() == 0


def _groups(beside: Beside, found: Independent, is_fixed: Mask) -> tuple[Bound, ...]:
    """z that supports bind together, and those of rigid bodies: one group each."""
    plain = np.zeros(beside.total, dtype=bool)
    plain[found.own[found.own >= 0]] = True
    at = np.flatnonzero(is_fixed & ~plain)
    rows = found.map.tocsr()[at]
    nz, start = found.map.shape[1], np.full(found.map.shape[1], False)
    start[found.loose.ravel()] = True
    start[np.unique(rows.indices)] = True
    links = sparse.csr_array(abs(rows))
    ahead = np.repeat(found.loose[:, :1], found.loose.shape[1] - 1, axis=1).ravel()
    motions = sparse.coo_array(
        (np.ones(len(ahead)), (ahead, found.loose[:, 1:].ravel())), shape=(nz, nz)
    )
    graph = sparse.csr_array(links.T @ links) + motions
    _, label = csgraph.connected_components(graph, directed=False)
    out = []
    order = np.flatnonzero(start)
    for one in dict.fromkeys(label[order].tolist()):
        columns = order[label[order] == one]
        known = columns[(found.own[columns] >= 0)]
        known = known[is_fixed[found.own[known]]]
        mine = at[np.unique(sparse.csc_array(rows)[:, columns].nonzero()[0])]
        dofs = np.concatenate([mine, found.own[known]]).astype(np.int64)
        dense = found.map.tocsr()[dofs][:, columns].toarray()
        out.append(Bound.of(_words(beside, found, columns, dofs), columns, dofs, dense))
    return tuple(out)


def _words(beside: Beside, found: Independent, columns: Index, dofs: Index) -> str:
    """What is wrong where the values that supports give here contradict each other."""
    for body, numbers in zip(found.rigid, found.loose, strict=True):
        if np.isin(numbers, columns).any():
            return (f"body {beside.bodies[body].name!r} is rigid, and what they prescribe on "
                    "it is no small rigid motion")  # fmt: skip
    names = ", ".join(beside.where(int(dof)) for dof in dofs[:3])
    return (f"what they prescribe of {names}{', ...' if len(dofs) > 3 else ''} contradicts the "
            "constraints between these")  # fmt: skip


def _without_rounding(
    inner: sparse.csc_array, spread: sparse.csc_array, whole: sparse.csr_array
) -> sparse.csc_array:
    """Without what rounding leaves where all cancels: bodies that move as one hold nothing."""
    size = sparse.csc_array(abs(spread).T @ abs(whole) @ abs(spread))
    kept = abs(inner) > CANCELLED * size
    out = sparse.csc_array(inner.multiply(kept))
    out.eliminate_zeros()
    return out
