"""Constraints as rows of C u = 0, each with the degree of freedom that it eliminates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, within
from ..elements.rigid import Rigid
from ..meshes.mesh import unknown
from ..meshes.surfaces import facet_normals, surface_load
from .beside import POINT, Beside
from .constraints import (
    DISTRIBUTING,
    ROTATION,
    Axes,
    Constraint,
    Coupling,
    Equation,
    Pretension,
    Spring,
    Term,
)
from .supports import locate

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SAME_PLACE = 1e-6  # of the size of a section: partners of a pretension that are at one place


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of C u = 0: matrix (m, dofs), dependent (m,) dof of each, and whose they are, (m,).

    owner: number of the constraint in the model.
    """

    matrix: sparse.csr_array
    dependent: Index
    owner: Index

    @classmethod
    def of(cls, constraints: Sequence[Constraint], beside: Beside) -> Rows:
        """Of all constraints of a model; raises InvalidInput that names one of them."""
        parts = []
        for k, part in enumerate(constraints):
            with within("constraints", k):
                parts.append(_rows(part, beside))
        blocks = [rows for rows, _ in parts] or [sparse.csr_array((0, beside.total))]
        matrix = sparse.csr_array(sparse.vstack(blocks, format="csr"))
        matrix.sum_duplicates()
        matrix.eliminate_zeros()
        dependent = np.concatenate([np.zeros(0, dtype=np.int64), *(d for _, d in parts)])
        sizes = [len(d) for _, d in parts]
        return cls(matrix, dependent, np.repeat(np.arange(len(parts)), sizes))


def _rows(part: Constraint, beside: Beside) -> tuple[sparse.csr_array, Index]:
    if isinstance(part, Equation):
        return equations(part.terms, beside)
    if isinstance(part, Pretension):
        return _section(part, beside)
    if isinstance(part, Axes):
        return _turned(part, beside)
    return _coupled(part, beside)


def _matrix(columns: Index, factors: Array, beside: Beside) -> sparse.csr_array:
    """Rows with factors (m, k) at columns (m, k)."""
    m, k = columns.shape
    rows = np.repeat(np.arange(m), k)
    entries = (np.broadcast_to(factors, (m, k)).ravel(), (rows, columns.ravel()))
    return sparse.csr_array(sparse.coo_array(entries, shape=(m, beside.total)))


def equations(terms: Sequence[Term], beside: Beside) -> tuple[sparse.csr_array, Index]:
    """The rows of terms, and their first dofs."""
    columns = []
    for k, (where, component, _) in enumerate(terms):
        with within("terms", k):
            entry = beside.named(where)  # type: ignore[arg-type]  # a name or not
            dofs = beside.nodes(where)[0] if entry is None else entry.dofs
            if component >= dofs.shape[1]:
                raise InvalidInput(
                    f"component: expected one below {dofs.shape[1]} of {where!r}, got "
                    f"{component}"
                )
            columns.append(dofs[:, component])
    count = max(len(c) for c in columns)
    for k, column in enumerate(columns):
        if len(column) not in (1, count):
            raise InvalidInput(
                f"expected 1 node or {count}, as another term has, got {len(column)}",
                ("terms", k), "",
            )  # fmt: skip
    table = np.stack([np.broadcast_to(c, (count,)) for c in columns], axis=1)
    factors = np.array([factor for _, _, factor in terms])
    return _matrix(table, factors[None], beside), table[:, 0]


def _turned(part: Axes, beside: Beside) -> tuple[sparse.csr_array, Index]:
    """u = axes^T e of each node, e being the components along the axes."""
    entry = beside.entries[part.name]
    dofs, _ = beside.nodes(part.on)
    assert entry.axes is not None
    d = dofs.shape[1]
    along = np.repeat(entry.dofs[:, None], d, axis=1)
    columns = np.concatenate([dofs[:, :, None], along], axis=2)
    factors = np.concatenate(
        [np.ones((len(dofs), d, 1)), -np.swapaxes(entry.axes, 1, 2)], axis=2
    )
    return _matrix(columns.reshape(-1, d + 1), factors.reshape(-1, d + 1), beside), dofs.ravel()


def _section(part: Pretension, beside: Beside) -> tuple[sparse.csr_array, Index]:
    """u(side) - u(partner) - normal * length = 0 of each node of the first side."""
    with within("sides"):
        sides = [locate(beside.bodies, name) for name in part.sides]
    (k, name), (j, other) = sides
    mesh, partner = beside.bodies[k].mesh, beside.bodies[j].mesh
    nodes, others = mesh.surface_nodes(name), partner.surface_nodes(other)
    size = float(np.ptp(mesh.points[nodes], axis=0).max())
    from scipy.spatial import cKDTree

    tree = cKDTree(partner.points[others])
    away, at = tree.query(mesh.points[nodes])
    if len(nodes) != len(others) or away.max(initial=0.0) > SAME_PLACE * size:
        worst = mesh.points[nodes[int(away.argmax())]].tolist()
        raise InvalidInput(
            f"expected two surfaces with nodes at the same places, got {len(nodes)} and "
            f"{len(others)} nodes, and none of {other!r} at {worst}; `opened` makes such a "
            "section", ("sides",), f"pretension {part.name!r}",
        )  # fmt: skip
    if (k, name) == (j, other) or (k == j and (nodes == others[at]).any()):
        raise InvalidInput("expected sides that share no node", ("sides",),
                           f"pretension {part.name!r}")  # fmt: skip
    normal = part.normal if part.normal is not None else _mean_normal(mesh, name)
    d = mesh.dim
    if len(normal) != d:
        raise InvalidInput(f"expected {d} components, got {len(normal)}", ("normal",),
                           f"pretension {part.name!r}")  # fmt: skip
    own = (beside.offsets[k] + nodes[:, None] * d + np.arange(d)).ravel()
    facing = (beside.offsets[j] + others[at][:, None] * d + np.arange(d)).ravel()
    length = np.full(len(own), beside.entries[part.name].dofs[0, 0])
    factors = np.stack([np.ones(len(own)), -np.ones(len(own)), -np.tile(normal, len(nodes))],
                       axis=1)  # fmt: skip
    return _matrix(np.stack([own, facing, length], axis=1), factors, beside), own


def _mean_normal(mesh, name: str) -> Array:  # noqa: ANN001
    total = np.zeros(mesh.dim)
    for facets in mesh.surface(name):
        normals = facet_normals(mesh.points, facets)
        total += normals.reshape(-1, mesh.dim).sum(axis=0)
    size = float(np.linalg.norm(total))
    if not size:
        raise InvalidInput(f"surface {name!r}: has no mean normal; give one", ("normal",), "")
    return total / size


# ------------------------------------------------------------------------------- couplings
def _coupled(part: Coupling, beside: Beside) -> tuple[sparse.csr_array, Index]:
    entry = beside.named(part.reference)
    if entry is None or entry.kind != POINT:
        known = [n for n, e in beside.entries.items() if e.kind == POINT]
        raise InvalidInput(
            unknown("reference", part.reference, known), ("reference",),
            f"coupling of {part.on!r}",
        )  # fmt: skip
    with within("on"):
        dofs, points = coupled_nodes(part, beside)
    turn = beside.entries[part.reference + ROTATION].dofs[0]
    arms = points - entry.points[0]
    if part.kind == DISTRIBUTING and not is_rigid(part, beside):
        weights = _weights(part, beside)
        return _shared(dofs, arms, weights, entry.dofs[0], turn, beside)
    chosen = range(beside.dim) if part.components is None else part.components
    if max(chosen) >= beside.dim:
        raise InvalidInput("expected 0 and 1 in 2D", ("components",),
                           f"coupling of {part.on!r}")  # fmt: skip
    blocks = [_following(dofs, arms, c, entry.dofs[0], turn, beside) for c in chosen]
    matrix = sparse.csr_array(sparse.vstack(blocks, format="csr"))
    return matrix, np.concatenate([dofs[:, c] for c in chosen])


def _following(
    dofs: Index, arms: Array, c: int, point: Index, turn: Index, beside: Beside
) -> sparse.csr_array:
    """u_c - U_c - (theta x arm)_c = 0."""
    n = len(dofs)
    if beside.dim == 2:
        across = -arms[:, 1] if c == 0 else arms[:, 0]
        lever, turns = across[:, None], turn[:1]
    else:
        i, j = (c + 1) % 3, (c + 2) % 3  # (theta x arm)_c = theta_i arm_j - theta_j arm_i
        lever, turns = np.stack([arms[:, j], -arms[:, i]], axis=1), turn[[i, j]]
    columns = np.column_stack([dofs[:, c], np.full(n, point[c]), np.tile(turns, (n, 1))])
    factors = np.column_stack([np.ones(n), -np.ones(n), -lever])
    return _matrix(columns, factors, beside)


def _shared(
    dofs: Index, arms: Array, weights: Array, point: Index, turn: Index, beside: Beside
) -> tuple[sparse.csr_array, Index]:
    """The rigid motion at the reference that fits all nodes best, with their weights (k,).

    So a force there is shared as a uniform traction, a moment as a linear one.
    """
    n, d = arms.shape
    modes = np.zeros((n, d, d + len(turn)))
    modes[:, :, :d] = np.eye(d)
    if d == 2:
        modes[:, 0, 2], modes[:, 1, 2] = -arms[:, 1], arms[:, 0]
    else:
        for c in range(3):
            modes[:, (c + 1) % 3, d + c], modes[:, (c + 2) % 3, d + c] = (
                -arms[:, (c + 2) % 3], arms[:, (c + 1) % 3],
            )  # fmt: skip
    size = float(np.abs(arms).max()) or 1.0
    flat = modes.reshape(n * d, -1)
    flat[:, d:] /= size
    root = np.repeat(np.sqrt(weights / weights.mean()), d)
    if np.linalg.matrix_rank(root[:, None] * flat, tol=1e-6 * np.sqrt(n)) < flat.shape[1]:
        raise InvalidInput(
            "a distributing coupling needs nodes that are on no line (in 2D: two nodes), else "
            "they can not take a moment"
        )
    fit: Array = np.linalg.pinv(root[:, None] * flat) * root  # type: ignore[assignment]
    fit[d:] /= size
    own = np.concatenate([point, turn])
    columns = np.column_stack([own, np.tile(dofs.ravel(), (len(own), 1))])
    factors = np.column_stack([np.ones(len(own)), -fit])
    return _matrix(columns, factors, beside), own


def _weights(part: Coupling, beside: Beside) -> Array:
    """Areas of the nodes of a surface, 1 for those of a node set."""
    k, _ = beside._numbered(part.on)
    mesh = beside.bodies[k].mesh
    name = part.on.removeprefix(f"{beside.bodies[k].name}.")
    if name not in mesh.surfaces:
        return np.ones(len(beside.nodes(part.on)[0]))
    along = np.zeros_like(mesh.points)
    along[:, 0] = 1.0
    areas = surface_load(mesh.points, mesh.surface(name), along)[:, 0]
    return np.maximum(areas[mesh.surface_nodes(name)], 0.0)


def coupled_nodes(part: Coupling, beside: Beside) -> tuple[Index, Array]:
    """Dofs and points of the nodes of a coupling; of a rigid body all of them."""
    k, _ = beside._numbered(part.on)
    if isinstance(beside.bodies[k].material, Rigid):
        points = beside.bodies[k].mesh.points
        dofs = beside.offsets[k] + np.arange(points.size).reshape(points.shape)
        return dofs, points
    return beside.nodes(part.on)


def is_rigid(part: Coupling, beside: Beside) -> bool:
    """True where the nodes are those of a rigid body."""
    return isinstance(beside.bodies[beside._numbered(part.on)[0]].material, Rigid)


def spring_stiffness(
    springs: Sequence[Spring], beside: Beside
) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Stiffness (dofs, dofs) of all springs, and rows (k, dofs) whose product is a stretch."""
    none = sparse.csr_array((0, beside.total))
    out, every = sparse.csr_array((beside.total, beside.total)), [none]
    for k, spring in enumerate(springs):
        with within("springs", k):
            rows, _ = equations(spring.terms, beside)
        out = out + spring.stiffness * (rows.T @ rows)
        every.append(rows if spring.stiffness else none)
    return sparse.csr_array(out), sparse.csr_array(sparse.vstack(every, format="csr"))
