"""Contact fields at the nodes of both sides of all pairs, for viewers.

What a master node shows are means over the contacts that act on it.  With N the weight of the
node in a contact of area w, its share is |N| w: of second order, or where a contact covers a
part of a facet, weights of either sign nearly cancel, and are no mean then.  Its force is the
one that the contact's rows give it: the forces of both sides cancel.
"""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import fields as fields_of
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..linear.blocks import spatial
from ..mechanics.meshes.cells import CELLS
from ..mechanics.model.faced import Onto
from ..mechanics.model.matching import pairs_of

if TYPE_CHECKING:
    from ..mechanics.model import ContactFields, Model
    from ..mechanics.model.placing import Placed

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
OFF = -1  # CSTATUS of nodes that are no contact; the other contact fields are zero there
SLAVE, MASTER = 1, 2  # CSIDE, added up where a node is both
NONE = 1e-9  # weight of a node in a contact that is none


@dataclass(frozen=True, eq=False)
class _Side:
    """Values at k nodes of one side of contacts; at (k,): nodes of the whole model.

    side, status, sliding (k,); gap, pressure, slip, path, work (k,); shear, traction, force
    (k, d) in global axes.
    """

    at: Index
    side: Index
    status: Index
    sliding: Index
    gap: Array
    pressure: Array
    slip: Array
    path: Array
    work: Array
    shear: Array
    traction: Array
    force: Array


def contact_fields(
    model: Model, fields: ContactFields, sliding: NDArray[np.bool_], starts: Index
) -> dict[str, NDArray]:
    """Values per node of all bodies; starts: first node of every body, and their number.

    COPEN gap, CPRESS pressure, CSHEAR and CSLIP lengths of the shear traction and of the
    tangential displacement since the start, CSLIP_ACCUMULATED length of the way slid,
    CFRICTION_WORK energy per undeformed area that it took, CSTATUS 0 open, 1 slip, 2 stick and
    -1 off the contact surfaces, CSLIDING 0 or 1, CSIDE 1 slave, 2 master, 3 both, CFORCE force
    and CTRACTION force per area on the body, global axes.  Areas of pressures and tractions are
    those of `ContactFields`.

    Where several pairs meet at a node, forces, pressures and tractions are summed up; COPEN is
    the least of them, the others are the most.
    """
    sides = [_slaves(model, fields, sliding, starts)]
    for k, (contact, placed, numbers) in enumerate(pairs_of(model)):
        if contact.master is None:
            continue
        now = None if fields.faced is None else fields.faced.onto[k]
        onto = _onto(placed, numbers, fields, int(starts[placed.body])) if now is None else now
        sides += _masters(sides[0], onto, numbers, fields)
    whole = _Side(*(
        np.concatenate([getattr(side, field.name) for side in sides])
        for field in fields_of(_Side)
    ))  # fmt: skip
    nodes, index = np.unique(whole.at, return_inverse=True)
    shear = np.linalg.norm(_gathered(np.add, whole.shear, index), axis=1)
    found = {
        "COPEN": _gathered(np.minimum, whole.gap, index),
        "CPRESS": _gathered(np.add, whole.pressure, index), "CSHEAR": shear,
        "CSLIP": _gathered(np.maximum, whole.slip, index),
        "CSLIP_ACCUMULATED": _gathered(np.maximum, whole.path, index),
        "CFRICTION_WORK": _gathered(np.maximum, whole.work, index),
        "CSTATUS": _gathered(np.maximum, whole.status, index),
        "CSLIDING": _gathered(np.maximum, whole.sliding, index),
        "CSIDE": _gathered(np.bitwise_or, whole.side, index),
        "CFORCE": spatial(_gathered(np.add, whole.force, index)),
        "CTRACTION": spatial(_gathered(np.add, whole.traction, index)),
    }  # fmt: skip
    out = {}
    for name, values in found.items():
        everywhere = np.zeros((starts[-1], *values.shape[1:]), dtype=values.dtype)
        if name == "CSTATUS":
            everywhere[:] = OFF
        everywhere[nodes] = values
        out[name] = everywhere
    known = np.zeros(starts[-1], dtype=bool)
    known[nodes] = True
    for name, values in out.items():
        if values.ndim == 1:
            out[name] = _filled(values, fields, starts, known)
    return out


def _slaves(
    model: Model, fields: ContactFields, sliding: NDArray[np.bool_], starts: Index
) -> _Side:
    """All contacts on their slaves."""
    at = starts[fields.body] + fields.node
    share, undeformed = _shares(model, fields, at), model.discretisation.sites.weights
    shear = np.einsum("ik,ikc->ic", fields.shear, fields.frames[:, 1:])
    return _Side(
        at, np.full(len(at), SLAVE), fields.status.astype(np.int64), sliding.astype(np.int64),
        fields.gap, share * fields.pressure, np.linalg.norm(fields.slip, axis=1), fields.path,
        fields.friction_work / undeformed, share[:, None] * shear,
        share[:, None] * (shear + fields.pressure[:, None] * fields.frames[:, 0]), fields.force,
    )  # fmt: skip


def _onto(placed: Placed, numbers: Index, fields: ContactFields, first: int) -> Onto:
    """What contacts of a pair give its master; first: first node of the slave's body."""
    d = fields.points.shape[1]
    own = placed.rows.H.tocoo()
    shape: Any = placed.H.shape
    moved = (own.coords[0] + first * d, own.coords[1])
    H = sparse.csc_array(placed.H - sparse.coo_array((own.data, moved), shape=shape).tocsc())
    N = _weights(sparse.csc_array(H[:, ::d]), fields.frames[numbers, 0])
    r = np.column_stack([fields.pressure, fields.shear])[numbers]
    r = r * fields.weights[numbers, None]
    force = (H @ r.ravel()).reshape(-1, d)
    return Onto(np.arange(len(force)), sparse.csr_array(N), force)


def _masters(slaves: _Side, onto: Onto, numbers: Index, fields: ContactFields) -> list[_Side]:
    """The contacts of a pair on its master; an empty list where they act on no node."""
    N = onto.parts.tocoo()
    if not N.nnz:
        return []
    node, contact = (np.asarray(each, dtype=np.int64) for each in N.coords)
    some, index = np.unique(node, return_inverse=True)
    chosen = numbers[contact]
    share = np.abs(N.data) * fields.weights[chosen]
    area = np.bincount(index, share)

    def mean(values: Array) -> Array:
        columns = values[chosen].reshape(len(chosen), -1)
        sums = [np.bincount(index, share * column) for column in columns.T]
        return (np.stack(sums, axis=1) / area[:, None]).reshape(len(some), *values.shape[1:])

    main = np.empty(len(some), dtype=np.int64)
    order = np.argsort(share, kind="stable")
    main[index[order]] = chosen[order]  # the last one, with the largest share, stays
    shear = np.einsum("ik,ikc->ic", fields.shear, fields.frames[:, 1:])
    return [_Side(
        onto.nodes[some], np.full(len(some), MASTER), slaves.status[main],
        slaves.sliding[main], mean(fields.gap), mean(fields.pressure), mean(slaves.slip),
        mean(slaves.path), mean(slaves.work), -mean(shear),
        -mean(shear + fields.pressure[:, None] * fields.frames[:, 0]), onto.force[some],
    )]  # fmt: skip


def _weights(H: sparse.csc_array, normals: Array) -> sparse.coo_array:
    """Weights N (nodes, k) of master nodes in contacts, of the normal columns of H, -N n."""
    entries = H.tocoo()
    row, column = entries.coords
    d = normals.shape[1]
    values = -np.asarray(entries.data, dtype=float) * normals[column, row % d]
    shape = (H.shape[0] // d, H.shape[1])
    N = sparse.coo_array((values, (row // d, column)), shape=shape).tocsc()
    N.data[np.abs(N.data) < NONE] = 0.0
    N.eliminate_zeros()
    return N.tocoo()


def _shares(model: Model, fields: ContactFields, at: Index) -> Array:
    """Part of each contact in its pair's area at the node, (nc,): 1 but for Gauss points."""
    sizes = [len(placed.rows.nodes) for placed in model.discretisation.placed]
    pair = np.repeat(np.arange(len(sizes)), sizes)
    _, label = np.unique(np.stack([pair, at]), axis=1, return_inverse=True)
    total = np.bincount(label.ravel(), fields.weights)
    return fields.weights / total[label.ravel()]


def _gathered(combine: np.ufunc, values: NDArray, index: Index) -> NDArray:
    """Values of the contacts at each node, combined; index (nc,): their place in the result."""
    out = np.zeros((index.max(initial=-1) + 1, *values.shape[1:]), dtype=values.dtype)
    if combine not in (np.add, np.bitwise_or):
        out[index] = values  # one of them, to begin with
    combine.at(out, index, values)
    return out


def _filled(values: Array, fields: ContactFields, starts: Index, known: Mask) -> Array:
    """Values (n,) with those between at nodes of second order that have no contact.

    They are corners of triangles in nodal contact, and middles where contacts sit at corners.
    Numbers become means, states the largest of both.  known (n,): nodes with a contact.
    """
    is_state = values.dtype.kind != "f"
    total, count = np.zeros_like(values), np.zeros(len(values), dtype=np.int64)
    for body, blocks in fields.facets:
        for facets in blocks:
            cell, nodes = CELLS[facets.kind], facets.nodes + starts[body]
            between = {cell.corner_count + k: list(p) for k, p in enumerate(cell.parents)}
            if facets.kind == "tri6":
                between |= {k: [3 + k, 3 + (k - 1) % 3] for k in range(3)}
            for k, ends in between.items():
                here = ~known[nodes[:, k]] & known[nodes[:, ends]].all(axis=1)
                at, around = nodes[here, k], values[nodes[here][:, ends]]
                if is_state:
                    total[at] = np.maximum(total[at], around.max(axis=1))
                else:
                    np.add.at(total, at, around.mean(axis=1))
                np.add.at(count, at, 1)
    met = count > 0
    if not met.any():
        return values
    if is_state:
        return np.where(met, total, values)
    return np.where(met, total / np.maximum(count, 1), values)
