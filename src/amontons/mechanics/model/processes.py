"""A model solved by several processes of MPI: mesh, matrix, vectors and contacts in parts.

    mpirun -n 4 python script.py

All processes call `distributed`.  The first one makes the model and cuts it (`cutting`), each
assembles and keeps its part, and together they run a semismooth Newton method
(`solvers.active_set.spread`) on PETSc's matrix.  Nothing but the mesh is whole anywhere, until
`gather` is called.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, MissingDependency
from ...core.memory import trim
from ...core.threads import asked, threads
from ...linear.distributed import SpreadMatrix
from ...linear.petsc import Petsc, mpi, petsc
from ...solvers.active_set.spread import OwnContacts, SpreadActiveSet, SpreadProblem
from ..elements.elasticity import stiffness
from ..meshes.partition import partition
from .cutting import Share, Whole, shares, whole
from .model import Model
from .spread_solution import DistributedSolution
from .together import ended_together, together

Array = NDArray[np.float64]
Index = NDArray[np.int64]
TOLERANCE = 1e-8
SLAB = 10_000  # blocks that are moved at a time


def distributed(
    model: Model | Callable[[], Model], *, tolerance: float = TOLERANCE,
    linear: Petsc | None = None, comm: Any = None,
) -> DistributedSolution:  # fmt: skip
    """The solution of a model, in the parts in which all processes of `comm` have found it.

    All processes call it.  model: a function that makes the model, which is called on the
    first process alone, so that the others never hold the whole mesh; or the model, of which
    the one of the first process counts.  tolerance: of the judge's error, as of `solve`.
    comm: a communicator of mpi4py, by default all processes.

    Raises on all processes alike: MissingDependency without the extra `distributed`,
    InvalidInput for more processes than nodes, UnsupportedForm for what several processes can
    not solve yet (bodies that contact alone holds, large strains, constraints, plastic flow),
    SingularOperator where multigrid does not converge, and what making the model raises.
    """
    try:
        petsc()
    except MissingDependency:
        _check_options(tolerance, linear)
        raise
    comm = mpi().COMM_WORLD if comm is None else comm
    if comm.size > 1 and not asked():
        threads(1)  # one core each
    with ended_together(comm):
        together(comm, lambda: _check_options(tolerance, linear))
        share = _received(model, comm)
        trim()  # what the first one has needed for the whole mesh
        rows = [together(comm, lambda: _rows(share))]
        problem = _problem(share, rows, comm, linear or Petsc())
        trim()  # blocks of which PETSc has made its matrix
        found = SpreadActiveSet(problem).solve(float(tolerance))
        solution = DistributedSolution.of(share, problem, found, comm)
        problem.K.destroy()
        return solution


def _check_options(tolerance: float, linear: Petsc | None) -> None:
    """Raise InvalidInput for what `distributed` can not take."""
    if not (isinstance(tolerance, float | int) and 0 < tolerance < 1):
        raise InvalidInput(f"tolerance: expected a number between 0 and 1, got {tolerance!r}")
    if not isinstance(linear, Petsc | None):
        raise InvalidInput(f"linear: expected Petsc(...), got {type(linear).__name__}")


def _received(model: Model | Callable[[], Model], comm: Any) -> Share:
    """The share of this process; the first one makes and sends all, one after another."""
    found = together(comm, lambda: None if comm.rank else _made(model, comm.size))
    if found is None:
        return comm.recv(source=0)
    own = None
    for rank, share in shares(*found, comm.size):
        if rank:
            comm.send(share, dest=rank)
        else:
            own = share
    assert own is not None
    return own


def _made(model: Model | Callable[[], Model], processes: int) -> tuple[Whole, Index]:
    """All but the matrix, and the process of every node, on the first process."""
    made = model() if callable(model) else model
    if not isinstance(made, Model):
        raise InvalidInput(
            "model: expected a Model, or a function that returns one, got "
            f"{type(made).__name__}"
        )
    given = whole(made)
    return given, partition(given.points, processes)


def _rows(share: Share) -> sparse.bsr_array:
    """Rows (own, n) of the stiffness in the frames of contacts; columns are PETSc's."""
    d = share.fixed.shape[1]
    frame = np.full(len(share.nodes), -1)
    frame[share.framed] = np.arange(len(share.framed))
    parts, first = [], 0
    for _, mesh, material in share.bodies:
        local = np.arange(first, first + len(mesh.points))
        first += len(mesh.points)
        parts.append(_rows_of_body(stiffness(mesh, material), local, share, frame))
    if len(parts) == 1:  # without a copy
        pointers, columns, blocks = parts[0]
    else:
        ends = [np.zeros(1, dtype=np.int64)]
        for block in parts:
            ends.append(ends[-1][-1] + block[0][1:])
        pointers = np.concatenate(ends)
        columns, blocks = (np.concatenate([p[k] for p in parts]) for k in (1, 2))
    own = int(share.own.sum()) * d
    shape = own, int(share.starts[-1]) * d
    return sparse.bsr_array((blocks, columns, pointers), shape=shape)


def _rows_of_body(
    K: sparse.bsr_array, local: Index, share: Share, frame: Index
) -> tuple[Index, Index, Array]:
    """Pointers, PETSc's nodes and blocks of the own rows of one body of this process."""
    own = share.own[local]
    counts = np.diff(K.indptr)
    row = np.repeat(np.arange(len(local), dtype=np.int32), counts)
    column, blocks = K.indices, np.asarray(K.data, dtype=float)
    if not own.all():
        kept = np.flatnonzero(own[row])
        row, column = row[kept], column[kept]
        blocks = _moved_up(blocks, kept)
    for nodes, turn in ((row, "kab,kbc->kac"), (column, "kac,kbc->kab")):
        at = frame[local[nodes]]
        some = np.flatnonzero(at >= 0)
        F = share.frames[at[some]]
        blocks[some] = (np.einsum(turn, F, blocks[some]) if nodes is row
                        else np.einsum(turn, blocks[some], F))  # fmt: skip
    pointers = np.concatenate([[0], np.cumsum(counts[own])])
    return pointers, share.number[local][column], blocks


def _moved_up(blocks: Array, kept: Index) -> Array:
    """blocks[kept], kept ascending, in the memory of blocks, which are not to be used then."""
    for first in range(0, len(kept), SLAB):
        some = kept[first : first + SLAB]
        blocks[first : first + len(some)] = blocks[some]
    if blocks.flags.owndata:
        blocks.resize((len(kept), *blocks.shape[1:]), refcheck=False)
    return blocks[: len(kept)]


def _problem(
    share: Share, rows: list[sparse.bsr_array], comm: Any, options: Petsc
) -> SpreadProblem:
    """Matrix, load and supports of this process in the basis of contacts.

    rows: the one result of `_rows`, taken out of the list, so that it can go when PETSc has it.
    """
    d, contacts = share.fixed.shape[1], share.contacts
    frames = np.zeros((0, d, d)) if not len(contacts.node) else contacts.frames
    dofs = contacts.node[:, None] * d + np.arange(d)

    def turned(values: Array) -> Array:
        """Values (o d, ...) at own nodes in the frames of contacts."""
        out = values.reshape(len(share.fixed), d, -1).copy()
        out[contacts.node] = np.einsum("kab,kbc->kac", frames, out[contacts.node])
        return out.reshape(values.shape)

    fixed = share.fixed.ravel()
    contact = np.zeros(len(fixed), dtype=bool)
    contact[dofs] = True
    matrix = SpreadMatrix(
        comm, rows.pop, _basis(share, comm.rank) if share.coupled else None,
        modes=lambda: turned(share.modes), d=d, fixed=fixed, contact=contact, options=options,
    )  # fmt: skip
    y = matrix.to_basis(turned(share.prescribed.ravel()))
    y[~fixed] = 0.0
    f = matrix.load_in_basis(turned(share.load.ravel()))
    return SpreadProblem(
        matrix, f, y, fixed, OwnContacts(dofs, contacts.gap, contacts.law, contacts.able)
    )


def _basis(share: Share, rank: int) -> sparse.bsr_array:
    """T = I - B' of own rows, (own, n)."""
    d = share.fixed.shape[1]
    own, first = share.fixed.size, int(share.starts[rank]) * d
    row, column, value = share.coupling
    index = np.arange(own)
    entries = np.concatenate([np.ones(own), value])
    where = np.concatenate([index, row]), np.concatenate([first + index, column])
    T = sparse.coo_array((entries, where), shape=(own, int(share.starts[-1]) * d)).tocsr()
    return sparse.bsr_array(T.tobsr((d, d)))
